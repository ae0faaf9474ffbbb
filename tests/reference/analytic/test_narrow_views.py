"""Where a pixel is a millionth of a radian, edges far away are known to be: rounding moves them by many pixels."""

import numpy as np

from rayproof.cases.families import select
from rayproof.reference.analytic import Analytic


def test_in_a_narrow_view_edges_are_told_from_pixels_far_away() -> None:
    # Inside a sphere, 24 pixels in a thousandth of a degree: no edge is within hundreds of pixels.
    (case,) = select(["random/2/20"])

    edges = Analytic().edges(case.scene)

    assert np.min(edges.silhouette) > 100
    assert np.min(edges.terminator) > 100


def test_a_shadow_a_thousand_pixels_away_is_known_to_be() -> None:
    # Rounding in float32 moves shadows by 740 of these pixels, which are a millionth of a radian.
    (case,) = select(["random/1/158"])

    assert np.min(Analytic().edges(case.scene).shadow[..., 0]) > 1000
