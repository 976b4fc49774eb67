"""A page's modules come as one file that does what they do."""

import json
from importlib import resources
from pathlib import Path

import httpx
import pytest
from playwright.sync_api import Page

from studio.web.program import is_vendor, program_of

STATIC = Path(str(resources.files("studio.web") / "static"))
MODULES = [
    path for file in STATIC.rglob("*.js") if not is_vendor(path := file.relative_to(STATIC).as_posix())
]

HERE = {
    "page/main.js": """import whole from "../words/whole.js";
import * as all from "./numbers.js";
import {
  one,
  two as zwei,
} from "./numbers.js";
import "./effect.js";
window.found = [whole.word, Object.keys(all).sort().join(), one, zwei(), window.effect, new all.Three().value];
""",
    "page/numbers.js": """// Numbers.
export const one = 1;
export function two() { return one + 1; }
export class Three { value = 3; }
""",
    "page/effect.js": 'import { one } from "./numbers.js";\nwindow.effect = (window.effect ?? 0) + one;\n',
    "words/whole.js": 'import "../page/effect.js";\nexport default {\n  word: "whole",\n};\n',
}


def written(folder: Path, modules: dict[str, str]) -> Path:
    for name, text in modules.items():
        file = folder / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text, encoding="utf-8")
    return folder


def test_every_module_of_the_pages_can_be_in_a_program():
    assert len(MODULES) > 150
    for module in MODULES:
        program_of(STATIC, module)


def test_a_program_does_what_its_modules_do(page: Page, tmp_path: Path) -> None:
    program = program_of(written(tmp_path, HERE), "page/main.js")
    page.add_script_tag(content=program.text, type="module")
    assert page.evaluate("window.found") == ["whole", "Three,one,two", 1, 2, 1, 3]


def test_what_is_not_in_the_folder_stays_an_import(tmp_path: Path) -> None:
    outer = {
        "page/main.js": 'import * as THREE from "three";\nimport { load } from "../vendor/a/loader.mjs";\n',
        "vendor/a/loader.mjs": "not read",
    }
    text = program_of(written(tmp_path, outer), "page/main.js").text
    first = 'import * as outside0 from "three"; import * as outside1 from "./../vendor/a/loader.mjs";\n'
    assert text.startswith(first)
    assert "const THREE = outside0;" in text
    assert "const { load } = outside1;" in text


def test_the_source_map_names_each_line_s_module(tmp_path: Path) -> None:
    program = program_of(written(tmp_path, HERE), "page/main.js")
    lines = program.text.split("\n")
    sections = json.loads(program.source_map)["sections"]
    assert len(sections) == len(HERE)
    for section in sections:
        source = (tmp_path / "page" / section["map"]["sources"][0]).read_text(encoding="utf-8").splitlines()
        begin = section["offset"]["line"]
        assert section["map"]["mappings"].count(";") + 1 == len(source)
        for new, old in zip(lines[begin:], source, strict=False):
            assert new in (old, "") or old.startswith(("import", "export"))


@pytest.mark.parametrize(
    ("modules", "said"),
    [
        (
            {"a.js": 'import { b } from "./b.js";\n', "b.js": 'import { a } from "./a.js";\n'},
            "a.js -> b.js -> a.js",
        ),
        (
            {"a.js": 'import { c } from "./b.js";\n', "b.js": "export const b = 1;\n"},
            "a.js imports c, which b.js",
        ),
        ({"a.js": "export let b = 1;\n"}, "export let b = 1;"),
        ({"a.js": 'export { b } from "./b.js";\n'}, 'export { b } from "./b.js";'),
    ],
)
def test_what_cannot_be_kept_is_refused(modules, said, tmp_path):
    with pytest.raises(ValueError, match=said.replace("{", r"\{")):
        program_of(written(tmp_path, modules), "a.js")


def test_a_file_that_changes_changes_the_program(tmp_path: Path) -> None:
    folder = written(tmp_path, HERE)
    before = program_of(folder, "page/main.js")
    assert program_of(folder, "page/main.js") is before
    (folder / "page/effect.js").write_text("window.effect = 7;\n\n", encoding="utf-8")
    assert "window.effect = 7;" in program_of(folder, "page/main.js").text


def test_a_browser_asks_once_and_gets_it_anew_where_it_changed(address: str) -> None:
    url = f"{address}/static/stage/main.js"
    with httpx.Client() as http:
        program = http.get(f"{url}?bundle=0.1.0")
        assert program.text == program_of(STATIC, "stage/main.js").text
        assert program.headers["Content-Type"].startswith("text/javascript")
        assert program.headers["Cache-Control"] == "no-cache"
        again = http.get(f"{url}?bundle=0.1.0", headers={"If-None-Match": program.headers["ETag"]})
        assert again.status_code == 304
        assert http.get(f"{url}?map").json() == json.loads(program_of(STATIC, "stage/main.js").source_map)
        assert http.get(url).text == (STATIC / "stage" / "main.js").read_text(encoding="utf-8")
        assert http.get(f"{address}/static/stage/none.js?bundle").status_code == 404
        assert http.get(f"{address}/static/vendor/three/three.core.js?bundle").text.startswith("/**")
