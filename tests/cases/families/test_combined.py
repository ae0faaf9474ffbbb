"""The covering array, read off its scenes: every pair of values occurs in the light; what it was made to see."""

from itertools import combinations, product

import numpy as np
import pytest

import rayproof
from rayproof.cases.case import Case
from rayproof.cases.families import cases_of
from rayproof.cases.scene import IDENTITY, Mesh, Plane, Scene, Sphere, Triangle

CASES = cases_of("combined")
VALUES = {
    "up": {"across", "leaning", "0.1 long", "10 long"},
    "attitude": {"level", "steep", "rolled"},
    "image": {"square", "portrait", "2:1", "wider", "odd"},
    "fovy": {15.0, 45.0, 90.0},
    "eye": {"origin", "near", "far"},
    "shape": {"Sphere", "Cube", "Square", "Plane", "Triangle", "Mesh"},
    "size": {0.01, 1.0, 100.0},
    "matrix": {"none", "turned", "stretched", "sheared", "mirrored"},
    "sides": {1, 2},
    "lights": {"one", "three", "near", "far", "coloured"},
    "shading": {"inverse_square", "simplified"},
    "clip": {"depth", "shell", "none"},
}


def across(points: np.ndarray) -> float:
    """Return the largest distance between two points along an axis."""
    return float(np.ptp(points, axis=0).max())


def extent(scene: Scene) -> float:
    """Return how large [m] the first shape is in the world; of a plane what the camera sees of it."""
    shape, matrix, camera = scene.shapes[0], np.asarray(scene.shapes[0].to_world)[:3, :3], scene.camera
    if isinstance(shape, Sphere):
        return 2 * shape.radius * float(np.linalg.norm(matrix, 2))
    if isinstance(shape, Plane):
        return 2 * float(np.linalg.norm(np.subtract(camera.target, camera.eye))) * np.tan(camera.alpha)
    corners = np.array(list(product((-0.5, 0.5), repeat=3)))
    if isinstance(shape, Triangle | Mesh):
        corners = np.asarray(shape.vertices, dtype=np.float64)
    return across(corners @ matrix.T)


def values(scene: Scene) -> dict[str, object]:
    """Return what a scene has of each setting, by its numbers."""
    camera, shape = scene.camera, scene.shapes[0]
    size = min((0.01, 1.0, 100.0), key=lambda size: abs(np.log(extent(scene) / size)))
    assert 0.4 < extent(scene) / size < 2.5
    forward = np.subtract(camera.target, camera.eye)
    forward = forward / np.linalg.norm(forward)
    right = np.cross(forward, camera.up)
    right = right / np.linalg.norm(right)
    length, lean = np.linalg.norm(camera.up), float(forward @ camera.up)
    eye = float(np.linalg.norm(camera.eye)) / size
    linear = np.asarray(shape.to_world)[:3, :3] / (1.0 if shape.to_world == IDENTITY else size)
    gram = linear.T @ linear
    away = [float(np.linalg.norm(np.subtract(light.position, camera.target))) / size for light in scene.lights]
    fluxes = {channel / light.flux[0] for light in scene.lights for channel in light.flux}
    ratio = camera.width / camera.height
    return {
        "up": f"{length:.3g} long" if abs(length - 1) > 1e-9 else "leaning" if abs(lean) > 0.2 else "across",
        "attitude": "rolled" if abs(right[2]) > 0.3 else "level" if abs(forward[2]) < 1e-9 else "steep",
        "image": "odd" if camera.width % 2 * camera.height % 2 else
        "square" if ratio == 1 else "portrait" if ratio < 1 else "2:1" if ratio == 2 else "wider",
        "fovy": camera.fovy,
        "eye": "origin" if eye == 0 else "near" if eye < 8 else "far",
        "shape": type(shape).__name__,
        "size": size,
        "matrix": "none" if shape.to_world == IDENTITY else
        "mirrored" if np.linalg.det(linear) < 0 else
        "turned" if np.allclose(gram, np.eye(3)) else
        "stretched" if np.allclose(gram, np.diag(np.diag(gram))) else "sheared",
        "sides": 1 + shape.two_sided,
        "lights": "coloured" if fluxes != {1.0} else "three" if len(away) == 3 else
        "near" if away[0] < 1.5 else "far" if away[0] > 300 else "one",
        "shading": scene.shading,
        "clip": scene.clip,
    }  # fmt: skip


def test_every_pair_of_values_occurs() -> None:
    met = {pair for case in CASES for pair in combinations(values(case.scene).items(), 2)}
    wanted = {
        ((first, left), (second, right))
        for first, second in combinations(VALUES, 2)
        for left in VALUES[first]
        for right in VALUES[second]
    }

    assert wanted - met == set()
    assert met - wanted == set()


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_its_scene_is_lit_and_the_shape_is_seen_in_the_light(case: Case) -> None:
    images = rayproof.oracle(case.scene, ("object", "radiance"))
    lit = images["radiance"].max(axis=-1) > 0

    assert np.mean(lit) >= 0.6
    assert np.sum(lit & (images["object"][..., 0] == 0)) >= 100
