"""Mitsuba 3 XML (https://mitsuba.readthedocs.io, "Scene XML file format"): parsed by Mitsuba's own parser.

Perspective sensors; spheres, cubes, rectangles, OBJ and PLY meshes, instances of groups of them; diffuse and two-sided
materials; point lights. A disk whose id begins with "infinite-plane" stands for a plane. Whatever else a file holds is
left out or replaced, and told.
"""

from collections.abc import Callable, Iterator
from math import atan, degrees, hypot, pi, radians, tan
from pathlib import Path
from typing import Any, TypedDict

import numpy as np

from rayproof.cases.mesh_files import read_mesh
from rayproof.cases.scene import Camera, Cube, Mesh, Plane, PointLight, Rgb, Scene, SceneError, Shape, Sphere, Square
from rayproof.reports.interchange import IMPORTERS, Imported, ImportOptions, Size
from rayproof.reports.interchange.framing import camera_for, light_for, matrix, vector
from rayproof.reports.interchange.mitsuba_document import Element, Spectrum, read_tree

PLANE = "infinite-plane"  # how the id of a disk begins that stands for a plane


PINHOLES = ("perspective", "thinlens")
# What renders a scene and is no part of it; a film is the sensor's.
OF_THE_RENDERER = ("Integrator", "Sampler", "ReconstructionFilter")


def lights_of(scene: Element, drop: Callable[[str], None]) -> Iterator[PointLight]:
    """Yield the point lights of a scene; every other emitter is dropped, and told.

    Mitsuba gives intensity I [W/sr] per channel; the flux is 4 pi I [W].

    Raises:
        SceneError: a light is one that the specification refuses.

    """
    for _, emitter in scene.children("Emitter"):
        if emitter.plugin != "point":
            drop(f"{emitter.place}: the {emitter.plugin} light")
            continue
        where = emitter.get("position", None)
        position = emitter.matrix()[:3, 3] if where is None else np.asarray(where, dtype=np.float64)
        if any(name == "intensity" for name, _ in emitter.children()):
            drop(f"{emitter.place}: the light's texture; its intensity is 1")
            intensity = (1.0, 1.0, 1.0)
        else:
            intensity = rgb(emitter.get("intensity", 1.0), f"{emitter.place}: intensity", drop)
        try:
            yield PointLight(position=vector(position), flux=vector(4 * pi * np.asarray(intensity)))
        except SceneError as error:
            raise SceneError(f"{emitter.place}: {error}") from None


@IMPORTERS.register(".xml")
def import_mitsuba(path: Path, options: ImportOptions) -> Imported:
    """Return the scene in a Mitsuba XML file; direct light only, whatever its integrator would add.

    Raises:
        SceneError: the file cannot be understood, or holds what the specification refuses.

    """
    try:
        return _scene(path, options)
    except SceneError:
        raise
    except (TypeError, AttributeError, KeyError, ValueError, OverflowError) as error:
        # Properties of other types than the plug-ins': Mitsuba's parser leaves that to them.
        raise SceneError(f"{path}: is no scene for Mitsuba: {' '.join(str(error).split())}") from None


def _scene(path: Path, options: ImportOptions) -> Imported:
    try:
        root = read_tree(path, options.allowed)
        root.budget.spend("shapes", count_shapes(root), by="it with its instances")
    except SceneError as error:
        raise SceneError(f"{path}: {error}") from None
    if root.kind != "Scene":
        raise SceneError(f"{path}: must hold a scene, got a {root.kind.lower()}")
    dropped: dict[str, None] = {}

    def drop(sentence: str) -> None:
        dropped[sentence] = None

    try:
        shapes = tuple(shapes_of(root, path.parent, drop))
    except SceneError as error:
        raise SceneError(f"{path}: {error}") from None
    sensors = [sensor for _, sensor in root.children("Sensor")]
    usable = [sensor for sensor in sensors if sensor.plugin in PINHOLES]
    for sensor in sensors:
        if not usable or sensor is not usable[0]:
            drop(f"{sensor.place}: the sensor {sensor.plugin}{'; the first one counts' if usable else ''}")
    if not usable:
        drop(f"{path.name}: it has no perspective sensor; a camera was made that shows every shape")
    camera = camera_of(usable[0], options.size, drop) if usable else camera_for(shapes, options.size, up="y")
    lights = tuple(lights_of(root, drop))
    if not lights:
        drop(f"{path.name}: it has no point light; one was made")
        light, dark = light_for(camera, shapes)
        lights = (light,)
        if dark:
            drop(f"{path.name}: {dark}")
    for name, child in root.children():
        if child.kind == "Integrator" and child.plugin != "direct":
            drop(f"{child.place}: the integrator {child.plugin}; direct light is all that is computed")
        elif child.kind not in ("Shape", "Sensor", "Emitter", "BSDF", "Texture", *OF_THE_RENDERER):
            drop(f"{child.place}: the {child.kind.lower()} {child.plugin} ({name})")
    for element in root.everything():
        if element.kind not in ("Scene", "Film", *OF_THE_RENDERER):
            for name in element.unread():
                drop(f"{element.place}: the {name} of the {element.plugin}")
    return Imported(scene=Scene(camera=camera, shapes=shapes, lights=lights), dropped=tuple(dropped))


# Mitsuba's shapes as the specification's: its cube and rectangle reach from -1 to 1, instances repeat a group.


Drop = Callable[[str], None]
TWICE = np.diag([2.0, 2.0, 2.0, 1.0])
TURNED = np.diag([1.0, 1.0, -1.0, 1.0])  # under the inverse transpose a square's normal turns around


class Surface(TypedDict):
    """What a shape of any kind has beside its geometry."""

    albedo: Rgb
    two_sided: bool


def count_shapes(element: Element, counts: dict[int, int] | None = None, depth: int = 0) -> int:
    """Return how many shapes a scene or group comes to, its instances unfolded, before any is built.

    Raises:
        SceneError: they are more than are read, or nested too deeply.

    """
    counts = {} if counts is None else counts
    element.budget.go_down(depth, by=element.place)
    if id(element) not in counts:
        total = 0
        for _, child in element.children("Shape"):
            if child.plugin == "instance":
                total += sum(count_shapes(group, counts, depth + 1) for _, group in child.children("Shape"))
            elif child.plugin == "merge":
                total += count_shapes(child, counts, depth + 1)
            elif child.plugin != "shapegroup":
                total += 1
        counts[id(element)] = total
    return counts[id(element)]


def shapes_of(element: Element, folder: Path, drop: Drop, outer: np.ndarray | None = None) -> Iterator[Shape]:
    """Yield the shapes of a scene or group, the members of its groups placed wherever they are instanced.

    Raises:
        SceneError: a shape is one that the specification refuses, or its mesh file cannot be read.

    """
    outer = np.eye(4) if outer is None else outer
    for _, child in element.children("Shape"):
        if child.plugin == "shapegroup":
            continue  # seen only where an instance says so
        if child.plugin == "merge":
            yield from shapes_of(child, folder, drop, outer)
        elif child.plugin == "instance" and element.plugin == "shapegroup":
            drop(f"{child.place}: the instance within a group, which Mitsuba does not draw either")
        elif child.plugin == "instance":
            for _, group in child.children("Shape"):
                yield from shapes_of(group, folder, drop, outer @ child.matrix())
        elif (shape := _shape(child, folder, drop, outer @ child.matrix())) is not None:
            yield shape


def _shape(element: Element, folder: Path, drop: Drop, to_world: np.ndarray) -> Shape | None:
    known = {
        "disk": _plane,
        "sphere": _sphere,
        "cube": _cube,
        "rectangle": _rectangle,
        "obj": _mesh,
        "ply": _mesh,
        "stl": _mesh,
    }
    if element.plugin not in known or (element.plugin == "disk" and not element.id.startswith(PLANE)):
        drop(f"{element.place}: the shape {element.plugin}")
        return None
    for _, emitter in element.children("Emitter"):
        drop(f"{emitter.place}: the {emitter.plugin} light of the shape; it neither lights nor shines")
    albedo, two_sided = material_of(element, drop)
    try:
        return known[element.plugin](element, folder, drop, to_world, {"albedo": albedo, "two_sided": two_sided})
    except SceneError as error:
        raise SceneError(f"{element.place}: {error}") from None


def _flipped(element: Element, surface: Surface) -> bool:
    # Both sides look alike on a two-sided shape.
    return bool(element.get("flip_normals", False)) and not surface["two_sided"]


def _sphere(element: Element, folder: Path, drop: Drop, to_world: np.ndarray, surface: Surface) -> Shape:
    center = vector(element.get("center", (0.0, 0.0, 0.0)))
    if _flipped(element, surface):
        drop(f"{element.place}: flip_normals; the sphere faces outward")
    return Sphere(center=center, radius=float(element.get("radius", 1.0)), to_world=matrix(to_world), **surface)


def _cube(element: Element, folder: Path, drop: Drop, to_world: np.ndarray, surface: Surface) -> Shape:
    if _flipped(element, surface):
        drop(f"{element.place}: flip_normals; the cube faces outward")
    return Cube(to_world=matrix(to_world @ TWICE), **surface)


def _rectangle(element: Element, folder: Path, drop: Drop, to_world: np.ndarray, surface: Surface) -> Shape:
    turned = TURNED if _flipped(element, surface) else np.eye(4)
    return Square(to_world=matrix(to_world @ TWICE @ turned), **surface)


def _plane(element: Element, folder: Path, drop: Drop, to_world: np.ndarray, surface: Surface) -> Shape:
    return Plane(to_world=matrix(to_world), **surface)


def _folder_of(name: str, element: Element) -> Path:
    """Return the first folder in which a file may lie that has it; the scene's own if none does."""
    try:
        return next((folder for folder in element.folders if (folder / name).is_file()), element.folders[0])
    except (OSError, ValueError):  # too long a name, say: whoever reads it says so
        return element.folders[0]


def _mesh(element: Element, folder: Path, drop: Drop, to_world: np.ndarray, surface: Surface) -> Shape:
    name = str(element.get("filename", ""))
    vertices, faces = read_mesh(name, _folder_of(name, element), element.budget)
    if not element.get("face_normals", False):
        drop(f"{element.place}: vertex normals, if {element.get('filename', '')} has any; the mesh is shaded by faces")
    if _flipped(element, surface):
        faces = faces[:, ::-1]
    return Mesh(vertices=vertices, faces=faces, to_world=matrix(to_world), **surface)


# Mitsuba's materials as an albedo and a flag: diffuse ones exactly, all others by the diffuse part that they have.


GREY: Rgb = (0.5, 0.5, 0.5)  # Mitsuba's own default
# Linear sRGB of the equal-energy spectrum, X = Y = Z = 1: the row sums of the matrix from XYZ (IEC 61966-2-1).
EQUAL_ENERGY = (1.2047843, 0.9483008, 0.9088427)


def material_of(shape: Element, drop: Callable[[str], None]) -> tuple[Rgb, bool]:
    """Return the albedo of a shape's material and whether both of its sides are seen."""
    material = next((child for _, child in shape.children("BSDF")), None)
    if material is None:
        return GREY, False
    two_sided = False
    while material.plugin == "twosided":
        two_sided = True
        sides = [child for _, child in material.children("BSDF")]
        if len(sides) != 1:
            drop(f"{material.place}: the second of {len(sides)} sides; both get the first one's material")
        if not sides:
            return GREY, True
        material = sides[0]
    if material.plugin == "diffuse":
        return _reflectance(material, "reflectance", drop), two_sided
    name = next((name for name in ("diffuse_reflectance", "base_color", "reflectance") if material.has(name)), None)
    drop(f"{material.place}: {material.plugin} is taken as diffuse{f', by its {name}' if name else ' and grey'}")
    return (_reflectance(material, name, drop) if name else GREY), two_sided


def _reflectance(material: Element, name: str, drop: Callable[[str], None]) -> Rgb:
    if not material.has(name):
        return GREY
    texture = next((child for known, child in material.children() if known == name), None)
    if texture is not None:
        drop(f"{texture.place}: the texture; the albedo is 0.5")
        return GREY
    return rgb(material.get(name, GREY), f"{material.place}: {name}", drop, white=(1.0, 1.0, 1.0))


def rgb(value: Any, place: str, drop: Callable[[str], None], *, white: Rgb = EQUAL_ENERGY) -> Rgb:
    """Return a colour property as linear RGB; `white` is what a uniform spectrum of 1 looks like in its role."""
    if isinstance(value, Spectrum):
        level = float(np.mean(value.values))
        if not value.uniform:
            drop(f"{place}: the spectrum; its mean {level:g} is taken at all wavelengths")
        return (level * white[0], level * white[1], level * white[2])
    return vector(np.broadcast_to(np.asarray(value, dtype=np.float64), 3))


# Mitsuba's perspective sensor as the specification's camera.
#
# Its camera looks along +z with y up and x to the *left*; `fov` is measured along `fov_axis`, by default the
# horizontal one; `focal_length` is that of a 35 mm film (36 x 24 mm), by its diagonal.


FILM = (768, 576)  # px; Mitsuba's default
FOCAL_LENGTH = "50mm"
ORTHOGONAL = 1e-9  # cosine; matrices are written with more digits than this


def camera_of(sensor: Element, size: Size, drop: Callable[[str], None]) -> Camera:
    """Return the camera of a perspective (or, its aperture dropped, thin-lens) sensor.

    Raises:
        SceneError: its `to_world` shears, or a value is one that the specification refuses.

    """
    if sensor.plugin == "thinlens":
        drop(f"{sensor.place}: the lens of {sensor.get('aperture_radius', 0)} m; the camera is a pinhole")
    film = next((child for _, child in sensor.children("Film")), None)
    width, height = (
        (int(film.get(name, usual)) for name, usual in zip(("width", "height"), FILM, strict=True)) if film else FILM
    )
    if film is not None and min(width, height) < 1:
        raise SceneError(f"{film.place}: a film must have at least 1 x 1 px, got {width} x {height}")
    if film is not None and any(film.get(f"crop_{name}", 0) for name in ("width", "height", "offset_x", "offset_y")):
        drop(f"{film.place}: the crop window; the whole film is rendered")
    if any(sensor.get(f"principal_point_offset_{axis}", 0) for axis in "xy"):
        drop(f"{sensor.place}: the principal point's offset")
    fovy = _fovy(sensor, width, height)
    width, height = size or (width, height)
    matrix = sensor.matrix()
    axes = matrix[:3, :3] / np.linalg.norm(matrix[:3, :3], axis=0)
    if not np.allclose(axes.T @ axes, np.eye(3), rtol=0, atol=ORTHOGONAL):
        raise SceneError(f"{sensor.place}: the sensor's to_world shears, which no camera of the specification does")
    if np.linalg.det(axes) < 0:
        drop(f"{sensor.place}: the sensor's to_world mirrors the image; this camera does not")
    eye, forward, up = matrix[:3, 3], axes[:, 2], axes[:, 1]
    try:
        return Camera(
            eye=vector(eye),
            target=vector(eye + forward),
            up=vector(up),
            fovy=fovy,
            width=width,
            height=height,
            near=float(sensor.get("near_clip", 1e-2)),
            far=float(sensor.get("far_clip", 1e4)),
        )
    except SceneError as error:
        raise SceneError(f"{sensor.place}: {error}") from None


def _fovy(sensor: Element, width: int, height: int) -> float:
    """Return the full vertical angle [degrees]."""
    if (angle := sensor.get("fov", None)) is not None:
        axis = str(sensor.get("fov_axis", "x"))
        if not 0 < float(angle) < 180:
            raise SceneError(f"{sensor.place}: fov must lie inside (0, 180), got {angle} degrees")
        half = tan(radians(float(angle)) / 2)
    else:
        text = str(sensor.get("focal_length", FOCAL_LENGTH))
        try:
            focal = float(text.removesuffix("mm"))
        except ValueError:
            focal = 0.0
        if not focal > 0:
            raise SceneError(f"{sensor.place}: focal_length must be a length in mm, got {text!r}")
        axis, half = "diagonal", hypot(36.0, 24.0) / 2 / focal
    extents = {
        "x": width,
        "y": height,
        "diagonal": hypot(width, height),
        "smaller": min(width, height),
        "larger": max(width, height),
    }
    if axis not in extents:
        raise SceneError(f"{sensor.place}: fov_axis must be one of {', '.join(extents)}, got {axis!r}")
    return 2 * degrees(atan(half * height / extents[axis]))
