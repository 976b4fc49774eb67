"""Whether controls can be reached: a click at the middle of every control hits that control."""

from playwright.sync_api import Page

SIZES = ((1920, 1080), (1280, 720), (390, 844))

# Controls that something else lies over, at their middle, once they are scrolled into sight. What lets clicks through
# (`pointer-events: none`) hides a control all the same: for the test it does not let them through. Of an open modal
# dialog only what is in it can be used.
COVERED = """() => {
  const solid = document.createElement("style");
  const through = "option, .over, .over-top, .over-middle, .over-bottom";  // frames without anything to see
  solid.textContent = `:where(*) { pointer-events: auto !important } ${through} { pointer-events: none !important }`
    + " * { scroll-behavior: auto !important }";
  document.head.append(solid);
  const modal = [...document.querySelectorAll("dialog:modal")].at(-1);
  const acts = "button, a[href], input, select, textarea, summary, [role=slider], [role=button]";
  const usable = (e) => e.checkVisibility({ visibilityProperty: true, opacityProperty: true })
    && !e.matches(":disabled") && !e.closest("[inert]");
  const found = [];
  for (const e of [...(modal ?? document).querySelectorAll(acts)].filter(usable)) {
    e.scrollIntoView({ block: "center", inline: "center" });
    const box = e.getBoundingClientRect();
    if (box.width < 2 || box.height < 2) continue;  // for those who read with their ears
    const hit = document.elementFromPoint(box.left + box.width / 2, box.top + box.height / 2);
    const itself = hit && (e.contains(hit) || (hit.contains(e) && hit.matches("label, button, a")));
    if (itself || [...(e.labels ?? [])].some((label) => label.contains(hit))) continue;
    found.push(`${e.outerHTML.slice(0, 90)} lies under ${hit ? hit.outerHTML.slice(0, 90) : "nothing"}`);
  }
  solid.remove();
  scrollTo(0, 0);
  return found;
}"""


def covered(page: Page) -> dict[str, list[str]]:
    """What is covered, by size; the page is left at the last size."""
    found = {}
    for width, height in SIZES:
        page.set_viewport_size({"width": width, "height": height})
        found[f"{width}x{height}"] = page.evaluate(COVERED)
    return {where: names for where, names in found.items() if names}
