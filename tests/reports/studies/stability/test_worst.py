"""The search for the worst inputs: it finds what breaks a formula, and nothing beyond the limits of a good one."""

import csv
import itertools
from pathlib import Path

import numpy as np
import pytest

from rayproof.reports.studies.stability import worst
from rayproof.reports.studies.stability.worst import Worst, breeds_of, clearance, common, decoded, search
from rayproof.tracer.formulas import FORMULAS
from tests.reports.commands.conftest import Rayproof

GENERATIONS = 25


@pytest.fixture(autouse=True)
def clock(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let a generation take a second, so that a search depends on no machine's load."""
    ticks = itertools.count()
    monkeypatch.setattr(worst.time, "monotonic", lambda: float(next(ticks)))


def found(name: str, precision: str = "float32", generations: float = GENERATIONS) -> Worst:
    """Return the worst inputs of a formula, over all ladders that they are bred from."""
    breeds = breeds_of(FORMULAS[name], precision, 1)
    each = [search(breed, seconds=generations, seed=1, tell=lambda line: None) for breed in breeds]
    return max(each, key=lambda one: one.scores.max(initial=0.0))


@pytest.mark.parametrize("slot", ["sphere", "triangle", "cube", "square", "plane"])
def test_a_default_formula_keeps_its_limits(slot: str) -> None:
    best = found(f"{slot}/{FORMULAS.slots[slot]}")

    assert best.tried > 10_000
    assert 0 < best.scores[0] <= 1


@pytest.mark.parametrize("precision", ["float32", "float64"])
@pytest.mark.parametrize(
    "slot",
    [
        "ray",  # a view of nearly 180 degrees, where a rounding of fovy turns rays by much
        "basis", "half_extent", "clip_depth", "position", "sphere_normal", "cosine", "falloff", "exitance", "radiance",
        "sum_lights", "horizon", "hidden", "facing",
    ],
)  # fmt: skip
def test_a_default_formula_of_another_slot_keeps_its_limits(slot: str, precision: str) -> None:
    best = found(f"{slot}/{FORMULAS.slots[slot]}", precision, 8)

    assert best.tried > 2000
    assert best.scores[0] <= 1
    assert "nan" not in " ".join(common(best))


@pytest.mark.parametrize(
    "name",
    [
        "sphere/textbook",  # far spheres
        "triangle/moeller_trumbore",  # slivers
        "triangle/fault_loose_unsigned",
        "sphere/fault_far_root",
        "cube/fault_negative_zero",
        "ray/fault_depends_on_t",
        "world_normal/fault_model_matrix",
        "falloff/fault_inverse",
        "facing/fault_away",
        "clip_shell/fault_planes",
    ],
)
def test_what_breaks_a_formula_is_found(name: str) -> None:
    assert found(name, generations=3).scores[0] > 10


def test_rays_in_a_face_are_found_where_zero_times_infinity_misses_them() -> None:
    ties = found("cube/ieee_slabs").ties

    assert len(ties["o"])
    in_face = np.any((abs(ties["o"]) == 0.5) & (ties["d"] == 0), axis=1)
    assert np.any(in_face)
    assert not len(found("cube/slabs").ties.get("o", ()))


def test_a_search_is_the_same_for_the_same_seed_and_its_numbers_are_float32() -> None:
    one, other = found("sphere/haines"), found("sphere/haines")

    assert np.array_equal(one.scores, other.scores)
    genomes = np.random.default_rng(2).random((worst.GENES, 500))
    for slot in ("sphere", "triangle", "cube"):
        for array in decoded(slot, genomes, "float32").values():
            assert np.array_equal(array, array.astype(np.float32))


def test_clearance_counts_roundings_from_the_outline() -> None:
    o, d = np.array([[2.0**-20 + 1.0, 0.0, -4.0]]), np.array([[0.0, 0.0, 1.0]])
    beside = {"o": o, "d": d, "c": np.zeros((1, 3)), "r": np.ones(1)}

    (clear,) = clearance("sphere", beside, "float32")

    # 16 roundings of 1 m beside the outline; lengths up to 4 m are rounded, in several products.
    assert 16 / 30 < clear < 16
    assert clearance("sphere", beside | {"o": np.array([[1.0, 0.0, -4.0]])}, "float32")[0] == 0


def test_the_command_keeps_vectors_and_ends_with_1_where_a_limit_is_broken(rayproof: Rayproof, tmp_path: Path) -> None:
    kept = tmp_path / "worst.csv"

    ended = rayproof("worst", "sphere/textbook", "--seconds", 8, "--seed", 2, "--keep", kept)
    good = rayproof("worst", "sphere/haines", "--seconds", 8)

    assert (ended.code, good.code) == (1, 0)
    rows = list(csv.DictReader(kept.read_text().splitlines()))
    assert len(rows) == 100
    assert {row["question"] for row in rows} == {"distance"}
    assert "limits." in rows[0]["why"]
    for wrong in (
        (),
        ("sphere/haines", "--seconds", 0),
        ("nearest/smaller",),
        ("sphere/haines", "--precision", "float64", "--seconds", 1, "--keep", kept),
    ):
        assert rayproof("worst", *wrong).code == 2
