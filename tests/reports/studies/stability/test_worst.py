"""The search for the worst inputs: it finds what breaks a formula, and nothing beyond the limits of a good one."""

import itertools

import numpy as np
import pytest

from rayproof.reports.studies.stability import worst
from rayproof.reports.studies.stability.worst import Worst, breeds_of, common, decoded, search
from rayproof.tracer.formulas import FORMULAS

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
