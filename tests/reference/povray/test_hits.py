"""POV-Ray's trace() and its coloured faces against closed forms, in float64."""

from dataclasses import replace

import numpy as np
import pytest

from rayproof.cases.scene import Cube, Mesh, Plane, Scene, Sphere, Triangle
from rayproof.cases.stages import Stage
from tests.reference.pictured import ALBEDO, answer, every_shape, looking_down, object_space, raised, tetrahedron

# A few dozen roundings at the scale of the scene, which measures some ten metres.
CLOSE = 1e-12
ROUNDED = 20 * 2.0**-24


def test_every_shape_is_hit_on_its_surface_with_the_inverse_transposed_normal(povray):
    scene = every_shape()

    ray, objects, distance, position, normal = answer(
        povray, scene, Stage.RAY, Stage.OBJECT, Stage.DISTANCE, Stage.POSITION, Stage.NORMAL
    )

    along = np.asarray(scene.camera.eye) + distance * ray
    for index, shape in enumerate(scene.shapes):
        here = objects[..., 0] == index
        assert here.sum() >= 8
        assert np.abs(along - position)[here].max() <= CLOSE
        assert np.abs(np.linalg.norm(normal[here], axis=1) - 1).max() <= CLOSE
        local, upward = object_space(scene, index, position[here], normal[here])
        expected, height = gradients(shape, local, objects[here, 1].astype(int))
        # Triangles' corners are rounded to float32 in world space.
        close = ROUNDED if isinstance(shape, Triangle | Mesh) else CLOSE
        assert np.abs(height).max() <= close
        assert np.abs(upward / np.linalg.norm(upward, axis=1, keepdims=True) - expected).max() <= close
        assert isinstance(shape, Mesh) or not objects[here, 1].any()


def gradients(shape, local, faces):
    """Return unit outward normals at object-space points, and how high above the surface these are [m]."""
    if isinstance(shape, Sphere):
        out = (local - shape.center) / shape.radius
        return out, np.linalg.norm(out, axis=1) - 1
    if isinstance(shape, Cube):
        return np.where(np.abs(np.abs(local) - 0.5) <= CLOSE, np.sign(local), 0), np.abs(local).max(axis=1) - 0.5
    if isinstance(shape, Mesh):
        corners = shape.vertices.astype(float)[shape.faces[faces]]
        out = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        out /= np.linalg.norm(out, axis=1, keepdims=True)
        return out, np.einsum("ij,ij->i", out, local - corners[:, 0])
    return np.array([[0, 0, 1.0]]), local[:, 2]


def test_a_miss_keeps_its_ray_and_nothing_else(povray):
    scene = Scene(camera=looking_down(height=5), shapes=(Sphere(albedo=ALBEDO, radius=0.5),))

    ray, objects, distance, position, normal = answer(
        povray, scene, Stage.RAY, Stage.OBJECT, Stage.DISTANCE, Stage.POSITION, Stage.NORMAL
    )

    missed = objects[..., 0] < 0
    assert missed[0, 0]
    assert not missed[9, 12]
    assert np.all(objects[missed] == -1)
    assert np.all(np.isinf(distance[missed]))
    assert not position[missed].any()
    assert not normal[missed].any()
    assert np.abs(np.linalg.norm(ray, axis=-1) - 1).max() <= CLOSE


@pytest.mark.parametrize(("clip", "height"), [("none", 0.5), ("depth", -0.5), ("shell", -0.5)])
def test_the_first_hit_inside_the_clip_interval_counts(povray, clip, height):
    camera = looking_down(height=2.0, near=2.0, far=2.6, fovy=2)
    scene = Scene(camera=camera, shapes=(Sphere(albedo=ALBEDO, radius=0.5, two_sided=True),), clip=clip)

    position, normal = answer(povray, scene, Stage.POSITION, Stage.NORMAL)

    # Beyond the near surface the far one is seen from inside, and shades towards the viewer.
    assert abs(position[9, 12, 2] - height) <= CLOSE
    assert abs(normal[9, 12, 2] - 1) <= CLOSE


def test_clipped_geometry_still_blocks_feelers(povray):
    light = every_shape().lights[0]
    light = replace(light, position=(0.0, 0.0, 3.0))
    cap = Sphere(albedo=ALBEDO, center=(0, 0, 2.0), radius=0.5)
    camera = looking_down(height=5, near=4.0)
    scene = Scene(camera=camera, shapes=(Plane(albedo=ALBEDO), cap), lights=(light,))

    objects, visibility, radiance = answer(povray, scene, Stage.OBJECT, Stage.VISIBILITY, Stage.RADIANCE)

    assert objects[9, 12, 0] == 0
    assert visibility[9, 12, 0] == 0
    assert not radiance[9, 12].any()
    assert visibility[0, 0, 0] == 1
    assert radiance[0, 0].all()


def test_a_mesh_without_area_is_never_hit(povray):
    flat = replace(tetrahedron(), vertices=np.zeros((4, 3)), to_world=raised(0))
    scene = Scene(camera=looking_down(height=5), shapes=(flat,))

    objects, position = answer(povray, scene, Stage.OBJECT, Stage.POSITION)

    assert np.all(objects == -1)
    assert not position.any()
