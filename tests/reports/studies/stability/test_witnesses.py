"""Every ladder's truth has a witness in balls, and a witness that is contradicted raises a doubt."""

import numpy as np
import pytest
from flint import arb

from rayproof.cases.ladders import Ladder, all_ladders
from rayproof.reports.studies.stability.climb import drawn
from rayproof.reports.studies.stability.questions.values import dark, impossible
from rayproof.reports.studies.stability.survey import doubted

LADDERS = all_ladders()


@pytest.mark.parametrize("ladder", LADDERS, ids=lambda ladder: ladder.name)
def test_every_ladder_has_a_witness_that_agrees(ladder: Ladder) -> None:
    given = drawn(ladder, "float32", quick=True)

    assert given.truth.witness.values > 0
    assert doubted(given) == ""


def test_what_has_a_finite_answer_is_not_impossible() -> None:
    inputs = {"x": np.array([1.0, np.nan, 2.0])}

    def double(x: dict) -> dict:
        return {"y": x["x"] * arb(2)}

    assert impossible(double, inputs, np.isnan(inputs["x"])).worst == 0
    assert impossible(double, inputs, np.ones(3, dtype=bool)).worst == 1


def test_a_light_above_the_horizon_is_not_dark() -> None:
    inputs = {"flux": np.ones(2), "normal": np.eye(3)[:2], "away": np.array([[-1.0, 0, 0], [0, -1.0, 0]])}

    assert dark(inputs).worst == 0
    assert dark(inputs | {"away": np.array([[-1.0, 0, 0], [0, 1e-300, 0]])}).worst == 1
