"""What scenes share moves as one: no nearby scene has a crack, and no name decides what is nearby."""

from dataclasses import replace

import numpy as np
import pytest

from rayproof.cases.scene import Mesh, Scene
from rayproof.cases.stages import Stage
from rayproof.reports.judge.measurement import Kind
from rayproof.reports.judge.nearby.problems import Problems, adjoining, problems_of
from tests.reports.judge.nearby.scenes import MIDDLE, VERTEX, above, lamp, level, netted
from tests.reports.judge.scenes import against, kind, kinds, naming, seen_around

NET = netted()


def soup(scene: Scene) -> Scene:
    """Return the scene with three vertices of its own for each face of its mesh."""
    mesh, *others = scene.shapes
    assert isinstance(mesh, Mesh)
    corners = mesh.vertices[mesh.faces].reshape(-1, 3)
    return replace(
        scene, shapes=(replace(mesh, vertices=corners, faces=np.arange(len(corners)).reshape(-1, 3)), *others)
    )


@pytest.mark.parametrize("scene", [NET, soup(NET)], ids=["shared-indices", "soup"])
def test_a_hole_between_faces_is_explained_by_no_vertices_whatever_their_indices(scene):
    ours = naming(scene, VERTEX, 1.0)
    staged = kinds(scene, ours, VERTEX)

    assert staged[Stage.OBJECT] is staged[Stage.RADIANCE] is Kind.WRONG
    assert kind(scene, {Stage.RADIANCE: ours[Stage.RADIANCE]}, Stage.RADIANCE, VERTEX) is Kind.WRONG


def test_each_face_at_a_vertex_is_explained():
    around = list(seen_around(NET, VERTEX))

    assert len(around) == 6
    for ours in around:
        assert Kind.WRONG not in kinds(NET, ours, VERTEX).values()
        assert kind(NET, {Stage.RADIANCE: ours[Stage.RADIANCE]}, Stage.RADIANCE, VERTEX) is not Kind.WRONG


JOINT = 2.0**-30  # m: so far beside the middle pixel's ray the squares join
JOINED = above(
    level(JOINT - 2.0, 0.0, 0.0), level(JOINT + 2.0, 0.0, 0.0), level(0.0, 0.0, -1.0, side=16.0),
    lights=(lamp(0.3, 0.2, 6.0),),
)  # fmt: skip


def test_shapes_that_share_corners_leave_no_gap_and_others_may():
    apart = replace(JOINED, shapes=(JOINED.shapes[0], level(2.0 + 3 * JOINT, 0.0, 0.0), JOINED.shapes[2]))

    assert adjoining(JOINED.shapes) == ((0, 1), (2,))
    assert kind(JOINED, naming(JOINED, MIDDLE, 1.0), Stage.OBJECT, MIDDLE) is Kind.ROUNDING
    assert kind(JOINED, naming(JOINED, MIDDLE, 2.0), Stage.OBJECT, MIDDLE) is Kind.WRONG
    assert kind(apart, naming(apart, MIDDLE, 2.0), Stage.OBJECT, MIDDLE) is Kind.ROUNDING


def test_what_moves_is_drawn_from_what_the_scene_contains():
    mesh = NET.shapes[0]
    assert isinstance(mesh, Mesh)
    same = replace(NET, shapes=(replace(mesh, file="another.ply"), *NET.shapes[1:]))
    brighter = replace(NET, lights=(replace(NET.lights[0], flux=(1.0, 2.0, 3.0)),))
    seeds = [Problems(scene, "float32").seed for scene in (NET, replace(NET), same, brighter)]

    assert len(set(seeds[:3])) == 1
    assert seeds[3] != seeds[0]
    moved = [Problems(scene, "float32").moved(16.0, 3) for scene in (NET, same)]
    assert moved[0] is not None
    assert moved[1] is not None
    assert moved[0].scene == moved[1].scene
    assert moved[0].seed == moved[1].seed
    assert problems_of(NET, "float32", baked=False) is problems_of(same, "float32", baked=False)


def test_what_is_drawn_for_a_pixel_does_not_depend_on_which_others_are_asked():
    several = [(4, 8), VERTEX, (9, 3)]
    ours = naming(NET, VERTEX, 0.0, 0.0)
    for pixel in several:
        ours[Stage.OBJECT][pixel] = naming(NET, pixel, 1.0)[Stage.OBJECT][pixel]
    alone, together = against(NET, naming(NET, VERTEX, 1.0)), against(NET, ours)
    clouds = []
    for each in (alone, together):
        over = {Stage.OBJECT: each.over(Stage.OBJECT)}
        asking = each.asking(over, keep=True)
        asking.explain()
        (cloud, rows, columns), *_ = asking.clouds
        place = int(np.flatnonzero((rows == VERTEX[0]) & (columns == VERTEX[1]))[0])
        clouds.append(cloud.at(np.array([place])))

    assert len(clouds[0].codes) == len(clouds[1].codes)
    np.testing.assert_array_equal(clouds[0].rows[Stage.RAY], clouds[1].rows[Stage.RAY])
