"""Of a C++ program that shares no code with the tracer mistakes are named, and none is named wrongly."""

from dataclasses import replace
from pathlib import Path

import pytest

from rayproof.reports.diagnosis.diagnosing import causes_of
from rayproof.reports.mistakes import MISTAKES
from tests.harness.audit import diagnosing

CASES = (
    "primitives/plane",
    "sidedness/square_lit_from_the_viewer",
    "simplified/shadows",
    "transforms/cube_sheared",
    "transforms/mesh_sheared",
    "transforms/sphere_stretched",
)

pytestmark = pytest.mark.skipif(diagnosing.compiler() is None, reason="there is no C++ compiler")


@pytest.fixture(scope="module")
def program(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return diagnosing.built(tmp_path_factory.mktemp("mistaken"))


def switched(program: Path, mistake: str) -> diagnosing.Renderer:
    (found,) = (one for one in diagnosing.switched(program) if one.name == mistake)
    return found


@pytest.mark.process
@pytest.mark.parametrize("mistake", ["normal_by_model", "gamma_2_2", "linear_fov"])
def test_a_mistake_is_named_by_all_stages_and_by_radiance_alone(program: Path, mistake: str, tmp_path: Path) -> None:
    for one in diagnosing.outcomes(switched(program, mistake), tmp_path, CASES):
        assert one.failing
        assert one.right, one


@pytest.mark.process
@pytest.mark.parametrize("mistake", ["", "ambient"])
def test_of_what_nobody_knows_nothing_is_named(program: Path, mistake: str, tmp_path: Path) -> None:
    for one in diagnosing.outcomes(switched(program, mistake), tmp_path, CASES):
        assert bool(one.failing) == bool(mistake)
        assert one.named == ()


DAMAGES = ("radiance_upside_down", "columns_first", "one_pixel_late", "tiles_undrawn")
DAMAGED_CASES = (*CASES, "primitives/sphere", "random_scenes/seed_1", "shadows/behind_the_light")


@pytest.mark.process
@pytest.mark.parametrize("damage", DAMAGES)
def test_an_image_that_is_stored_wrongly_is_told_so_and_no_formula_is_named(
    program: Path, damage: str, tmp_path: Path
) -> None:
    for written, evidence in diagnosing.evidence_of(switched(program, damage), tmp_path, DAMAGED_CASES).items():
        findings, searched = causes_of(evidence)
        named = {finding.name for finding in findings} | {cause.mistake.name for cause in searched.causes}

        assert named & switched(program, damage).accepted[0], (damage, written, named)
        if not (
            damage.startswith("radiance_") and written == diagnosing.ALONE
        ):  # one image with that of a wrong camera
            assert {item for name in named for item in MISTAKES[name].items} == {"IMG-1"}, (damage, written, named)


def test_a_name_for_a_program_that_has_no_hypothesis_is_a_wrong_name() -> None:
    def said(mistake: str, *, kind: str, named: tuple[str, ...], right: bool) -> diagnosing.Outcome:
        return diagnosing.Outcome(
            programs=kind, mistake=mistake, written=diagnosing.ALONE, failing=3, named=named, right=right,
            wrong=bool(named) and not right, seconds=1.0,
        )  # fmt: skip

    found = [
        said("fog", kind=diagnosing.KNOWN_NONE, named=("no_pi",), right=False),
        said("no_pi", kind=diagnosing.KNOWN_ONE, named=("no_pi/factor_of_radiance_physical",), right=True),
        said("srgb", kind=diagnosing.KNOWN_ONE, named=(), right=False),
    ]

    rows = {(row["programs"], row["written"]): row for row in diagnosing.table(found)}

    assert [one.mistake for one in found if one.wrong] == ["fog"]
    known = rows["a mistake that has a hypothesis", diagnosing.ALONE]
    assert (known["of"], known["right"], known["class_of_at_most_2"], known["does_not_know"]) == (2, 1, 1, 1)


@pytest.mark.process
def test_both_of_two_mistakes_are_named(program: Path, tmp_path: Path) -> None:
    first, second = switched(program, "no_pi"), switched(program, "normal_by_model")
    both = replace(
        first, mistakes=(first.name, second.name), accepted=first.accepted + second.accepted, kind=diagnosing.TWO
    )

    (stages, radiance) = diagnosing.outcomes(both, tmp_path, CASES)

    assert stages.right, stages
    assert radiance.failing
