"""A subject is found by name or by command line, or refused in one line that says why."""

import sys
from pathlib import Path

import pytest

from rayproof.reference import REFERENCES
from rayproof.reports.run.plan import panel
from rayproof.reports.subjects import Subject
from rayproof.reports.subjects.choosing import chosen
from rayproof.reports.subjects.protocol import Capabilities


def nothing(subject: Subject) -> Capabilities:
    return Capabilities()


def choose(text: str) -> Subject:
    return chosen(text, seconds=5.0, memory=2**30, ask=nothing)


def test_a_reference_is_chosen_by_its_name() -> None:
    assert choose("mitsuba_scalar").renderer("mitsuba_scalar") == "mitsuba_scalar"


def test_a_program_is_found_and_its_files_made_absolute(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("adapter.py").touch()

    subject = choose("exec:python3 adapter.py --fast 'two words' {scene} {output}")

    assert Path(subject.command[0]).is_absolute()
    assert subject.command[1:] == (str(tmp_path / "adapter.py"), "--fast", "two words", "{scene}", "{output}")


def test_a_program_that_was_built_anew_is_another_subject(tmp_path: Path) -> None:
    path = tmp_path / "render"
    path.write_text("#!/bin/sh\n")
    path.chmod(0o755)
    before = choose(f"exec:{path} {{scene}} {{output}}").identity

    assert choose(f"exec:{path} {{scene}} {{output}}").identity == before
    path.write_text("#!/bin/sh\nexit 1\n")
    assert choose(f"exec:{path} {{scene}} {{output}}").identity != before


WRONG = {
    "unknown": ("maya", "no renderer is called 'maya'; known: analytic"),
    "the oracle": ("analytic", "certified"),
    "no command": ("exec:", "no command"),
    "no program": ("exec:no-such-renderer {scene}", "'no-such-renderer' is no program"),
    "no image to write": (
        "exec:true {scene}",
        "none of its words is {output}, {output.pfm}, {output.hdr} or {output.png}",
    ),
    "no such format": ("exec:true {scene.max} {output}", "{scene.max} is no format that is written; known: {scene"),
    "two formats": ("exec:true {scene.xml} {scene.gltf} {output}", "in one format, got xml, gltf"),
    "open quote": ("exec:true 'half", "quotation"),
}


@pytest.mark.parametrize(("text", "said"), WRONG.values(), ids=WRONG.keys())
def test_what_cannot_be_put_under_test_says_why(text: str, said: str) -> None:
    with pytest.raises((ValueError, LookupError), match=r"^[^\n]+$") as refused:
        choose(text)

    assert said in str(refused.value)


def test_a_wrong_answer_to_the_question_refuses_the_program() -> None:
    def wrong(subject: Subject) -> Capabilities:
        raise ValueError("protocol must be 1, got 2")

    with pytest.raises(ValueError, match="its answer to --capabilities: protocol must be 1"):
        chosen(f"exec:{sys.executable} {{output}}", seconds=5.0, memory=2**30, ask=wrong)


def test_neither_the_subject_nor_its_kin_is_a_witness() -> None:
    found = panel((), choose("mitsuba_llvm"))

    assert found.names[0] == "analytic"
    assert not {"mitsuba_llvm", "mitsuba_scalar"} & set(found.names)
    assert "under test" in found.absent["mitsuba_llvm"]
    assert "shares its code" in found.absent["mitsuba_scalar"]


THE_PANEL = ("analytic", "mitsuba_llvm", "mitsuba_scalar", "radiance")


def test_the_panel_is_the_same_whatever_is_installed(monkeypatch: pytest.MonkeyPatch) -> None:
    assert panel(()).names == THE_PANEL
    monkeypatch.setenv("PATH", "")
    for name in THE_PANEL[1:]:
        monkeypatch.setattr(REFERENCES[name], "missing", staticmethod(lambda: "It is not installed."))

    assert panel(()).names == THE_PANEL
    assert panel(()).absent == {}
