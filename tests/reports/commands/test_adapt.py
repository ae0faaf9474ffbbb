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


def test_what_exists_is_left_alone(rayproof: Rayproof, tmp_path: Path) -> None:
    (tmp_path / "rayproof.hpp").write_text("mine")

    ended = rayproof("new", "adapter", tmp_path / "new.cpp")

    assert ended.code == 2
    assert ended.error == f"rayproof: {tmp_path / 'rayproof.hpp'}: exists already, and is not overwritten\n"
    assert [path.name for path in tmp_path.iterdir()] == ["rayproof.hpp"]


def test_the_language_is_the_endings_unless_it_is_said(rayproof: Rayproof, tmp_path: Path) -> None:
    assert rayproof("new", "adapter", tmp_path / "a" / "renderer", "--language", "c++").code == 0
    assert rayproof("new", "adapter", tmp_path / "b" / "renderer").code == 0

    assert "#include" in (tmp_path / "a" / "renderer").read_text()
    assert "import json" in (tmp_path / "b" / "renderer").read_text()
    assert rayproof("new", "adapter", tmp_path / "c", "--language", "fortran").code == 2
