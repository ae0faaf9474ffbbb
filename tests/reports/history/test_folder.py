"""Two runs made into one results folder: images of both, where they differ; a record; a page that shows it."""

import copy
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from msgspec.structs import replace

from rayproof.cases.stages import Stage
from rayproof.reports.history.image_difference import write_both, write_folder
from rayproof.reports.history.run_difference import comparison, moved, sentence
from rayproof.reports.publish import publish_all
from rayproof.reports.publish.page.comparisons import comparison_front
from rayproof.reports.results.case_records import Measurement
from rayproof.reports.results.document import load_results, save_results
from rayproof.reports.results.images import kept_images, read_answers, read_pixels, write_answers, write_pixels
from rayproof.reports.results.outcomes import Outcome
from tests.reports.publish.sample import answers, make_folder
from tests.reports.publish.visits import Visit


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """Return two runs: in the second one case broke, one was mended, one is slower, one was renamed."""
    folders = (tmp_path_factory.mktemp("before"), tmp_path_factory.mktemp("after"))
    results = [make_folder(folder) for folder in folders]
    broken, mended, slow, *_ = results[1]["cases"]
    broken |= {"verdict": "fail", "stage": "radiance"}
    worse = {"outcome": Outcome.FAIL, "ratio": 12.5, "end_to_end": Measurement(worst_ratio=12.5)}
    broken["checks"] = [replace(check, **worse) if check.stage == "radiance" else check for check in broken["checks"]]
    mended |= {"verdict": "pass"}
    better = {"outcome": Outcome.PASS, "ratio": 0.21, "end_to_end": Measurement(worst_ratio=0.21)}
    mended["checks"] = [replace(check, **better) for check in mended["checks"]]
    for render in slow["renders"]:
        render["seconds"] *= 3
    results[1]["cases"][-1]["name"] = "plane/other"
    path = folders[1] / "images/sphere/plain/tracer-float32.exr"
    answers = read_answers(path)
    answers[Stage.RADIANCE][10:15, 10:20] *= np.float32(1.1)
    write_answers(path, answers, 2)
    save_results(folders[1], results[1])
    return folders


@pytest.fixture(scope="module")
def folder(runs: tuple[Path, Path], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of both, published."""
    folder = tmp_path_factory.mktemp("both")
    loaded = (load_results(runs[0]), load_results(runs[1]))
    write_folder(folder, runs, loaded, comparison(*loaded, ("old", "new")))
    publish_all(folder)
    return folder


def test_the_record_says_what_changed_worst_first(folder: Path) -> None:
    record = load_results(folder)["comparison"]

    assert [(row["case"], row["before"], row["after"], row["pixels"]) for row in record["rows"]] == [
        ("sphere/plain", "pass", "fail", 50),
        ("sphere/sheared", "fail", "pass", 0),
        ("lights/acne", "fail", "fail", 0),
    ]
    assert record["rows"][0]["worst"]["before"] == ["pass", 0.21]
    assert record["rows"][0]["worst"]["after"] == ["fail", 12.5]
    assert record["rows"][2]["seconds"][2] == pytest.approx(3)
    assert (record["appeared"], record["vanished"]) == ([["plane/other", "warn"]], [["plane/tilted", "warn"]])
    assert record["sentence"] == (
        "2 of 8 verdicts changed, 1 for the worse; worst errors grew in 1 and shrank in 1; images differ in 1 of 5; "
        "times, at different hours: x1 in the median case; 1 slower and 0 faster than that explains; "
        "1 appeared; 1 vanished."
    )


def test_images_of_both_are_kept_bit_for_bit_where_they_differ(folder: Path, runs: tuple[Path, Path]) -> None:
    cases = {case["name"]: case for case in load_results(folder)["cases"]}

    images, notes = kept_images(folder, cases["sphere/plain"])
    assert notes == []
    assert set(images) >= {"old: tracer-float32", "tracer-float32", "old: tracer-float64", "analytic"}
    for name, run in (("old: tracer-float32", runs[0]), ("tracer-float32", runs[1])):
        kept = read_answers(run / "images/sphere/plain/tracer-float32.exr")
        assert {stage: image.tobytes() for stage, image in images[name].items()} == {
            stage: image.tobytes() for stage, image in kept.items()
        }
    same, _ = kept_images(folder, cases["sphere/sheared"])
    assert not any(name.startswith("old") for name in same)


def test_images_that_both_runs_kept_alike_are_taken_over(tmp_path: Path) -> None:
    renders = {"tracer-float32": answers(rounding=1e-7), "analytic": answers()}
    folders = (tmp_path / "before", tmp_path / "after")
    case = {"name": "a/b", "verdict": "pass", "checks": [], "pixels": "images/a/b.js",
            "renders": [{"renderer": name, "configuration": None} for name in renders]}  # fmt: skip
    for folder in folders:
        write_pixels(folder / "images/a/b.js", "images/a/b.js", renders, None)
    pairs = {"tracer-float32": "tracer-float32"}

    counted = write_both(folders, (case, case), pairs, "before", tmp_path / "out", "images/0001.js")

    assert counted == (0, True)
    assert (tmp_path / "out/images/0001.js").read_text().startswith('rayproof.receive("images/0001.js",\n')
    kept = read_pixels(tmp_path / "out/images/0001.js")
    assert {name: stages.keys() for name, stages in kept.items()} == {name: one.keys() for name, one in renders.items()}
    renders["tracer-float32"][Stage.NORMAL][3, 4] = 7
    write_pixels(folders[1] / "images/a/b.js", "images/a/b.js", renders, None)
    counted = write_both(folders, (case, case), pairs, "before", tmp_path / "out", "images/0001.js")
    assert counted == (1, True)
    assert "before: tracer-float32" in read_pixels(tmp_path / "out/images/0001.js")


def test_two_equal_runs_differ_in_nothing(runs: tuple[Path, Path]) -> None:
    results = load_results(runs[0])

    found = comparison(results, copy.deepcopy(results), ("a", "b"))

    assert not any(map(moved, found["rows"]))
    assert sentence(found).startswith("0 of 9 verdicts changed, 0 for the worse; worst errors grew in 0")


def test_what_all_cases_share_is_no_case_s_own_slowness(runs: tuple[Path, Path]) -> None:
    results = load_results(runs[0])
    slower = copy.deepcopy(results)
    for case in slower["cases"]:
        for render in case["renders"]:
            render["seconds"] *= 5

    found = comparison(results, slower, ("a", "b"))

    assert found["time"] == pytest.approx(5)
    assert not any(row["stands_out"] for row in found["rows"])


@pytest.mark.parametrize(
    "spoiled", [{"rows": 1}, {"rows": [{}]}, {"base": "x"}, {"vanished": [["a"]]}, {"renderers": []}]
)
def test_a_record_of_another_shape_is_not_shown(folder: Path, spoiled: dict[str, Any]) -> None:
    record = json.loads((folder / "results.json").read_text())["comparison"]

    assert comparison_front({"comparison": record}) is not None
    assert comparison_front({"comparison": record | spoiled}) is None
    assert comparison_front({}) is None


@pytest.mark.browser
def test_the_page_shows_the_table_and_both_images(browser: Any, folder: Path) -> None:
    visit = Visit(browser, folder)
    page = visit.open()

    table = page.get_by_role("region", name="What changed")
    assert [row.split()[0] for row in table.locator("tbody th").all_inner_texts()] == [
        "sphere/plain",
        "sphere/sheared",
        "lights/acne",
    ]
    table.get_by_role("link", name="sphere/plain").click()
    page.wait_for_selector(".pane .frame > canvas")
    assert page.get_by_role("tab", selected=True).inner_text().split()[1] == "radiance"
    assert page.get_by_label("reference", exact=True).input_value() == "old: tracer-float32"
    assert "50 of 1200 pixels differ" in page.locator(".panes").inner_text()
    panel = page.get_by_role("region", name="Before and after")
    assert "4 of 38 checks changed; 50 pixels differ" in panel.inner_text()
    visit.end()
