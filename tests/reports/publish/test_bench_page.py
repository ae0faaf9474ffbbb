"""What `rayproof bench --out DIR` left reaches the report: the table, everybody on a scene, error against time."""

import copy
import json
from pathlib import Path
from typing import Any

import pytest

from rayproof.reports.publish import publish_all
from rayproof.reports.publish.page.plots import bench, pages
from tests.reports.publish.sample import make_folder
from tests.reports.publish.visits import Visit

HOSTILE = "ball <img src=x onerror=alert(1)> %{x} $(rm)"
ERROR = {"median": 3.1e-8, "p99": 2.5e-6, "pixels": 4000, "disagree": 0}
TIMED = {
    "does": "a frozen frame",
    "ms": 4.0,
    "fastest_ms": 3.5,
    "rounds": 31,
    "first_ms": 30.0,
    "build_ms": 2.0,
    "error": ERROR,
}
SCENE: dict[str, Any] = {
    "name": "sphere_and_floor", "about": "1 sphere + floor", "width": 512, "height": 512, "lights": 1, "ours_ms": 4.0,
    "minimal_ms": 32.0, "direct_ms": 40.0, "ratio_minimal": 8.123, "ratio_minimal_interval": [7.5, 8.9],
    "ratio_direct": 10.0, "ratio_direct_interval": [0.9, 11.0], "control": 1.01, "control_interval": [0.98, 1.03],
    "pixels_differ": 0.00012, "error": ERROR, "compile_ms": 30.4, "build_ms": 2.0, "kernel_ms": 3.6, "operations": 1e8,
    "limit_fraction": 0.56, "limit_by": "divisions",
    "contenders": {
        "ours": TIMED, "mitsuba_minimal": TIMED | {"ms": 32.0, "error": None}, "povray": {"left_out": "<b>no</b>"},
    },
}  # fmt: skip
# A mesh, nothing of which is known but its size and our own time.
BARE = SCENE | dict.fromkeys([key for key in SCENE if "ratio" in key or "control" in key or "limit" in key]) | {
    "name": HOSTILE, "error": None, "pixels_differ": None, "contenders": {"ours": TIMED | {"ms": "nan"}},
}  # fmt: skip
CHANGE = {
    "name": "sphere_and_floor",
    "width": 512,
    "height": 512,
    "change": 1.3,
    "interval": [1.2, 1.4],
    "verdict": "slower",
}
DOCUMENT: dict[str, Any] = {
    "schema": 1, "started": "2026-01-02T03:04:05+00:00", "versions": {"drjit": "1.5 <i>"},
    "machine": {"threads": 2, "float32": {"divisions_per_second": 8.6e9}}, "scenes": [SCENE, BARE], "changes": [CHANGE],
}  # fmt: skip


@pytest.mark.parametrize(
    "content",
    [
        "", "[]", "{}", '{"scenes": []}', '{"scenes": 3}', '{"scenes": [{}]}',
        '{"scenes": [{"width": 0, "height": 1}]}',
        '{"scenes": [{"width": 2, "height": 1, "control_interval": [1]}]}',
    ],
)  # fmt: skip
def test_what_is_no_benchmark_has_no_page(tmp_path: Path, content: str) -> None:
    (tmp_path / "bench.json").write_text(content)

    assert bench(tmp_path) is None
    assert pages(tmp_path) == {}


def test_a_benchmark_is_taken_with_numbers_rounded_for_drawing(tmp_path: Path) -> None:
    odd = copy.deepcopy(DOCUMENT) | {"machine": 3, "changes": [CHANGE, "x", {"interval": 1}]}
    odd["scenes"][0]["contenders"]["ours"] = 7
    odd["scenes"][0]["ours_ms"] = 4.123456
    (tmp_path / "bench.json").write_text(json.dumps(odd))

    found = bench(tmp_path)

    assert found is not None
    assert (found["machine"], found["changes"]) == ({}, [CHANGE])
    assert set(found["scenes"][0]["contenders"]) == {"mitsuba_minimal", "povray"}
    assert found["scenes"][0]["ours_ms"] == 4.123


@pytest.mark.browser
def test_the_page_has_the_table_everybody_on_a_scene_and_the_diagram(browser: Any, tmp_path: Path) -> None:
    make_folder(tmp_path)
    (tmp_path / "bench.json").write_text(json.dumps(DOCUMENT))
    publish_all(tmp_path)
    visit = Visit(browser, tmp_path)
    page = visit.open()

    page.get_by_role("navigation", name="Pages").get_by_role("link", name="Benchmark").click()

    page.wait_for_selector(".plot[data-drawn]")
    assert page.locator("h1").inner_text() == "Benchmark of 2 scenes"
    # By the whole interval: the direct integrator's reaches below 1.
    assert (
        "than a minimal Mitsuba kernel in 1 of 1, than Mitsuba's direct integrator in 0 of 1"
        in page.locator("main").inner_text()
    )
    assert "sphere_and_floor, 512×512: slower, time ×1.3 [1.20, 1.40]" in page.locator("main").inner_text()
    first, second = (page.locator(".bench tbody tr").nth(index).locator("td").all_inner_texts() for index in range(2))
    assert first == ["4 ms", "8.12 [7.50, 8.90]", "10.00 [0.90, 11.00]", "1.01 [0.98, 1.03]", "0.012 %",
                     "3.1e-8, 2.5e-6", "30.4 ms", "2 ms", "56 %"]  # fmt: skip
    assert second[1:6] == ["–", "–", "–", "–", ""]
    assert page.locator(".bench circle").count() == 2
    everybody = page.get_by_role("region", name="Scenes").get_by_role("status")
    assert "<b>no</b>" in everybody.inner_text()
    assert "limited by divisions" in everybody.inner_text()
    assert "8.60e+9" in page.get_by_role("region", name="Machine").inner_text()
    # Only who has an error has a point; it opens its scene, as the table's button does.
    assert page.locator(".plot .points path").count() == 1
    page.get_by_role("button", name="ball <img").click()
    assert everybody.locator("code").inner_text().endswith("'")
    assert HOSTILE in everybody.inner_text()
    page.locator(".plot").scroll_into_view_if_needed()
    point = page.locator(".plot .points path").first.bounding_box()
    page.mouse.move(point["x"] + point["width"] / 2, point["y"] + point["height"] / 2)
    page.wait_for_timeout(200)
    page.mouse.click(point["x"] + point["width"] / 2, point["y"] + point["height"] / 2)
    page.wait_for_selector("[role=status] h3:has-text('sphere_and_floor')")
    visit.end()


@pytest.mark.browser
def test_without_a_benchmark_there_is_no_such_page(visit: Visit) -> None:
    page = visit.open()

    assert page.get_by_role("link", name="Benchmark").count() == 0
