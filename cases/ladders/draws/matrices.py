"""Model matrices, and rays and normals to go with them. Every value has a few matrices, each for a block of rays."""

from collections.abc import Callable

import numpy as np

from rayproof.cases.ladders.draws import across, directions, rotation, rounded
from rayproof.cases.ladders.ladder import Draw, Inputs

MATRICES = 2  # per value
Make = Callable[[float, np.random.Generator], np.ndarray]  # (3, 4)


def _affine(linear: np.ndarray, translation: np.ndarray | None = None) -> np.ndarray:
    return np.concatenate([linear, np.reshape(np.zeros(3) if translation is None else translation, (3, 1))], axis=1)


def squeezed(condition: float, generator: np.random.Generator) -> np.ndarray:
    """Return R1 diag(1, k^-1/2, 1/k) R2."""
    return _affine(rotation(generator) @ np.diag([1, condition**-0.5, 1 / condition]) @ rotation(generator))


def mirrored(condition: float, generator: np.random.Generator) -> np.ndarray:
    """Return a squeezed matrix with a mirror in it."""
    return _affine(rotation(generator) @ np.diag([-1, condition**-0.5, 1 / condition]) @ rotation(generator))


def turned(steps: float, generator: np.random.Generator) -> np.ndarray:
    """Return the product of `steps` rotations in float32, which is one no more."""
    step = rotation(generator).astype(np.float32)
    product = np.eye(3, dtype=np.float32)
    for bit in bin(int(steps))[2:]:
        product = product @ product
        product = product @ step if bit == "1" else product
    return _affine(product.astype(np.float64))


def shrunk(size: float, generator: np.random.Generator) -> np.ndarray:
    """Return a rotation times `size`."""
    return _affine(rotation(generator) * size)


def moved(offset: float, generator: np.random.Generator) -> np.ndarray:
    """Return a gently squeezed matrix and a translation of `offset` m."""
    return _affine(squeezed(4.0, generator)[:, :3], offset * directions(1, generator)[0])


def sheared(slant: float, generator: np.random.Generator) -> np.ndarray:
    """Return a rotated shear: y leans towards x by this factor."""
    return _affine(rotation(generator) @ np.array([[1, slant, 0], [0, 1, 0], [0, 0, 1]]))


def stretched(ratio: float, generator: np.random.Generator) -> np.ndarray:
    """Return a rotation times diag(ratio, 1, 1)."""
    return _affine(rotation(generator) @ np.diag([ratio, 1, 1]))


def _blocks(make: Make, value: float, count: int, generator: np.random.Generator, precision: str) -> np.ndarray:
    each = count // MATRICES
    return np.repeat([rounded(make(value, generator), precision).ravel() for _ in range(MATRICES)], each, axis=0)


def rays(make: Make, *, reach: float = 1.2, flat: bool = False) -> Draw:
    """Return a draw of rays at object-space targets within `reach` of the origin (`flat`: with z = 0), from outside."""

    def draw(value: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
        matrix = _blocks(make, value, count, generator, precision)
        linear, shift = matrix.reshape(-1, 3, 4)[:, :, :3], matrix.reshape(-1, 3, 4)[:, :, 3]
        target = generator.uniform(-reach, reach, (len(matrix), 3)) * ([1, 1, 0] if flat else [0.7, 0.7, 0.7])
        # From far enough outside in world space, at least a whole unit whatever the squeeze.
        size = np.linalg.norm(linear, axis=(1, 2))[:, None]
        world = np.einsum("nij,nj->ni", linear, target) + shift
        origin = rounded(world + directions(len(matrix), generator) * 3 * size, precision)
        direction = world - origin
        unit = rounded(direction / np.linalg.norm(direction, axis=1, keepdims=True), precision)
        return {"matrix": matrix, "o": origin, "d": unit}

    return draw


def triangles(make: Make) -> Draw:
    """Return a draw of unit triangles in object space, float32 as meshes have them, and rays at them in world space."""

    def draw(value: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
        matrix = _blocks(make, value, count, generator, precision)
        linear, shift = matrix.reshape(-1, 3, 4)[:, :, :3], matrix.reshape(-1, 3, 4)[:, :, 3]
        along = directions(len(matrix), generator)
        start = directions(len(matrix), generator)
        corners = [start, start + along, start + 0.4 * along + across(along, generator)]
        corners = [rounded(corner, "float32") for corner in corners]
        weights = 0.1 + 0.7 * generator.dirichlet((1.0, 1.0, 1.0), len(matrix))
        target = sum(corner * weights[:, i : i + 1] for i, corner in enumerate(corners))
        first, second, third = (np.einsum("nij,nj->ni", linear, corner) for corner in corners)
        normal = np.cross(second - first, third - first)
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        slope = np.sqrt(generator.uniform(0.3, 1.0, (len(matrix), 1)))
        world = np.einsum("nij,nj->ni", linear, target) + shift
        away = slope * normal + np.sqrt(1 - slope**2) * across(normal, generator)
        origin = rounded(world + 3 * away, precision)
        unit = (world - origin) / np.linalg.norm(world - origin, axis=1, keepdims=True)
        return {"matrix": matrix, "o": origin, "d": rounded(unit, precision), **dict(zip("abc", corners, strict=True))}

    return draw


def normals(make: Make) -> Draw:
    """Return a draw of unit object-space normals in all directions."""

    def draw(value: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
        matrix = _blocks(make, value, count, generator, precision)
        return {"matrix": matrix, "n": rounded(directions(len(matrix), generator), precision)}

    return draw
