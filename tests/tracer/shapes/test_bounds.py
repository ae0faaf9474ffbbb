"""At the ends of a precision's range: a right answer, an infinity that is counted, or a refusal; never a silent NaN."""

import dataclasses
import math

import numpy as np
import pytest

from rayproof.cases.scene import Camera, Cube, PointLight, Scene, Sphere
from rayproof.cases.stages import IMAGE_STAGES, Stage
from rayproof.tracer.configuration import Configuration
from rayproof.tracer.render import render
from rayproof.tracer.shapes.bounds import LARGEST
from tests.tracer.scenes import camera, scene


def sized(size: float) -> Scene:
    """Return a ball and a cube of about `size` [m], seen and lit from as far."""
    view = Camera(
        eye=(3 * size, -4 * size, 2.5 * size),
        target=(0.1 * size, 0.2 * size, 0.3 * size),
        up=(0.1, 0.05, 1.0),
        fovy=40.0,
        width=12,
        height=9,
        near=0.1 * size,
        far=50 * size,
    )
    place = ((size, 0, 0, size), (0, size, 0, 0), (0, 0, size, 0), (0, 0, 0, 1))
    ball = Sphere(albedo=(0.7, 0.5, 0.0), center=(0.2 * size, 0.1 * size, 0.4 * size), radius=0.9 * size)
    light = PointLight(position=(2 * size, -2 * size, 4 * size), flux=(1.0, 2.0, 3.0))
    return Scene(camera=view, shapes=(ball, Cube(albedo=(0.5, 0.5, 0.5), to_world=place)), lights=(light,))


@pytest.mark.parametrize("exponent", [-0.5, 0.5], ids=["small", "large"])
def test_up_to_half_the_orders_of_magnitude_every_stage_scales(exponent: float, precision: str) -> None:
    size = 2.0 ** round(exponent * math.log2(LARGEST[precision]))
    configuration = Configuration(precision=precision)

    usual = render(sized(1.0), IMAGE_STAGES, configuration)
    scaled = render(sized(size), IMAGE_STAGES, configuration)

    for stage, power in ((Stage.RAY, 0), (Stage.DISTANCE, 1), (Stage.NORMAL, 0), (Stage.IRRADIANCE, -2)):
        np.testing.assert_allclose(scaled[stage], usual[stage] * size**power, rtol=1e-3, atol=1e-3 * size**power)
    assert np.array_equal(scaled[Stage.OBJECT], usual[Stage.OBJECT])


@pytest.mark.parametrize("exponent", [-90, 90], ids=["small", "large"])
def test_a_tree_is_walked_without_culling_where_its_grid_would_leave_float32(exponent: int) -> None:
    """Boxes are compared in float32 steps of a grid, whatever the precision; float64 scenes may be larger than that."""
    centers = [(0.6 * x, 0.6 * y, 0.1 * x * y) for x in (-1, 0, 1) for y in (-1, 0, 1)]

    def seen(size: float) -> np.ndarray:
        balls = [
            Sphere(albedo=(0.5, 0.5, 0.5), center=(size * x, size * y, size * z), radius=0.2 * size)
            for x, y, z in centers
        ]
        near = camera(eye=(0.5 * size, 1.0 * size, 4.0 * size), target=(0.0, 0.0, 0.0))
        looking = dataclasses.replace(near, near=near.near * size, far=near.far * size)
        return render(scene(*balls, camera=looking), (Stage.OBJECT,), Configuration(precision="float64"))[Stage.OBJECT]

    usual = seen(1.0)

    assert len(np.unique(usual)) > 5
    np.testing.assert_array_equal(seen(2.0**exponent), usual)


@pytest.mark.parametrize("length", [1e-150, 1e-40, 1e-22, 1e22, 1e37])
def test_the_up_vector_may_have_any_length(length: float, precision: str) -> None:
    usual = render(scene(), (Stage.RAY,), Configuration(precision=precision))[Stage.RAY]

    x, y, z = camera().up
    turned = scene(camera=camera(up=(x * length, y * length, z * length)))
    if precision == "float32" and length < 1e-38:
        # It flushes it to zero, and no ray would have a direction.
        with pytest.raises(ValueError, match="float32 cannot tell it from zero"):
            render(turned, (Stage.RAY,), Configuration(precision=precision))
        return
    found = render(turned, (Stage.RAY,), Configuration(precision=precision))[Stage.RAY]

    np.testing.assert_allclose(found, usual, atol=1e-6)


# Found by a search over random scenes: without a direction of view every ray was NaN, and the tracer was accused.
@pytest.mark.parametrize(
    ("target", "complaint"),
    [
        ((2000.00005, 1e-4, 0.0), "up is .*: float32 cannot tell it from the direction of view"),
        ((2000.00001, 0.0, 0.0), "float32 cannot tell the target .* m from the eye"),
    ],
)
def test_a_view_that_float32_cannot_tell_is_refused(target: tuple[float, float, float], complaint: str) -> None:
    view = Camera(eye=(2000, 0, 0), target=target, up=(0, 1, 0), fovy=30, width=2, height=2, near=0.1, far=9)

    with pytest.raises(ValueError, match=complaint):
        render(scene(camera=view), (Stage.RAY,), Configuration(precision="float32"))
    assert np.isfinite(render(scene(camera=view), (Stage.RAY,), Configuration(precision="float64"))[Stage.RAY]).all()


def test_black_stays_black_where_the_irradiance_overflows() -> None:
    """A light 1e-19 m above the cube sends more than float32 can say; its black channel is 0 and not 0 times inf."""
    flux = 3e38
    cube = Cube(albedo=(0.5, 0.0, 0.5))
    light = PointLight(position=(0.0, 0.0, 0.6), flux=(flux, flux, flux))
    bright = Scene(camera=camera(target=(0, 0, 0.5)), shapes=(cube,), lights=(light,))

    found = render(bright, (Stage.IRRADIANCE, Stage.EXITANCE), Configuration())

    assert np.isinf(found[Stage.IRRADIANCE]).any()
    assert np.isinf(found[Stage.EXITANCE][..., 0]).any()
    assert not found[Stage.EXITANCE][..., 1].any()
