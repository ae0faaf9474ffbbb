"""What geometry demands of every camera formula."""

import numpy as np
import pytest

from rayproof.cases.rounding import UNIT_ROUNDOFF
from rayproof.cases.stages import Stage
from rayproof.tracer.configuration import Configuration
from rayproof.tracer.formulas import FORMULAS
from rayproof.tracer.render import render
from tests.tracer.scenes import camera, scene

RAYS = [formula.variant for formula in FORMULAS.variants("ray") if formula.kind == "right"]
CAMERA = camera(eye=(31.0, -57.0, 24.0), target=(30.1, -56.2, 23.5), width=7, height=5)


@pytest.mark.parametrize("variant", RAYS)
def test_rays_are_unit_and_pass_through_pixel_centres(variant: str, precision: str) -> None:
    configuration = Configuration(precision=precision, formulas={"ray": variant})
    answers = render(scene(camera=CAMERA), (Stage.CAMERA, Stage.RAY), configuration)
    rays, matrices = answers[Stage.RAY], answers[Stage.CAMERA]

    in_camera = rays @ matrices["view"][:3, :3].T
    tangent = np.tan(CAMERA.alpha)
    sx = in_camera[..., 0] / in_camera[..., 2] / (tangent * CAMERA.aspect)
    sy = in_camera[..., 1] / in_camera[..., 2] / tangent

    u = UNIT_ROUNDOFF[precision]
    assert np.abs(np.linalg.norm(rays, axis=-1) - 1).max() <= 4 * u
    # The eye is 60 m from the origin and the target 1.3 m away: the basis loses that ratio of digits.
    np.testing.assert_allclose(sx, np.broadcast_to((2 * np.arange(7) + 1) / 7 - 1, sx.shape), atol=1000 * u)
    np.testing.assert_allclose(sy, np.broadcast_to(1 - (2 * np.arange(5)[:, None] + 1) / 5, sy.shape), atol=1000 * u)


def test_matrices_keep_the_conventions(precision: str) -> None:
    view = camera(near=0.5, far=40.0)
    answer = render(scene(camera=view), (Stage.CAMERA,), Configuration(precision=precision))[Stage.CAMERA]
    u = UNIT_ROUNDOFF[precision]

    eye = answer["view"] @ (*view.eye, 1.0)
    target = answer["view"] @ (*view.target, 1.0)
    depths = [answer["projection"] @ (0.0, 0.0, depth, 1.0) for depth in (view.near, view.far)]

    np.testing.assert_allclose(eye, (0, 0, 0, 1), atol=64 * u)
    np.testing.assert_allclose(target[:2], 0, atol=64 * u)
    assert target[2] > 0
    np.testing.assert_allclose([clip[2] / clip[3] for clip in depths], (0, 1), atol=64 * u)
    np.testing.assert_allclose([clip[3] for clip in depths], (view.near, view.far), rtol=4 * u)
    np.testing.assert_allclose(answer["view"] @ answer["view_inverse"], np.eye(4), atol=64 * u)
    np.testing.assert_allclose(answer["projection"] @ answer["projection_inverse"], np.eye(4), atol=64 * u)


def test_frustum_corners_project_to_the_corners_of_clip_space(precision: str) -> None:
    answer = render(scene(), (Stage.CAMERA,), Configuration(precision=precision))[Stage.CAMERA]

    corners = np.concatenate([answer["frustum_corners"], np.ones((8, 1))], axis=1)
    clip = corners @ (answer["projection"] @ answer["view"]).T
    square = [(-1, -1), (1, -1), (1, 1), (-1, 1)]

    expected = [(*corner, depth) for depth in (0, 1) for corner in square]
    # Near is 0.1 m and the eye 8 m from the origin, so a near corner is known to 80 roundings of its depth.
    np.testing.assert_allclose(clip[:, :3] / clip[:, 3:], expected, atol=4096 * UNIT_ROUNDOFF[precision])


def test_pixels_survive_the_way_to_ndc_and_back(precision: str) -> None:
    answer = render(scene(), (Stage.CAMERA,), Configuration(precision=precision))[Stage.CAMERA]

    columns, rows = np.meshgrid(np.arange(40) + 0.5, np.arange(30) + 0.5)

    np.testing.assert_allclose(answer["pixel"][..., 0], columns, atol=40 * 4 * UNIT_ROUNDOFF[precision])
    np.testing.assert_allclose(answer["pixel"][..., 1], rows, atol=40 * 4 * UNIT_ROUNDOFF[precision])
    assert answer["ndc"][0, 0, 0] < 0 < answer["ndc"][0, 0, 1]
