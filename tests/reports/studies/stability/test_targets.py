"""The quick survey brings no surprise, and the design's headline figures are met by it."""

import pytest

from rayproof.reports.studies.stability.records import ClimbRecord
from rayproof.reports.studies.stability.survey import plan, survey

Records = dict[tuple[str, str, str], ClimbRecord]


@pytest.fixture(scope="module")
def doubts() -> list[str]:
    return []


@pytest.fixture(scope="module")
def records(doubts: list[str]) -> Records:
    """Return every climb of `rayproof stability --quick`."""
    planned = plan((), ladders=(), precisions=("float32", "float64"), quick=True)
    found = survey(planned, doubts=doubts.append)
    return {(one.ladder, one.formula, one.precision): one for one in found}


def test_nothing_is_surprising(records: Records, doubts: list[str]) -> None:
    assert [(key, one.surprise) for key, one in records.items() if one.surprise] == []
    assert doubts == []


def test_every_ladder_is_climbed_in_both_precisions(records: Records) -> None:
    assert len({ladder for ladder, _, _ in records}) >= 50
    assert {precision for _, _, precision in records} == {"float32", "float64"}


@pytest.mark.parametrize(("formula", "slope"), [("sphere/textbook", 1.97), ("sphere/haines", 0.98)])
def test_the_far_sphere_follows_its_law(records: Records, formula: str, slope: float, precision: str) -> None:
    assert records["SPH-FAR", formula, precision].slope == pytest.approx(slope, abs=0.1)


@pytest.mark.parametrize("formula", ["triangle/woop", "triangle/woop_kahan", "triangle/woop_float64_fallback"])
@pytest.mark.parametrize("ladder", ["TRI-EDGE", "TRI-EDGE-SCALE", "TRI-VERT", "TRI-VERT-SCALE"])
def test_woop_leaks_nothing(records: Records, ladder: str, formula: str, precision: str) -> None:
    assert records[ladder, formula, precision]["per_million"]["leaks"] == 0


def test_moeller_trumbore_leaks_at_edges(records: Records, precision: str) -> None:
    assert records["TRI-EDGE", "triangle/moeller_trumbore", precision]["per_million"]["leaks"] > 50_000


@pytest.mark.parametrize("ladder", ["SHD-GROW", "SHD-SHRINK"])
@pytest.mark.parametrize("formula", ["shadow_ray/error_bound", "shadow_ray/normal_offset"])
def test_a_bound_on_the_error_keeps_shadows_clean(records: Records, ladder: str, formula: str, precision: str) -> None:
    assert records[ladder, formula, precision]["per_million"] == {"acne": 0, "leak": 0}


def test_the_multiplied_matrix_dies_between_ten_and_a_hundred_million(records: Records) -> None:
    found = records["CAM-RATIO", "ray/matrix_w_divide", "float32"]

    assert found["breakpoint"] == 1e7
    assert [rung["invalid"] == rung["rays"] for rung in found["values"]] == [False] * 7 + [True] * 3


def test_only_float64_survives_the_near_sphere_on_float32_numbers(records: Records) -> None:
    assert records["SPH-NEAR", "sphere/float64", "float32"].slope == pytest.approx(0, abs=0.15)
    assert records["SPH-NEAR", "sphere/stable_quadratic", "float32"].slope == pytest.approx(-1, abs=0.15)
