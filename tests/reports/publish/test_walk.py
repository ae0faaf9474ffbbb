"""The way of a reviewer through a report, by clicks alone: from the cause to its worst pixel, then through every tab.

The tests beside this one look at single pages by their addresses. Here nothing but what can be clicked leads on, on a
wide and on a narrow screen. Screenshots of each step lie in the folder that RAYPROOF_SCREENSHOTS names, if it is set.
"""

import os
import re
from pathlib import Path
from typing import Any

import pytest

from tests.reports.publish.visits import ARRIVED, Visit

WIDTHS = (1280, 390)
KEPT = os.environ.get("RAYPROOF_SCREENSHOTS")


@pytest.fixture(scope="module")
def failing(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder in which normals by the model matrix failed."""
    from rayproof.reports.cli import main

    folder = tmp_path_factory.mktemp("walk") / "report"
    words = ["transforms/mesh_stretched", "transforms/sphere_stretched", "primitives/sphere", "--jobs", "1"]
    mistake = ["--formula", "world_normal=model_matrix", "--configuration", "float32"]
    assert main(["run", *words, *mistake, "--out", str(folder)]) == 1
    return folder


@pytest.mark.browser
@pytest.mark.parametrize("width", WIDTHS)
def test_a_reviewer_walks_from_the_cause_to_its_pixel_and_through_every_tab(
    browser: Any, failing: Path, width: int, tmp_path: Path
) -> None:
    visit = Visit(browser, failing, viewport={"width": width, "height": 900})
    pictures = Path(KEPT) if KEPT else tmp_path
    steps = iter(range(1, 20))

    def look(name: str) -> str:
        page.wait_for_function(ARRIVED)
        page.wait_for_timeout(200)
        page.screenshot(path=pictures / f"{width}-{next(steps)}-{name}.png", full_page=True)
        assert page.evaluate("document.documentElement.scrollWidth") <= width
        return page.locator("main").inner_text()

    page = visit.open()
    assert "turns normals by the model matrix" in look("front")
    page.locator("section", has_text="What is wrong").get_by_role("link").first.click()
    case = look("case")
    assert "NRM-3" in case
    assert re.search(r"rayproof probe \S+ \d+ \d+ .*--configuration \S*world_normal=model_matrix", case)
    page.get_by_role("button", name="open in 3-D").click()
    page.wait_for_selector("iframe[data-drawn]")
    look("view")
    page.get_by_role("link", name=re.compile("all cases")).click()
    for tab, told in (
        ("Stability", "rayproof stability"),
        ("Error against time", "primitives/sphere"),
        ("References", "analytic"),
    ):
        page.get_by_role("link", name=tab, exact=True).click()
        assert told in look(tab.lower().replace(" ", "-"))
    page.get_by_role("link", name="Cases", exact=True).click()
    assert "2 fail" in look("back")
    visit.end()
    assert len(list(pictures.glob(f"{width}-*.png"))) >= 7
