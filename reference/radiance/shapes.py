"""The specification's shapes as Radiance's, in Radiance's scene language (refman, "Surfaces").

Face m of shape n is called `s<n>.<m>`; numbers are written with all the digits that a float64 has.
"""

from collections.abc import Iterable, Iterator

import numpy as np

from rayproof.cases.placement import world_triangles
from rayproof.cases.scene import Cube, Mesh, Plane, Scene, Shape, Sphere, Square, Triangle
from rayproof.reference.radiance.extents import CUBE_CORNERS, SQUARE_CORNERS, height, placed, reach

# Each side of the cube as indices into its corners, counter-clockwise seen from outside.
CUBE_SIDES = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))


def radius(sphere: Sphere) -> float:
    """Return the radius [m] of a sphere under a similarity."""
    return sphere.radius * float(np.linalg.norm(np.asarray(sphere.to_world)[:3, 0]))


def surfaces(scene: Scene, scale: float) -> Iterator[str]:
    """Yield the finite shapes' surfaces, in units of 1/scale m; shape n's modifier is `m<n>`."""
    for index, shape in enumerate(scene.shapes):
        if not isinstance(shape, Plane):
            yield from (f"m{index} {text}" for text in _surfaces(shape, f"s{index}", scale))


def discs(scene: Scene, scale: float) -> Iterator[tuple[int, str]]:
    """Yield each plane's index and the disc about the foot of the eye that stands in for it, without a modifier."""
    eye = np.asarray(scene.camera.eye)
    for index, shape in enumerate(scene.shapes):
        if isinstance(shape, Plane):
            above, normal = height(shape, scene.camera.eye)
            numbers = _numbers([*((eye - above * normal) * scale), *normal, 0.0, reach(scene) * scale])
            yield index, f"ring s{index}.0 {numbers}"


def _surfaces(shape: Shape, name: str, scale: float) -> Iterator[str]:
    if isinstance(shape, Triangle | Mesh):
        corners = world_triangles(shape).astype(np.float64)
        first, second = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
        # Degenerate triangles are never hit; Radiance would warn of each.
        kept = np.flatnonzero(np.any(np.cross(first, second) != 0, axis=1))
        # Each vertex is put into words once, whoever shares it.
        vertices, uses = np.unique((corners[kept] * scale).reshape(-1, 3), axis=0, return_inverse=True)
        words = [" ".join(map(repr, vertex)) for vertex in vertices.tolist()]
        faces = uses.reshape(-1, 3)
        # A face once only: oconv parts a box with more than six surfaces again and again, 2^14 times a side.
        for row in np.sort(np.unique(faces, axis=0, return_index=True)[1]).tolist():
            a, b, c = faces[row].tolist()
            yield f"polygon {name}.{kept[row]} 0 0 9 {words[a]} {words[b]} {words[c]}"
        return
    matrix = np.asarray(shape.to_world, dtype=np.float64)
    if isinstance(shape, Sphere):
        center = placed(matrix, np.asarray([shape.center]))[0]
        yield f"sphere {name}.0 {_numbers([*(center * scale), radius(shape) * scale])}"
    elif isinstance(shape, Square):
        yield f"polygon {name}.0 {_numbers(_turned(matrix, SQUARE_CORNERS) * scale)}"
    elif isinstance(shape, Cube):
        for side in CUBE_SIDES:
            yield f"polygon {name}.0 {_numbers(_turned(matrix, CUBE_CORNERS[list(side)]) * scale)}"
    else:
        raise LookupError(f"Radiance has not been taught the shape {type(shape).__name__}")


def _turned(matrix: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """Return corners in world space, turned around under a mirror: a polygon's normal is by its winding."""
    world = placed(matrix, corners)
    return (world[::-1] if np.linalg.det(matrix[:3, :3]) < 0 else world).ravel()


def _numbers(values: Iterable[float]) -> str:
    digits = [repr(float(value)) for value in values]
    return f"0 0 {len(digits)} {' '.join(digits)}"
