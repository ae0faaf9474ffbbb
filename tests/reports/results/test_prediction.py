"""What is foretold of an image from a reader's other images; only what is near needs to be right, not all."""

import numpy as np
import pytest

from rayproof.cases.stages import Stage
from rayproof.reports.results.float_codec import (
    along,
    factors,
    intensities,
    lit,
    pinhole,
    predicted,
    predictions,
    through,
    times,
)
from tests.reports.publish.sample import EYE, SCENE, answers


@pytest.fixture
def own():
    """Return a renderer's stages in float32."""
    return {stage: image.astype(np.float32) for stage, image in answers().items()}


def test_exitance_is_foretold_by_the_albedos_and_radiance_by_pi(own):
    table = factors(own[Stage.EXITANCE], own[Stage.IRRADIANCE], own[Stage.OBJECT])
    assert table["0"] == pytest.approx([0.8, 0.3, 0.2])
    assert table["1"] == pytest.approx([0.4, 0.5, 0.6])

    foretold = times(own[Stage.IRRADIANCE], own[Stage.OBJECT], table)

    assert np.allclose(foretold, own[Stage.EXITANCE], rtol=2**-22)


def test_rays_are_foretold_by_the_camera(own):
    rays = pinhole(SCENE["camera"])
    assert rays is not None

    assert np.allclose(through(rays, 30, 40), own[Stage.RAY], atol=2**-23)


def test_hit_points_are_foretold_by_the_ray_and_misses_by_0(own):
    foretold = along(own[Stage.RAY], own[Stage.DISTANCE], EYE)

    assert np.allclose(foretold, own[Stage.POSITION], atol=1e-5)


def test_every_prediction_is_made_again_from_what_it_says_of_itself(own):
    base = {stage: image + np.float32(1) for stage, image in own.items()}
    seen = set()

    lights = intensities(SCENE)
    for stage, before in [*((stage, base) for stage in own), (Stage.IRRADIANCE, None)]:
        for how, foretold in predictions(stage, own, before, tuple(EYE), pinhole(SCENE["camera"]), lights=lights):
            height, width, _ = foretold.shape
            again = predicted({**how, "height": height, "width": width}, stage, own, before)
            assert (np.zeros_like(foretold) if again is None else again).tobytes() == foretold.tobytes()
            assert np.isfinite(foretold).all() or how["by"] == "base"
            seen.add(how["by"])

    assert seen == {"nothing", "base", "factors", "ray", "pinhole", "lights"}


def test_irradiance_is_foretold_by_the_lights(own):
    lights = intensities(SCENE)
    assert lights is not None

    foretold = lit(own, lights)

    # Of hit points, normals and E that are rounded to float32.
    assert np.allclose(foretold, own[Stage.IRRADIANCE], rtol=1e-4, atol=1e-6)
    assert (foretold > 0).mean() > 0.2


@pytest.mark.parametrize("seed", range(20))
def test_factors_are_each_object_s_and_channel_s_medians_of_what_is_finite(seed):
    random = np.random.default_rng(seed)
    objects = random.integers(-1, 3, (7, 9, 1)).astype(np.float32)
    image, source = random.random((2, 7, 9, 3)).astype(np.float32)
    source[random.random((7, 9)) < 0.3] = 0  # in the dark
    source[random.random((7, 9, 3)) < 0.05 * (seed % 3)] = np.nan

    table = factors(image, source, objects)

    with np.errstate(all="ignore"):
        ratio = image.astype(np.float64) / source
    for index in np.unique(objects):
        columns = [column[np.isfinite(column)] for column in ratio[objects[..., 0] == index].T]
        assert table[str(int(index))] == [float(np.float32(np.median(column))) for column in columns]


def test_factors_are_found_once_for_all_who_are_compared_with_one(own):
    other = {stage: image * np.float32(1.5) for stage, image in own.items()} | {Stage.OBJECT: own[Stage.OBJECT]}
    misshapen = {stage: image[1:] for stage, image in own.items()}
    tables = {}

    def told(images, base):
        ways = predictions(Stage.EXITANCE, images, base, tuple(EYE), None, tables)
        return next(how["factors"] for how, _ in ways if how["by"] == "factors")

    assert told(other, own) is told(own, None) is tables[Stage.EXITANCE]
    assert told(misshapen, own) is not tables[Stage.EXITANCE]
