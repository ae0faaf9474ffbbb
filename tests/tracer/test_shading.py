"""Shading: closed forms per pixel, and NaN that no clamp hides."""

import dataclasses

import drjit as dr
import numpy as np
import pytest

from rayproof.cases.rounding import UNIT_ROUNDOFF
from rayproof.cases.scene import Plane, Scene
from rayproof.cases.stages import Stage
from rayproof.tracer.configuration import Configuration
from rayproof.tracer.kernel.arrays import array_types
from rayproof.tracer.render import render
from tests.tracer.scenes import LIGHT, SECOND_LIGHT, camera, everything, scene


def expected_irradiance(answers: dict, what: Scene) -> np.ndarray:
    """Return E from the tracer's own positions, normals and visibilities."""
    total = np.zeros((*answers[Stage.POSITION].shape[:2], 3))
    for index, light in enumerate(what.lights):
        toward = np.asarray(light.position) - answers[Stage.POSITION]
        squared = np.sum(toward**2, axis=-1)
        cosine = np.clip(np.sum(toward * answers[Stage.NORMAL], axis=-1) / np.sqrt(squared), 0, 1)
        if what.shading == "inverse_square":
            cosine = cosine / (4 * np.pi * squared)
        total += (cosine * answers[Stage.VISIBILITY][..., index])[..., np.newaxis] * light.flux
    return total


@pytest.mark.parametrize("shading", ["inverse_square", "simplified"])
def test_light_follows_from_the_stages_before(shading: str, precision: str) -> None:
    what = everything(shading=shading)
    answers = render(what, tuple(Stage), Configuration(precision=precision))
    shape = answers[Stage.OBJECT][..., 0].astype(int)
    albedo = np.array([*(one.albedo for one in what.shapes), (0.0, 0.0, 0.0)])[shape]
    behind = np.sum(answers[Stage.NORMAL] * answers[Stage.RAY], axis=-1) > 0
    one_sided = np.array([*(not one.two_sided for one in what.shapes), False])[shape]

    irradiance = expected_irradiance(answers, what)
    limit = 64 * UNIT_ROUNDOFF[precision] * irradiance.max()
    divisor = np.pi if shading == "inverse_square" else 1.0

    np.testing.assert_allclose(answers[Stage.IRRADIANCE], irradiance, atol=limit)
    np.testing.assert_allclose(answers[Stage.EXITANCE], albedo * answers[Stage.IRRADIANCE], atol=limit)
    radiance = np.where((behind & one_sided)[..., np.newaxis], 0, answers[Stage.EXITANCE] / divisor)
    np.testing.assert_allclose(answers[Stage.RADIANCE], radiance, atol=limit)
    assert (answers[Stage.RADIANCE] > 0).mean() > 0.5


def test_lights_add(precision: str) -> None:
    both = everything()
    alone = [dataclasses.replace(both, lights=(light,)) for light in both.lights]
    configuration = Configuration(precision=precision)

    together, first, second = (
        render(what, (Stage.RADIANCE,), configuration)[Stage.RADIANCE] for what in (both, *alone)
    )

    np.testing.assert_allclose(together, first + second, rtol=8 * UNIT_ROUNDOFF[precision])


def test_a_one_sided_surface_from_behind_is_black_but_lit() -> None:
    below = camera(eye=(1.0, -2.0, -3.0))
    floor = Plane(albedo=(0.3, 0.4, 0.8))
    one, two = (
        render(scene(dataclasses.replace(floor, two_sided=sides), camera=below), tuple(Stage), Configuration())
        for sides in (False, True)
    )

    assert not one[Stage.RADIANCE].any()
    assert (one[Stage.IRRADIANCE] > 0).all()
    assert not two[Stage.IRRADIANCE].any()
    assert (two[Stage.NORMAL][..., 2] == -1).all()


def test_no_clamp_hides_a_nan(precision: str) -> None:
    Float = array_types(precision).Float
    usual, nan = Configuration(), Float(dr.nan)

    assert dr.isnan(usual["lambert"](Float(1), nan)[0])
    assert dr.isnan(usual["simplified"](Float(1), nan)[0])
    assert not usual["horizon"](nan)[0]


@pytest.mark.parametrize("slot", ["lambert", "simplified"])
def test_below_the_horizon_the_law_itself_gives_nothing(slot: str, precision: str) -> None:
    Float = array_types(precision).Float

    brought = Configuration()[slot](Float(2), Float(-0.5, -0.0, 0.5))

    assert list(brought) == [0, 0, 1]


def test_overflow_is_an_infinity_and_not_a_nan() -> None:
    bright = tuple(dataclasses.replace(light, flux=(1e38, 1e38, 1e38)) for light in (LIGHT, SECOND_LIGHT))
    close = tuple(dataclasses.replace(light, position=(0.0, 0.0, 1e-3)) for light in bright)
    view = camera(eye=(0.0, -0.5, 3.0), target=(0.0, 0.0, 0.0), width=9, height=7)
    radiance = render(
        scene(Plane(albedo=(1.0, 1.0, 1.0)), camera=view, lights=close), (Stage.RADIANCE,), Configuration()
    )

    assert not np.isnan(radiance[Stage.RADIANCE]).any()
    assert np.isinf(radiance[Stage.RADIANCE]).any()
