"""Ladders of model matrices: squeezed, mirrored, sheared; of rays, triangles and normals under them."""

from collections.abc import Callable
from typing import Any

import numpy as np

from rayproof.cases.ladders import (
    Draw,
    Failure,
    Gate,
    Inputs,
    Ladder,
    PredictedSlope,
    across,
    directions,
    rotation,
    rounded,
)
from rayproof.cases.placement import unit

# Draws. Model matrices, and rays and normals to go with them. Every value has a few matrices, each for a block of rays.
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
    size = count // MATRICES
    return np.repeat([rounded(make(value, generator), precision).ravel() for _ in range(MATRICES)], size, axis=0)


def rays(make: Make, *, reach: float = 1.2, flat: bool = False) -> Draw:
    """Return a draw of rays at object-space targets within `reach` of the origin (`flat`: with z = 0), from outside."""

    def draw(value: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
        matrix = _blocks(make, value, count, generator, precision)
        linear, shift = matrix.reshape(-1, 3, 4)[:, :, :3], matrix.reshape(-1, 3, 4)[:, :, 3]
        target = generator.uniform(-reach, reach, (len(matrix), 3)) * ([1, 1, 0] if flat else [0.7, 0.7, 0.7])
        # From far enough outside in world space, at least a whole unit for any squeeze.
        size = np.linalg.norm(linear, axis=(1, 2))[:, None]
        world = np.einsum("nij,nj->ni", linear, target) + shift
        origin = rounded(world + directions(len(matrix), generator) * 3 * size, precision)
        return {"matrix": matrix, "o": origin, "d": rounded(unit(world - origin), precision)}

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
        normal = unit(np.cross(second - first, third - first))
        slope = np.sqrt(generator.uniform(0.3, 1.0, (len(matrix), 1)))
        world = np.einsum("nij,nj->ni", linear, target) + shift
        away = slope * normal + np.sqrt(1 - slope**2) * across(normal, generator)
        origin = rounded(world + 3 * away, precision)
        direction = rounded(unit(world - origin), precision)
        return {"matrix": matrix, "o": origin, "d": direction, **dict(zip("abc", corners, strict=True))}

    return draw


def normals(make: Make) -> Draw:
    """Return a draw of unit object-space normals in all directions."""

    def draw(value: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
        matrix = _blocks(make, value, count, generator, precision)
        return {"matrix": matrix, "n": rounded(directions(len(matrix), generator), precision)}

    return draw


def edge_on(cosine: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
    """Return unit normals and directions with n . d about plus or minus `cosine`."""
    normal = directions(count, generator)
    side = np.where(generator.random((count, 1)) < 0.5, -1.0, 1.0)
    upright = unit(np.cross(normal, directions(count, generator)))
    direction = side * cosine * normal + np.sqrt(1 - cosine**2) * upright
    return {"n": rounded(normal, precision), "d": rounded(direction, precision)}


# The ladders.
K_OBJECT = "K_local of the shape along the exact object-space ray"
K_MATRIX = "cond(M), the ratio of its largest and smallest singular value"


def _ray(shape: str, **about: Any) -> Ladder:
    fields: dict[str, Any] = {
        "group": "transforms and normals",
        "question": "placed_distance",
        "slots": ("to_object",),
        "unit": "u t",
        "condition": K_OBJECT,
        "saturated": float("inf"),
    }
    return Ladder(**(fields | about), options={"shape": shape})


def _normal(**about: Any) -> Ladder:
    fields: dict[str, Any] = {
        "group": "transforms and normals",
        "question": "placed_normal",
        "slots": ("world_normal",),
        "unit": "degrees",
        "condition": K_MATRIX,
        "saturated": 1.0,
    }
    return Ladder(**(fields | about))


NO_DIRECTION = Failure(
    formulas=("model_matrix",),
    because="a normal is no direction: right for rotations and uniform scales alone",
)
LADDERS = (
    _ray(
        "sphere",
        name="XF-COND",
        parameter="condition of the matrix",
        values=(1.0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7),
        draw=rays(squeezed),
        rays=2000,
        gate=Gate(reaches={"float32": 1e2, "float64": 1e7}, index=1e9),
        first_to_break="float32 inverses; the tracer inverts in float64",
        survivor="float64",
        measured="predicted: 0.5 % misclassified at 1e5; the same, and the median t stays at 0.9 u",
    ),
    _ray(
        "cube",
        name="XF-COND-BOX",
        parameter="condition of the matrix",
        values=(1.0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6),
        draw=rays(squeezed, reach=0.7),
        rays=2000,
        gate=Gate(reaches={"float32": 1e2, "float64": 1e6}, index=1e9),
        first_to_break="float32 inverses",
        survivor="float64",
    ),
    _ray(
        "sphere",
        name="XF-FAR",
        parameter="translation [m]",
        values=(1.0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6),
        draw=rays(moved),
        gate=Gate(reaches={"float32": 1e4, "float64": 1e6}, index=30.0),
        first_to_break="a 4x4 affine product, M^-1 o + t'",
        survivor="to_object/inverse: subtracts the translation first",
        slopes=(PredictedSlope(formulas=("inverse",), slope=0.0, because="o - T is exact or nearly so"),),
    ),
    _ray(
        "sphere",
        name="XF-ROT",
        parameter="rotations multiplied in float32",
        values=(1.0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6),
        draw=rays(turned),
        gate=Gate(reaches={"float32": 1e6, "float64": 1e6}, index=30.0),
        first_to_break="a transpose taken for the inverse of a product that drifted",
        survivor="to_object/inverse: whatever the matrix is, its inverse is that matrix's",
        slopes=(
            PredictedSlope(formulas=("inverse",), slope=0.0, because="a drifted rotation is still well conditioned"),
        ),
    ),
    _ray(
        "sphere",
        name="XF-SING",
        parameter="uniform scale of the matrix",
        values=(1e-3, 1e-6, 1e-9, 1e-12, 1e-15),
        draw=rays(shrunk),
        gate=Gate(reaches={"float32": 1e-9, "float64": 1e-15}, index=30.0),
        first_to_break="a guard against small determinants: 1e-15 cubed is 1e-45, and no singularity",
        survivor="to_object/inverse: scale-free",
    ),
    _ray(
        "sphere",
        name="XF-MIRR",
        parameter="condition of a mirroring matrix",
        values=(1.0, 1e1, 1e2, 1e3, 1e4),
        draw=rays(mirrored),
        gate=Gate(reaches={"float32": 1e2, "float64": 1e4}, index=1e9),
        first_to_break="none: t does not know handedness",
        survivor="to_object/inverse",
    ),
    _normal(
        name="NRM-COND",
        parameter="condition of the matrix",
        values=(1.0, 3.0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6),
        draw=normals(squeezed),
        gate=Gate(reaches={"float32": 1e6, "float64": 1e6}),
        fails=(NO_DIRECTION,),
        first_to_break="world_normal/model_matrix",
        survivor="world_normal/inverse_transpose",
    ),
    _normal(
        name="NRM-MIRR",
        parameter="condition of a mirroring matrix",
        values=(1.0, 1e1, 1e2, 1e3, 1e4),
        draw=normals(mirrored),
        gate=Gate(reaches={"float32": 1e4, "float64": 1e4}),
        fails=(NO_DIRECTION,),
        first_to_break="world_normal/model_matrix; a cross product of transformed edges",
        survivor="world_normal/inverse_transpose",
    ),
    _normal(
        name="NRM-MOVED",
        parameter="translation [m]",
        values=(1.0, 1e2, 1e4, 1e6),
        draw=normals(moved),
        gate=Gate(reaches={"float32": 1e6, "float64": 1e6}),
        fails=(
            NO_DIRECTION,
            Failure(formulas=("with_w",), because="erratum E13: w enters the length"),
        ),
        first_to_break="world_normal/with_w",
        survivor="world_normal/inverse_transpose",
        slopes=(PredictedSlope(formulas=("inverse_transpose",), slope=0.0, because="a normal is not translated"),),
    ),
    _normal(
        name="NRM-SHEAR",
        parameter="slant",
        values=(1.0, 1e1, 1e2, 1e3),
        draw=normals(sheared),
        gate=Gate(reaches={"float32": 1e3, "float64": 1e3}),
        fails=(NO_DIRECTION,),
        first_to_break="world_normal/model_matrix",
        survivor="world_normal/inverse_transpose",
    ),
    _normal(
        name="NRM-FACING",
        question="facing",
        slots=("facing",),
        parameter="|cosine| between normal and viewing direction",
        values=(1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8),
        draw=edge_on,
        kind="count",
        unit="normals on the wrong side",
        condition="none: right or wrong",
        gate=Gate(reaches={"float32": 1e-6, "float64": 1e-8}),
        first_to_break="the sign of a dot product at u",
        survivor="float64",
    ),
)
