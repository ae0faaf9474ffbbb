"""The scene as a program gets it: JSON of the published schema, with meshes as OBJ files beside it."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np

from rayproof.cases.scene import Cube, Mesh, Scene, Shape, Square, Triangle
from rayproof.cases.scene_json import scene_to_json

NAME = "scene.json"
# Halves are exact in float32, so that the mesh is the shape itself. Counter-clockwise seen from outside.
_CORNERS = np.array([(x, y, z) for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)], dtype=np.float32)
_SIDES = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))
_CUBE_FACES = np.array([half for a, b, c, d in _SIDES for half in ((a, b, c), (a, c, d))], dtype=np.int32)
_SQUARE = np.array([(-0.5, -0.5, 0), (0.5, -0.5, 0), (0.5, 0.5, 0), (-0.5, 0.5, 0)], dtype=np.float32)
_SQUARE_FACES = np.array([(0, 1, 2), (0, 2, 3)], dtype=np.int32)


def hand_over(scene: Scene, folder: Path) -> Path:
    """Write the scene into `folder` and return the path of its JSON."""
    document = scene_to_json(scene)
    for index, (shape, members) in enumerate(zip(scene.shapes, document["shapes"], strict=True)):
        if isinstance(shape, Mesh):
            del members["vertices"], members["faces"]
            members["file"] = f"mesh-{index}.obj"
            (folder / members["file"]).write_text(_obj(shape), encoding="ascii")
    path = folder / NAME
    path.write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")
    return path


def _obj(mesh: Mesh) -> str:
    # Shortest decimals that read back, as float64 or float32, to the very vertex.
    lines = ["v {!r} {!r} {!r}".format(*vertex) for vertex in mesh.vertices.astype(np.float64).tolist()]
    lines += ["f {} {} {}".format(*face) for face in (mesh.faces + 1).tolist()]
    return "\n".join(lines) + "\n"


def triangulated(scene: Scene) -> Scene:
    """Return the scene with cubes, squares and triangles as meshes, which they equal; the other shapes stay."""
    return replace(scene, shapes=tuple(map(_as_mesh, scene.shapes)))


def _as_mesh(shape: Shape) -> Shape:
    if isinstance(shape, Cube):
        vertices, faces = _CORNERS, _CUBE_FACES
    elif isinstance(shape, Square):
        vertices, faces = _SQUARE, _SQUARE_FACES
    elif isinstance(shape, Triangle):
        vertices, faces = np.array(shape.vertices, dtype=np.float32), np.array([(0, 1, 2)], dtype=np.int32)
    else:
        return shape
    return Mesh(albedo=shape.albedo, to_world=shape.to_world, two_sided=shape.two_sided, vertices=vertices, faces=faces)
