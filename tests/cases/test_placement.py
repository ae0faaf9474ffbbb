"""Matrices act on column vectors, the last motion first; cameras look where they are told."""

from math import asin, atan2, degrees, tan

import numpy as np
import pytest

from rayproof.cases.placement import camera_around, compose, frontal_fovy, mapped, rotation, scaling, shear, translation


@pytest.mark.parametrize(
    ("matrix", "point", "expected"),
    [
        pytest.param(translation(1, 2, 3), (4, 5, 6), (5, 7, 9), id="translation"),
        pytest.param(scaling(2, -3, 4), (1, 1, 1), (2, -3, 4), id="scaling-and-mirror"),
        pytest.param(shear(xy=2, xz=3, yz=5), (1, 10, 100), (321, 510, 100), id="shear"),
        pytest.param(rotation((0, 0, 2), 90), (1, 0, 0), (0, 1, 0), id="counter-clockwise"),
        pytest.param(rotation((1, 1, 1), 120), (1, 2, 3), (3, 1, 2), id="about-a-diagonal"),
        pytest.param(compose(translation(1, 0, 0), rotation((0, 0, 1), 90)), (1, 0, 0), (1, 1, 0), id="last-first"),
    ],
)
def test_where_a_matrix_takes_a_point(matrix, point, expected):
    assert mapped(matrix, point) == pytest.approx(expected, abs=1e-15)


def test_a_rotation_keeps_lengths_and_handedness():
    linear = np.asarray(rotation((0.3, -0.5, 0.8), 71))[:3, :3]

    np.testing.assert_allclose(linear @ linear.T, np.eye(3), atol=1e-15)
    assert np.linalg.det(linear) == pytest.approx(1)


def test_a_camera_stands_where_it_is_told_and_rolls_to_its_left():
    camera = camera_around((1, 2, 3), distance=2, azimuth=90, elevation=0, roll=90, width=4, height=3)

    assert camera.eye == pytest.approx((1, 4, 3))
    assert camera.up == pytest.approx((1, 0, 0))


@pytest.mark.parametrize(("azimuth", "elevation"), [(30.0, 20.0), (-140.0, 65.0), (100.0, -40.0)])
def test_a_camera_stands_in_the_direction_of_its_angles_with_z_upward(azimuth: float, elevation: float) -> None:
    camera = camera_around((1, 2, 3), distance=2, azimuth=azimuth, elevation=elevation, roll=0, width=4, height=3)

    x, y, z = np.subtract(camera.eye, camera.target) / 2
    assert (degrees(atan2(y, x)), degrees(asin(z))) == pytest.approx((azimuth, elevation))
    assert np.linalg.norm((x, y, z)) == pytest.approx(1)
    # Of all directions at a right angle to the view the one with most of z.
    assert camera.up == pytest.approx((np.array((0, 0, 1)) - z * np.array((x, y, z))) / np.cos(np.radians(elevation)))


def test_a_frontal_plane_has_the_pixels_that_were_asked_for():
    fovy = frontal_fovy(height=65, pixel=0.0625, distance=5)

    assert 2 * 5 * tan(np.radians(fovy) / 2) / 65 == pytest.approx(0.0625)
    assert 0 < fovy < degrees(np.pi)
