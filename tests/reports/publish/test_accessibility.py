"""Nobody is kept out: axe-core finds nothing serious on any view, light or dark, and nothing overflows any screen."""

import hashlib

import pytest

from tests.reports.publish.everything import PAGES
from tests.reports.publish.visits import VENDOR, Visit

pytestmark = pytest.mark.browser
VIEWS = [
    {},
    {"case": "lights/broken", "stage": "radiance"},
    {"case": "sphere/sheared", "stage": "normal", "mode": "swipe", "explained": "1"},
]
# What is wider inside than outside, so that a part of it is cut or has to be scrolled to. A text that ends in dots has
# its whole as a title; axes' numbers may stand out of the bar that they belong to.
CUT = """() => [...document.querySelectorAll("main, main *")]
    .filter((node) => node.clientWidth > 0 && node.scrollWidth > node.clientWidth + 1)
    .filter((node) => !node.closest("svg, select, .offscreen, .plot, .ratio-axis"))
    .filter((node) => getComputedStyle(node).display !== "inline" && getComputedStyle(node).textOverflow !== "ellipsis")
    .map((node) => `${node.tagName}.${node.className} ${node.scrollWidth} > ${node.clientWidth}`)"""
PHONE, DESK = ({"width": width, "height": height} for width, height in ((390, 844), (1280, 720)))
# What is wide scrolls on a phone alone; colours differ by scheme.
SEEN = pytest.mark.parametrize(
    "context", [{"color_scheme": "light", "viewport": DESK}, {"color_scheme": "dark", "viewport": PHONE}],
    ids=["light desk", "dark phone"],
)  # fmt: skip


def test_the_checker_is_the_one_that_was_looked_at():
    digest = hashlib.sha256((VENDOR / "axe.min.js").read_bytes()).hexdigest()

    assert digest in (VENDOR / "VENDOR.md").read_text()


@SEEN
@pytest.mark.parametrize("view", VIEWS, ids=["front", "case", "swipe"])
def test_axe_finds_nothing_serious(browser, published, context, view):
    visit = Visit(browser, published.folder, **context)
    visit.open(**view)

    assert visit.barriers() == []
    visit.end()


@SEEN
@pytest.mark.parametrize("name", PAGES)
def test_axe_finds_nothing_serious_on_any_page(browser, everything, context, name):
    visit = Visit(browser, everything, **context)
    visit.open(page=name).wait_for_selector(".panel")

    assert visit.barriers() == []
    visit.end()


@pytest.mark.parametrize("size", [PHONE, DESK], ids=["phone", "desk"])
def test_nothing_overflows_and_nothing_is_cut(browser, published, everything, size):
    views = [(published.folder, address) for address in VIEWS]
    views += [(everything, {"page": name}) for name in PAGES]
    for folder, address in views:
        visit = Visit(browser, folder, viewport=size)
        page = visit.open(**address)
        page.wait_for_selector(".panel")
        for scheme in ("light", "dark"):
            page.emulate_media(color_scheme=scheme)
            assert page.evaluate("document.documentElement.scrollWidth <= innerWidth"), (address, scheme)
        page.evaluate("for (const one of document.querySelectorAll('details')) one.open = true")
        assert page.evaluate(CUT) == [], address
        visit.end()
