"""The scene as a program gets it: JSON of the published schema, with meshes as OBJ files beside it."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from rayproof.cases.scene import Cube, Mesh, Scene, Shape, Square, Triangle
from rayproof.cases.scene_json import NAMES, scene_to_json
from rayproof.cases.stages import Stage

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


@dataclass(frozen=True, kw_only=True)
class Rebuilt:
    """A scene with meshes or triangles in place of other shapes, which they equal, and what each of its shapes is."""

    scene: Scene
    shapes: np.ndarray  # (shapes of `scene`,): the shape of the original
    faces: np.ndarray  # likewise: the face of the original's mesh; -1 where the mesh is handed over itself

    def named_as_asked(self, images: Mapping[Stage, np.ndarray]) -> dict[Stage, np.ndarray]:
        """Return a program's images with the shapes and faces of the original; a shape that is none stays none."""
        if Stage.OBJECT not in images:
            return dict(images)
        objects = images[Stage.OBJECT].copy()
        written = objects[..., 0]
        known = (written >= 0) & (written < len(self.shapes)) & (written == np.floor(written))
        pieces = written[known].astype(int)
        faces = self.faces[pieces]
        objects[known] = np.stack([self.shapes[pieces], np.where(faces < 0, objects[known, 1], faces)], axis=-1)
        return dict(images) | {Stage.OBJECT: objects}


def rebuilt(scene: Scene, stand_ins: Mapping[str, str]) -> Rebuilt:
    """Return the scene with a "mesh", or a "triangle" for each face, in place of shapes of the types given."""
    shapes: list[Shape] = []
    owners, numbers = [], []
    for index, shape in enumerate(scene.shapes):
        instead = stand_ins.get(NAMES[type(shape)])
        pieces = [shape] if instead is None else [_as_mesh(shape)] if instead == "mesh" else _as_triangles(shape)
        mesh = isinstance(shape, Mesh)
        shapes += pieces
        owners += [index] * len(pieces)
        numbers += ([-1] if instead is None else range(len(pieces))) if mesh else [0 if instead else -1] * len(pieces)
    return Rebuilt(scene=replace(scene, shapes=tuple(shapes)), shapes=np.array(owners), faces=np.array(numbers))


def _as_triangles(shape: Shape) -> Sequence[Shape]:
    mesh = _as_mesh(shape)
    assert isinstance(mesh, Mesh)
    corners = mesh.vertices[mesh.faces].astype(np.float64).tolist()
    about = {"albedo": mesh.albedo, "to_world": mesh.to_world, "two_sided": mesh.two_sided}
    return [Triangle(**about, vertices=(tuple(p), tuple(q), tuple(r))) for p, q, r in corners]


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
