"""What hides a light, against closed forms; no surface hides it from itself."""

import numpy as np
import pytest

from rayproof.cases.placement import compose, scaling
from rayproof.cases.scene import Cube, Mesh, PointLight, Scene, Square
from rayproof.cases.stages import Stage
from rayproof.reference.embree.program import CLEARANCE
from tests.reference.mitsuba3.geometry import SHEARED, WHITE, answer, looking_down


def level(size, height, facing=1.0):
    return ((size, 0, 0, 0), (0, size, 0, 0), (0, 0, facing, height), (0, 0, 0, 1.0))


@pytest.mark.parametrize(("height", "blocked"), [(1.0, True), (3.0, False)], ids=["below-the-light", "above"])
@pytest.mark.parametrize("facing", [1.0, -1.0], ids=["facing-the-light", "facing-away"])
def test_only_what_stands_between_point_and_light_casts_a_shadow(embree, height, blocked, facing):
    light = PointLight(position=(0, 0, 2), flux=(0.0, 0.0, 0.0))
    camera = looking_down(height=8, fovy=25) if blocked else looking_down(height=1.5, fovy=80)
    shapes = tuple(Square(albedo=WHITE, to_world=one) for one in (level(40.0, 0.0), level(0.6, height, facing)))
    scene = Scene(camera=camera, shapes=shapes, lights=(light,))

    shape, position, visibility = answer(embree, scene, Stage.OBJECT, Stage.POSITION, Stage.VISIBILITY)

    half = 0.3 * 2 / (2 - height) if blocked else -1.0
    outward = np.abs(position[..., :2]).max(-1)
    clear = (shape[..., 0] == 0) & (np.abs(outward - half) > 1e-4)
    assert clear.sum() > 300
    assert np.array_equal(visibility[clear, 0] == 1, outward[clear] > half)


@pytest.mark.parametrize("grazing", [1.0, 1e-3, 1e-5], ids=["high", "low", "very-low"])
def test_a_floor_never_hides_a_light_from_itself(embree, grazing):
    # Far larger than what is seen of it, so that float32 sees its plane off by many clearances.
    floor = compose(SHEARED, scaling(3000, 3000, 3000))
    normal = np.linalg.inv(floor)[2, :3]
    normal /= np.linalg.norm(normal)
    x, y, z = np.array(floor)[:3, 3] + 4 * grazing * normal + 4 * np.array(SHEARED)[:3, 0]
    camera = looking_down(height=5)
    light = PointLight(position=(float(x), float(y), float(z)), flux=(1.0, 1.0, 1.0))
    scene = Scene(camera=camera, shapes=(Square(albedo=WHITE, to_world=floor),), lights=(light,))

    shape, visibility = answer(embree, scene, Stage.OBJECT, Stage.VISIBILITY)

    assert not shape.any()
    assert np.all(visibility == 1)


def test_a_finely_divided_sheet_never_hides_a_light_from_itself(embree):
    count = 40
    x, y = np.meshgrid(np.linspace(-3, 3, count + 1), np.linspace(-3, 3, count + 1))
    # A gentle bowl: every triangle's neighbours rise in front of it, by less than the light stands.
    vertices = np.stack([x, y, 0.01 * (x**2 + y**2)], axis=-1).reshape(-1, 3)
    corner = (np.arange(count)[:, None] * (count + 1) + np.arange(count)).ravel()
    first = np.stack([corner, corner + 1, corner + count + 2], axis=1)
    second = np.stack([corner, corner + count + 2, corner + count + 1], axis=1)
    bowl = Mesh(albedo=WHITE, vertices=vertices, faces=np.vstack([first, second]))
    light = PointLight(position=(1.0, 2.0, 3.0), flux=(1.0, 1.0, 1.0))
    scene = Scene(camera=looking_down(height=5), shapes=(bowl,), lights=(light,))

    shape, visibility = answer(embree, scene, Stage.OBJECT, Stage.VISIBILITY)

    assert np.all(shape[..., 0] == 0)
    assert np.all(visibility == 1)


def test_each_light_has_a_channel_and_none_none(embree):
    lights = tuple(PointLight(position=(0, 0, z), flux=(1.0, 1.0, 1.0)) for z in (2.0, -2.0, 0.1))
    shapes = (Square(albedo=WHITE, to_world=level(20.0, 0.0)), Square(albedo=WHITE, to_world=level(20.0, 1.0)))
    camera = looking_down(height=0.9)

    (lit,) = answer(embree, Scene(camera=camera, shapes=shapes, lights=lights), Stage.VISIBILITY)
    (unlit,) = answer(embree, Scene(camera=camera, shapes=shapes), Stage.VISIBILITY)

    assert np.all(lit == (0, 0, 1))
    assert unlit.shape == (camera.height, camera.width, 0)


def test_no_light_leaves_a_closed_cube(embree):
    light = PointLight(position=(0, 0, 0.1), flux=(1.0, 1.0, 1.0))
    shapes = (Cube(albedo=WHITE), Square(albedo=WHITE, to_world=level(9.0, -0.4)))
    scene = Scene(camera=looking_down(height=5), shapes=shapes, lights=(light,))

    (visibility,) = answer(embree, scene, Stage.VISIBILITY)

    assert not visibility.any()


@pytest.mark.parametrize(("gap", "blocked"), [(0.5, False), (2.0, True)], ids=["within-its-epsilon", "beyond"])
def test_blockers_nearer_than_its_epsilon_do_not_count(embree, gap, blocked):
    # A sheet hangs so low over the floor that the camera, which starts below it, sees the floor alone.
    camera = looking_down(height=1.0, near=1.0 - 1e-7, fovy=1)
    sheet = Square(albedo=WHITE, to_world=level(9.0, gap * CLEARANCE))
    light = PointLight(position=(0, 0, 3), flux=(1.0, 1.0, 1.0))
    scene = Scene(camera=camera, shapes=(Square(albedo=WHITE, to_world=level(9.0, 0.0)), sheet), lights=(light,))

    found = embree.render(scene, (Stage.OBJECT, Stage.DISTANCE, Stage.VISIBILITY))

    middle = (camera.height // 2, camera.width // 2)
    assert found[Stage.OBJECT][middle][0] == 0
    assert found[Stage.VISIBILITY][middle] == (not blocked)
    assert embree.epsilon_at(found)[middle] == pytest.approx(CLEARANCE)
