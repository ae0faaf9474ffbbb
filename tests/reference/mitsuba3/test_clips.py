"""The three clip modes on a sphere that the near limit cuts open, and on planes up to the far limit."""

from dataclasses import replace

import numpy as np
import pytest

from rayproof.cases.scene import IDENTITY, Plane, PointLight, Scene, Sphere
from rayproof.cases.stages import Stage
from tests.reference.mitsuba3.geometry import WHITE, answer, directions, looking_down, unit_sphere_roots


def expected_distance(camera, clip):
    roots = np.stack(unit_sphere_roots(camera, IDENTITY)[:2])
    measure = roots * (-directions(camera)[:, :, 0, 2]) if clip == "depth" else roots
    low, high = (0, np.inf) if clip == "none" else (camera.near, camera.far)
    counted = np.where((measure > low) & (measure < high), roots, np.inf)
    return counted.min(axis=0)


@pytest.mark.parametrize("clip", ["depth", "shell", "none"])
@pytest.mark.parametrize("limits", [(2.2, 50.0), (0.1, 2.1), (2.1, 3.7), (0.01, 1e4)], ids=str)
def test_the_smallest_root_inside_the_interval_counts(mitsuba, clip, limits):
    camera = looking_down(height=3, width=63, rows=49, near=limits[0], far=limits[1])
    scene = Scene(camera=camera, shapes=(Sphere(albedo=WHITE),), clip=clip)

    (distance,) = answer(mitsuba, scene, Stage.DISTANCE)

    expected = expected_distance(camera, clip)
    clear = np.isfinite(expected) & (unit_sphere_roots(camera, IDENTITY)[2] > 0.01)
    assert np.array_equal(np.isfinite(distance[..., 0]), np.isfinite(expected))
    assert np.abs(distance[clear, 0] - expected[clear]).max(initial=0.0) <= 200 * 2.0**-24
    if clip == "depth" and limits[0] > 2:
        shell = expected_distance(camera, "shell")
        assert np.any(shell != expected), "the case must tell planes from spheres"


def test_without_clipping_the_image_sees_what_near_and_far_would_hide(mitsuba):
    camera = looking_down(height=3, near=10.0, far=20.0)
    light = PointLight(position=(0, 0, 3), flux=(40.0, 50.0, 60.0))
    scene = Scene(camera=camera, shapes=(Sphere(albedo=WHITE),), lights=(light,), clip="none")

    exitance, radiance = answer(mitsuba, scene, Stage.EXITANCE, Stage.RADIANCE)

    assert radiance.max() > 0.2
    assert np.abs(radiance - exitance / np.pi).max() <= 80 * 2.0**-24 * radiance.max()


@pytest.mark.parametrize("clip", ["depth", "shell"])
def test_a_plane_reaches_exactly_to_the_far_limit(mitsuba, clip):
    camera = looking_down(height=2, near=0.1, far=60.0)
    camera = replace(camera, target=(0.0, 40.0, 0.0), up=(0, 0, 1))
    scene = Scene(camera=camera, shapes=(Plane(albedo=WHITE),), clip=clip)

    (distance,) = answer(mitsuba, scene, Stage.DISTANCE)

    ray = directions(camera)[:, :, 0]
    with np.errstate(divide="ignore"):
        expected = 2.0 / -ray[..., 2]
    forward = np.array([0, 40.0, -2.0]) / np.hypot(40, 2)
    inside = (expected > 0) & ((expected * (ray @ forward) if clip == "depth" else expected) < camera.far)
    assert np.array_equal(np.isfinite(distance[..., 0]), inside)
    assert np.abs(distance[..., 0] / expected - 1)[inside].max() <= 300 * 2.0**-24
