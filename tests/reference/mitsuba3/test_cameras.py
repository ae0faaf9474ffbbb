"""The camera stage against matrices written down from the camera's definition."""

from dataclasses import replace

import numpy as np
import pytest

from rayproof.cases.scene import Scene
from rayproof.cases.stages import Stage
from tests.reference.mitsuba3.geometry import GENERIC

CLOSE = 20 * 2.0**-24
WIDE = replace(GENERIC, fovy=95.0, width=64, height=20, near=0.01, far=1000.0)
NARROW = replace(GENERIC, fovy=3.0, width=20, height=48, near=2.0, far=5.0)


def axes(camera):
    forward = np.subtract(camera.target, camera.eye)
    forward = forward / np.linalg.norm(forward)
    right = np.cross(forward, camera.up)
    right = right / np.linalg.norm(right)
    return np.array([right, np.cross(right, forward), forward])


@pytest.mark.parametrize("camera", [GENERIC, WIDE, NARROW], ids=["generic", "wide", "narrow"])
def test_matrices_corners_and_pixels(mitsuba, camera):
    rows, near, far = axes(camera), camera.near, camera.far
    high = np.tan(np.radians(camera.fovy) / 2)
    wide = high * camera.width / camera.height
    view = np.eye(4)
    view[:3] = np.c_[rows, -rows @ camera.eye]
    depth = far / (far - near)
    projection = np.array([[1 / wide, 0, 0, 0], [0, 1 / high, 0, 0], [0, 0, depth, -depth * near], [0, 0, 1, 0]])
    signs = np.array([(-1, -1, 1), (1, -1, 1), (1, 1, 1), (-1, 1, 1)])
    corners = [camera.eye + (signs * (wide, high, 1) * at) @ rows for at in (near, far)]

    found = mitsuba.render(Scene(camera=camera, shapes=()), [Stage.CAMERA])[Stage.CAMERA]

    size = np.linalg.norm(camera.eye)
    inverse = np.linalg.inv(projection)
    assert np.abs(found["view"] - view).max() <= CLOSE * size
    assert np.abs(found["view_inverse"] - np.linalg.inv(view)).max() <= CLOSE * size
    assert np.abs(found["projection"] - projection).max() <= CLOSE * np.abs(projection).max()
    assert np.abs(found["projection_inverse"] - inverse).max() <= CLOSE * np.abs(inverse).max()
    reach = size + np.repeat([near, far], 4)[:, np.newaxis] * np.hypot(1, wide)
    assert (np.abs(found["frustum_corners"] - np.concatenate(corners)) / reach).max() <= CLOSE
    assert np.allclose(found["pixel"][2, 3], (3.5, 2.5), rtol=CLOSE, atol=0)
    assert np.allclose(found["ndc"][2, 3], (7 / camera.width - 1, 1 - 5 / camera.height), rtol=0, atol=CLOSE)
