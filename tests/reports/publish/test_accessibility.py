"""Nobody is kept out: axe-core finds nothing serious on any view, light or dark, and nothing overflows any screen."""

import hashlib
from pathlib import Path

import pytest

from tests.reports.publish.visits import Visit

pytestmark = pytest.mark.browser
VENDOR = Path(__file__).parents[2] / "vendor"
VIEWS = [
    {},
    {"case": "lights/broken", "stage": "radiance"},
    {"case": "sphere/sheared", "stage": "normal", "mode": "swipe", "edges": "1"},
]


def test_the_checker_is_the_one_that_was_looked_at():
    digest = hashlib.sha256((VENDOR / "axe.min.js").read_bytes()).hexdigest()

    assert digest in (VENDOR / "VENDOR.md").read_text()


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("view", VIEWS, ids=["front", "case", "swipe"])
def test_axe_finds_nothing_serious(browser, published, scheme, view):
    visit = Visit(browser, published.folder, color_scheme=scheme)
    page = visit.open(**view)
    page.evaluate("for (const one of document.querySelectorAll('details')) one.open = true")

    # By the driver, not by the page: its policy lets no script in.
    page.evaluate((VENDOR / "axe.min.js").read_text())
    found = page.evaluate("axe.run({ resultTypes: ['violations'] })")

    serious = [
        f"{one['id']}: {one['help']}: {[node['html'][:160] for node in one['nodes'][:3]]}"
        for one in found["violations"]
        if one["impact"] in ("serious", "critical")
    ]
    assert serious == []
    visit.end()


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("size", [(390, 844), (3840, 2160)], ids=["phone", "4K"])
def test_nothing_overflows(browser, published, size, scheme):
    visit = Visit(browser, published.folder, viewport={"width": size[0], "height": size[1]}, color_scheme=scheme)

    for address in VIEWS:
        page = visit.open(**address)
        assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
    visit.end()
