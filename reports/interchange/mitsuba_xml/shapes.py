"""Mitsuba's shapes as the specification's: its cube and rectangle reach from -1 to 1, instances repeat a group."""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TypedDict

import numpy as np

from rayproof.cases.mesh_files import read_mesh
from rayproof.cases.scene import Cube, Mesh, Plane, Rgb, SceneError, Shape, Sphere, Square
from rayproof.reports.interchange.mitsuba_xml import PLANE
from rayproof.reports.interchange.mitsuba_xml.materials import material_of
from rayproof.reports.interchange.mitsuba_xml.tree import Element
from rayproof.reports.interchange.numbers import matrix, vector

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
