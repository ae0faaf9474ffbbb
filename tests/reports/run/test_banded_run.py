"""An image that is judged in bands of rows has the verdicts, counts and worst pixels of the same image judged whole."""

from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rayproof.cases.case import Case
from rayproof.cases.families import select
from rayproof.cases.scene import Cube, PointLight, Scene, Sphere, Square
from rayproof.cases.scene_json import scene_to_json
from rayproof.cases.stages import Stage
from rayproof.reference import REFERENCES
from rayproof.reports.results.image_script import read_pixels
from rayproof.reports.results.records import ConventionRecord
from rayproof.reports.run import size
from rayproof.reports.run.banded_run import band
from rayproof.reports.run.messages import JudgeTask, ReferenceTask, TracerTask
from rayproof.reports.run.plan import PlannedCase
from rayproof.reports.run.record import images as keeping
from rayproof.reports.run.record import merging
from rayproof.reports.run.tasks import judge_task
from rayproof.reports.run.tasks.reference_task import WHOLE_ONLY, heard, unable
from rayproof.reports.run.tasks.trace_task import trace
from rayproof.reports.subjects import PROGRAM, THE_TRACER, Subject

PANEL = ("analytic", "radiance")
PLACED = ((0.5, 0.1, 0.0, 0.9), (0.0, 0.6, 0.1, 0.8), (0.0, 0.0, 0.5, 0.3), (0.0, 0.0, 0.0, 1.0))
BEHIND = ((6.0, 0.0, 0.0, 0.0), (0.0, 6.0, 0.0, 0.0), (0.0, 0.0, 1.0, -1.2), (0.0, 0.0, 0.0, 1.0))


@pytest.fixture
def case() -> Case:
    known = select(["primitives/sphere"])[0]
    camera = replace(
        known.scene.camera, eye=(0, 0, 4), target=(0, 0, 0), up=(0, 1, 0), fovy=40, width=36, height=30, near=1, far=9
    )
    grey = (0.5, 0.6, 0.7)
    shapes = (Sphere(albedo=grey), Square(albedo=grey, to_world=BEHIND), Cube(albedo=grey, to_world=PLACED))
    lights = (PointLight(position=(3, 4, 5), flux=(90, 80, 70)), PointLight(position=(-2, 1, 3), flux=(30, 40, 50)))
    scene = Scene(camera=camera, shapes=shapes, lights=lights)
    return replace(
        known, name="file/banded", scene=scene, expectations=(), least_interior=0, most_edge=0.5, tuned=False
    )


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(judge_task, "_guarded", lambda **_: None)
    monkeypatch.setattr(keeping, "MOST_KEPT", 150)  # every third pixel
    return tmp_path


def judged(planned: PlannedCase, folder: Path, light: float = 1.0) -> dict[str, Any]:
    """Return the record of a case, put to the tracer alone, whose radiance is off by a factor in its lower half."""
    case = planned.case
    candidate, versions, *_ = trace(TracerTask(scene=case.scene, configuration="float32", samples=1))
    if light != 1.0:
        assert candidate.answers is not None
        rows = np.arange(case.scene.camera.lines) + case.scene.camera.first_row
        off = np.where(rows >= case.scene.camera.height // 2, light, 1.0)[:, np.newaxis, np.newaxis]
        radiance = candidate.answers[Stage.RADIANCE] * off
        candidate = replace(candidate, answers={**candidate.answers, Stage.RADIANCE: radiance})
    asked = ReferenceTask(scene=case.scene, samples=1)
    witnesses = tuple(heard(name, REFERENCES[name](), asked, independent=True) for name in PANEL)
    task = JudgeTask(
        case=case, candidates=(candidate,), witnesses=witnesses, versions=versions, folder=folder, require=()
    )
    record = judge_task.judge(task)
    for render in record["renders"]:
        render["seconds"] = 0.0
    return record | {"seconds": 0.0, "judge_seconds": 0.0, "remembered": False, "versions": versions}


def in_bands(planned: PlannedCase, folder: Path, light: float = 1.0) -> dict[str, Any]:
    bands = ((0, 11), (11, 22), (22, 30))
    records = [judged(band(planned, rows), folder, light) for rows in bands]
    return merging.merged(planned, records, folder=folder, subject=THE_TRACER)


def same(whole: Any, bands: Any, path: str = "") -> None:
    """Compare records but for what is told of bands otherwise."""
    if isinstance(whole, dict) and "worst_ratio" in whole and whole["worst_ratio"] == bands["worst_ratio"]:
        # Of two pixels that are off by the same five digits of a limit the whole image and the bands may name either.
        either = {"pixel", "worst_error", "limit", "ours", "theirs", "ulp"}
        whole, bands = ({key: value for key, value in one.items() if key not in either} for one in (whole, bands))
    if isinstance(whole, dict):
        # Metrics that inform are of whole images; factors are tested band by band, conventions where they may explain.
        left = {"bias", "conventions", "ssim", "psnr", "nrmse", "relative_mse", "range", "because", "reason"}
        assert set(whole) - left == set(bands) - left, path
        for key in set(whole) - left:
            same(whole[key], bands[key], f"{path}/{key}")
    elif isinstance(whole, list):
        assert len(whole) == len(bands), path
        for number, both in enumerate(zip(whole, bands, strict=True)):
            same(*both, f"{path}/{number}")
    elif isinstance(whole, float) and np.isfinite(whole):
        assert bands == pytest.approx(whole, rel=1e-9, abs=1e-300), path
    else:
        assert whole == bands, path


@pytest.mark.process
@pytest.mark.parametrize("light", [1.0, 1.01])
def test_bands_are_judged_as_the_whole_image_is(case: Case, folder: Path, light: float) -> None:
    planned = PlannedCase(case=case, configurations=("float32",))
    whole, bands = judged(planned, folder / "whole", light), in_bands(planned, folder / "bands", light)

    assert whole["verdict"] == ("pass" if light == 1.0 else "fail")
    for key in ("verdict", "stage", "item", "checks", "adjudication", "width", "height", "scene", "covers"):
        same(whole[key], bands[key], key)
    assert (folder / "bands" / bands["scene"]).read_bytes() == (folder / "whole" / whole["scene"]).read_bytes()


@pytest.mark.process
def test_a_thinned_image_is_kept_to_look_at(case: Case, folder: Path) -> None:
    planned = PlannedCase(case=case, configurations=("float32",))
    bands = in_bands(planned, folder)

    (kept,) = (folder / "images").rglob("*.js")
    assert kept == folder / bands["pixels"]
    images = read_pixels(kept)
    right = trace(TracerTask(scene=case.scene, configuration="float32", samples=1))[0].answers
    assert right is not None
    assert set(images) == {"tracer-float32", *PANEL}
    for stage, image in images["tracer-float32"].items():
        np.testing.assert_array_equal(image, right[stage][::3, ::3].astype(np.float32))
    assert (bands["masks"]["height"], bands["masks"]["width"]) == (10, 12)
    assert bands["notes"][-1]["note"].endswith("its images show every 3th pixel of every 3th row.")


def test_bands_cover_a_large_image_and_a_small_one_is_whole(case: Case) -> None:
    camera = replace(case.scene.camera, width=4096, height=4096)
    large = replace(case, scene=replace(case.scene, camera=camera))

    bands = size.bands_of(large, THE_TRACER)

    assert [bands[0][0], bands[-1][1]] == [0, 4096]
    assert all(one[1] == other[0] for one, other in pairwise(bands))
    assert size.estimate(large, candidates=2, references=5).memory < 2e9
    assert size.bands_of(case, THE_TRACER) == ()
    # Nobody can ask a program for a part of its image, and a case of the suite promises something of its whole image.
    assert size.bands_of(large, Subject(name=PROGRAM, title="exec:x")) == ()
    assert size.bands_of(replace(large, tuned=True), THE_TRACER) == ()


def test_who_draws_whole_images_alone_says_so_of_a_band(case: Case) -> None:
    part = band(PlannedCase(case=case, configurations=("float32",)), (0, 11)).case.scene

    assert unable(REFERENCES["certified"](), part, Stage.RAY) == WHOLE_ONLY
    assert unable(REFERENCES["analytic"](), part, Stage.RAY) is None
    assert "rows" not in scene_to_json(part)["camera"]


def test_a_convention_that_was_not_measured_in_a_band_explains_nothing() -> None:
    measured: ConventionRecord = {"what": "mirrors", "explains": True, "ratio": 0.5, "differing": 0, "interior": 9}
    unmeasured: ConventionRecord = {**measured, "ratio": None, "differing": None}

    assert [one.explains for one in merging._conventions([[measured], [measured]])] == [True]
    assert [one.explains for one in merging._conventions([[measured], [unmeasured]])] == [False]
