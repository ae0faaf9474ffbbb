"""No answer changes within the distance that `edges` promises; and the distance is not far below the truth."""

import dataclasses
from typing import Any

import numpy as np
import pytest

from rayproof.cases.scene import Cube, Plane, PointLight, Scene, Sphere, Square, Triangle
from rayproof.cases.stages import Stage
from rayproof.reference.analytic import Analytic
from rayproof.reference.analytic.camera import pixel_centers
from rayproof.reference.analytic.edges import Edges
from rayproof.reference.analytic.edges.inverse_depths import reach
from tests.reference.analytic.scenes import camera, icosphere, looking_down, matrix, position, random_scene

ORACLE: Any = Analytic()
GREY = (0.5, 0.25, 0.125)
STAGES = [Stage.OBJECT, Stage.NORMAL, Stage.VISIBILITY]


def least(edges: Edges) -> np.ndarray:
    """Return the least of the three distances, shape (N,)."""
    per_light = np.minimum(edges.shadow, edges.terminator).min(axis=2, initial=np.inf)
    return np.minimum(edges.silhouette, per_light).ravel()


def changes(scene: Scene, bounds: np.ndarray, *, seed: int, rounds: int) -> int:
    """Return how often an answer changed at random points within `bounds` of the pixel centres."""
    generator = np.random.default_rng(seed)
    centers = pixel_centers(scene.camera)
    here = ORACLE.at(scene, STAGES, centers)
    cubes = [index for index, shape in enumerate(scene.shapes) if isinstance(shape, Cube)]
    on_cube = np.isin(here[Stage.OBJECT][:, 0], cubes)
    changed = 0
    for _ in range(rounds):
        angles = generator.uniform(0, 2 * np.pi, len(centers))
        radii = np.minimum(bounds, 30) * generator.choice([0.2, 0.5, 0.9, 0.999], len(centers))
        points = centers + radii[:, np.newaxis] * np.stack([np.cos(angles), np.sin(angles)], axis=1)
        there = ORACLE.at(scene, STAGES, points)
        differs = (there[Stage.OBJECT] != here[Stage.OBJECT]).any(axis=1)
        differs |= (there[Stage.VISIBILITY] != here[Stage.VISIBILITY]).any(axis=1)
        differs |= on_cube & (np.abs(there[Stage.NORMAL] - here[Stage.NORMAL]).max(axis=1) > 1e-6)
        changed += int(differs.sum())
    return changed


def inside_everything(seed: int) -> Scene:
    """Return a random scene seen by a wide camera from among its shapes, in a two-sided sphere and room."""
    generator = np.random.default_rng(seed)
    scene = random_scene(seed, width=30, height=24)
    view = dataclasses.replace(
        scene.camera, eye=position(generator, (-1, 1), (-1, 1), (-1, 1)), target=(1.0, 3.0, 0.5), fovy=110.0, near=0.05
    )
    ball = Sphere(albedo=GREY, radius=9, two_sided=True)
    room = Cube(albedo=GREY, to_world=matrix(np.eye(3) * 14, (0, 0, 2)), two_sided=True)
    return dataclasses.replace(scene, camera=view, shapes=(*scene.shapes, ball, room))


def many_faces(seed: int) -> Scene:
    """Return a random scene with a mirrored mesh of so many edges that only the near ones are looked at."""
    scene = random_scene(seed, width=24, height=20)
    ball = icosphere(3 + seed % 2, to_world=matrix(np.diag([0.9, -1.1, 0.7]), (0, -1, 0.3)))
    return dataclasses.replace(scene, shapes=(*scene.shapes[:3], ball))


SCENES = [
    *(pytest.param(random_scene(seed), id=f"mixed-{seed}") for seed in range(6)),
    *(pytest.param(inside_everything(seed), id=f"inside-{seed}") for seed in range(6, 10)),
    *(pytest.param(many_faces(seed), id=f"faces-{seed}") for seed in range(10, 14)),
]


@pytest.mark.parametrize("scene", SCENES)
def test_nothing_changes_within_the_bound(scene):
    bounds = least(ORACLE.edges(scene))

    assert changes(scene, bounds, seed=1, rounds=6) == 0


@pytest.mark.parametrize("scene", SCENES[:6])
def test_the_bound_is_not_far_below_the_distance(scene):
    """Also the control of the test above: it sees a bound that is too great."""
    bounds = least(ORACLE.edges(scene))

    assert changes(scene, 1.3 * bounds, seed=1, rounds=6) > 50
    assert changes(scene, 3 * bounds, seed=1, rounds=6) > 0.1 * len(bounds)


@pytest.mark.parametrize("scene", SCENES)
def test_few_pixels_are_next_to_an_edge(scene):
    bounds = least(ORACLE.edges(scene))

    assert (bounds < 1e-3).mean() < 0.01
    assert not np.isnan(bounds).any()


def test_where_there_is_no_edge_the_distance_is_infinite():
    light = PointLight(position=(0, 0, 3), flux=(1, 1, 1))
    scene = Scene(camera=looking_down(2), shapes=(Plane(albedo=GREY),), lights=(light,), clip="none")

    edges = ORACLE.edges(scene)

    assert np.isinf(edges.shadow).all()
    assert np.isinf(edges.terminator).all()
    # The horizon of a plane across the view is infinitely far.
    assert np.isinf(edges.silhouette).all()


def test_the_edge_of_a_square_is_where_geometry_says():
    """A square of half-size 0.5 seen from 2 m above, in an image of 11 px and 2 tan(25 degrees) height per metre."""
    scene = Scene(camera=looking_down(2), shapes=(Square(albedo=GREY),))
    half = 0.5 / 2 * 11 / (2 * np.tan(np.radians(25)))

    silhouette = ORACLE.edges(scene).silhouette

    assert silhouette[5, 7] == pytest.approx(half, abs=1e-8)
    assert silhouette[5, 14] == pytest.approx(7 - half, abs=1e-8)


def test_the_shadow_of_a_square_ends_where_similar_triangles_say():
    """Half-size a at height z under a light at height h throws a shadow of half-size a h / (h - z)."""
    blocker = Square(albedo=GREY, to_world=matrix(np.eye(3) * 0.5, (0, 0, 1)))
    light = PointLight(position=(0, 0, 3), flux=(1, 1, 1))
    view = looking_down(0.8, width=41, height=31, fovy=90, near=0.01)
    scene = Scene(camera=view, shapes=(Plane(albedo=GREY), blocker), lights=(light,))
    half = 0.25 * 3 / (3 - 1) / 0.8 * 31 / 2

    edges = ORACLE.edges(scene)

    assert edges.shadow[15, 20, 0] == pytest.approx(half, abs=1e-8)
    assert edges.shadow[15, 40, 0] == pytest.approx(20 - half, abs=1e-8)


@pytest.mark.parametrize("height", [0.3, 1.7])
def test_what_stands_higher_above_a_plane_than_the_light_throws_no_shadow_on_it(height):
    light = PointLight(position=(0.5, 0.2, height), flux=(1, 1, 1))
    shapes = (Sphere(albedo=GREY, radius=0.2), Cube(albedo=GREY), Square(albedo=GREY))
    higher = [dataclasses.replace(one, to_world=matrix(np.eye(3) * 0.3, (0.2, 0, 1))) for one in shapes]
    for blocker in higher:
        view = looking_down(0.8, width=21, height=15, fovy=90, near=0.01)
        scene = Scene(camera=view, shapes=(Plane(albedo=GREY), blocker), lights=(light,))

        assert np.isinf(ORACLE.edges(scene).shadow).all() == (height < 0.5)


def test_a_triangle_without_area_throws_no_shadow():
    light = PointLight(position=(0.5, 0.2, 2), flux=(1, 1, 1))
    line = Triangle(albedo=GREY, vertices=((0, 0, 1), (0.3, 0, 1), (0, 0, 1)))
    scene = Scene(camera=looking_down(0.8, near=0.01), shapes=(Plane(albedo=GREY), line), lights=(light,))

    assert np.isinf(ORACLE.edges(scene).shadow).all()


def test_a_hidden_edge_does_not_count():
    """A mesh behind a square has hundreds of edges; the square's own are all that matter in front of it."""
    front = Square(albedo=GREY, to_world=matrix(np.eye(3) * 1.3, (0, 0, 2)))
    view = looking_down(4, width=61, height=45)

    alone, both = Scene(camera=view, shapes=(front,)), Scene(camera=view, shapes=(front, icosphere(2)))
    on_square = ORACLE.render(alone, [Stage.OBJECT])[Stage.OBJECT][..., 0] == 0

    expected, found = ORACLE.edges(alone).silhouette[on_square], ORACLE.edges(both).silhouette[on_square]

    # Among many edges nothing is looked for beyond a few pixels.
    assert found.max() < expected.max()
    assert np.array_equal(found[expected < 7], expected[expected < 7])


def test_an_edge_through_pixel_centers_is_at_distance_zero():
    """A square that ends exactly at a column of pixel centres, up to rounding."""
    half = 4 * 2 * np.tan(np.radians(25)) / 11 * 2
    square = Square(albedo=GREY, to_world=matrix(np.eye(3) * 2 * half))

    silhouette = ORACLE.edges(Scene(camera=looking_down(2), shapes=(square,))).silhouette

    assert silhouette[5, 3] == 0
    assert silhouette[5, 11] == 0


def test_a_light_in_the_plane_flags_every_pixel_of_it():
    light = PointLight(position=(0.3, 0.2, 0), flux=(1, 1, 1))
    scene = Scene(camera=camera(), shapes=(Plane(albedo=GREY),), lights=(light,))

    edges = ORACLE.edges(scene)

    assert (edges.terminator[edges.silhouette > 1] == 0).any()


@pytest.mark.parametrize(
    ("value", "slope", "bend", "expected"),
    [
        (3.0, 2.0, 0.0, 1.5),
        (2.0, 0.0, 1.0, 2.0),
        (0.0, 0.0, 0.0, 0.0),
        (1.0, 0.0, 0.0, 5.0),
        (np.inf, np.inf, 0.0, 0.0),
    ],
)
def test_reach_solves_the_quadratic_and_stays_within_its_radius(value, slope, bend, expected):
    found = reach(*(np.array([number]) for number in (value, slope, bend, 5.0)))

    assert found[0] == pytest.approx(expected)


def test_of_two_squares_in_one_plane_either_may_be_seen():
    turned = np.array([[np.cos(0.4), -np.sin(0.4), 0], [np.sin(0.4), np.cos(0.4), 0], [0, 0, 1]])
    shapes = (Square(albedo=GREY), Square(albedo=GREY, to_world=matrix(turned * 0.4, (0.1, 0, 0))))
    scene = Scene(camera=looking_down(2, width=41, height=41), shapes=shapes)

    edges = ORACLE.edges(scene)

    assert edges.gap[20, 20] == 0
    assert edges.behind[20, 20] == 1
    assert edges.silhouette[20, 20] > 2
    # Towards a corner of the greater one there is no second surface.
    assert np.isinf(edges.gap[13, 13])
    assert edges.behind[13, 13] == -1


def test_the_gap_to_the_next_surface_is_measured_along_the_ray():
    shapes = (Square(albedo=GREY), Sphere(albedo=GREY, center=(0, 0, -1.5), radius=0.5))
    scene = Scene(camera=looking_down(2, width=5, height=5), shapes=shapes)

    edges = ORACLE.edges(scene)

    assert edges.gap[2, 2] == pytest.approx(1, abs=1e-12)
    assert edges.behind[2, 2] == 1


LAMPS = {
    "square": Square(albedo=GREY, to_world=matrix(np.eye(3), (0, 0, 1.5))),
    "cube": Cube(albedo=GREY, to_world=matrix(np.eye(3), (0, 0, 2))),
    "sphere": Sphere(albedo=GREY, center=(0, 0, 2), radius=0.5),
    "mesh": icosphere(1, to_world=matrix(np.eye(3) * 0.5, (0, 0, 2))),
}


@pytest.mark.parametrize("name", LAMPS)
@pytest.mark.parametrize("beside", [0.0, 1e-7, -1e-7])
def test_a_light_on_a_blocker_is_told_with_all_the_points_that_hang_on_it(name, beside):
    """The light stands 1.5 m over a floor's middle, on the underside of what hangs there; a ball hides it in part."""
    ball = Sphere(albedo=GREY, center=(0.6, 0, 0.5), radius=0.2)
    light = PointLight(position=(0, 0, 1.5 + beside), flux=(1, 1, 1))
    view = looking_down(1.2, fovy=90, width=21, height=15)
    scene = Scene(
        camera=view, shapes=(Square(albedo=GREY, to_world=matrix(4 * np.eye(3))), LAMPS[name], ball), lights=(light,)
    )
    without = Scene(camera=view, shapes=(scene.shapes[0], ball), lights=(light,))
    seen = ORACLE.render(without, [Stage.VISIBILITY])[Stage.VISIBILITY][..., 0] > 0

    (end,) = ORACLE.edges(scene).light_ends

    assert (end.light, end.shape) == (0, 1)
    # A lower bound: the mesh's faces slope away from the corner that the light is next to.
    assert 0.9 * abs(beside) <= end.gap + 1e-15 <= abs(beside) + 1e-14
    assert np.array_equal(end.pixels, seen)
    assert 0 < seen.sum() < seen.size


def test_a_light_that_something_else_hides_hangs_on_nothing():
    """On a cube's upper side, looked at from below: its lower side blocks whatever its upper one does."""
    cube = Cube(albedo=GREY, to_world=matrix(np.eye(3), (0, 0, 2)))
    light = PointLight(position=(0.1, 0, 2.5), flux=(1, 1, 1))
    view = looking_down(1.2, width=11, height=9)
    scene = Scene(camera=view, shapes=(Square(albedo=GREY, to_world=matrix(np.eye(3) * 0.9)), cube), lights=(light,))

    (end,) = ORACLE.edges(scene).light_ends

    assert not end.pixels.any()


def test_a_light_in_the_open_is_near_nothing():
    light = PointLight(position=(0.1, 0, 2.5), flux=(1, 1, 1))
    scene = Scene(camera=looking_down(2), shapes=(Square(albedo=GREY), LAMPS["sphere"]), lights=(light,))

    assert ORACLE.edges(scene).light_ends == ()
