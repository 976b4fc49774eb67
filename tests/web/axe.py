"""What axe (npm package axe-core) finds on a page that keeps people from using it."""

from pathlib import Path

import pytest
from playwright.sync_api import Error, Frame, Page

from tests.web.browser import until

AXE = Path(__file__).parents[2] / ".tools" / "readers" / "node_modules" / "axe-core" / "axe.min.js"
SIZES = ((1280, 720), (390, 844))
_TRIES = 8
_LOADED_ANEW = ("context was destroyed", "detached", "frame timed out")
THEMES = ("dark", "light")

# Runs all rules of axe that are not experimental, or only those about colours. A line for each finding: the
# rule, the element, what is wrong. Of what rules may want to be loaded, these want media alone.
_FIND = """async (onlyColours) => {
  const waits = { frameWaitTime: 60000, pingWaitTime: 5000 }, preload = { assets: ["media"] };
  const coloured = axe.getRules(["cat.color"]).filter(({ tags }) => !tags.includes("wcag2aaa"));
  const values = coloured.map(({ ruleId }) => ruleId);
  const rules = onlyColours ? { runOnly: { type: "rule", values } } : {};
  const { violations } = await axe.run(document, { resultTypes: ["violations"], preload, ...waits, ...rules });
  const why = ({ any, all, none }) => [...any, ...all, ...none].map(({ message }) => message).join("; ");
  return violations.flatMap(({ id, impact, nodes }) => nodes.map((node) =>
    `${id} (${impact}) ${node.target.flat(9).join(" ")} ${why(node).slice(0, 200)}`));
}"""

# All animations that have an end have reached it.
_SETTLED = """() => document.getAnimations().every((one) => one.playState === "finished"
  || one.effect.getComputedTiming().endTime === Infinity)"""


def found_in(page: Page, state: str) -> list[str]:
    """What axe finds in a state of a page, dark and light, on a laptop and on a phone: a line each.

    Themes differ in colours alone (`test_styles.py`): all rules look at one theme on a laptop and at the other on a
    phone, and those for colours at both on both.
    """
    lines = []
    for size, (width, height) in enumerate(SIZES):
        page.set_viewport_size({"width": width, "height": height})
        for number, theme in enumerate(THEMES):
            page.emulate_media(color_scheme="light" if theme == "light" else "dark")
            until(page, f"({_SETTLED})()")
            found = violations(page, only_colours=number != size)
            lines += [f"{state}, {theme}, {width}: {one}" for one in found]
    return lines


def violations(page: Page, *, only_colours: bool = False) -> list[str]:
    """What axe finds on a page and in its frames."""
    if not AXE.is_file():
        pytest.skip("axe is not here: sh tests/fetch_readers.sh")
    for _ in range(_TRIES):
        try:
            for frame in page.frames:
                _load(frame)
            return page.evaluate(_FIND, only_colours)
        except Error as error:  # the 3D view is loaded anew where its picture is old, as on a busy machine
            if not any(one in str(error) for one in _LOADED_ANEW):
                raise
    raise AssertionError("the page's frames are loaded anew all the time")


def _load(frame: Frame) -> None:
    """Have a frame know axe: by the browser's tools, which the page's policy does not bind. It copies no HTML."""
    if not frame.evaluate("'axe' in window"):
        frame.evaluate(AXE.read_text(encoding="utf-8") + "; axe.configure({ noHtml: true })")
