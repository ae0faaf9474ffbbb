"""The eye sees all its points by one sheet: what is said of them is what a sheet of each would say, to the last bit."""

from dataclasses import replace

import numpy as np
import pytest

from rayproof.reference.analytic.camera import pixel_centers, view_of
from rayproof.reference.analytic.edges.inverse_depths import no_screens, no_sheet, reach
from rayproof.reference.analytic.edges.outlines import Sight, ellipsoid_distances, sight_from_eye
from rayproof.reference.analytic.surfaces import Ellipsoid
from tests.reference.analytic.scenes import camera

RANDOM = np.random.default_rng(4)


@pytest.fixture
def sights() -> tuple[Sight, Sight]:
    """Return the eye's sight of a camera's pixels, by one sheet and by one for each."""
    view = view_of(camera())
    directions = view.directions(pixel_centers(camera()))
    sight = sight_from_eye(view, directions)
    return sight, replace(sight, sheet=no_sheet(len(directions)))


def test_planes_through_the_eye_are_as_far_away(sights):
    rays = RANDOM.permutation(len(sights[0].directions))[:100]
    planes = RANDOM.normal(size=(17, 3))

    (value, distance), (other, each) = (sight[rays].linear(planes) for sight in sights)

    assert value.tobytes() == other.tobytes()
    assert distance.tobytes() == each.tobytes()


def test_so_are_an_ellipsoid_and_the_distances_in_which_directions_change_moderately(sights):
    axes = RANDOM.normal(size=(3, 3))
    surface = Ellipsoid(center=np.array([0.3, 20.0, 0.1]), axes=axes, to_unit=np.linalg.inv(axes))
    screens = no_screens(len(sights[0].directions), hides_touching=False)

    one, each = (ellipsoid_distances(sight, surface, screens) for sight in sights)

    assert one.tobytes() == each.tobytes()
    for found, other in zip(*(sight.caps(8.0) for sight in sights), strict=True):
        assert found.tobytes() == other.tobytes()


def test_what_is_linear_is_as_far_away_as_what_hardly_bends():
    value, slope = RANDOM.normal(size=(50, 7)), RANDOM.random((1, 7))
    value[0], value[1, 0], slope[0, 0] = 0.0, np.inf, 0.0
    everywhere = np.full((1, 1), np.inf)

    plain = reach(value, slope, np.zeros((1, 1)), everywhere)
    finite = np.isfinite(value).all(axis=1)

    assert plain[1, 0] == 0  # an overflow, where nothing can be claimed
    assert reach(value[finite], slope, np.zeros((1, 1)), everywhere).tobytes() == plain[finite].tobytes()
    assert np.allclose(reach(value[finite], slope, np.full((1, 1), 1e-300), everywhere)[:, 1:], plain[finite][:, 1:])
