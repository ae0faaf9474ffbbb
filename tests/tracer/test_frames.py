"""Frames of several samples a pixel: what the finer image averages to, in one kernel."""

import dataclasses

import drjit as dr
import numpy as np
import pytest

from rayproof.cases.benchmark_scenes import rods
from rayproof.cases.rounding import gamma
from rayproof.cases.scene import PointLight, Scene, Sphere
from rayproof.cases.stages import Stage
from rayproof.tracer import render as rendering
from rayproof.tracer.configuration import Configuration
from rayproof.tracer.frames import Frames
from rayproof.tracer.kernel.parameters import Literals
from rayproof.tracer.light_path import illumination
from rayproof.tracer.plan import Plan, plan
from rayproof.tracer.render import render
from tests.tracer.scenes import ALBEDO, FLOOR, LIGHT, camera, everything, octahedron, scene

SPHERE = Sphere(albedo=ALBEDO, center=(0.1, 0.2, 1.0))
LIGHTS = tuple(PointLight(position=(2.0, -3.0, 4.0 + k), flux=(30.0, 20.0 + k, 10.0)) for k in range(8))


@pytest.fixture(autouse=True)
def _literal(monkeypatch: pytest.MonkeyPatch) -> None:
    """Render with the scene's numbers in the code, as frames have them: they fold by roundings of their own."""
    monkeypatch.setattr(rendering, "NumbersInMemory", Literals)


def averaged(what: Scene, configuration: Configuration, samples: int, chosen: Plan) -> np.ndarray:
    """Return the mean over the samples of each pixel of the finer image."""
    return render(what, (Stage.RADIANCE,), configuration, samples=samples, chosen=chosen)[Stage.RADIANCE]


@pytest.mark.parametrize("samples", [2, 3])
@pytest.mark.parametrize(
    ("what", "tile"),
    [
        (scene(SPHERE, FLOOR), {"columns": 8}),
        (scene(SPHERE, FLOOR, lights=LIGHTS), {}),
        (everything(), {"columns": 2, "rows": 2}),
        (scene(SPHERE, lights=()), {}),
    ],
    ids=["unrolled", "many-lights", "trees", "dark"],
)
def test_samples_are_averaged_in_one_kernel(what: Scene, tile: dict[str, int], samples: int, precision: str) -> None:
    configuration = Configuration(precision=precision)
    chosen = dataclasses.replace(plan(what, configuration), split=False, columns=1, rows=1)
    frames = Frames(what, configuration, samples=samples, chosen=dataclasses.replace(chosen, **tile))

    dr.set_flag(dr.JitFlag.KernelHistory, True)
    dr.kernel_history_clear()
    try:
        pixels = frames.pixels()
        launched = dr.kernel_history([dr.KernelType.JIT])
    finally:
        dr.set_flag(dr.JitFlag.KernelHistory, False)

    expected = averaged(what, configuration, samples, chosen)
    assert len(launched) == 1
    assert pixels.dtype == np.dtype(precision)
    # Each sample is what it is there; the sum of positive numbers rounds once a sample, the quotient once.
    limit = gamma(samples**2 + 1, precision=precision)
    different = np.abs(pixels - expected) > limit * expected
    # Narrow tiles turn triangles as their middle ray does, which moves what is seen along an edge.
    assert different.mean() <= (0.002 if "rows" in tile else 0)
    np.testing.assert_array_equal(frames.pixels(), pixels)


def test_the_only_pixel_may_show_something_in_its_last_sample_alone() -> None:
    # Of one pixel Dr.Jit computes the first sample while it traces, and finds that nothing needs light there.
    aside = Sphere(albedo=ALBEDO, center=(1.0, -1.0, 0.0), radius=0.9)
    above = camera(width=1, height=1, eye=(0.0, 0.0, 10.0), target=(0.0, 0.0, 0.0), up=(0.0, 1.0, 0.0))
    what = scene(aside, lights=LIGHTS, camera=above)

    pixels = Frames(what, Configuration(), samples=2).pixels()

    expected = averaged(what, Configuration(), 2, plan(what, Configuration()))
    assert (pixels > 0).all()
    np.testing.assert_allclose(pixels, expected, rtol=1e-6)


def test_samples_of_a_mesh_stay_in_one_kernel_though_hits_would_go_through_memory() -> None:
    what = scene(octahedron(), FLOOR, lights=(LIGHT,), camera=camera(width=16, height=12))
    for configuration in (Configuration(), Configuration(formulas={"segment": "endless"})):
        assert plan(what, configuration, samples=2).split

        frames = Frames(what, configuration, samples=2)

        assert not frames.plan.split
        expected = averaged(what, configuration, 2, plan(what, configuration, samples=2))
        np.testing.assert_allclose(frames.pixels(), expected, rtol=1e-5, atol=1e-7)


def test_shadow_rays_through_trees_alone_are_one_loop_over_lights_with_the_same_pixels(
    precision: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    what, configuration = scene(rods(400), lights=LIGHTS[:3]), Configuration(precision=precision)

    def frame() -> tuple[np.ndarray, int]:
        dr.kernel_history_clear()
        with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
            pixels = Frames(what, configuration).pixels()
        return pixels, sum(kernel["operation_count"] for kernel in dr.kernel_history([dr.KernelType.JIT]))

    by_loop, short = frame()
    monkeypatch.setattr(illumination, "_alike", lambda world: False)
    unrolled, long = frame()

    np.testing.assert_array_equal(by_loop, unrolled)
    assert short < 0.8 * long


@pytest.mark.parametrize("lights", [LIGHTS[:2], LIGHTS], ids=["two", "many"])
def test_leaving_out_what_shows_nothing_changes_no_pixel(lights: tuple[PointLight, ...]) -> None:
    black_in_red = dataclasses.replace(octahedron(), albedo=(0.0, 0.5, 0.3))
    what = scene(black_in_red, lights=lights, camera=camera(width=64, height=48))
    chosen = dataclasses.replace(plan(what, Configuration()), split=False, columns=4, rows=2)

    expected = render(what, (Stage.RADIANCE,), Configuration(), chosen=chosen)[Stage.RADIANCE]

    assert 0.05 < (expected[..., 1] > 0).mean() < 0.6
    np.testing.assert_array_equal(Frames(what, Configuration(), chosen=chosen).pixels(), expected)
