"""The starter of a formula of one's own: of every slot, and it computes what the slot's default does."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from rayproof.cases.families import select
from rayproof.cases.stages import Stage
from rayproof.reports.commands.new import starter
from rayproof.tracer.configuration import Configuration
from rayproof.tracer.formulas import FORMULAS
from rayproof.tracer.render import render
from tests.reports.commands.conftest import Rayproof


@pytest.mark.parametrize("slot", FORMULAS.slots)
def test_every_slot_has_a_starter_that_states_its_contract_and_loads(slot: str, tmp_path: Path) -> None:
    file = tmp_path / "mine.py"

    name, text = starter(FORMULAS[f"{slot}/{FORMULAS.slots[slot]}"])
    file.write_text(text)

    assert FORMULAS.named(f"{slot}={file}:{name}").slot == slot
    assert text.count("\ndef ") <= 2  # itself and a helper, not the whole page
    assert slot in text.split('"""')[1]
    assert "->" in text.split('"""')[1] or f"{slot}(" in text.split('"""')[1]


def test_a_starter_documents_the_members_of_its_arguments() -> None:
    about = starter(FORMULAS["sphere/haines"])[1].split('"""')[1]

    assert "    ray.origin, ray.direction\n    ray.at(t): Return the points at" in about
    assert "    interval.smallest(near, far): Return the smaller of two ordered roots" in about
    assert "shear" not in about  # a cache of the triangles' formulas


def test_it_works_as_it_stands(rayproof: Rayproof, tmp_path: Path) -> None:
    chosen = {}
    for slot in ("sphere", "shadow_ray", "falloff", "ray"):
        file = tmp_path / f"{slot}.py"
        ended = rayproof("new", "formula", slot, file)
        assert ended.code == 0
        chosen[slot] = next(line for line in ended.out.splitlines() if "run --formula" in line).rpartition("=")[2]
    scene = select(["primitives/sphere"])[0].scene

    mine = render(scene, [Stage.RADIANCE], Configuration(formulas=chosen))[Stage.RADIANCE]

    assert np.array_equal(mine, render(scene, [Stage.RADIANCE], Configuration())[Stage.RADIANCE])


def test_what_cannot_be_written_is_refused(rayproof: Rayproof, tmp_path: Path) -> None:
    (tmp_path / "there.py").write_text("x = 1\n")

    for arguments, named in (
        (("cylinder", tmp_path / "a.py"), "cylinder"),
        (("sphere", tmp_path / "there.py"), "exists already"),
        (("sphere", tmp_path / "a.txt"), ".py"),
    ):
        ended = rayproof("new", "formula", *arguments)
        assert (ended.code, ended.error.count("\n")) == (2, 1)
        assert named in ended.error
    assert (tmp_path / "there.py").read_text() == "x = 1\n"


@pytest.mark.process
def test_the_starter_is_compared_with_another_form_and_has_a_test_that_can_fail(
    rayproof: Rayproof, tmp_path: Path
) -> None:
    ended = rayproof("new", "formula", "sphere", tmp_path / "mine.py")
    (compared,) = (line.split() for line in ended.out.splitlines() if " compare " in line)

    def passes() -> bool:
        words = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", tmp_path / "test_mine.py"]
        return subprocess.run(words, cwd=tmp_path, capture_output=True, check=False).returncode == 0

    base = FORMULAS.named(compared[compared.index("compare") + 1])
    assert (base.slot, base.default, base.kind) == ("sphere", False, "right")
    assert passes()
    text = (tmp_path / "mine.py").read_text()
    (tmp_path / "mine.py").write_text(text.replace("dr.square(sphere.radius)", "dr.square(sphere.radius) * 2"))
    assert (tmp_path / "mine.py").read_text() != text
    assert not passes()
    assert rayproof("new", "formula", "sphere", tmp_path / "mine.py").code == 2
