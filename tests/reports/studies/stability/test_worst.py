"""The search for the worst rays: it finds what breaks a formula, and nothing beyond the limits of a good one."""

import csv
import itertools
from pathlib import Path

import numpy as np
import pytest

from rayproof.reports.studies.stability import worst
from rayproof.reports.studies.stability.worst import Worst, clearance, decoded, search
from rayproof.tracer.formulas import FORMULAS
from tests.reports.commands.conftest import Rayproof

GENERATIONS = 25


@pytest.fixture(autouse=True)
def clock(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let a generation take a second, so that a search depends on no machine's load."""
    ticks = itertools.count()
    monkeypatch.setattr(worst.time, "monotonic", lambda: float(next(ticks)))


def found(name: str) -> Worst:
    return search(FORMULAS[name], seconds=GENERATIONS, seed=1, tell=lambda line: None)


@pytest.mark.parametrize("slot", ["sphere", "triangle", "cube", "square", "plane"])
def test_a_default_formula_keeps_its_limits(slot: str) -> None:
    best = found(f"{slot}/{FORMULAS.slots[slot]}")

    assert best.tried > 10_000
    assert 0 < best.scores[0] <= 1


@pytest.mark.parametrize(
    "name",
    [
        "sphere/textbook",  # far spheres
        "triangle/moeller_trumbore",  # slivers
        "triangle/fault_loose_unsigned",
        "sphere/fault_far_root",
        "cube/fault_negative_zero",
    ],
)
def test_what_breaks_a_formula_is_found(name: str) -> None:
    assert found(name).scores[0] > 10


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
        for array in decoded(slot, genomes).values():
            assert np.array_equal(array, array.astype(np.float32))


def test_clearance_counts_roundings_from_the_outline() -> None:
    o, d = np.array([[2.0**-20 + 1.0, 0.0, -4.0]]), np.array([[0.0, 0.0, 1.0]])
    beside = {"o": o, "d": d, "c": np.zeros((1, 3)), "r": np.ones(1)}

    (clear,) = clearance("sphere", beside)

    # 16 roundings of 1 m beside the outline; lengths up to 4 m are rounded, in several products.
    assert 16 / 30 < clear < 16
    assert clearance("sphere", beside | {"o": np.array([[1.0, 0.0, -4.0]])})[0] == 0


def test_the_command_keeps_vectors_and_ends_with_1_where_a_limit_is_broken(rayproof: Rayproof, tmp_path: Path) -> None:
    kept = tmp_path / "worst.csv"

    ended = rayproof("stability", "sphere/textbook", "--worst", "--seconds", 8, "--seed", 2, "--keep", kept)
    good = rayproof("stability", "sphere/haines", "--worst", "--seconds", 8)

    assert (ended.code, good.code) == (1, 0)
    rows = list(csv.DictReader(kept.read_text().splitlines()))
    assert len(rows) == 100
    assert {row["question"] for row in rows} == {"distance"}
    assert "limits." in rows[0]["why"]
    for wrong in (
        ("--seed", 1),
        ("--worst",),
        ("sphere/haines", "--worst", "--seconds", 0),
        ("falloff/scaled", "--worst"),
    ):
        assert rayproof("stability", *wrong).code == 2
