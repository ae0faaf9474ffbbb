"""Ladders of points on spheres, planes and triangles, and of the normals on spheres."""

from rayproof.cases.ladders.draws import special, triangle
from rayproof.cases.ladders.draws import sphere as draws
from rayproof.cases.ladders.ladder import Failure, Gate, Ladder, Law

LADDERS = (
    Ladder(
        name="SPH-POINT-FAR",
        group="sphere",
        question="point",
        slots=("position",),
        parameter="distance / radius",
        values=(1e1, 1e2, 1e3, 1e4, 1e5, 1e6),
        draw=draws.far,
        unit="distance from the surface [r]",
        condition="(|c| + r) / r: a point cannot be closer than its own rounding",
        options={"shape": "sphere"},
        rays=2000,
        gate=Gate(reaches={"float32": 1e5, "float64": 1e6}),
        fails=(
            Failure(
                formulas=("along_ray", "by_matrix"),
                because="o + t d is rounded at the size of t, not of the sphere",
            ),
        ),
        first_to_break="position/along_ray, position/by_matrix",
        survivor="position/reprojected",
        laws=(
            Law(formulas=("reprojected",), slope=0.0, because="the radius is restored last"),
            Law(formulas=("*",), slope=1.0, because="o + t d rounds at the size of t: u D"),
        ),
    ),
    Ladder(
        name="SPH-POINT-NORMAL",
        group="sphere",
        question="sphere_normal",
        slots=("sphere_normal",),
        parameter="distance of the centre from the world's origin [r]",
        values=(1.0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6),
        draw=special.points,
        unit="degrees",
        condition="1: p - c is exact or nearly so",
        gate=Gate(reaches={"float32": 1e6, "float64": 1e6}),
        fails=(Failure(formulas=("center_kept",), because="erratum E17: the centre is not subtracted"),),
        first_to_break="sphere_normal/center_kept",
        survivor="sphere_normal/from_center",
        saturated=float("inf"),
        laws=(Law(formulas=("from_center",), slope=0.0, because="the formula only sees p - c"),),
    ),
    *(
        Ladder(
            name=f"PNT-{shape.upper()}",
            group="triangle, square, plane",
            question="point",
            slots=("position",),
            parameter="distance of the eye [m]",
            values=(1e1, 1e2, 1e3, 1e4, 1e5, 1e6),
            draw=draw,
            unit="m",
            condition="|n| . (|o| + |t d| + |a|): o + t d is rounded at the size of the way",
            options={"shape": shape},
            gate=Gate(reaches={"float32": reach, "float64": 1e6}),
            first_to_break="all alike; Pharr et al. (2023), 6.8: a point by barycentric coordinates would not",
            survivor="none: a point by o + t d rounds at the size of t",
            saturated=float("inf"),
            laws=(Law(formulas=("*",), slope=1.0, because="o + t d rounds at the size of t: u D"),),
        )
        for shape, draw, reach in (("plane", triangle.plane_far, 1e6), ("triangle", triangle.well_shaped, 1e3))
    ),
)
