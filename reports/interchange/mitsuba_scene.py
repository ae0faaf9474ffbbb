"""Conversion of a tree of Mitsuba elements to a scene: sensors, shapes, materials, point lights (Mitsuba 3 XML).

Supported are perspective sensors; spheres, cubes, rectangles, disks, OBJ and PLY meshes, instances of groups of them;
diffuse and two-sided materials and their wrappers; point lights. A disk whose id begins with "infinite-plane"
represents a plane. Everything else in a file is left out or replaced, and reported.
"""

from collections.abc import Callable, Iterator
from math import atan, cos, degrees, hypot, pi, radians, tan
from pathlib import Path
from typing import TypedDict

import numpy as np
import trimesh

from rayproof.cases.foreign_files import located
from rayproof.cases.mesh_files import read_mesh
from rayproof.cases.scene import Camera, Cube, Mesh, Plane, PointLight, Rgb, Scene, SceneError, Shape, Sphere, Square
from rayproof.reports.interchange import IMPORTERS, Imported, ImportOptions, Size
from rayproof.reports.interchange.framing import camera_for, light_for, matrix, vector
from rayproof.reports.interchange.meshes import has_normals
from rayproof.reports.interchange.mitsuba_document import COLOURS, Element, Spectrum, read_tree

PLANE = "infinite-plane"  # prefix of the id of a disk that represents a plane


PINHOLES = ("perspective", "thinlens")
# Elements of the renderer, which are not part of the scene; a film belongs to the sensor.
OF_THE_RENDERER = ("Integrator", "Sampler", "ReconstructionFilter")


def lights_of(scene: Element, drop: Callable[[str], None]) -> Iterator[PointLight]:
    """Yield the point lights of a scene; every other emitter is dropped with a sentence.

    Mitsuba gives intensity I [W/sr] per channel; the flux is 4 pi I [W].

    Raises:
        SceneError: the specification refuses a light.

    """
    for _, emitter in scene.children("Emitter"):
        if emitter.plugin != "point":
            drop(f"{emitter.place}: the {emitter.plugin} light")
            continue
        position = emitter.three("position", (0.0, 0.0, 0.0)) if emitter.has("position") else emitter.matrix()[:3, 3]
        intensity = colour(emitter, "intensity", light=True)
        if intensity is None:
            drop(f"{emitter.place}: the light's texture; its intensity is 1")
            intensity = (1.0, 1.0, 1.0)
        try:
            yield PointLight(position=vector(position), flux=vector(4 * pi * np.asarray(intensity)))
        except SceneError as error:
            raise SceneError(f"{emitter.place}: {error}") from None


@IMPORTERS.register(".xml")
def import_mitsuba(path: Path, options: ImportOptions) -> Imported:
    """Return the scene in a Mitsuba XML file; direct light only, whatever its integrator would add.

    Raises:
        SceneError: the file is malformed, or has a value that the specification refuses.

    """
    try:
        return _scene(path, options)
    except SceneError:
        raise
    except (TypeError, AttributeError, KeyError, ValueError, OverflowError):
        # Mitsuba's parser leaves the types of properties to the plug-ins. `Element` checks those that are read.
        raise SceneError(
            f"{path}: is no scene for Mitsuba: a property is of another type than its plug-in reads"
        ) from None


def _scene(path: Path, options: ImportOptions) -> Imported:
    try:
        root = read_tree(path, options.allowed, options.parameters)
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
SIMILAR = 1e-9  # of a sphere's matrix: matrices are written with more digits than this
DISK_CORNERS = 256
SUBDIVISIONS = 5  # of an icosahedron, to 20 480 triangles
TURNED = np.diag([1.0, 1.0, -1.0, 1.0])  # under the inverse transpose a square's normal turns around


class SurfaceProperties(TypedDict):
    """The properties of a shape of any kind other than its geometry."""

    albedo: Rgb
    two_sided: bool


def count_shapes(element: Element, counts: dict[int, int] | None = None, depth: int = 0) -> int:
    """Return the number of shapes in a scene or group with its instances expanded, before any is built.

    Raises:
        SceneError: there are more shapes than the limit, or they are nested too deeply.

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
    """Yield the shapes of a scene or group; the members of a group once for each of its instances.

    Raises:
        SceneError: the specification refuses a shape, or its mesh file cannot be read.

    """
    outer = np.eye(4) if outer is None else outer
    for _, child in element.children("Shape"):
        if child.plugin == "shapegroup":
            continue  # visible only through an instance
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
    surface = {
        "disk": _plane if element.id.startswith(PLANE) else _disk,
        "sphere": _sphere,
        "cube": _cube,
        "rectangle": _rectangle,
        "obj": _mesh,
        "ply": _mesh,
        "stl": _mesh,
    }
    if element.plugin not in surface:
        drop(f"{element.place}: the shape {element.plugin}")
        return None
    for _, emitter in element.children("Emitter"):
        drop(f"{emitter.place}: the {emitter.plugin} light of the shape; it neither lights nor shines")
    albedo, two_sided = material_of(element, drop)
    try:
        return surface[element.plugin](element, folder, drop, to_world, {"albedo": albedo, "two_sided": two_sided})
    except SceneError as error:
        if str(error).startswith(element.place):
            raise
        raise SceneError(f"{element.place}: {error}") from None


# The visible side of a one-sided shape in Mitsuba 3.9. `flip_normals` turns all shapes. A mirroring `to_world` of the
# shape itself turns spheres, and meshes whose normals follow from the winding in the world, but not cubes, rectangles,
# disks and meshes with vertex normals; that of an instance turns nothing. The specification's mirrors turn nothing.


def _flipped(element: Element, surface: SurfaceProperties, *, mirrors: bool = False) -> bool:
    mirrored = mirrors and bool(np.linalg.det(element.matrix()[:3, :3]) < 0)
    # Both sides look alike on a two-sided shape.
    return (element.flag("flip_normals") != mirrored) and not surface["two_sided"]


def _sphere(element: Element, folder: Path, drop: Drop, to_world: np.ndarray, surface: SurfaceProperties) -> Shape:
    center, radius = vector(element.three("center", (0.0, 0.0, 0.0))), element.number("radius", 1.0)
    own = element.matrix()
    lengths = np.linalg.norm(own[:3, :3], axis=0)
    if not np.allclose(
        own[:3, :3].T @ own[:3, :3], lengths[0] ** 2 * np.eye(3), rtol=0, atol=SIMILAR * lengths[0] ** 2
    ):
        # Mitsuba places the centre and stretches the radius as the matrix does x. An instance around it stretches all.
        drop(f"{element.place}: the stretching of the sphere by its own to_world, which Mitsuba leaves out, too")
        around = to_world @ np.linalg.inv(own)
        center, radius = vector((own @ (*center, 1.0))[:3]), radius * float(lengths[0])
        to_world = around
    if not _flipped(element, surface, mirrors=True):
        return Sphere(center=center, radius=radius, to_world=matrix(to_world), **surface)
    ball = trimesh.creation.icosphere(subdivisions=SUBDIVISIONS, radius=1.0)
    planes = np.einsum("ij,ij->i", ball.face_normals, ball.triangles[:, 0])
    error = radius * (1 - float(planes.min()))
    drop(
        f"{element.place}: the roundness of the sphere, whose one side faces inward; it is a mesh of {len(ball.faces)} "
        f"triangles, which lie up to {error:.2g} m inside of it before to_world"
    )
    element.budget.spend("triangles", len(ball.faces), by=element.place)
    vertices = np.asarray(ball.vertices) * radius + center
    return Mesh(vertices=vertices, faces=ball.faces[:, ::-1], to_world=matrix(to_world), **surface)


def _cube(element: Element, folder: Path, drop: Drop, to_world: np.ndarray, surface: SurfaceProperties) -> Shape:
    if not _flipped(element, surface):
        return Cube(to_world=matrix(to_world @ TWICE), **surface)
    box = trimesh.creation.box((2.0, 2.0, 2.0))  # the same as a mesh, which can face inward
    return Mesh(vertices=box.vertices, faces=box.faces[:, ::-1], to_world=matrix(to_world), **surface)


def _rectangle(element: Element, folder: Path, drop: Drop, to_world: np.ndarray, surface: SurfaceProperties) -> Shape:
    turned = TURNED if _flipped(element, surface) else np.eye(4)
    return Square(to_world=matrix(to_world @ TWICE @ turned), **surface)


def _disk(element: Element, folder: Path, drop: Drop, to_world: np.ndarray, surface: SurfaceProperties) -> Shape:
    angles = np.arange(DISK_CORNERS) * (2 * pi / DISK_CORNERS)
    vertices = np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=1)
    inner = np.arange(1, DISK_CORNERS - 1)
    faces = np.stack([0 * inner, inner, inner + 1], axis=1)
    drop(
        f"{element.place}: the roundness of the disk; it is a mesh of {len(faces)} triangles, whose edge lies up to "
        f"{1 - cos(pi / DISK_CORNERS):.2g} of the radius inside of it"
    )
    faces = faces[:, ::-1] if _flipped(element, surface) else faces
    return Mesh(vertices=vertices, faces=faces, to_world=matrix(to_world), **surface)


def _plane(element: Element, folder: Path, drop: Drop, to_world: np.ndarray, surface: SurfaceProperties) -> Shape:
    return Plane(to_world=matrix(to_world), **surface)


def _mesh(element: Element, folder: Path, drop: Drop, to_world: np.ndarray, surface: SurfaceProperties) -> Shape:
    name = element.text("filename", "")
    where, within = located(name, element.folders, (element.folders[0], *element.allowed), "file")
    vertices, faces = read_mesh(within, where, element.budget)
    path = (where / within).resolve()
    for note in element.budget.notes[path]:
        drop(f"{name}: {note}")
    by_winding = element.flag("face_normals") or not has_normals(path)
    if not element.flag("face_normals"):
        whose = "that Mitsuba makes up" if by_winding else f"of {name}"
        drop(f"{element.place}: the vertex normals {whose}; the mesh is shaded by faces")
    if not _flipped(element, surface, mirrors=by_winding):
        return Mesh(vertices=vertices, faces=faces, to_world=matrix(to_world), file=str(path), **surface)
    return Mesh(vertices=vertices, faces=faces[:, ::-1], to_world=matrix(to_world), **surface)


# Mitsuba's materials as an albedo and a flag: diffuse ones exactly, all others by the diffuse part that they have.


GREY: Rgb = (0.5, 0.5, 0.5)  # Mitsuba's own default
# Materials that wrap another one, and the effect of each that is left out.
WRAPPERS = {
    "twosided": "",
    "mask": "the opacity of the mask; the surface is opaque",
    "bumpmap": "the bumps of the bumpmap; the surface is smooth",
    "normalmap": "the normals of the normalmap; the surface is smooth",
}
# Linear sRGB of the equal-energy spectrum, X = Y = Z = 1: the row sums of the matrix from XYZ (IEC 61966-2-1).
EQUAL_ENERGY = (1.2047843, 0.9483008, 0.9088427)


def material_of(shape: Element, drop: Callable[[str], None]) -> tuple[Rgb, bool]:
    """Return the albedo of a shape's material and whether both of its sides are seen."""
    material = next((child for _, child in shape.children("BSDF")), None)
    return (GREY, False) if material is None else _albedo(material, drop, 0)


def _albedo(material: Element, drop: Callable[[str], None], depth: int) -> tuple[Rgb, bool]:
    material.budget.go_down(depth, by=material.place)
    inner = [child for _, child in material.children("BSDF")]
    if material.plugin in WRAPPERS:
        if sentence := WRAPPERS[material.plugin]:
            drop(f"{material.place}: {sentence}")
            for name in material.properties:
                material.has(name)  # left out with the wrapper
        if material.plugin == "twosided" and len(inner) > 1:
            drop(f"{material.place}: the second of {len(inner)} sides; both get the first one's material")
        albedo, two_sided = _albedo(inner[0], drop, depth + 1) if inner else (GREY, False)
        return albedo, two_sided or material.plugin == "twosided"
    if material.plugin == "blendbsdf" and len(inner) == 2:
        (first, first_both), (second, second_both) = (_albedo(child, drop, depth + 1) for child in inner)
        weight = 0.5
        if any(name == "weight" for name, _ in material.children()):
            drop(f"{material.place}: the texture of the blend's weight, which is 0.5 everywhere")
        else:
            weight = material.number("weight", 0.5)
        if first_both != second_both:
            drop(f"{material.place}: that one of the two blended materials is seen from both sides; the blend is")
        return vector((1 - weight) * np.array(first) + weight * np.array(second)), first_both or second_both
    if material.plugin == "diffuse":
        return _reflectance(material, "reflectance", drop), False
    name = next((name for name in ("diffuse_reflectance", "base_color", "reflectance") if material.has(name)), None)
    drop(f"{material.place}: {material.plugin} is taken as diffuse{f', by its {name}' if name else ' and grey'}")
    return (_reflectance(material, name, drop) if name else GREY), False


def _reflectance(material: Element, name: str, drop: Callable[[str], None]) -> Rgb:
    if not material.has(name):
        return GREY
    albedo = colour(material, name)
    if albedo is None:
        texture = next(child for label, child in material.children() if label == name)
        drop(f"{texture.place}: the texture; the albedo is 0.5")
    return albedo or GREY


def colour(element: Element, name: str, *, light: bool = False) -> Rgb | None:
    """Return a colour as linear sRGB, as Mitsuba's modes for RGB do; 1 if none is given, None for a texture."""
    child = next((child for label, child in element.children() if label == name), None)
    if child is None:
        return _rgb(element, name, light=light)
    if child.plugin in ("d65", "uniform"):  # which these modes take for a level of grey
        return vector(np.full(3, child.number("scale" if child.plugin == "d65" else "value", 1.0)))
    if child.plugin == "srgb":
        return vector(child.three("color", (1.0, 1.0, 1.0)))
    if not child.has(COLOURS):
        return None
    for label in child.properties:
        child.has(label)
    return _rgb(child, COLOURS, light=light)


def _rgb(element: Element, name: str, *, light: bool) -> Rgb:
    value = element.get(name, None)
    if not isinstance(value, Spectrum):
        return vector(element.three(name, (1.0, 1.0, 1.0)))
    if value.level is None:
        return vector(value.emission if light else value.reflectance)
    return vector(value.level * np.array(EQUAL_ENERGY if light else (1.0, 1.0, 1.0)))


# Mitsuba's perspective sensor as the specification's camera.
#
# Its camera looks along +z with y up and x to the *left*; `fov` is measured along `fov_axis`, by default the
# horizontal one; `focal_length` is that of a 35 mm film (36 x 24 mm), by its diagonal.


FILM = (768, 576)  # px; Mitsuba's default
FOCAL_LENGTH = "50mm"
ORTHOGONAL = 1e-9  # cosine; matrices are written with more digits than this


def camera_of(sensor: Element, size: Size, drop: Callable[[str], None]) -> Camera:
    """Return the camera of a perspective sensor, or of a thin-lens sensor without its aperture.

    Raises:
        SceneError: its `to_world` shears, or the specification refuses a value.

    """
    if sensor.plugin == "thinlens":
        drop(f"{sensor.place}: the lens of {sensor.number('aperture_radius', 0.0):g} m; the camera is a pinhole")
    film = next((child for _, child in sensor.children("Film")), None)
    width, height = (
        (film.whole(name, usual) for name, usual in zip(("width", "height"), FILM, strict=True)) if film else FILM
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
            near=sensor.number("near_clip", 1e-2),
            far=sensor.number("far_clip", 1e4),
        )
    except SceneError as error:
        raise SceneError(f"{sensor.place}: {error}") from None


def _fovy(sensor: Element, width: int, height: int) -> float:
    """Return the full vertical angle [degrees]."""
    if sensor.has("fov"):
        angle = sensor.number("fov", 0.0)
        axis = sensor.text("fov_axis", "x")
        if not 0 < angle < 180:
            raise SceneError(f"{sensor.place}: fov must lie inside (0, 180), got {angle:g} degrees")
        half = tan(radians(angle) / 2)
    else:
        text = sensor.text("focal_length", FOCAL_LENGTH)
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
