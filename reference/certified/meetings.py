"""Exact intersection of rays with shapes (sphere, plane, square, triangle, cube), one shape per ray.

Each class has `predicates` (rational functions whose signs decide), `values` (the possible t) and `decide(signs,
values, inputs)`, which returns hit, t as a bundle, normal and size. Inputs by name: o, d, and the shape's parameters.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from rayproof.reference.certified.bundles import Bundle
from rayproof.reference.certified.columns import Columns
from rayproof.reference.certified.numbers import cross, dot, minus

Signs = Mapping[str, np.ndarray]


@dataclass(frozen=True, kw_only=True)
class ExactHit:
    """The exact answer."""

    hit: np.ndarray
    t: Bundle
    normal: np.ndarray  # (rays, 3) unit, of either sign
    size: np.ndarray  # R in K: the size of the shape's parameters


class ExactShape(Protocol):
    """The mathematics of one shape."""

    @property
    def center(self) -> str | None:
        """Return the name of the input that is its position, None if it is at the origin."""
        ...

    def predicates(self, x: Columns) -> Columns:
        """Return the numbers whose signs decide."""
        ...

    def values(self, x: Columns) -> Columns:
        """Return the possible t."""
        ...

    def decide(self, signs: Signs, values: Mapping[str, Bundle], inputs: Mapping[str, np.ndarray]) -> ExactHit:
        """Return the exact answer."""
        ...


def chosen(options: list[tuple[np.ndarray, Bundle]]) -> Bundle:
    """Return the number of the first condition that is true, NaN if none is."""
    conditions = [condition for condition, _ in options]
    high = np.select(conditions, [value.high for _, value in options], np.nan)
    low = np.select(conditions, [np.broadcast_to(value.low, high.shape) for _, value in options], 0.0)
    radius = np.select(conditions, [np.broadcast_to(value.radius, high.shape) for _, value in options], 0.0)
    return Bundle(high, low, radius)


class ExactSphere:
    """By Lagrange's identity; f = o - c."""

    center = "c"

    def _parts(self, x: Columns) -> tuple[Any, Any, Any, Any]:
        f, d, r = minus(x["o"], x["c"]), x["d"], x["r"]
        a, m = dot(d, d), cross(f, d)
        return a, dot(f, d), dot(f, f) - r * r, a * r * r - dot(m, m)

    def predicates(self, x: Columns) -> Columns:
        """Return the margin, the outside, the approach and the squared length of the direction."""
        a, h, outside, margin = self._parts(x)
        return {"margin": margin, "outside": outside, "approach": -h, "moving": a}

    def values(self, x: Columns) -> Columns:
        """Return both roots."""
        a, h, _, margin = self._parts(x)
        root = margin.sqrt()
        return {"near": (-h - root) / a, "far": (root - h) / a}

    def decide(self, signs: Signs, values: Mapping[str, Bundle], inputs: Mapping[str, np.ndarray]) -> ExactHit:
        """Return the near root for an origin outside, the far root for one inside or on the surface going inwards."""
        outside, inside = signs["outside"] > 0, signs["outside"] <= 0
        ahead = np.where(signs["outside"] < 0, True, signs["approach"] > 0)
        hit = (signs["margin"] >= 0) & ahead & (signs["moving"] > 0)
        t = chosen([(hit & outside, values["near"]), (hit & inside, values["far"])])
        local = inputs["o"] - inputs["c"] + t.high[:, None] * inputs["d"]
        with np.errstate(all="ignore"):
            normal = local / np.linalg.norm(local, axis=1, keepdims=True)
        return ExactHit(hit=hit, t=t, normal=normal, size=abs(inputs["r"]))


class ExactPlane:
    """The plane z = 0."""

    center = None

    def predicates(self, x: Columns) -> Columns:
        """Return the numbers o.z (height) and d.z (slope)."""
        return {"height": x["o"][2] + 0, "climb": x["d"][2] + 0}

    def values(self, x: Columns) -> Columns:
        """Return t."""
        return {"t": -x["o"][2] / x["d"][2]}

    def decide(self, signs: Signs, values: Mapping[str, Bundle], inputs: Mapping[str, np.ndarray]) -> ExactHit:
        """Return a hit where o.z and d.z differ in sign."""
        hit = (signs["height"] * signs["climb"]).astype(int) == -1
        rays = len(hit)
        return ExactHit(
            hit=hit,
            t=chosen([(hit, values["t"])]),
            normal=np.broadcast_to([0.0, 0.0, 1.0], (rays, 3)),
            size=np.zeros(rays),
        )


class ExactSquare(ExactPlane):
    """The open square abs(x), abs(y) < 0.5 in z = 0."""

    def predicates(self, x: Columns) -> Columns:
        """Return o.z, d.z, and the distances to the four borders times d.z."""
        o, d = x["o"], x["d"]
        across = {name: o[i] * d[2] - o[2] * d[i] for i, name in enumerate("xy")}
        half = d[2] / 2
        return super().predicates(x) | {
            f"{side}{name}": value
            for name, p in across.items()
            for side, value in (("low", half + p), ("up", half - p))
        }

    def decide(self, signs: Signs, values: Mapping[str, Bundle], inputs: Mapping[str, np.ndarray]) -> ExactHit:
        """Return the plane's hit where it is inside the square."""
        plane = super().decide(signs, values, inputs)
        # Inside, all four products have the sign of d.z.
        inside = np.all([signs[name] == signs["climb"] for name in ("lowx", "upx", "lowy", "upy")], axis=0)
        hit = plane.hit & inside
        return ExactHit(hit=hit, t=chosen([(hit, plane.t)]), normal=plane.normal, size=plane.size)


class ExactTriangle:
    """By Cramer's rule, with the determinant's sign factored out: no division decides."""

    center = "a"

    def _parts(self, x: Columns) -> Columns:
        edge, second_edge, from_first = minus(x["b"], x["a"]), minus(x["c"], x["a"]), minus(x["o"], x["a"])
        p, q = cross(x["d"], second_edge), cross(from_first, edge)
        det, u, v = dot(p, edge), dot(p, from_first), dot(q, x["d"])
        return {"det": det, "u": u, "v": v, "w": det - u - v, "t": dot(q, second_edge)}

    def predicates(self, x: Columns) -> Columns:
        """Return the determinants."""
        return self._parts(x)

    def values(self, x: Columns) -> Columns:
        """Return t."""
        parts = self._parts(x)
        return {"t": parts["t"] / parts["det"]}

    def met(self, signs: Signs) -> np.ndarray:
        """Return a mask: no area differs in sign from the determinant, and t is positive."""
        det = signs["det"].astype(int)
        inside = np.all([signs[name] * det >= 0 for name in "uvw"], axis=0)
        return (det != 0) & inside & (signs["t"] * det > 0)

    def decide(self, signs: Signs, values: Mapping[str, Bundle], inputs: Mapping[str, np.ndarray]) -> ExactHit:
        """Return a hit where `met` is true."""
        hit = self.met(signs)
        normal = np.cross(inputs["b"] - inputs["a"], inputs["c"] - inputs["a"])
        with np.errstate(all="ignore"):
            normal = normal / np.linalg.norm(normal, axis=1, keepdims=True)
        return ExactHit(hit=hit, t=chosen([(hit, values["t"])]), normal=normal, size=np.zeros(len(hit)))


class ExactCube:
    """The closed cube of half-size 0.5, by slabs compared by cross-multiplication; a parallel ray needs no case."""

    center = None

    def _bounds(self, x: Columns) -> tuple[list[Any], list[Any], list[Any]]:
        # Everything is multiplied by 2: rationals combine with integers, not with the float 0.5.
        enter, leave, speed = [], [], []
        for o, d, towards in zip(x["o"], x["d"], x["towards"], strict=True):
            enter.append(-2 * (o * towards) - 1)
            leave.append(-2 * (o * towards) + 1)
            speed.append(2 * (d * towards))
        return enter, leave, speed

    def predicates(self, x: Columns) -> Columns:
        """Return per pair of axes a number >= 0 if slab i is entered before j is left, and the numerators of all t."""
        enter, leave, speed = self._bounds(x)
        overlap = {
            f"overlap{i}{j}": leave[j] * speed[i] - enter[i] * speed[j] for i in range(3) for j in range(3) if i != j
        }
        return overlap | {f"enter{i}": enter[i] for i in range(3)} | {f"leave{i}": leave[i] for i in range(3)}

    def values(self, x: Columns) -> Columns:
        """Return all six t."""
        enter, leave, speed = self._bounds(x)
        return {f"enter{i}": enter[i] / speed[i] for i in range(3)} | {
            f"leave{i}": leave[i] / speed[i] for i in range(3)
        }

    def decide(self, signs: Signs, values: Mapping[str, Bundle], inputs: Mapping[str, np.ndarray]) -> ExactHit:
        """Return the last entry if its t is positive, else the first exit."""
        moves = [inputs["d"][:, i] != 0 for i in range(3)]
        through = np.all([signs[f"overlap{i}{j}"] >= 0 for i in range(3) for j in range(3) if i != j], axis=0)
        ahead = np.all([(signs[f"leave{i}"] > 0) | ~moves[i] for i in range(3)], axis=0) & np.any(moves, axis=0)
        outside = np.any([(signs[f"enter{i}"] > 0) & moves[i] for i in range(3)], axis=0)
        hit = through & ahead
        enter = np.array([np.where(moves[i], values[f"enter{i}"].high, -np.inf) for i in range(3)])
        leave = np.array([np.where(moves[i], values[f"leave{i}"].high, np.inf) for i in range(3)])
        axis = np.where(outside, np.argmax(enter, axis=0), np.argmin(leave, axis=0))
        t = chosen(
            [(hit & outside & (axis == i), values[f"enter{i}"]) for i in range(3)]
            + [(hit & ~outside & (axis == i), values[f"leave{i}"]) for i in range(3)]
        )
        return ExactHit(hit=hit, t=t, normal=np.eye(3)[axis], size=np.full(len(hit), 0.5))


SHAPES: dict[str, type[ExactShape]] = {
    "sphere": ExactSphere,
    "plane": ExactPlane,
    "square": ExactSquare,
    "triangle": ExactTriangle,
    "cube": ExactCube,
}


def towards(directions: np.ndarray) -> np.ndarray:
    """Return the sign per component, 1 for zero of either sign."""
    return np.where(directions < 0, -1.0, 1.0)
