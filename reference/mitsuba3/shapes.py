"""The specification's shapes as Mitsuba's, so that none is silently wrong.

Mitsuba 3.9.1 only warns of a sheared or unevenly scaled `sphere` and then draws something else; it turns the normals
of a mirrored `sphere` inwards, and the geometric normals of a mirrored `cube` or `rectangle` against their shading
normals. Under an `instance` all of them are right.
"""

from functools import lru_cache
from typing import Any

import numpy as np

from rayproof.cases.placement import world_triangles
from rayproof.cases.scene import Cube, Mesh, Plane, Scene, Shape, Sphere, Square, Triangle, is_similarity
from rayproof.reference.mitsuba3.planes import disc_to_world


def needs_instance(shape: Shape) -> bool:
    """Return whether Mitsuba gets the shape right only as an instance."""
    linear = np.asarray(shape.to_world, dtype=np.float64)[:3, :3]
    return bool(np.linalg.det(linear) < 0) or (isinstance(shape, Sphere) and not is_similarity(shape.to_world))


@lru_cache(maxsize=64)
def kept_faces(shape: Triangle | Mesh) -> np.ndarray:
    """Return the indices of the triangles that have an area: Embree may report hits of the others."""
    corners = world_triangles(shape).astype(np.float64)
    doubled_area = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return np.flatnonzero(np.any(doubled_area != 0, axis=1))


def entries(mi: Any, scene: Scene) -> dict[str, Any]:
    """Return the shapes as entries of Mitsuba's scene dictionary; shape n is called `shape-n`.

    A mesh without area is left out.
    """
    found: dict[str, Any] = {}
    for index, shape in enumerate(scene.shapes):
        name = f"shape-{index}"
        if isinstance(shape, Triangle | Mesh):
            if len(kept_faces(shape)):
                found[name] = _mesh(mi, shape, name)
        elif isinstance(shape, Plane):
            to_world = _transform(mi, disc_to_world(shape, scene))
            found[name] = {"type": "disk", "to_world": to_world, "bsdf": _bsdf(shape)}
        elif needs_instance(shape):
            within, around = split(shape)
            found[f"group-{index}"] = {"type": "shapegroup", "shape": _primitive(mi, shape, within)}
            group = {"type": "ref", "id": f"group-{index}"}
            found[name] = {"type": "instance", "group": group, "to_world": _transform(mi, around)}
        else:
            found[name] = _primitive(mi, shape, np.asarray(shape.to_world))
    return found


def split(shape: Shape) -> tuple[np.ndarray, np.ndarray]:
    """Return two 4x4 matrices whose product is `to_world`: a uniform scale within the group, the rest around it.

    Mitsuba takes a ray to where it passes a sphere before it solves for the hits, by a distance that is right only for
    unit directions and ever farther beyond for longer ones. With the smallest stretch moved into the group no direction
    in it is longer than one; without, the LLVM variant's normals on a flat ellipsoid are off by a degree.
    """
    to_world = np.asarray(shape.to_world, dtype=np.float64)
    smallest = np.linalg.svd(to_world[:3, :3], compute_uv=False)[2]
    return np.diag([smallest, smallest, smallest, 1.0]), to_world @ np.diag([1 / smallest] * 3 + [1.0])


def _primitive(mi: Any, shape: Shape, to_world: np.ndarray) -> dict[str, Any]:
    bsdf = _bsdf(shape)
    if isinstance(shape, Sphere):
        center, radius = list(shape.center), shape.radius
        return {
            "type": "sphere",
            "center": center,
            "radius": radius,
            "to_world": _transform(mi, to_world),
            "bsdf": bsdf,
        }
    # Mitsuba's cube and rectangle reach from -1 to 1.
    halved = np.asarray(to_world, dtype=np.float64) @ np.diag([0.5, 0.5, 0.5, 1.0])
    if isinstance(shape, Cube):
        return {"type": "cube", "to_world": _transform(mi, halved), "bsdf": bsdf}
    if isinstance(shape, Square):
        return {"type": "rectangle", "to_world": _transform(mi, halved), "bsdf": bsdf}
    raise LookupError(f"Mitsuba has not been taught the shape {type(shape).__name__}")


def _mesh(mi: Any, shape: Triangle | Mesh, name: str) -> Any:
    corners = world_triangles(shape)[kept_faces(shape)]
    properties = mi.Properties()
    properties.set_id(name)
    properties["face_normals"] = True
    properties["bsdf"] = mi.load_dict(_bsdf(shape))
    mesh = mi.Mesh(name, vertex_count=3 * len(corners), face_count=len(corners), props=properties)
    parameters = mi.traverse(mesh)
    parameters["vertex_positions"] = corners.ravel()
    parameters["faces"] = np.arange(3 * len(corners), dtype=np.uint32)
    parameters.update()
    return mesh


def _bsdf(shape: Shape) -> dict[str, Any]:
    # Mitsuba refuses an albedo above 1; the answers that depend on it are declared unsupported.
    reflectance = {"type": "rgb", "value": [min(channel, 1.0) for channel in shape.albedo]}
    diffuse = {"type": "diffuse", "reflectance": reflectance}
    return {"type": "twosided", "side": diffuse} if shape.two_sided else diffuse


def _transform(mi: Any, matrix: Any) -> Any:
    return mi.ScalarTransform4f(np.asarray(matrix, dtype=np.float64))
