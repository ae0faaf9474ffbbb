"""What a scene takes is told before anything starts, and what no machine could hold is refused in one line."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import psutil
import pytest

from rayproof.cases.case import Case
from rayproof.cases.families import select
from rayproof.cases.scene import Mesh, SceneError
from rayproof.reports.cli import main
from rayproof.reports.run.scenes import USUAL_LIMIT, deadline, estimate, refuse_beyond_all


@pytest.fixture
def small() -> Case:
    return select(["shadows/*"])[0]


def larger(case: Case, how: str) -> Case:
    scene = case.scene
    if how == "pixels":
        camera = replace(scene.camera, width=100 * scene.camera.width, height=100 * scene.camera.height)
        return replace(case, scene=replace(scene, camera=camera))
    if how == "lights":
        return replace(case, scene=replace(scene, lights=1000 * scene.lights))
    corners = np.eye(3, dtype=np.float32)
    mesh = Mesh(albedo=(0.5, 0.5, 0.5), vertices=corners, faces=np.tile(np.arange(3, dtype=np.int32), (2_000_000, 1)))
    return replace(case, scene=replace(scene, shapes=(*scene.shapes, mesh)))


@pytest.mark.parametrize("how", ["pixels", "lights", "triangles"])
def test_more_of_anything_is_estimated_to_take_more(small: Case, how: str) -> None:
    before = estimate(small, configurations=2, references=5)
    after = estimate(larger(small, how), configurations=2, references=5)

    assert after.seconds > before.seconds
    assert after.longest > before.longest
    assert after.memory > before.memory
    # What a mesh is made of is not kept once more.
    assert after.disk > before.disk or how == "triangles"


def test_deadlines_grow_with_what_is_estimated(small: Case) -> None:
    assert deadline(small, configurations=2, references=5) == USUAL_LIMIT
    # A 4096 x 4096 image takes scalar Mitsuba more than the usual limit.
    camera = replace(small.scene.camera, width=4096, height=4096)
    large = replace(small, scene=replace(small.scene, camera=camera))
    assert deadline(large, configurations=2, references=5) > 8 * USUAL_LIMIT


@pytest.mark.parametrize(
    ("how", "refusal"),
    [
        ("pixels", r"a.json: 5200 x 3900 px are more than the 4194304 that are judged; make the image smaller"),
        ("memory", r"a.json: 52 x 39 px and its meshes take about .* GB of memory to judge, and this machine has 0 GB"),
    ],
)
def test_an_image_too_large_to_be_judged_is_refused_in_one_sentence(
    small: Case, how: str, refusal: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    case = small
    if how == "pixels":
        case = replace(small, scene=replace(small.scene, camera=replace(small.scene.camera, width=5200, height=3900)))
    else:
        case = replace(small, scene=replace(small.scene, camera=replace(small.scene.camera, width=52, height=39)))
        monkeypatch.setattr(psutil, "virtual_memory", lambda: SimpleNamespace(total=2e8))

    with pytest.raises(SceneError, match=refusal):
        refuse_beyond_all(case, "a.json")


def test_a_dry_run_prints_the_plan_and_does_nothing(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "report"

    code = main(["run", "primitives/sphere", "--dry-run", "--out", str(out), "--jobs", "2"])

    lines = capsys.readouterr().out.splitlines()
    assert code == 0
    assert lines[0].startswith("plan: 1 case, ")
    assert any(line.startswith("largest case: primitives/sphere, ") for line in lines)
    for what in ("time", "memory", "disk"):
        assert any(line.startswith(f"estimated {what}: ") for line in lines)
    assert lines[-1] == "deadline: 120 s for one render or one judgement"
    assert not out.exists()
