"""The liar: found out wherever the judge looks, and only there."""

import numpy as np
import pytest

from rayproof.cases.families import select
from rayproof.cases.stages import Stage
from rayproof.reports.judge import against_oracle
from rayproof.reports.judge.limit_sentinels import CASE
from tests.harness.audit import liar
from tests.harness.audit.orders import LiarOrder


def test_before_an_honest_judge_nothing_hides_away_from_edges() -> None:
    report = liar.lie(LiarOrder(case=CASE, epsilon=0.0))

    camera = CASE.scene.camera
    assert report.pixels == 9 * camera.width * camera.height
    assert report.unseen == 0
    assert report.holes == ()


def test_a_judge_that_looks_at_half_of_an_image_lets_the_liar_spoil_the_other(monkeypatch: pytest.MonkeyPatch) -> None:
    right = against_oracle.ratios

    def blind(stage: Stage, ours: np.ndarray, theirs: np.ndarray, limit: np.ndarray):
        ratio, wrong = right(stage, ours, theirs, limit)
        return np.where(np.arange(ratio.shape[1]) < ratio.shape[1] // 2, ratio, 0.0), wrong

    monkeypatch.setattr(against_oracle, "ratios", blind)

    report = liar.lie(LiarOrder(case=CASE, epsilon=0.0))

    assert report.unseen > 100
    assert any("distance" in hole for hole in report.holes)


@pytest.mark.parametrize("name", [
    "random/31104/19",  # an outline that rounding moves by more than a pixel
    "random/31105/19",  # the eye on a sphere: distances of any size around a pixel
    "random/42011/99",  # the eye in a flat ellipsoid, whose normals around a pixel are opposite
    "random/42011/179",  # the same, and a normal that is longer than 1
    "random/72003/299",  # a light in the plane of what it lights, above it or below by rounding
])  # fmt: skip
def test_where_much_is_seen_around_a_pixel_the_liar_hides_nothing_beyond_it(name: str) -> None:
    (case,) = select([name])

    assert liar.lie(LiarOrder(case=case, epsilon=0.0)).holes == ()
