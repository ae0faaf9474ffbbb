"""`rayproof call` makes one call of a program by hand, and `rayproof probe` puts a pixel of it beside the rest."""

import json
import sys
from pathlib import Path

import pytest

from rayproof.cases.families import select
from rayproof.cases.stages import Stage
from rayproof.reference.analytic import Analytic
from rayproof.reports.judge.oracle import stages_of
from rayproof.reports.results.images import write_answers
from tests.reports.commands.conftest import Rayproof


def script(folder: Path, *lines: str) -> str:
    """Return a program under test that runs these lines, with SCENE and OUTPUT in its hands."""
    path = folder / "program.py"
    path.write_text("\n".join(["import shutil, sys", "SCENE, OUTPUT = (sys.argv[1:] + ['', ''])[:2]", *lines]))
    return f"exec:{sys.executable} -S {path} {{scene}} {{output}}"


@pytest.mark.references
def test_a_program_s_pixel_stands_beside_those_of_the_panel(rayproof: Rayproof, tmp_path: Path) -> None:
    scene = select(["primitives/sphere"])[0].scene
    answers = Analytic().render(scene, stages_of(scene))
    images = {stage: image for stage, image in answers.items() if stage is not Stage.CAMERA}
    write_answers(tmp_path / "prepared.exr", images, lights=len(scene.lights))
    subject = script(tmp_path, f"OUTPUT and shutil.copyfile({str(tmp_path / 'prepared.exr')!r}, OUTPUT)")

    ended = rayproof("probe", "primitives/sphere", 48, 36, "--subject", subject, "--json", tmp_path / "pixel.json")

    shown = json.loads((tmp_path / "pixel.json").read_text())["renderers"]
    assert ended.code == 0
    assert shown["program"]["radiance.R"] == pytest.approx(shown["analytic"]["radiance.R"], rel=1e-6)
    assert shown["program"]["camera"].startswith("unsupported: ")
