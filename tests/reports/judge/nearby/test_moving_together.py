"""What scenes share moves as one: no nearby scene has a crack, and no name decides what is nearby."""

from dataclasses import replace

import numpy as np
import pytest

from rayproof.cases.scene import Mesh, Scene
from rayproof.cases.stages import Stage
from rayproof.reports.judge.measurement import Kind
from tests.reports.judge.nearby.scenes import VERTEX, netted
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
