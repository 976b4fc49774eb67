"""The frame of a report: one HTML file that needs nothing else, no network and no script."""

from collections.abc import Sequence
from html import escape

_STYLE = """
:root{color-scheme:light}
body{font:15px/1.5 system-ui,sans-serif;color:#26303c;background:#f4f5f7;margin:0}
main{max-width:1080px;margin:0 auto;padding:24px 20px 60px}
h1{font-size:26px;margin:0 0 4px}h2{font-size:19px;margin:34px 0 8px}h3{font-size:15px;margin:18px 0 6px}
p{max-width:75ch;margin:6px 0}ul{max-width:75ch;margin:6px 0;padding-left:22px}
.faint{color:#5b6573}.agrees{color:#23743f}.differs{color:#a8342b}.open{color:#7a5a10}
.charts{display:grid;grid-template-columns:repeat(auto-fit,minmax(min(320px,100%),1fr));gap:10px}
.wide{overflow-x:auto}
table{border-collapse:collapse;background:#fff;font-size:13.5px;margin:8px 0}
th,td{padding:4px 10px;border-bottom:1px solid #e1e5ea;text-align:right;vertical-align:top}
th:first-child,td:first-child,.words td{text-align:left}thead th{border-bottom:2px solid #c3c9d1}
td small{color:#5b6573;white-space:nowrap}
img{max-width:100%;height:auto}
details{margin:8px 0}summary{cursor:pointer}
"""


class Markup(str):
    """Text that is HTML already; any other text is escaped."""


def safe(value: str) -> str:
    """Return text for HTML."""
    return str(value) if isinstance(value, Markup) else escape(value)


def html_table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return a table; cells are escaped but for `Markup`."""
    head = "".join(f"<th>{safe(cell)}</th>" for cell in header)
    body = "".join("<tr>" + "".join(f"<td>{safe(cell)}</td>" for cell in row) + "</tr>" for row in rows)
    return f'<div class="wide"><table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table></div>'


def paragraph(words: str, kind: str = "") -> str:
    """Return a paragraph, escaped unless it is `Markup`."""
    return f'<p class="{kind}">{safe(words)}</p>' if kind else f"<p>{safe(words)}</p>"


def bullets(items: Sequence[str]) -> str:
    """Return a list; nothing where there are no items."""
    return "<ul>" + "".join(f"<li>{safe(item)}</li>" for item in items) + "</ul>" if items else ""


def charts_row(charts: Sequence[str]) -> str:
    """Return drawings side by side, as many as fit."""
    return '<div class="charts">' + "".join(f"<div>{chart}</div>" for chart in charts) + "</div>"


def page(title: str, parts: Sequence[str]) -> str:
    """Return a whole page."""
    return (
        '<!doctype html><html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width,initial-scale=1">'
        f"<title>{escape(title)}</title><style>{_STYLE}</style></head>"
        f"<body><main><h1>{escape(title)}</h1>{''.join(parts)}</main></body></html>\n"
    )
