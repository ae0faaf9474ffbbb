"""What a timed launch is given: the ladder's own rays, in as few runs of one matrix as the ladder has."""

import numpy as np

from rayproof.reports.studies.stability.questions.placed import blocks
from rayproof.reports.studies.tradeoff.formulas import LADDER_RAYS as RAYS
from rayproof.reports.studies.tradeoff.formulas import enough, ladders, value_of


def test_every_ray_is_timed_equally_often() -> None:
    many = enough({"number": np.arange(1000)}, 1000)

    found, counts = np.unique(many["number"], return_counts=True)

    assert (len(found), counts.sum()) == (1000, RAYS)
    assert counts.max() - counts.min() <= 1


def test_repeats_do_not_multiply_the_runs_of_a_matrix() -> None:
    (ladder,) = ladders(["XF-SING"])
    inputs = ladder.draw(value_of(ladder), ladder.rays, np.random.default_rng(ladder.seed), "float32")

    assert len(blocks(enough(inputs, ladder.rays))) == len(blocks(inputs)) <= 4
