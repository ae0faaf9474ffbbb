"""A formula that is wrong on a minority of pixels is told worse, however right it is on most, and luck is not."""

import numpy as np
import pytest

from rayproof.cases.families import select
from rayproof.cases.stages import Stage
from rayproof.reports.studies.compare.contenders import contender
from rayproof.reports.studies.compare.findings import accuracy, finding
from rayproof.reports.studies.compare.paired_errors import PairedStage, paired
from rayproof.reports.studies.compare.statistics import TILE, Tail, leaning, lost

ROWS, COLUMNS = 9, 12  # tiles of the images below


def image(value: float = 1.0) -> np.ndarray:
    return np.full((ROWS * TILE, COLUMNS * TILE), value)


def compared(base: str, candidate: str, case: str, stage: Stage) -> PairedStage:
    first, second = (contender(name, precision="float32") for name in (base, candidate))
    scene = select([case])[0].scene
    (found,) = paired(scene, (stage,), first, [second], slots=(base.split("/")[0],), seed=1)
    return found[stage]


@pytest.mark.parametrize(
    ("base", "candidate", "case", "stage"),
    [
        ("world_normal/inverse_transpose", "world_normal/model_matrix", "random_scenes/seed_1", Stage.NORMAL),
        ("facing/viewer", "facing/fault_away", "random_scenes/seed_1", Stage.NORMAL),
    ],
    ids=["model-matrix", "facing-away"],
)
def test_what_is_wrong_on_a_minority_of_pixels_is_worse(base: str, candidate: str, case: str, stage: Stage) -> None:
    there, back = (compared(*names, case, stage) for names in ((base, candidate), (candidate, base)))

    signs, reversed_signs = (
        accuracy(finding("random", False, [{stage: pair}], level=0.95, seed=1), alpha=0.05) for pair in (there, back)
    )

    assert signs.tail == -1
    assert signs.all == {-1}
    assert reversed_signs.all == {1}


def test_a_pixel_is_lost_by_more_than_the_factor_that_roundoff_excuses() -> None:
    base = np.array([[0.1, 0.1, 1.0, 9.0, 1e3, np.nan]])
    candidate = np.array([[4.0, 4.1, 4.1, 30.0, 4.1e3, 1e9]])

    assert lost(candidate, base).tolist() == [[False, True, True, False, True, False]]


def test_a_patch_is_one_witness_however_many_pixels_it_has() -> None:
    worse = image()
    worse[:TILE, :TILE] = 1e6

    tail = Tail.of([leaning(image(), worse)])

    assert (tail.worse, tail.tiles_worse) == (TILE * TILE, 1)
    assert tail.p == 1.0


def test_scenes_are_not_mixed_in_a_tile() -> None:
    worse = image()
    worse[0, 0] = 1e6

    tail = Tail.of([leaning(image(), worse), leaning(worse, image())])

    assert (tail.tiles_worse, tail.tiles_better, tail.scenes) == (1, 1, 2)
    assert tail.p == 1.0


def test_tails_that_differ_by_luck_alone_are_told_apart_no_oftener_than_the_level_says() -> None:
    """Errors of both from one distribution with a long tail, the same over patches of pixels."""
    generator = np.random.default_rng(7)
    patches = (2, 300, ROWS * 2, COLUMNS * 2)
    errors = np.repeat(np.repeat(generator.standard_cauchy(patches), TILE // 2, axis=2), TILE // 2, axis=3)

    values = [Tail.of([leaning(*np.abs(pair))]).p for pair in errors.swapaxes(0, 1)]

    # 300 draws at 5 %: more than 7.8 % has probability 0.02. The exact test is on the safe side of 5 %.
    assert np.mean(np.array(values) < 0.05) <= 0.078
