"""Draws who imports whom, wing by wing and room by room: `python docs/graph.py docs/pictures`.

Two pictures are written: `rooms.svg` of the program, and `wings.svg` of the engine, whose wings name their rooms. A
part stands above all that it imports.
"""

import sys
from collections.abc import Iterable
from pathlib import Path

import grimp

HEIGHT, GAP, ROW = 40, 20, 92
INK, FILL, LINE = "#1f2937", "#e8eef7", "#8a97ab"


def parts_of(package: str) -> tuple[dict[str, set[str]], dict[str, str]]:
    """Return what each child of a package imports of its siblings, and its caption: lines, and rooms of a wing."""
    graph = grimp.build_graph("studio")
    children = sorted(graph.find_children(package))
    imports = {
        child: {
            other
            for other in children
            if other != child and graph.direct_import_exists(importer=child, imported=other, as_packages=True)
        }
        for child in children
    }
    captions = {}
    for child in children:
        rooms = sorted(name.rpartition(".")[2] for name in graph.find_children(child) if _is_room(name))
        inside = f": {', '.join(rooms)}" if rooms and package != "studio" else ""
        captions[child] = f"{lines_of(child):,} lines{inside}"
    return imports, captions


def _is_room(module: str) -> bool:
    return Path(*module.split(".")).is_dir()


def lines_of(module: str) -> int:
    """Return the lines of Python of a module or package."""
    path = Path(*module.split("."))
    files: Iterable[Path] = path.rglob("*.py") if path.is_dir() else [path.with_suffix(".py")]
    return sum(len(file.read_text(encoding="utf-8").splitlines()) for file in files)


def floors(imports: dict[str, set[str]]) -> dict[str, int]:
    """Return the floor of each part: 0 where it imports no sibling, else one above the highest that it imports."""
    found: dict[str, int] = {}

    def floor(part: str) -> int:
        if part not in found:
            found[part] = max((floor(other) + 1 for other in imports[part]), default=0)
        return found[part]

    for part in imports:
        floor(part)
    return found


def svg(imports: dict[str, set[str]], captions: dict[str, str], title: str) -> str:
    """Return the picture: a row of boxes a floor, an arrow an import that no longer way stands for."""
    on = floors(imports)
    box = max(128, 7 * max(map(len, captions.values())))
    rows = [
        [part for part in sorted(imports) if on[part] == number] for number in range(max(on.values()) + 1)
    ]
    width = max(len(row) for row in rows) * (box + GAP) + GAP
    height = len(rows) * ROW + 40
    place: dict[str, tuple[float, float]] = {}
    for number, row in enumerate(rows):
        left = (width - len(row) * (box + GAP) + GAP) / 2
        for k, part in enumerate(row):
            place[part] = (left + k * (box + GAP), height - (number + 1) * ROW + 20)
    drawn = []
    for part, others in sorted(imports.items()):
        reached = {far for other in others for far in _below(imports, other)}
        for other in sorted(others - reached):
            (x0, y0), (x1, y1) = place[part], place[other]
            drawn.append(
                f'<path d="M{x0 + box / 2:.0f} {y0 + HEIGHT} C{x0 + box / 2:.0f} {y0 + HEIGHT + 30} '
                f'{x1 + box / 2:.0f} {y1 - 30:.0f} {x1 + box / 2:.0f} {y1 - 3:.0f}" fill="none" stroke="{LINE}" '
                'stroke-width="1.5" marker-end="url(#tip)"/>'
            )
    for part, (x, y) in place.items():
        name, middle = part.rpartition(".")[2], x + box / 2
        drawn.append(
            f'<rect x="{x:.0f}" y="{y:.0f}" width="{box}" height="{HEIGHT}" rx="6" fill="{FILL}" stroke="{LINE}"/>'
            f'<g fill="{INK}" text-anchor="middle">'
            f'<text x="{middle:.0f}" y="{y + 17:.0f}" font-weight="600">{name}</text>'
            f'<text x="{middle:.0f}" y="{y + 32:.0f}" font-size="11">{captions[part]}</text></g>'
        )
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width}" height="{height}" '
        f'font-family="system-ui, sans-serif" font-size="14"><title>{title}</title>'
        f'<rect width="{width}" height="{height}" fill="#ffffff"/>'
        '<defs><marker id="tip" viewBox="0 0 8 8" refX="6" refY="4" markerWidth="6" markerHeight="6" orient="auto">'
        f'<path d="M0 0 L8 4 L0 8 z" fill="{LINE}"/></marker></defs>' + "".join(drawn) + "</svg>\n"
    )


def _below(imports: dict[str, set[str]], part: str) -> set[str]:
    """Return all that a part imports, directly or not."""
    out: set[str] = set()
    for other in imports[part]:
        out |= {other} | _below(imports, other)
    return out


def main(folder: Path) -> None:
    for package, name, title in (
        ("studio", "rooms", "The rooms of the program"),
        ("studio.engine", "wings", "The wings of the engine"),
    ):
        (folder / f"{name}.svg").write_text(svg(*parts_of(package), title), encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
