"""`Capabilities`, which a program declares, and the scene that is handed to it (JSON, OBJ); docs/protocol.md.

The scene is JSON of the published schema, with meshes as OBJ files beside it.
"""

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from rayproof.cases.rounding import PRECISIONS
from rayproof.cases.scene import (
    CLIPS,
    SHADINGS,
    Cube,
    Matrix,
    Mesh,
    Scene,
    Shape,
    Square,
    Triangle,
    is_similarity,
    shown,
)
from rayproof.cases.scene_json import NAMES, SHAPES, scene_to_json
from rayproof.cases.stages import IMAGE_STAGES, Stage
from rayproof.reports.results.files import number

ONCE, STAYS = 1, 2  # versions of the protocol: a program is called for each image, or stays alive
OF_STAYS = ("samples", "format")  # keys of the second alone
FORMATS = ("exr", "pfm")
EPSILONS = ("shadow", "ray")
FLAT = ("cube", "square", "triangle", "mesh")  # types of shapes that triangles can stand for
LONGEST_NAME = 80
PIECES = {"mesh": "a mesh of triangles", "triangle": "single triangles"}


@dataclass(frozen=True, kw_only=True)
class Capabilities:
    """What a program declares. Nothing declared means: every scene, and whatever stages it writes."""

    protocol: int = ONCE
    name: str = ""
    version: str = ""
    precision: str = "float32"
    stages: tuple[Stage, ...] | None = None
    shapes: tuple[str, ...] = tuple(SHAPES)
    shading: tuple[str, ...] = SHADINGS
    clip: tuple[str, ...] = CLIPS
    two_sided: bool = True
    affine: bool = True  # stretched, sheared and mirrored shapes
    triangulated: bool = False  # wants cubes, squares and triangles as meshes
    chained: bool = False  # each stage is made of the very numbers written for the stages before it, but for rounding
    world_normals: bool = False  # takes faces' normals from corners that it rounds to float32 in world space
    deterministic: bool = True  # the same scene gives the same image, to the last bit
    samples: bool = False  # of one that stays alive: it averages n x n points itself
    format: str = "exr"  # of one that stays alive: what it writes
    shadow_epsilon: float = 0.0  # m
    ray_epsilon: float = 0.0  # m

    @property
    def title(self) -> str:
        """Return program and version, as far as they are known."""
        return f"{self.name} {self.version}".strip() or "a program that does not say its name"

    def refusal(self, scene: Scene) -> str | None:
        """Return why the program cannot draw the scene, in a sentence, or None."""
        for index, shape in enumerate(scene.shapes):
            kind = NAMES[type(shape)]
            if kind not in self.shapes and kind not in self.stand_ins:
                return f"It draws no {kind}, as shapes[{index}] is."
            if shape.two_sided and not self.two_sided:
                return f"It has no two-sided surfaces, as shapes[{index}] has."
            if not self.affine and not (is_similarity(shape.to_world) and _keeps_hands(shape.to_world)):
                return f"It cannot stretch, shear or mirror, as shapes[{index}] is."
        if scene.shading not in self.shading:
            return f"It has no {scene.shading} light."
        return None if scene.clip in self.clip else f"It does not clip by {scene.clip}."

    @property
    def stand_ins(self) -> Mapping[str, str]:
        """Return what it is handed, "mesh" or "triangle", for each type that it does not draw, or not as such."""
        found = {}
        for kind in FLAT:
            if "mesh" in self.shapes and kind != "mesh" and (self.triangulated or kind not in self.shapes):
                found[kind] = "mesh"
            elif "triangle" in self.shapes and kind not in self.shapes:
                found[kind] = "triangle"
        return found

    def under_its_light(self, scene: Scene) -> Scene:
        """Return the scene under a model of light that it has: its own, or else the one that the program has."""
        return scene if scene.shading in self.shading else replace(scene, shading=self.shading[0])  # type: ignore[arg-type]

    def told(self, scene: Scene) -> tuple[str, ...]:
        """Return in sentences what of a scene is handed over as something else."""
        kinds = [kind for kind in self.stand_ins if any(NAMES[type(shape)] == kind for shape in scene.shapes)]
        whole = "since the program asks for it" if self.triangulated else "since the program does not draw it"
        return tuple(f"Each {kind} is handed over as {PIECES[self.stand_ins[kind]]}, {whole}." for kind in kinds)


def _keeps_hands(matrix: Matrix) -> bool:
    """Say whether a matrix does not mirror."""
    return bool(np.linalg.det(np.asarray(matrix)[:3, :3]) > 0)


def capabilities_from(text: str) -> Capabilities | None:
    """Return what an answer declares, or None if it is no JSON object: a program need not know the question.

    Raises:
        ValueError: it is an object, but not the one that the protocol asks for; one line names the key.

    """
    try:
        declared = json.loads(text)
    except (ValueError, RecursionError):
        return None
    return capabilities_of(declared, ONCE) if isinstance(declared, dict) else None


def capabilities_of(declared: Mapping[str, Any], protocol: int) -> Capabilities:
    """Return what an object declares by a version of the protocol; raise ValueError, whose one line names the key."""
    known = {field.name for field in fields(Capabilities)} - {"shadow_epsilon", "ray_epsilon"} | {"epsilons"}
    known -= set(OF_STAYS) if protocol == ONCE else set()
    if unknown := sorted(set(declared) - known):
        raise ValueError(f"{unknown[0]!r} is not known; known: {', '.join(sorted(known))}")
    if declared.get("protocol") != protocol:
        raise ValueError(f"protocol must be {protocol}, got {declared.get('protocol')!r}")
    found = Capabilities(protocol=protocol)
    for name, known_names in (("shapes", tuple(SHAPES)), ("shading", SHADINGS), ("clip", CLIPS)):
        if name in declared:
            found = replace(found, **{name: _names(name, declared[name], known_names)})
    if "stages" in declared:
        found = replace(found, stages=tuple(map(Stage, _names("stages", declared["stages"], IMAGE_STAGES))))
    for name, known_names in (("precision", PRECISIONS), ("format", FORMATS)):
        if name in declared:
            found = replace(found, **{name: _names(name, [declared[name]], known_names)[0]})
    for name in ("name", "version"):
        if name in declared:
            found = replace(found, **{name: _text(name, declared[name])})
    for name in ("two_sided", "affine", "triangulated", "chained", "world_normals", "deterministic", "samples"):
        if name in declared:
            if not isinstance(declared[name], bool):
                raise ValueError(f"{name} must be true or false, got {declared[name]!r}")
            found = replace(found, **{name: declared[name]})
    return replace(found, **_epsilons(declared.get("epsilons", {})))


def _names(name: str, given: Any, known: tuple[str, ...]) -> tuple[str, ...]:
    if not isinstance(given, list) or not given or not all(isinstance(one, str) for one in given):
        raise ValueError(f"{name} must be a list of names, got {given!r}")
    for one in given:
        if one not in known:
            raise ValueError(f"{name}: {one!r} is not known; known: {', '.join(known)}")
    return tuple(given)


def _text(name: str, given: Any) -> str:
    if not isinstance(given, str) or not given.isprintable() or len(given) > LONGEST_NAME:
        raise ValueError(f"{name} must be at most {LONGEST_NAME} printable characters, got {str(given)[:40]!r}")
    return given


def _epsilons(given: Any) -> dict[str, float]:
    if not isinstance(given, Mapping) or not set(given) <= set(EPSILONS):
        raise ValueError(f"epsilons must be an object with {' and '.join(EPSILONS)}, got {given!r}")
    for name, value in given.items():
        length = None if isinstance(value, str) else number(value)  # JSON's whole numbers have no end
        if length is None or not math.isfinite(length) or length < 0:
            raise ValueError(f"epsilons.{name} must be a length >= 0 m, got {shown(value)}")
    return {f"{name}_epsilon": float(value) for name, value in given.items()}


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
