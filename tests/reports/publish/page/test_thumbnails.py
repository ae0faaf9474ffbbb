"""Thumbnails: of what did not pass, at the blamed stage, whatever numbers are in it."""

import math
from pathlib import Path

import numpy as np
import pytest
from matplotlib.image import imread
from msgspec.structs import replace

from rayproof.cases.stages import Stage
from rayproof.reports.publish.page.thumbnails import BROKEN, GAP, draw_thumbnails
from rayproof.reports.results.case_records import Measurement
from rayproof.reports.results.images import write_answers
from tests.reports.publish.sample import make_folder


def test_what_did_not_pass_and_has_images_is_drawn(tmp_path: Path) -> None:
    results = make_folder(tmp_path)

    (tmp_path / "thumbnails").mkdir()
    (tmp_path / "thumbnails" / "10.png").touch()

    paths = draw_thumbnails(tmp_path, results)

    drawn = {case["name"]: case["thumbnail"] for case in results["cases"] if "thumbnail" in case}
    assert (
        sorted(paths) == sorted((tmp_path / "thumbnails").iterdir()) == sorted(tmp_path / one for one in drawn.values())
    )
    assert {"sphere/sheared", "lights/acne", "lights/broken"} <= set(drawn)
    assert not {"sphere/plain", "plane/tilted", "mesh/crash"} & set(drawn)
    for path in drawn.values():
        image = imread(tmp_path / path)
        assert image.shape[:2] == (30, 3 * 40 + 2 * GAP)
        assert image[:, -40:, :3].max() > 0  # the difference


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, 3e38])
def test_numbers_of_any_kind_are_drawn(value: float, tmp_path: Path) -> None:
    results = make_folder(tmp_path)
    case = next(case for case in results["cases"] if case["name"] == "lights/broken")
    ours = next(render for render in case["renders"] if render["renderer"].startswith("tracer"))
    image = np.zeros((30, 40, 3))
    image[3, 4] = value
    write_answers(tmp_path / ours["image"], {Stage.RADIANCE: image}, lights=2, comments="")

    (path,) = draw_thumbnails(tmp_path, results | {"cases": [case]})

    shown = imread(path)[3, 4, :3]
    assert tuple(shown) == (BROKEN if not np.isfinite(value) else (1.0, 1.0, 1.0))


def test_of_checks_alike_the_one_with_the_worst_error_is_drawn_and_nan_is_the_worst(tmp_path: Path) -> None:
    results = make_folder(tmp_path)
    case = next(case for case in results["cases"] if case["name"] == "lights/broken")
    stage, verdict = case["stage"], case["verdict"]
    alike = [check for check in case["checks"] if check.stage == stage and check.outcome == verdict]
    assert len(alike) >= 2
    both = zip((5.0, math.nan), alike, strict=False)
    alike = [replace(check, ratio=ratio, end_to_end=Measurement(worst_ratio=ratio)) for ratio, check in both]
    worst = alike[1]
    marked = np.full((30, 40, 3), 0.25)
    drawn = next(one for one in case["renders"] if one["renderer"] in (worst.reference,))
    write_answers(tmp_path / drawn["image"], {Stage(stage): marked}, lights=2, comments="")

    (path,) = draw_thumbnails(tmp_path, results | {"cases": [{**case, "checks": alike}]})

    theirs = imread(path)[:, 40 + GAP : 80 + GAP, :3]
    assert len(np.unique(theirs)) == 1


def test_summary_and_junit_point_to_them(tmp_path: Path) -> None:
    from rayproof.reports.publish.junit import publish_junit
    from rayproof.reports.publish.summaries import publish_summary as summary

    results = make_folder(tmp_path)

    draw_thumbnails(tmp_path, results)
    (markdown,), (xml,) = summary(tmp_path, results), publish_junit(tmp_path, results)

    assert "](thumbnails/01.png)" in markdown.read_text()
    assert "[[ATTACHMENT|thumbnails/01.png]]" in xml.read_text()
