"""Thumbnails: of what did not pass, at the blamed stage, whatever numbers are in it."""

import math
from pathlib import Path

import numpy as np
from matplotlib.image import imread
from msgspec.structs import replace

from rayproof.cases.stages import Stage
from rayproof.reports.publish.page.thumbnails import GAP, draw_thumbnails
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
