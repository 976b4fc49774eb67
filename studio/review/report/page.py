"""The frame of a report: one HTML file without external files, network access or scripts."""

from collections.abc import Sequence
from html import escape

from studio.review.report.svg import DARK, LIGHT


def _variables(colours: dict[str, str]) -> str:
    return ":root{" + "".join(f"--{name}:{colour};" for name, colour in colours.items()) + "}"


_PAGE_LIGHT = {"ground": "#f4f5f7", "good": "#23743f", "bad": "#a8342b", "open": "#7a5a10"}
_PAGE_DARK = {"ground": "#14181e", "good": "#6cc485", "bad": "#f0918c", "open": "#dfba6a"}
_STYLE = (
    ":root{color-scheme:light dark}"
    + _variables(LIGHT | _PAGE_LIGHT)
    + "@media (prefers-color-scheme:dark){"
    + _variables(DARK | _PAGE_DARK)
    + "}"
    + """
body{font:15px/1.5 system-ui,sans-serif;color:var(--ink);background:var(--ground);margin:0}
main{max-width:1080px;margin:0 auto;padding:24px 20px 60px}
h1{font-size:26px;margin:0 0 4px}h2{font-size:19px;margin:34px 0 8px}h3{font-size:15px;margin:18px 0 6px}
p{max-width:75ch;margin:6px 0}ul{max-width:75ch;margin:6px 0;padding-left:22px}
.faint{color:var(--faint)}.agrees{color:var(--good)}.differs{color:var(--bad)}.open{color:var(--open)}
.charts{display:grid;grid-template-columns:repeat(auto-fit,minmax(min(320px,100%),1fr));gap:10px}
.wide{overflow-x:auto}
table{border-collapse:collapse;background:var(--paper);font-size:13.5px;margin:8px 0}
th,td{padding:4px 10px;border-bottom:1px solid var(--grid);text-align:right;vertical-align:top}
th:first-child,td:first-child,.words td{text-align:left}thead th{border-bottom:2px solid var(--beside)}
td small{color:var(--faint);white-space:nowrap}
img{max-width:100%;height:auto}
details{margin:8px 0}summary{cursor:pointer}
"""
)


class Markup(str):
    """Text that is HTML already; any other text is escaped."""


def safe(value: str) -> str:
    """Return text escaped for HTML."""
    return str(value) if isinstance(value, Markup) else escape(value)


def html_table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return a table; cells are escaped except `Markup`. A wide table scrolls, also by keyboard."""
    head = "".join(f"<th>{safe(cell)}</th>" if cell else "<td></td>" for cell in header)
    body = "".join("<tr>" + "".join(f"<td>{safe(cell)}</td>" for cell in row) + "</tr>" for row in rows)
    table = f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"
    return f'<div class="wide" role="group" tabindex="0">{table}</div>'


def paragraph(words: str, kind: str = "") -> str:
    """Return a paragraph, escaped unless it is `Markup`."""
    return f'<p class="{kind}">{safe(words)}</p>' if kind else f"<p>{safe(words)}</p>"


def bullets(items: Sequence[str]) -> str:
    """Return a list; empty text without items."""
    return "<ul>" + "".join(f"<li>{safe(item)}</li>" for item in items) + "</ul>" if items else ""


def charts_row(charts: Sequence[str]) -> str:
    """Return drawings side by side, as many as fit."""
    return '<div class="charts">' + "".join(f"<div>{chart}</div>" for chart in charts) + "</div>"


def page(title: str, parts: Sequence[str], language: str = "en") -> str:
    """Return a whole page, light or dark by the reader's system."""
    return (
        f'<!doctype html><html lang="{language}"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width,initial-scale=1">'
        f"<title>{escape(title)}</title><style>{_STYLE}</style></head>"
        f"<body><main><h1>{escape(title)}</h1>{''.join(parts)}</main></body></html>\n"
    )
