"""`rayproof new adapter` writes a program that works as it stands, and overwrites nothing."""

import sys
from dataclasses import replace
from pathlib import Path

import pytest

from rayproof.cases.families import select
from rayproof.reports.subjects import PROGRAM, Subject
from rayproof.reports.subjects.program import ask_capabilities, ask_program
from tests.examples.test_renderers import answers_line_by_line, judged
from tests.reports.commands.conftest import Rayproof


@pytest.mark.process
def test_the_starter_in_python_passes_on_spheres(rayproof: Rayproof, tmp_path: Path) -> None:
    ended = rayproof("new", "adapter", tmp_path / "mine.py")

    assert ended.code == 0
    assert (
        'rayproof run primitives/sphere nearest/spheres --subject "exec:python3 mine.py {scene} {output}"' in ended.out
    )
    assert 'rayproof run primitives/sphere nearest/spheres --subject "serve:python3 mine.py"' in ended.out
    command = (sys.executable, "-I", "-W", "error", str(tmp_path / "mine.py"))
    answers_line_by_line(*command)
    subject = Subject(name=PROGRAM, transport=PROGRAM, title="exec:mine", command=(*command, "{scene}", "{output}"))
    able = replace(subject, capabilities=ask_capabilities(subject, seconds=10))
    (sphere,), (cube,) = select(["primitives/sphere"]), select(["primitives/cube"])
    assert judged(able, sphere).outcome == "pass"
    assert "draws no cube" in next(iter(ask_program(able, cube.scene, samples=1).unsupported.values()))
