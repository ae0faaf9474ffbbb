"""Normals: unit, outward, perpendicular to the surface, under every transform."""

import dataclasses
from fractions import Fraction

import numpy as np
import pytest

from rayproof.cases.rounding import UNIT_ROUNDOFF
from rayproof.cases.scene import Shape
from rayproof.cases.stages import Stage
from rayproof.tracer.configuration import Configuration
from rayproof.tracer.kernel.arithmetic import inverse_root
from rayproof.tracer.kernel.arrays import array_types
from rayproof.tracer.render import render
from tests.tracer.scenes import SHAPES, affine, scene

STAGES = (Stage.RAY, Stage.OBJECT, Stage.POSITION, Stage.NORMAL)


def outward(shape: Shape, point: np.ndarray) -> np.ndarray:
    """Return the object-space gradient at world points: outward, of any length."""
    matrix = np.asarray(shape.to_world)
    local = (point - matrix[:3, 3]) @ np.linalg.inv(matrix[:3, :3]).T
    match type(shape).__name__:
        case "Sphere":
            return local - np.asarray(shape.center)  # type: ignore[attr-defined]
        case "Cube":
            axis = np.abs(local).argmax(axis=-1)[..., np.newaxis]
            return np.where(np.arange(3) == axis, np.sign(local), 0.0)
        case "Mesh":
            return np.sign(local)  # an octahedron
        case "Triangle":
            a, b, c = np.asarray(shape.vertices)  # type: ignore[attr-defined]
            return np.broadcast_to(np.cross(b - a, c - a), local.shape)
        case _:
            return np.broadcast_to((0.0, 0.0, 1.0), local.shape)


@pytest.mark.parametrize("name", sorted(SHAPES))
@pytest.mark.parametrize("mirror", [False, True], ids=["proper", "mirrored"])
@pytest.mark.parametrize("two_sided", [False, True], ids=["one-sided", "two-sided"])
def test_normals_are_the_inverse_transpose_of_the_outward_ones(
    name: str, mirror: bool, two_sided: bool, precision: str
) -> None:
    shape = dataclasses.replace(SHAPES[name], two_sided=two_sided, to_world=affine(31, (0.1, 0.1, 0.9), mirror=mirror))
    answers = render(scene(shape), STAGES, Configuration(precision=precision))
    hit = answers[Stage.OBJECT][..., 0] == 0
    normal, ray = answers[Stage.NORMAL][hit], answers[Stage.RAY][hit]

    inverse = np.linalg.inv(np.asarray(shape.to_world)[:3, :3])
    expected = outward(shape, answers[Stage.POSITION][hit]) @ inverse
    expected /= np.linalg.norm(expected, axis=-1, keepdims=True)
    if two_sided:
        expected *= -np.sign(np.sum(expected * ray, axis=-1, keepdims=True))

    assert hit.sum() > 10
    # Positions are known to a few roundings of 8 m on shapes of 0.5 m with a condition number below 3.
    np.testing.assert_allclose(normal, expected, atol=512 * UNIT_ROUNDOFF[precision])
    assert not answers[Stage.NORMAL][~hit].any()


@pytest.mark.parametrize("precision", ["float32", "float64"])
def test_inverse_roots_are_off_by_one_and_a_half_roundings_at_most_and_keep_their_ends(precision: str) -> None:
    Float, kind = array_types(precision).Float, np.dtype(precision)
    generator, largest = np.random.default_rng(8), 0.98 * np.finfo(kind).maxexp
    x = np.concatenate([generator.uniform(1, 4, 3000), 2.0 ** generator.uniform(-largest, largest, 1000)]).astype(kind)

    found = np.array(inverse_root(Float(x)))

    # (1 + e)^2 x / x - 1 is 2 e, but for e^2.
    off = [
        abs(float(Fraction(float(y)) ** 2 * Fraction(float(each)) - 1)) / 2 for y, each in zip(found, x, strict=True)
    ]
    assert max(off) < 1.5001 * UNIT_ROUNDOFF[precision]
    assert np.array(inverse_root(Float([0.0, np.inf]))).tolist() == [np.inf, 0.0]
    assert np.isnan(inverse_root(Float([np.nan, 1.0]))[0])
