"""Scenes in JSON are loaded, saved and validated; a refusal is one line with the file, the field and the value.

The published schema (`schema()`) expresses the same rules as far as JSON Schema can: only this reader refuses a
singular matrix or a near plane beyond the far plane.
"""

import base64
import json
import math
import stat
import zlib
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, fields
from difflib import get_close_matches
from functools import partial
from pathlib import Path
from typing import Any, NoReturn

import numpy as np

from rayproof.cases.foreign_files import LIMITS, Budget
from rayproof.cases.scene import (
    CLIPS,
    IDENTITY,
    SHADINGS,
    Camera,
    Cube,
    Matrix,
    Mesh,
    Plane,
    PointLight,
    Scene,
    SceneError,
    Shape,
    Sphere,
    Square,
    Triangle,
    Vector,
    shown,
)

SHAPES: dict[str, type[Shape]] = {
    "sphere": Sphere,
    "cube": Cube,
    "square": Square,
    "plane": Plane,
    "triangle": Triangle,
    "mesh": Mesh,
}
NAMES: dict[type[Shape], str] = {kind: name for name, kind in SHAPES.items()}
LARGEST = 512 * 2**20  # bytes; beyond this a scene file is a mistake and would fill the memory
PACKED = 1024  # least number of faces for which a run's copy of a mesh is packed: as text it takes 12 times the space
ROW = 12  # bytes of three packed numbers


class Repeated(dict[str, Any]):
    """A JSON object that named a key twice; `key` is the first such."""

    def __init__(self, members: dict[str, Any], key: str) -> None:
        super().__init__(members)
        self.key = key


def object_from(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """Return a JSON object from its pairs, as `object_pairs_hook` of `json.loads`; repeated keys are remembered."""
    members = dict(pairs)
    if len(members) == len(pairs):
        return members
    keys = [key for key, _ in pairs]
    return Repeated(members, next(key for place, key in enumerate(keys) if key in keys[:place]))


@dataclass(frozen=True, kw_only=True)
class Field:
    """A value of a scene file with its path, such as `shapes[2].radius`, and the file's name. Every reader refuses."""

    value: Any
    path: str
    where: str

    def refuse(self, problem: str) -> NoReturn:
        """Raise SceneError that names file, field and problem in one line."""
        raise SceneError(f"{self.where}: {self.path or 'scene'} {problem}")

    def expected(self, what: str) -> NoReturn:
        """Raise SceneError with file, field, expectation and actual value."""
        self.refuse(f"must be {what}, got {shown(self.value)}")

    def members(self, required: Sequence[str], optional: Sequence[str] = ()) -> dict[str, "Field"]:
        """Return an object's members by key; refuse unknown, repeated and missing keys."""
        if not isinstance(self.value, dict):
            self.expected("an object")
        if isinstance(self.value, Repeated):
            self.refuse(f"names the key {shown(self.value.key)} twice")
        for key in self.value:
            if key not in required and key not in optional:
                near = get_close_matches(str(key), [*required, *optional], n=1)
                hint = f"did you mean {near[0]}?" if near else f"known: {', '.join((*required, *optional))}"
                self.refuse(f"has an unknown key {shown(key)}; {hint}")
        for key in required:
            if key not in self.value:
                self.refuse(f"lacks the key {shown(key)}")
        prefix = f"{self.path}." if self.path else ""
        return {key: Field(value=self.value[key], path=f"{prefix}{key}", where=self.where) for key in self.value}

    def items(self) -> Iterator["Field"]:
        """Yield an array's items."""
        if not isinstance(self.value, list):
            self.expected("an array")
        for index, item in enumerate(self.value):
            yield Field(value=item, path=f"{self.path}[{index}]", where=self.where)

    def number(self) -> float:
        """Return a finite number; JSON's true and false are not numbers."""
        if isinstance(self.value, bool) or not isinstance(self.value, (int, float)):
            self.expected("a number")
        try:
            number = float(self.value)
        except OverflowError:
            number = math.inf
        if not math.isfinite(number):
            self.expected("a finite number")
        return number

    def whole(self) -> int:
        """Return a whole number; 64.0 is one, as in JSON Schema."""
        number = self.number()
        if not number.is_integer():
            self.expected("a whole number")
        return int(self.value)

    def flag(self) -> bool:
        """Return true or false."""
        if not isinstance(self.value, bool):
            self.expected("true or false")
        return self.value

    def text(self) -> str:
        """Return a string."""
        if not isinstance(self.value, str):
            self.expected("a string")
        return self.value

    def choice(self, options: Sequence[str]) -> Any:
        """Return a string that is one of the `options`."""
        if not isinstance(self.value, str) or self.value not in options:
            self.expected(f"one of {', '.join(options)}")
        return self.value

    def exactly(self, count: int) -> list["Field"]:
        """Return the items of an array that must have `count` of them."""
        items = list(self.items())
        if len(items) != count:
            self.expected(f"an array of {count}, not of {len(items)}")
        return items

    def vector(self) -> Vector:
        """Return three finite numbers."""
        x, y, z = (item.number() for item in self.exactly(3))
        return (x, y, z)

    def matrix(self) -> Matrix:
        """Return four rows of four finite numbers."""
        rows = []
        for row in self.exactly(4):
            x, y, z, w = (item.number() for item in row.exactly(4))
            rows.append((x, y, z, w))
        first, second, third, last = rows
        return (first, second, third, last)

    def triples(self, *, whole: bool) -> np.ndarray:
        """Return an array of at least one triple of numbers, shape (n, 3), as float64 or int64."""
        rows = [
            [item.whole() if whole else item.number() for item in row.exactly(3)]
            for row in self.items()
        ]  # fmt: skip
        if not rows:
            self.expected("an array of at least one triple")
        try:
            return np.array(rows, dtype=np.int64 if whole else np.float64)
        except OverflowError:
            self.refuse("holds a whole number beyond 64 bits")


def load_scene(path: str | Path) -> Scene:
    """Return the scene in a JSON file; mesh files are relative to its folder.

    Raises:
        SceneError: the file or the scene is wrong; the message is one line.

    """
    path = Path(path)
    where = shown(str(path), 250)[1:-1]
    try:
        facts = path.stat()
        if stat.S_ISDIR(facts.st_mode):
            raise SceneError(f"{where}: is a folder, not a scene file")
        if not stat.S_ISREG(facts.st_mode):
            raise SceneError(f"{where}: is not a regular file")
        if facts.st_size > LARGEST:
            raise SceneError(f"{where}: has {facts.st_size} bytes, more than the {LARGEST} that a scene may have")
        data = path.read_bytes()
    except FileNotFoundError:
        raise SceneError(f"{where}: there is no such file") from None
    except (OSError, ValueError) as error:
        if isinstance(error, SceneError):
            raise
        reason = error.strerror if isinstance(error, OSError) else str(error)
        raise SceneError(f"{where}: cannot be read: {reason}") from None
    return scene_from_bytes(data, folder=path.parent, where=where)


def scene_from_bytes(
    data: bytes, *, folder: Path, where: str, prepared: Callable[[Any], Any] = lambda document: document
) -> Scene:
    """Return the scene in a JSON text; mesh files are relative to `folder`.

    `prepared` converts the document to that of a scene before it is read.

    Raises:
        SceneError: the text is wrong; the message is one line that begins with `where`.

    """
    return scene_from_json(prepared(document_from_bytes(data, where=where)), folder=folder, where=where)


def document_from_bytes(data: bytes, *, where: str) -> Any:
    """Return the content of a JSON text; raise SceneError that begins with `where` if it is none."""
    try:
        text = data.decode("utf-8")
    except UnicodeDecodeError as error:
        raise SceneError(f"{where}: is not UTF-8: {error.reason} at byte {error.start}") from None
    try:
        return json.loads(text, object_pairs_hook=object_from)
    except json.JSONDecodeError as error:
        raise SceneError(f"{where}: is not JSON: {error.msg} at line {error.lineno}, column {error.colno}") from None
    except RecursionError:
        raise SceneError(f"{where}: is nested too deeply") from None
    except ValueError as error:  # a whole number of more than 4300 digits
        raise SceneError(f"{where}: is not JSON that can be read: {str(error).partition(';')[0]}") from None


def save_scene(scene: Scene, path: str | Path, *, packed: int | None = None, named: bool = False) -> None:
    """Write `scene` as JSON with meshes as in `scene_to_json`: by default inline, so that the file needs no other."""
    document = scene_to_json(scene, packed=packed, named=named)
    Path(path).write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")


def scene_to_json(scene: Scene, *, packed: int | None = None, named: bool = False) -> dict[str, Any]:
    """Return the JSON document of `scene`; reading it back gives an equal scene, to the last bit.

    Meshes of `packed` faces or more are packed, a short form for rayproof. If `named`, a mesh from a file is written as
    the name of that file.
    """
    camera, lights = scene.camera, scene.lights
    return {
        "camera": {
            field.name: _plain(getattr(camera, field.name))
            for field in fields(camera)
            if field.name != "sample_offset" or any(camera.sample_offset)
        },
        "shapes": [_shape_to_json(shape, packed, named=named) for shape in scene.shapes],
        "lights": [{"position": _plain(light.position), "flux": _plain(light.flux)} for light in lights],
        "shading": scene.shading,
        "clip": scene.clip,
    }


def _plain(value: Any) -> Any:
    if isinstance(value, np.ndarray):
        return value.tolist()
    return [_plain(item) for item in value] if isinstance(value, tuple) else value


def pack(rows: np.ndarray) -> str:
    """Return rows of three numbers deflated and in base64: float32 or int32, the lowest byte first."""
    return base64.b64encode(zlib.compress(rows.astype("<f4" if rows.dtype.kind == "f" else "<i4").tobytes())).decode()


def unpack(text: str, kind: str) -> np.ndarray:
    """Return the array that `pack` packed; `kind` is "<f4" or "<i4".

    Raises:
        ValueError: the text is not packed, or has more rows than a scene may have; the message is for the user.

    """
    try:
        unpacking = zlib.decompressobj()
        content = unpacking.decompress(base64.b64decode(text, validate=True), ROW * LIMITS["triangles"])
    except (zlib.error, ValueError) as error:
        raise ValueError(f"is no deflated base64: {error}") from None
    if not unpacking.eof or unpacking.unused_data or not content or len(content) % ROW:
        raise ValueError("must unfold to at least one triple, and to whole ones")
    return np.frombuffer(content, kind).reshape(-1, 3)


def _shape_to_json(shape: Shape, packed: int | None, *, named: bool) -> dict[str, Any]:
    members: dict[str, Any] = {"type": NAMES[type(shape)]}
    for field in fields(shape):
        value = getattr(shape, field.name)
        is_default = (field.name == "to_world" and value == IDENTITY) or (field.name == "two_sided" and not value)
        if field.name != "file" and not is_default:
            members[field.name] = _plain(value)
    if isinstance(shape, Mesh) and named and shape.file is not None:
        members["file"] = shape.file
        del members["vertices"], members["faces"]
    elif isinstance(shape, Mesh) and packed is not None and len(shape.faces) >= packed:
        members |= {"vertices": pack(shape.vertices), "faces": pack(shape.faces)}
    return members


def scene_from_json(document: Any, folder: Path | None, where: str) -> Scene:
    """Return the scene in a JSON document; mesh files are looked for in `folder` (None: refused).

    Raises:
        SceneError: the document is no valid scene; one line that begins with `where`.

    """
    if is_lecture_scene(document):
        raise SceneError(f"{where}: is a scene of the lecture (CIS 561); `rayproof import` makes a scene file of it")
    members = Field(value=document, path="", where=where).members(
        ("camera", "shapes"), ("lights", "shading", "clip", "$schema")
    )
    if "$schema" in members:
        members["$schema"].text()
    lights = members["lights"].items() if "lights" in members else ()
    budget = Budget()
    return Scene(
        camera=_camera(members["camera"]),
        shapes=tuple(_shape(shape, folder, budget) for shape in members["shapes"].items()),
        lights=tuple(_light(light) for light in lights),
        shading=members["shading"].choice(SHADINGS) if "shading" in members else "inverse_square",
        clip=members["clip"].choice(CLIPS) if "clip" in members else "depth",
    )


def is_lecture_scene(document: Any) -> bool:
    """Return whether a JSON document is a scene as the lecture's course, CIS 561, writes them."""
    return isinstance(document, dict) and "frames" in document and "shapes" not in document


def _built(field: Field, kind: Callable[..., Any], **values: Any) -> Any:
    try:
        return kind(**values)
    except SceneError as error:
        _refuse_as(field, error)


def _refuse_as(field: Field, error: SceneError) -> NoReturn:
    # The dataclass's message begins with the name of its field.
    raise SceneError(f"{field.where}: {field.path}.{error}") from None


def _camera(field: Field) -> Camera:
    keys = ("eye", "target", "up", "fovy", "width", "height", "near", "far")
    members = field.members(keys, ("sample_offset",))
    values: dict[str, Any] = {name: members[name].vector() for name in ("eye", "target", "up")}
    values.update({name: members[name].number() for name in ("fovy", "near", "far")})
    values.update({name: members[name].whole() for name in ("width", "height")})
    if "sample_offset" in members:
        values["sample_offset"] = tuple(item.number() for item in members["sample_offset"].exactly(2))
    return _built(field, Camera, **values)


def _light(field: Field) -> PointLight:
    members = field.members(("position", "flux"))
    return _built(field, PointLight, position=members["position"].vector(), flux=members["flux"].vector())


def _shape(field: Field, folder: Path | None, budget: Budget) -> Shape:
    if not isinstance(field.value, dict) or "type" not in field.value:
        field.expected('an object with a "type"')
    kind = Field(value=field.value["type"], path=f"{field.path}.type", where=field.where).choice(tuple(SHAPES))
    required, optional = ["type", "albedo"], ["to_world", "two_sided"]
    if kind == "sphere":
        optional += ["center", "radius"]
    elif kind == "triangle":
        required.append("vertices")
    elif kind == "mesh":
        required += ["file"] if "file" in field.value else ["vertices", "faces"]
    members = field.members(required, optional)
    readers: dict[str, Callable[[Field], Any]] = {
        "albedo": Field.vector,
        "to_world": Field.matrix,
        "two_sided": Field.flag,
        "center": Field.vector,
        "radius": Field.number,
        "vertices": _corners if kind == "triangle" else partial(_vertices, budget=budget),
        "faces": partial(_faces, budget=budget),
    }
    values = {name: readers[name](member) for name, member in members.items() if name in readers}
    if "file" in members:
        from rayproof.cases.mesh_files import read_mesh  # whose readers only files of meshes need

        values["file"] = members["file"].text()
        try:
            values["vertices"], values["faces"] = read_mesh(values["file"], folder, budget)
        except SceneError as error:
            _refuse_as(field, error)
    return _built(field, SHAPES[kind], **values)


def _corners(field: Field) -> Any:
    return tuple(corner.vector() for corner in field.exactly(3))


def _unpacked(field: Field, kind: str, budget: Budget) -> np.ndarray:
    try:
        rows = unpack(field.value, kind)
    except ValueError as error:
        field.refuse(str(error))
    budget.spend("triangles", len(rows), by=f"{field.where}: {field.path}")
    return rows


def _vertices(field: Field, budget: Budget) -> np.ndarray:
    return _unpacked(field, "<f4", budget) if isinstance(field.value, str) else field.triples(whole=False)


def _faces(field: Field, budget: Budget) -> np.ndarray:
    faces = _unpacked(field, "<i4", budget) if isinstance(field.value, str) else field.triples(whole=True)
    if faces.min() < 0 or faces.max() > np.iinfo(np.int32).max:  # before the rounding to 32 bits wraps around
        row = int(np.flatnonzero((faces < 0).any(axis=1) | (faces > np.iinfo(np.int32).max).any(axis=1))[0])
        field.refuse(f"must index the vertices, got {faces[row].tolist()} at index {row}")
    return faces
