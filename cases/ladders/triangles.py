"""Ladders of ray and triangle (slivers, grazing, translated), of the nearest of layers, and of trees over tiles."""

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
    rounded,
    transforms,
)
from rayproof.cases.placement import unit


# Draws. Rays at triangles.
def _aimed(
    corners: list[np.ndarray],
    weights: np.ndarray,
    generator: np.random.Generator,
    precision: str,
    *,
    distance: float = 3.0,
    cosine: np.ndarray | None = None,
) -> Inputs:
    """Return rays at the barycentric `weights` (rays, 3) of triangles, from `distance` m, at random or given angles."""
    count = len(weights)
    corners = [rounded(corner, precision) for corner in corners]
    target = sum(corner * weights[:, i : i + 1] for i, corner in enumerate(corners))
    normal = unit(np.cross(corners[1] - corners[0], corners[2] - corners[0]))
    slope = (np.sqrt(generator.uniform(0.1, 1.0, count)) if cosine is None else cosine)[:, None]
    side = np.where(generator.random(count) < 0.5, -1.0, 1.0)[:, None]
    direction = side * slope * normal + np.sqrt(1 - slope**2) * across(normal, generator)
    origin = rounded(target - direction * distance, precision)
    return {"o": origin, "d": rounded(unit(target - origin), precision), **dict(zip("abc", corners, strict=True))}


def _weights(count: int, generator: np.random.Generator) -> np.ndarray:
    """Return weights of points inside, uniformly distributed."""
    return generator.dirichlet((1.0, 1.0, 1.0), count)


def _triangles(count: int, generator: np.random.Generator, *, aspect: float = 1.0) -> list[np.ndarray]:
    """Return corners of randomly turned triangles with a unit base and a height of 1 / aspect."""
    along = directions(count, generator)
    upwards = across(along, generator)
    start = directions(count, generator)
    third = start + along * generator.uniform(0.2, 0.8, (count, 1)) + upwards / aspect
    return [start, start + along, third]


def slivers(aspect: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
    """Return rays at points inside triangles of this aspect."""
    return _aimed(_triangles(count, generator, aspect=aspect), _weights(count, generator), generator, precision)


def well_shaped(distance: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
    """Return rays at points inside and around unit triangles from `distance` m."""
    weights = 2 * _weights(count, generator) - 1 / 3
    return _aimed(_triangles(count, generator), weights, generator, precision, distance=distance)


def grazing(cosine: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
    """Return rays at points inside unit triangles at this cosine of incidence."""
    slope = np.full(count, cosine)
    return _aimed(_triangles(count, generator), _weights(count, generator), generator, precision, cosine=slope)


def around(margin: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
    """Return rays that pass a sliver by a margin [m] in its plane, 300 m ahead at 0.5 degrees, 500 m from the origin.

    Its sides are 11.2, 9.75 and 1.47 m.
    Source: Lam, Incorrect intersection results, https://github.com/RenderKit/embree/issues/387 (2022).
    """
    long, middle, short = 11.2, 9.75, 1.47
    along = (long**2 + middle**2 - short**2) / (2 * long)
    x = directions(count, generator)
    y = across(x, generator)
    first = 500 * directions(count, generator)
    corners = [first, first + long * x, first + along * x + np.sqrt(middle**2 - along**2) * y]
    # Each ray hits the plane next to one of the three sides.
    side, share = generator.integers(3, size=count), generator.uniform(0, 1, (count, 1))
    start = np.choose(side[:, None], corners)
    edge = np.choose(side[:, None], corners[1:] + corners[:1]) - start
    target = start + share * edge + margin * unit(np.cross(edge, np.cross(x, y)))
    heading, grazing = generator.uniform(0, 2 * np.pi, (count, 1)), np.radians(0.5)
    above = np.where(generator.random((count, 1)) < 0.5, -1.0, 1.0) * np.sin(grazing)
    direction = above * np.cross(x, y) + np.cos(grazing) * (np.cos(heading) * x + np.sin(heading) * y)
    corners = [rounded(corner, precision) for corner in corners]
    origin = rounded(target - 300 * direction, precision)
    return {"o": origin, "d": rounded(unit(target - origin), precision), **dict(zip("abc", corners, strict=True))}


def translated(offset: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
    """Return rays at points well inside unit triangles, all moved by `offset` m."""
    moved = [corner + offset * np.array([[0.6, -0.48, 0.64]]) for corner in _triangles(count, generator)]
    weights = 0.1 + 0.7 * _weights(count, generator)
    return _aimed(moved, weights, generator, precision, cosine=np.sqrt(generator.uniform(0.3, 1.0, count)))


def scaled(scale: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
    """Return unit triangles and eyes scaled by `scale`, unit directions."""
    drawn = _aimed(_triangles(count, generator), 2 * _weights(count, generator) - 1 / 3, generator, precision)
    return drawn | {name: rounded(drawn[name] * scale, precision) for name in "oabc"}


def sized(size: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
    """Return rays at points well inside triangles of this size, from 3 m."""
    start, *others = _triangles(count, generator)
    corners = [start, *(start + (corner - start) * size for corner in others)]
    weights = 0.1 + 0.7 * _weights(count, generator)
    # The eye stays as near to the world's origin as the visible point, for triangles of any size.
    target = sum(corner * weights[:, i : i + 1] for i, corner in enumerate(corners))
    moved = [corner - target + start for corner in corners]
    return _aimed(moved, weights, generator, precision, cosine=np.sqrt(generator.uniform(0.3, 1.0, count)))


def layers(gap: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
    """Return rays at points well inside unit triangles, and the same triangles moved by `gap` m to either side."""
    weights = 0.1 + 0.7 * _weights(count, generator)
    drawn = _aimed(_triangles(count, generator), weights, generator, precision)
    normal = unit(np.cross(drawn["b"] - drawn["a"], drawn["c"] - drawn["a"]))
    side = np.where(generator.random(count) < 0.5, -gap, gap)[:, None]
    return drawn | {f"{name}2": rounded(drawn[name] + side * normal, precision) for name in "abc"}


def tiles(*, far: bool = False, moved: bool = False, grazing: bool = False) -> Draw:
    """Return a draw of right triangles in a flat sheet of cells, each with a ray at a point near its border.

    Sides and sheet are parallel to the axes, so that boxes have no thickness and their corners are those of the
    triangles. Four rays in a row start from one point. The value is the distance of the eye in sheets, the offset of
    the whole scene in sheets, or the cosine of incidence, at which rays go along one axis with the other component +0
    or -0.
    """

    def draw(value: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
        cells = int(np.ceil(np.sqrt(count)))
        place = np.stack(np.divmod(generator.permutation(cells * cells)[:count], cells), axis=1) / cells - 0.5
        flat, side = np.zeros((count, 1)), 0.9 / cells
        shift = value * np.array([0.6, -0.48, 0.64]) if moved else np.zeros(3)
        # Meshes have float32 corners.
        corners = [
            rounded(np.concatenate([place + np.array(step) * side, flat], axis=1) + shift, "float32")
            for step in ((0, 0), (1, 0), (0, 1))
        ]
        weights = 0.02 + 0.94 * generator.dirichlet((0.3, 0.3, 0.3), count)
        target = sum(corner * weights[:, i : i + 1] for i, corner in enumerate(corners))
        groups = -(-count // 4)
        eye = np.repeat(directions(groups, generator) * (3 * value if far else 3.0), 4, axis=0)[:count] + shift
        eye[:, 2] = shift[2] + np.repeat(np.where(generator.random(groups) < 0.5, -1.0, 1.0), 4)[:count] * (
            abs(eye[:, 2] - shift[2]) + 0.1
        )
        origin = rounded(eye, precision)
        if grazing:
            # Each ray has its own origin: rays along the same axis at different triangles cannot share an origin.
            along = generator.integers(2, size=count)
            direction = np.where(generator.random((count, 3)) < 0.5, -0.0, 0.0)
            direction[np.arange(count), along] = 1.0
            direction[:, 2] = -value
            origin = rounded(target - 3.0 * direction, precision)
            return {"o": origin, "d": rounded(direction, precision), **dict(zip("abc", corners, strict=True))}
        return {"o": origin, "d": rounded(unit(target - origin), precision), **dict(zip("abc", corners, strict=True))}

    return draw


def degenerate(kind: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
    """Return triangles without area: 1 a point, 2 two equal corners, 3 a middle corner, 4 a zero-length direction."""
    whole = generator.integers(-8, 9, size=(3, count, 3)).astype(np.float64)
    a, step = whole[0], whole[1] + 16
    b, c = {1: (a, a), 2: (a + step, a + step), 3: (a + 2 * step, a + step)}.get(int(kind), (a + step, a + whole[2]))
    weights = _weights(count, generator)[..., None]
    target = a * weights[:, 0] + b * weights[:, 1] + c * weights[:, 2]
    origin = rounded(target + 40 * directions(count, generator), precision)
    direction = np.zeros((count, 3)) if kind == 4 else rounded(unit(target - origin), precision)
    return {"o": origin, "d": direction, "a": a, "b": b, "c": c}


# The ladders.
MISPRINTS = ("printed_third_row", "unsigned_areas")
RIGHT = (
    "moeller_trumbore",
    "moeller_trumbore_epsilon",
    "scalar_triple",
    "signed_areas",
    "baldwin_weber",
    "pluecker",
    "woop",
    "woop_kahan",
    "woop_float64_fallback",
)
MISPRINTED = Failure(formulas=MISPRINTS, because="erratum E6 or E5: another condition than the triangle's")
NO_AREA = "what has no area may be hit by rounding; the tracer leaves such triangles out beforehand"


def _ladder(**about: Any) -> Ladder:
    fields: dict[str, Any] = {
        "group": "triangle, square, plane",
        "question": "distance",
        "slots": ("triangle",),
        "condition": "|n| . (|o - a| + |t d|) / (|n . d| |t|): the first corner is the origin",
        "unit": "u t",
        "saturated": float("inf"),
        "options": {"shape": "triangle", "natural": "roundings"},
    }
    return Ladder(**(fields | about))


def _tree(bundle: int = 1, **about: Any) -> Ladder:
    last = about["values"][-1]
    return Ladder(
        group="box",
        question="tree",
        slots=("triangle",),
        only=("woop_kahan",),
        unit="triangles lost",
        condition="none: met or lost",
        kind="count",
        rays=1024,
        quick_rays=256,
        options={"shape": "triangle", "bundle": bundle},
        gate=Gate(reaches={"float32": last, "float64": last}, misclassified=0.0, index=float("inf")),
        first_to_break="slabs without room for their own roundings: the far end comes before the near one",
        survivor="beams in tracer/trees, moved outward by 16 u (Ize 2013: 2 gamma(3))",
        **about,
    )


DELETED = Failure(
    formulas=("moeller_trumbore_epsilon",), because="an absolute epsilon on an area deletes small triangles"
)
LADDERS = (
    _ladder(
        name="TRI-SLIV",
        parameter="aspect: base / height",
        values=(1.0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7),
        draw=slivers,
        rays=2000,
        gate=Gate(reaches={"float32": 1e2, "float64": 1e2}, index=10.0),
        fails=(
            Failure(
                formulas=("moeller_trumbore", "moeller_trumbore_epsilon", "scalar_triple"),
                because="t is divided by a determinant that shrinks with the height",
            ),
            MISPRINTED,
        ),
        first_to_break="triangle/unsigned_areas, baldwin_weber, moeller_trumbore_epsilon",
        survivor="triangle/woop for t; misclassification is alike",
        measured="predicted: woop 200 times more accurate than moeller_trumbore at aspect 1e6, 220 times "
        "measured; woop_kahan has no slope at all (0.8 u at every aspect)",
        slopes=(
            PredictedSlope(
                formulas=("moeller_trumbore",), slope=1.0, because="the determinant shrinks with the height"
            ),
        ),
    ),
    _ladder(
        name="TRI-DEG",
        parameter="1 all corners equal, 2 two equal, 3 collinear, 4 no direction",
        values=(1.0, 2.0, 3.0, 4.0),
        draw=degenerate,
        kind="count",
        condition="none: right or wrong",
        gate=Gate(reaches={"float32": 4.0, "float64": 4.0}, misclassified=0.0),
        fails=(
            Failure(
                formulas=(
                    "woop",
                    "woop_kahan",
                    "woop_float64_fallback",
                    "pluecker",
                    "moeller_trumbore",
                    "printed_third_row",
                    "scalar_triple",
                ),
                because=NO_AREA,
            ),
            Failure(formulas=("moeller_trumbore_epsilon",), because=NO_AREA, precisions=("float32",)),
        ),
        first_to_break="a form that divides by the determinant unguarded",
        survivor="a guarded form; none may hit what has no area",
    ),
    _ladder(
        name="TRI-GRAZE",
        parameter="cosine of incidence",
        values=(1.0, 0.5, 0.1, 1e-2, 1e-3, 1e-4, 1e-5),
        draw=grazing,
        gate=Gate(reaches={"float32": 1e-2, "float64": 1e-5}, index=10.0),
        fails=(MISPRINTED,),
        first_to_break="all alike",
        survivor="float64",
        slopes=(PredictedSlope(formulas=("*",), slope=-1.0, because="K is 1 / cos"),),
    ),
    _ladder(
        name="TRI-AROUND",
        parameter="distance at which rays pass a sliver in its plane, seen at 0.5 degrees [m]",
        values=(3.0, 1.0, 0.3, 0.1, 0.03, 0.01, 3e-3, 1e-3),
        draw=around,
        kind="count",
        unit="phantom hits",
        condition="none: all miss",
        rays=50_000,
        quick_rays=5_000,
        gate=Gate(reaches={"float32": 0.1, "float64": 1e-3}, misclassified=0.0, index=float("inf")),
        fails=(Failure(formulas=("printed_third_row",), because="erratum E6: another condition than the triangle's"),),
        first_to_break="triangle/moeller_trumbore and scalar_triple, whose t is off by up to 560 K u then",
        survivor="float64; triangle/woop, woop_kahan, signed_areas",
        measured="in float32 300 m away 16 u are 3e-4 m, in the plane 0.033 m; of 50 000 rays that pass by 1 cm"
        " moeller_trumbore hits with 309, scalar_triple with 86; by 3 mm with 2930 and 2211, baldwin_weber with 819,"
        " pluecker with 42, woop_kahan with 1",
    ),
    _ladder(
        name="TRI-ORG",
        parameter="distance of triangle and eye from the world's origin [m]",
        values=(1.0, 1e1, 1e2, 1e3, 1e4, 1e5),
        draw=translated,
        gate=Gate(reaches={"float32": 1e3, "float64": 1e5}),
        fails=(MISPRINTED, Failure(formulas=("baldwin_weber",), because="its matrix holds the translation")),
        first_to_break="triangle/baldwin_weber, whose matrix holds the translation",
        survivor="every form that subtracts a corner first",
    ),
    _ladder(
        name="TRI-FAR",
        parameter="distance of the eye from a unit triangle [m]",
        values=(1e1, 1e2, 1e3, 1e4, 1e5, 1e6),
        draw=well_shaped,
        gate=Gate(reaches={"float32": 1e3, "float64": 1e6}),
        fails=(MISPRINTED,),
        first_to_break="all: barycentrics lose u D",
        survivor="float64",
    ),
    _ladder(
        name="TRI-LARGE",
        parameter="uniform scale [m]",
        values=(1.0, 1e3, 1e6, 1e9, 1e12, 1e15),
        draw=scaled,
        gate=Gate(reaches={"float32": 1e6, "float64": 1e15}),
        fails=(MISPRINTED,),
        first_to_break="forms with products of six lengths",
        survivor="triangle/woop",
    ),
    _ladder(
        name="TRI-TINY",
        parameter="uniform scale [m]",
        values=(1.0, 1e-2, 1e-4, 1e-6, 1e-9, 1e-12, 1e-15),
        draw=scaled,
        gate=Gate(reaches={"float32": 1e-6, "float64": 1e-15}),
        fails=(
            MISPRINTED,
            DELETED,
        ),
        first_to_break="triangle/moeller_trumbore_epsilon: a determinant is an area, not a number",
        survivor="triangle/moeller_trumbore, woop",
    ),
    _ladder(
        name="TRI-SHORT",
        parameter="size of a triangle [m], seen from 3 m",
        values=(1.0, 1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6),
        draw=sized,
        gate=Gate(reaches={"float32": 1e-4, "float64": 1e-6}),
        fails=(
            MISPRINTED,
            DELETED,
        ),
        first_to_break="triangle/moeller_trumbore_epsilon, then all alike: barycentrics lose u D / size",
        survivor="all for t",
        slopes=(
            PredictedSlope(
                formulas=RIGHT, slope=0.0, because="t is that of the plane, which the corners give at any size"
            ),
        ),
    ),
    _ladder(
        name="TRI-LONG",
        parameter="size of a triangle [m], seen from 3 m",
        values=(1.0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7),
        draw=sized,
        gate=Gate(reaches={"float32": 1e7, "float64": 1e7}, index=100.0),
        fails=(MISPRINTED,),
        first_to_break="triangle/woop, woop_kahan, pluecker: up to 28 K u",
        survivor="triangle/baldwin_weber in float32, whose matrix is made in float64",
        measured="predicted: 4 K u for all. The shear mixes the axes, so that t is off by the longest of them, where K"
        " counts what lies along the normal: 28 K u at most for woop_kahan, 9 for moeller_trumbore",
        slopes=(
            PredictedSlope(
                formulas=("baldwin_weber",), slope=0.0, because="its matrix is made in float64", precisions=("float32",)
            ),
            PredictedSlope(formulas=RIGHT, slope=1.0, because="corners are left with u L beside the ray", skip=2),
        ),
    ),
    _ladder(
        name="TRI-BAKED",
        question="baked_distance",
        parameter="distance from the world's origin to which a mesh is moved [m]",
        values=(1.0, 1e1, 1e2, 1e3, 1e4, 1e5),
        draw=transforms.triangles(transforms.moved),
        condition="|n| . (|o| + |t d|) / (|n . d| |t|): the world's origin is the origin",
        gate=Gate(reaches={"float32": 1e5, "float64": 1e5}),
        fails=(MISPRINTED,),
        first_to_break="the baking, not a formula: corners are float32 in either precision",
        survivor="none; a ray taken into object space would not see the translation (XF-FAR)",
        slopes=(
            PredictedSlope(formulas=RIGHT, slope=1.0, because="a corner is left with u T, u that of float32", skip=2),
        ),
    ),
    _ladder(
        name="TRI-ORDER",
        question="order",
        slots=("nearest", "triangle"),
        parameter="gap between two parallel triangles [m], seen from 3 m",
        values=(1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7),
        draw=layers,
        kind="count",
        unit="surfaces in the wrong order",
        condition="none: right or wrong",
        gate=Gate(reaches={"float32": 1e-5, "float64": 1e-7}),
        fails=(MISPRINTED,),
        first_to_break="all alike, where the gap is a few roundings of t",
        survivor="float64; nearest/smaller compares exactly whatever it is given",
    ),
    _tree(
        name="TREE-FAR",
        parameter="distance of the eye [sheets]",
        values=(1.0, 1e1, 1e2, 1e3, 1e4, 1e5),
        draw=tiles(far=True),
    ),
    _tree(
        name="TREE-FAR-BEAM",
        parameter="distance of the eye [sheets], four rays at once",
        values=(1.0, 1e1, 1e2, 1e3, 1e4, 1e5),
        draw=tiles(far=True),
        bundle=4,
    ),
    _tree(
        name="TREE-MOVED",
        parameter="distance from the world's origin [sheets]",
        values=(0.0, 1.0, 1e1, 1e2, 1e3),
        draw=tiles(moved=True),
    ),
    _tree(
        name="TREE-GRAZE",
        parameter="cosine of incidence, along an axis",
        values=(1e-1, 1e-2, 1e-3, 1e-4, 1e-5),
        draw=tiles(grazing=True),
    ),
)
