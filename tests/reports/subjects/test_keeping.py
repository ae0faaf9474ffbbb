"""A kept call has what the program was handed, to the byte, and what it said, in characters that nothing obeys."""

import json
import subprocess
from pathlib import Path

import pytest

from rayproof.reports.subjects.calls import TOLD
from rayproof.reports.subjects.program import ask_program
from rayproof.reports.subjects.protocol import hand_over
from tests.reports.subjects.conftest import SCENE, Writing

pytestmark = pytest.mark.process


def test_a_call_that_gave_no_image_is_kept_with_all_that_it_takes_to_make_it_again(
    program: Writing, tmp_path: Path
) -> None:
    subject = program("os.remove(SCENE)", "open(OUTPUT, 'w').write('half')", "sys.exit('no \\x1b[31mlicence')")
    kept, handed = tmp_path / "kept", tmp_path / "handed"
    handed.mkdir()
    hand_over(SCENE, handed)

    found = ask_program(subject, SCENE, samples=1, keep=kept)

    assert found.error is not None
    for path in handed.iterdir():
        assert (kept / path.name).read_bytes() == path.read_bytes()
    told = (kept / TOLD).read_text()
    assert "exit code: 1" in told
    assert "licence" in told
    assert "\x1b" not in told
    command = told.splitlines()[1]
    again = subprocess.run(command, shell=True, cwd=kept, capture_output=True, text=True, check=False)
    assert (again.returncode, "licence" in again.stderr) == (1, True)


def test_an_image_that_cannot_be_used_is_kept_and_nothing_of_an_earlier_call(program: Writing, tmp_path: Path) -> None:
    kept = tmp_path / "kept"
    ask_program(program("open(OUTPUT, 'w').write('hello')"), SCENE, samples=1, keep=kept)
    assert (kept / "image.exr").read_text() == "hello"
    assert json.loads((kept / "scene.json").read_text())["camera"]

    ask_program(program("pass"), SCENE, samples=1, keep=kept)

    assert not (kept / "image.exr").exists()
