"""What a scene takes is told before anything starts, and what no machine could hold is refused in one line."""

import json
import re
import sys
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import psutil
import pytest

from rayproof import ROOT
from rayproof.cases.case import Case
from rayproof.cases.families import select
from rayproof.cases.scene import Mesh, SceneError
from rayproof.reports.cli import main
from rayproof.reports.run.scenes import USUAL_LIMIT, deadline, estimate, refuse_beyond_all

CAMERA = {"eye": [0, 0, 4], "target": [0, 0, 0], "up": [0, 1, 0], "fovy": 40, "near": 1, "far": 9}


@pytest.mark.process
@pytest.mark.parametrize("command", ["run", "render"])
def test_an_image_beyond_all_memory_is_refused(
    command: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    scene = tmp_path / "large.json"
    shapes = [{"type": "sphere", "albedo": [0.5, 0.5, 0.5]}]
    # A million on a side: thousands of terabytes, so that the machine of the test does not matter.
    scene.write_text(json.dumps({"camera": CAMERA | {"width": 10**6, "height": 10**6}, "shapes": shapes}))
    out = [str(tmp_path / "image.exr")] if command == "render" else ["--out", str(tmp_path / "report")]

    code = main([command, str(scene), *out])

    said = capsys.readouterr().err
    assert code == 2
    takes = "are more than the 4194304" if command == "run" else "and its meshes take about 330000 GB of memory"
    assert said.startswith(f"rayproof: {scene}: 1000000 x 1000000 px {takes}")
    assert said.count("\n") == 1


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


@pytest.mark.process
@pytest.mark.references
def test_a_dry_run_and_the_last_line_of_its_run_count_the_same_checks(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    # The camera has no image, so that a program is never asked about it: 260 were planned, and 242 counted at the end.
    assert main(["new", "adapter", str(tmp_path / "mine.py")]) == 0
    words = ["run", "primitives/sphere", "primitives/cube", "--no-cache", "--out", str(tmp_path / "out")]
    words += ["--subject", f"serve:{sys.executable} {tmp_path / 'mine.py'}"]
    assert main([*words, "--dry-run"]) == 0
    plan = re.search(r"(\d+) checks, (\d+) of them of images", capsys.readouterr().out)
    assert main(words) == 0
    printed = capsys.readouterr().out
    checks = re.search(r"checks: (\d+) planned", printed)
    images = re.search(r"of (\d+) checks of images answered", printed)

    assert plan is not None
    assert checks is not None
    assert images is not None
    assert plan.groups() == (checks[1], images[1])


@pytest.mark.process
def test_a_dry_run_calls_a_program_once_and_counts_its_start(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    log, adapter = tmp_path / "log", ROOT / "reports" / "subjects" / "starters" / "adapter.py"
    program = tmp_path / "slow.py"
    program.write_text(
        f"import time; open({str(log)!r}, 'a').write('started '); time.sleep(0.6)\n" + adapter.read_text()
    )
    command = f"{sys.executable} -S {program}"

    assert main(["run", "primitives/sphere", "--dry-run", "--subject", f"serve:{command}"]) == 0
    alive = capsys.readouterr().out
    assert main(["run", "primitives/sphere", "--dry-run", "--subject", f"exec:{command} {{scene}} {{output}}"]) == 0
    called = capsys.readouterr().out

    assert log.read_text().split() == ["started"] * 3, "once; and for what it can, and for a case"
    start = re.search(r"takes ([\d.]+) s to start once for each worker, and ([\d.]+) s for primitives/sphere", alive)
    call = re.search(r"takes ([\d.]+) s for primitives/sphere; it answers 2 times", called)
    assert start is not None
    assert call is not None
    assert float(start[1]) >= 0.6
    assert float(call[1]) >= 0.6
