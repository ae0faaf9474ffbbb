"""A similarity is one however its numbers were rounded, and nothing else is."""

import pytest

from rayproof.cases.placement import compose, rotation, scaling, shear, translation
from rayproof.cases.similarity import is_similarity

TURNED = compose(translation(1e3, -2, 5), rotation((0.3, -0.5, 0.8), 71))


@pytest.mark.parametrize("factor", [1e-6, 1.0, 3e7])
def test_turning_moving_mirroring_and_scaling_evenly_keep_spheres(factor: float) -> None:
    assert is_similarity(compose(TURNED, scaling(factor, factor, factor)))
    assert is_similarity(compose(TURNED, scaling(factor, -factor, factor)))


@pytest.mark.parametrize(
    "matrix",
    [scaling(1, 1, 1 + 1e-12), scaling(1e-7, 1e-7, 2e-7), shear(xy=1e-12, xz=0, yz=0), shear(xy=0, xz=0, yz=2)],
)
def test_stretching_and_shearing_do_not(matrix) -> None:
    assert not is_similarity(compose(TURNED, matrix))
