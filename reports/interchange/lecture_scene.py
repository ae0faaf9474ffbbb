"""Import of scene files of the lecture's course (CIS 561, University of Pennsylvania), in JSON.

A file has frames; only the first is read. It has a camera; primitives of the shapes SquarePlane, Cube (both of side 1,
around the origin), Sphere (radius 1) and Mesh, placed by T Rx Ry Rz S; materials, of which only MatteMaterial has a
counterpart; and lights, of which only PointLight has one. The course's integrators treat surfaces as two-sided, and so
every shape is two-sided.
"""

from collections.abc import Callable, Iterator, Sequence
from math import pi
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from rayproof.cases.foreign_files import Budget, content_of, located
from rayproof.cases.mesh_files import read_mesh
from rayproof.cases.scene import Camera, Cube, Mesh, PointLight, Rgb, Scene, SceneError, Shape, Sphere, Square, shown
from rayproof.cases.scene_json import Field, Repeated, document_from_bytes, is_lecture_scene
from rayproof.reports.interchange import IMPORTERS, Imported, ImportOptions, Size
from rayproof.reports.interchange.framing import camera_for, light_for, matrix, vector

LARGEST = 64 * 2**20  # bytes of a file
GREY: Rgb = (0.5, 0.5, 0.5)
SHAPES: dict[str, type[Shape]] = {"Sphere": Sphere, "Cube": Cube, "SquarePlane": Square}
# Defaults of the course's loader.
FOVY, NEAR, FAR, PIXELS = 45.0, 0.1, 1000.0, 512
COLOURS = ("Kd", "Kr", "Kt")  # of a material; the first is used as the albedo
LENS = "thinlenscamera"
Drop = Callable[[str], None]


@IMPORTERS.register(".json")
def import_lecture_scene(path: Path, options: ImportOptions) -> Imported:
    """Return the first frame of a file of the course.

    Raises:
        SceneError: the file is no such scene, or has a value that the specification refuses.

    """
    where, budget = str(path), Budget()
    try:
        content = content_of(path, largest=LARGEST)
    except OSError as error:
        raise SceneError(f"{where}: cannot be read: {error.strerror}") from None
    except SceneError:
        raise SceneError(f"{where}: has more than the {LARGEST} bytes that such a scene may have") from None
    budget.count_file(path.resolve(), len(content))
    document = document_from_bytes(content, where=where)
    if not is_lecture_scene(document):
        is_scene = isinstance(document, dict) and "shapes" in document
        raise SceneError(
            f"{where}: is a scene file already; `rayproof run` takes it"
            if is_scene
            else f"{where}: is no scene of the lecture (CIS 561), which is an object with frames"
        )
    dropped: dict[str, None] = {}

    def drop(sentence: str) -> None:
        dropped[f"{path.name}: {sentence}"] = None

    frames = list(_members(Field(value=document, path="", where=where), ["frames"], drop)["frames"].items())
    if not frames:
        raise SceneError(f"{where}: frames must be an array of at least one frame, got []")
    if len(frames) > 1:
        drop(f"{len(frames) - 1} of {len(frames)} frames; the first one counts")
    frame = _members(frames[0], ["scene", "frameNumber"], drop)
    if "scene" not in frame:
        frames[0].refuse('lacks the key "scene"')
    members = _members(frame["scene"], ["camera", LENS, "primitives", "lights", "materials"], drop)
    materials = dict(_materials(members, drop))
    primitives = list(members["primitives"].items()) if "primitives" in members else []
    budget.spend("shapes", len(primitives), by=where)
    roots = (path.parent, *options.allowed)
    shapes = tuple(_shapes(primitives, materials, roots, budget, drop))
    lights = tuple(_lights(members, drop))
    camera = _camera(members, options.size, drop) or camera_for(shapes, options.size, up="y")
    if not lights:
        drop("it has no point light; one was made")
        light, dark = light_for(camera, shapes)
        lights = (light,)
        if dark:
            drop(dark)
    return Imported(scene=Scene(camera=camera, shapes=shapes, lights=lights), dropped=tuple(dropped))


def _members(field: Field, read: Sequence[str], drop: Drop, *, of: str = "") -> dict[str, Field]:
    """Return the supported members of an object; report unsupported members that are not empty."""
    if not isinstance(field.value, dict):
        field.expected("an object")
    if isinstance(field.value, Repeated):
        field.refuse(f"names the key {shown(field.value.key)} twice")
    for key, value in field.value.items():
        if key not in read and value not in (None, "", 0, [], {}):
            drop(f"{of or field.path or 'the file'}: its {shown(key)[1:-1]}")
    prefix = f"{field.path}." if field.path else ""
    return {
        key: Field(value=field.value[key], path=f"{prefix}{key}", where=field.where)
        for key in read
        if key in field.value
    }


def _named(field: Field, kind: str) -> str:
    """Return an object's designation in messages: its name if it has one."""
    name = field.value.get("name") if isinstance(field.value, dict) else None
    return f"the {kind} {shown(name)}" if isinstance(name, str) and name else f"the {kind} {field.path}"


def _materials(scene: dict[str, Field], drop: Drop) -> Iterator[tuple[str, Rgb]]:
    for field in scene["materials"].items() if "materials" in scene else ():
        called = _named(field, "material")
        kind = field.value.get("type") if isinstance(field.value, dict) else None
        members = _members(field, ["type", "name", *COLOURS], drop, of=called)
        colour = next((name for name in COLOURS if name in members), None)
        if kind != "MatteMaterial":
            drop(f"{called}: {shown(kind)[1:-1]} is taken as matte{f', by its {colour}' if colour else ' and grey'}")
        for name in COLOURS:
            if name in members and name != colour:
                drop(f"{called}: its {name}")
        if "name" in members:
            yield members["name"].text(), members[colour].vector() if colour else GREY


def _shapes(
    fields: Sequence[Field], materials: dict[str, Rgb], roots: tuple[Path, ...], budget: Budget, drop: Drop
) -> Iterator[Shape]:
    for field in fields:
        called = _named(field, "shape")
        members = _members(field, ["shape", "name", "material", "transform", "filename"], drop, of=called)
        if "shape" not in members:
            field.refuse('lacks the key "shape"')
        kind = members["shape"].text()
        if kind not in SHAPES and kind != "Mesh":
            drop(f"{called}: the shape {shown(kind)[1:-1]}")
            continue
        to_world = _transform(members, drop, of=called)
        if not np.linalg.det(to_world[:3, :3]):
            drop(f"{called}: its scale of 0 leaves nothing of it")
            continue
        material = members["material"].text() if "material" in members else ""
        if material not in materials:
            drop(
                f"{called}: {f'the material {shown(material)} is not there' if material else 'no material'}; it is grey"
            )
        albedo = materials.get(material, GREY)
        try:
            if kind != "Mesh":
                yield SHAPES[kind](albedo=albedo, two_sided=True, to_world=matrix(to_world))
                continue
            name = members["filename"].text() if "filename" in members else ""
            folder, within = located(name, roots[:1], roots, "filename")
            vertices, faces = read_mesh(within, folder, budget)
            file = (folder / within).resolve()
            for note in budget.notes[file]:
                drop(f"{name}: {note}")
            yield Mesh(
                albedo=albedo,
                two_sided=True,
                to_world=matrix(to_world),
                vertices=vertices,
                faces=faces,
                file=str(file),
            )
        except SceneError as error:
            raise SceneError(f"{field.where}: {field.path}: {error}") from None


def _transform(members: dict[str, Field], drop: Drop, *, of: str) -> np.ndarray:
    """Return T Rx Ry Rz S, float64 (4, 4); the identity for a shape without a transform."""
    placed = np.eye(4)
    if "transform" in members:
        parts = _members(members["transform"], ["translate", "rotate", "scale"], drop, of=of)
        translate, rotate, scale = (
            np.array(parts[name].vector() if name in parts else usual)
            for name, usual in (("translate", (0.0,) * 3), ("rotate", (0.0,) * 3), ("scale", (1.0,) * 3))
        )
        placed[:3, :3] = Rotation.from_euler("XYZ", rotate, degrees=True).as_matrix() * scale
        placed[:3, 3] = translate
    return placed


def _lights(scene: dict[str, Field], drop: Drop) -> Iterator[PointLight]:
    """Yield the point lights: lightColor times intensity is the radiant intensity [W/sr], the flux 4 pi times that."""
    for field in scene["lights"].items() if "lights" in scene else ():
        called = _named(field, "light")
        kind = field.value.get("type") if isinstance(field.value, dict) else None
        if kind != "PointLight":
            drop(f"{called}: {shown(kind)[1:-1]}; it neither lights nor is it seen")
            continue
        members = _members(field, ["shape", "type", "name", "lightColor", "intensity", "transform"], drop, of=called)
        color = members["lightColor"].vector() if "lightColor" in members else (1.0, 1.0, 1.0)
        intensity = members["intensity"].number() if "intensity" in members else 1.0
        position = _transform(members, drop, of=called)[:3, 3]
        try:
            yield PointLight(position=vector(position), flux=vector(4 * pi * intensity * np.array(color)))
        except SceneError as error:
            raise SceneError(f"{field.where}: {field.path}: {error}") from None


def _camera(scene: dict[str, Field], size: Size, drop: Drop) -> Camera | None:
    """Return the camera; None, after a call of `drop`, if there is none."""
    field = scene.get("camera") or scene.get(LENS)
    if field is None:
        drop("it has no camera; one was made that shows every shape")
        return None
    read = ["target", "eye", "worldUp", "fov", "width", "height", "nearClip", "farClip"]
    if "camera" not in scene:
        drop("the lens of its camera, which is a pinhole")
        read += ["type", "name", "lensRadius", "focalDistance"]
    members = _members(field, read, drop, of="the camera")
    for name in ("target", "eye", "worldUp"):
        if name not in members:
            field.refuse(f"lacks the key {shown(name)}")
    width, height = (members[name].whole() if name in members else PIXELS for name in ("width", "height"))
    width, height = size or (width, height)
    fovy, near, far = (
        members[name].number() if name in members else usual
        for name, usual in (("fov", FOVY), ("nearClip", NEAR), ("farClip", FAR))
    )
    try:
        return Camera(
            eye=members["eye"].vector(),
            target=members["target"].vector(),
            up=members["worldUp"].vector(),
            fovy=fovy,
            width=width,
            height=height,
            near=near,
            far=far,
        )
    except SceneError as error:
        raise SceneError(f"{field.where}: {field.path}: {error}") from None
