"""Ladders of model matrices, and of the normals that they carry."""

from typing import Any

from rayproof.cases.ladders.draws import matrices as draws
from rayproof.cases.ladders.draws import special
from rayproof.cases.ladders.ladder import Failure, Gate, Ladder, Law

K_OBJECT = "K_local of the shape along the exact object-space ray"
K_MATRIX = "cond(M), the ratio of its largest and smallest singular value"


def _ray(shape: str, **about: Any) -> Ladder:
    given: dict[str, Any] = {
        "group": "transforms and normals",
        "question": "placed_distance",
        "slots": ("to_object",),
        "unit": "u t",
        "condition": K_OBJECT,
        "saturated": float("inf"),
    }
    return Ladder(**(given | about), options={"shape": shape})


def _normal(**about: Any) -> Ladder:
    given: dict[str, Any] = {
        "group": "transforms and normals",
        "question": "placed_normal",
        "slots": ("world_normal",),
        "unit": "degrees",
        "condition": K_MATRIX,
        "saturated": 1.0,
    }
    return Ladder(**(given | about))


LADDERS = (
    _ray(
        "sphere",
        name="XF-COND",
        parameter="condition of the matrix",
        values=(1.0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7),
        draw=draws.rays(draws.squeezed),
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
        draw=draws.rays(draws.squeezed, reach=0.7),
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
        draw=draws.rays(draws.moved),
        gate=Gate(reaches={"float32": 1e4, "float64": 1e6}, index=30.0),
        first_to_break="a 4x4 affine product, M^-1 o + t'",
        survivor="to_object/inverse: subtracts the translation first",
        laws=(Law(formulas=("inverse",), slope=0.0, because="o - T is exact or nearly so"),),
    ),
    _ray(
        "sphere",
        name="XF-ROT",
        parameter="rotations multiplied in float32",
        values=(1.0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6),
        draw=draws.rays(draws.turned),
        gate=Gate(reaches={"float32": 1e6, "float64": 1e6}, index=30.0),
        first_to_break="a transpose taken for the inverse of a product that drifted",
        survivor="to_object/inverse: whatever the matrix is, its inverse is that matrix's",
        laws=(Law(formulas=("inverse",), slope=0.0, because="a drifted rotation is still well conditioned"),),
    ),
    _ray(
        "sphere",
        name="XF-SING",
        parameter="uniform scale of the matrix",
        values=(1e-3, 1e-6, 1e-9, 1e-12, 1e-15),
        draw=draws.rays(draws.shrunk),
        gate=Gate(reaches={"float32": 1e-9, "float64": 1e-15}, index=30.0),
        first_to_break="a guard against small determinants: 1e-15 cubed is 1e-45, and no singularity",
        survivor="to_object/inverse: scale-free",
    ),
    _ray(
        "sphere",
        name="XF-MIRR",
        parameter="condition of a mirroring matrix",
        values=(1.0, 1e1, 1e2, 1e3, 1e4),
        draw=draws.rays(draws.mirrored),
        gate=Gate(reaches={"float32": 1e2, "float64": 1e4}, index=1e9),
        first_to_break="none: t does not know handedness",
        survivor="to_object/inverse",
    ),
    _normal(
        name="NRM-COND",
        parameter="condition of the matrix",
        values=(1.0, 3.0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6),
        draw=draws.normals(draws.squeezed),
        gate=Gate(reaches={"float32": 1e6, "float64": 1e6}),
        fails=(
            Failure(
                formulas=("model_matrix",),
                because="a normal is no direction: right for rotations and uniform scales alone",
            ),
        ),
        first_to_break="world_normal/model_matrix",
        survivor="world_normal/inverse_transpose",
    ),
    _normal(
        name="NRM-MIRR",
        parameter="condition of a mirroring matrix",
        values=(1.0, 1e1, 1e2, 1e3, 1e4),
        draw=draws.normals(draws.mirrored),
        gate=Gate(reaches={"float32": 1e4, "float64": 1e4}),
        fails=(
            Failure(
                formulas=("model_matrix",),
                because="a normal is no direction: right for rotations and uniform scales alone",
            ),
        ),
        first_to_break="world_normal/model_matrix; a cross product of transformed edges",
        survivor="world_normal/inverse_transpose",
    ),
    _normal(
        name="NRM-MOVED",
        parameter="translation [m]",
        values=(1.0, 1e2, 1e4, 1e6),
        draw=draws.normals(draws.moved),
        gate=Gate(reaches={"float32": 1e6, "float64": 1e6}),
        fails=(
            Failure(
                formulas=("model_matrix",),
                because="a normal is no direction: right for rotations and uniform scales alone",
            ),
            Failure(formulas=("with_w",), because="erratum E13: w enters the length"),
        ),
        first_to_break="world_normal/with_w",
        survivor="world_normal/inverse_transpose",
        laws=(Law(formulas=("inverse_transpose",), slope=0.0, because="a normal is not translated"),),
    ),
    _normal(
        name="NRM-SHEAR",
        parameter="slant",
        values=(1.0, 1e1, 1e2, 1e3),
        draw=draws.normals(draws.sheared),
        gate=Gate(reaches={"float32": 1e3, "float64": 1e3}),
        fails=(
            Failure(
                formulas=("model_matrix",),
                because="a normal is no direction: right for rotations and uniform scales alone",
            ),
        ),
        first_to_break="world_normal/model_matrix",
        survivor="world_normal/inverse_transpose",
    ),
    _normal(
        name="NRM-FACING",
        question="facing",
        slots=("facing",),
        parameter="|cosine| between normal and viewing direction",
        values=(1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8),
        draw=special.edge_on,
        kind="count",
        unit="normals on the wrong side",
        condition="none: right or wrong",
        gate=Gate(reaches={"float32": 1e-6, "float64": 1e-8}),
        first_to_break="the sign of a dot product at u",
        survivor="float64",
    ),
)
