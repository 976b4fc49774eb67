"""What lies beyond the edge of a screen, at the sizes that the studio is made for."""

from playwright.sync_api import Page

SIZES = ((1280, 720), (1920, 1080), (390, 844))

BEYOND = """() => {
  const scrolls = (e) => {  // a part that may be pushed aside by a finger
    for (; e && e !== document.body; e = e.parentElement) {
      if (e.matches("pre")) return true;
    }
    return false;
  };
  const wide = document.documentElement.scrollWidth;
  return [...(wide > innerWidth ? [`the page: ${wide}`] : []),
    ...[...document.querySelectorAll("body *")].filter((e) => e.checkVisibility() && !scrolls(e)
        && e.getBoundingClientRect().width > 1 && e.getBoundingClientRect().right > innerWidth + 1)
      .map((e) => `${e.tagName} #${e.id} .${e.className} ${Math.round(e.getBoundingClientRect().right)}`)];
}"""


def assert_it_fits(page: Page) -> None:
    """Nothing lies beyond the right edge at any of the sizes; the page is left at the first one."""
    for width, height in (*SIZES[1:], SIZES[0]):
        page.set_viewport_size({"width": width, "height": height})
        assert page.evaluate(BEYOND) == [], f"at {width} x {height}"
