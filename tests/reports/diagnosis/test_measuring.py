"""Of a C++ program that shares no code with the tracer mistakes are named, and none is named wrongly."""

from pathlib import Path

import numpy as np
import pytest

from rayproof.cases.families import select
from rayproof.cases.stages import Stage
from rayproof.reference.analytic import Analytic
from rayproof.reports.diagnosis import measuring
from rayproof.reports.diagnosis.mistakes.acne import scattered
from rayproof.reports.diagnosis.trial import Evidence

CASES = (
    "primitives/plane",
    "sidedness/square_lit_from_the_viewer",
    "simplified/shadows",
    "transforms/cube_sheared",
    "transforms/mesh_sheared",
    "transforms/sphere_stretched",
)

ORACLE = Analytic()
pytestmark = pytest.mark.skipif(measuring.compiler() is None, reason="there is no C++ compiler")


@pytest.fixture(scope="module")
def program(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return measuring.built(tmp_path_factory.mktemp("mistaken"))


@pytest.mark.parametrize("mistake", ["no_pi", "normal_by_model", "gamma_2_2"])
def test_a_mistake_is_named_by_all_stages_and_by_radiance_alone(program: Path, mistake: str, tmp_path: Path) -> None:
    for one in measuring.outcomes(program, mistake, known=True, folder=tmp_path, names=CASES):
        assert one.failing
        assert one.right, one


@pytest.mark.parametrize("mistake", ["", "ambient"])
def test_of_what_nobody_knows_nothing_is_named(program: Path, mistake: str, tmp_path: Path) -> None:
    for one in measuring.outcomes(program, mistake, known=False, folder=tmp_path, names=CASES):
        assert bool(one.failing) == bool(mistake)
        assert one.named == ()


def test_a_name_for_a_program_that_has_no_hypothesis_is_a_wrong_name() -> None:
    said = {"written": measuring.ALONE, "failing": 3, "seconds": 1.0}
    found = [
        measuring.Outcome(mistake="fog", known=False, named=("no_pi",), right=False, **said),
        measuring.Outcome(
            mistake="no_pi", known=True, named=("no_pi", "factor_of_radiance_physical"), right=True, **said
        ),
        measuring.Outcome(mistake="srgb", known=True, named=(), right=False, **said),
    ]

    rows = {(row["programs"], row["written"]): row for row in measuring.table(found)}

    assert [one.mistake for one in found if one.wrong] == ["fog"]
    known = rows["a mistake that has a hypothesis", measuring.ALONE]
    assert (known["of"], known["right"], known["class_of_at_most_2"], known["does_not_know"]) == (2, 1, 1, 1)


def shown(one: Evidence, dark: np.ndarray) -> Evidence:
    """Return what a renderer shows whose radiance is right but where it is dark."""
    light = np.where(dark[..., np.newaxis], 0.0, one.right.answers[Stage.RADIANCE])
    found = Evidence(
        case=one.case, scene=one.scene, load=lambda: {Stage.RADIANCE: light}, failed=True, oracle=ORACLE, undecided=None
    )
    vars(found)["right"] = one.right
    return found


def test_acne_is_scattered_dark_points_and_a_shadow_that_is_missing_light_elsewhere_is_none() -> None:
    case = select(["primitives/sphere"])[0]
    plain = Evidence(case=case.name, scene=case.scene, load=dict, failed=True, oracle=ORACLE, undecided=None)
    size = plain.right.edge.shape
    _, columns = np.indices(size)
    points = np.random.default_rng(1).random(size) < 0.4
    region = columns < size[1] / 2

    assert scattered(shown(plain, points)) is True
    assert scattered(shown(plain, region)) is None
    assert scattered(shown(plain, np.zeros(size, dtype=bool))) is None
    dimmed = shown(plain, np.zeros(size, dtype=bool))
    vars(dimmed)["ours"] = {Stage.RADIANCE: 0.5 * plain.right.answers[Stage.RADIANCE]}
    assert scattered(dimmed) is False
