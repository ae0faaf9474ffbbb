"""Exact answers of ray and sphere, box, plane, triangle and square, with their limits.

A limit is 16 u (|o| + |shape| + t |d|) / |n . d|: sixteen roundings of the largest input lengths, converted to an error
of t by the normal n at the hit. A decision is required if the ray clears the shape's outline, its own start and the
parallel case by more than 16 u (|o| + |shape| + t |d|); otherwise either answer is accepted. Near a sphere's outline
the error is not linear in 1 / |n . d|: there the limit is the change of the half chord if the radius shrinks by that
length. The distance of a ray from an edge is multiplied by the sine between them, because a triple product divides by
it.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from math import isfinite
from typing import Any

from flint import arb, fmpq

from rayproof.cases.rounding import PRECISIONS
from rayproof.reference.certified.fields import exact, precision
from rayproof.reference.certified.numbers import cross, dot, minus, plus, scaled
from rayproof.reference.certified.truths import enclosed
from rayproof.reports.vectors import BITS, Exact, ball_limit, upwards
from rayproof.reports.vectors.check import EITHER

ZERO = fmpq(0)
Inputs = Mapping[str, Any]
Vector = Sequence[Any]


def vector(numbers: Iterable[float]) -> tuple[fmpq, fmpq, fmpq]:
    """Return three finite floats as rationals."""
    x, y, z = (exact(number) for number in numbers)
    return x, y, z


def length(of: Vector) -> arb:
    """Return the length of an exact vector."""
    return arb(dot(of, of)).sqrt()


def bounds(value: arb | fmpq) -> tuple[float, float]:
    """Return the float64 numbers next below and above a value."""
    return enclosed(arb(value) if isinstance(value, fmpq) else value)


def _answer(
    hit: bool,
    times_of: Mapping[str, arb | fmpq],
    clearance: arb,
    size: arb,
    error: Callable[[arb], arb | None],
    *,
    start: str = "",
    face: str = "",
) -> Exact:
    """Return the answer; `size` is the sum of lengths; `error` returns the error of t for one along the normal."""
    decision, limits = {}, {}
    for name in PRECISIONS:
        noise = ball_limit(size, name)
        clear = bool(clearance > noise)
        decision[name] = ("1" if hit else "0") if clear else EITHER
        limit = error(noise) if hit and clear else None
        if limit is not None and limit.is_finite():
            limits[name] = upwards(limit)
    return Exact(
        decision=decision,
        values={name: bounds(value) for name, value in times_of.items()},
        limits={"t": limits},
        clearance=float(clearance.mid()) if clearance.is_finite() else None,
        start=start,
        face=face,
    )


def degenerate() -> Exact:
    """Return an answer that accepts either decision."""
    return Exact(decision=dict.fromkeys(PRECISIONS, EITHER), clearance=0.0)


def miss() -> Exact:
    """Return a miss in every precision, the answer to inputs that are not finite."""
    return Exact(decision=dict.fromkeys(PRECISIONS, "0"))


def certified(question: Callable[[Inputs], Exact]) -> Callable[[Inputs], Exact]:
    """Decorate the function of an answer: it computes with balls of BITS bits and returns a miss for NaN or inf."""

    def asked(x: Inputs) -> Exact:
        with precision(BITS):
            try:
                return question(x)
            except (ValueError, OverflowError):  # by as_integer_ratio of NaN and infinities
                return miss()

    return asked


@certified
def sphere(x: Inputs) -> Exact:
    """Return both t of a sphere by Lagrange's identity, a r^2 - |f x d|^2."""
    o, d, c, r = vector(x["o"]), vector(x["d"]), vector(x["center"]), exact(x["radius"])
    f = minus(o, c)
    a, h, outside = dot(d, d), dot(f, d), dot(f, f) - r * r
    if a == ZERO:
        return degenerate()
    m = cross(f, d)
    margin = a * r * r - dot(m, m)
    away, apart = length(f), length(m) / arb(a).sqrt()
    speed = arb(a).sqrt()
    surface = abs(away - arb(r))
    hit = margin >= ZERO and (outside < ZERO or h < ZERO)
    root = arb(margin).sqrt() if margin > ZERO else arb(0)
    times = {"t_in": (-arb(h) - root) / arb(a), "t_out": (root - arb(h)) / arb(a)} if margin >= ZERO else {}
    t = times["t_out" if outside <= ZERO else "t_in"] if hit else abs(arb(h)) / arb(a)
    size = length(o) + length(c) + arb(r) + abs(t) * speed
    start = "outside" if outside > ZERO else "inside"
    clearance = arb("inf")
    if surface <= ball_limit(size, "float32"):
        # For a start on the surface both roots and zero are right, and a miss too if the ray leaves the sphere.
        start, clearance = "on", arb("inf") if outside < ZERO or h < ZERO else arb(0)
    elif outside > ZERO:
        lateral = abs(arb(r) - apart)
        clearance = lateral.min(surface) if hit else lateral if margin < ZERO and h < ZERO else surface
    half = root / speed

    def error(noise: arb) -> arb | None:
        smaller = arb(r) - noise
        left = smaller * smaller - apart * apart
        if not left > 0:
            return None
        return (half - left.sqrt()).max(noise) / speed

    if start == "on" and outside > ZERO:
        clearance = arb(0)  # a float32 origin does not determine the side of the surface
    return _answer(hit, times, clearance, size, error, start=start)


@certified
def box(x: Inputs) -> Exact:
    """Return both t of a closed box by slabs."""
    o, d = vector(x["o"]), vector(x["d"])
    low, high = vector(x["min"]), vector(x["max"])
    moving = [axis for axis in range(3) if d[axis] != ZERO]
    if not moving:
        return degenerate()
    ends = {axis: sorted(((low[axis] - o[axis]) / d[axis], (high[axis] - o[axis]) / d[axis])) for axis in moving}
    enter, leave = max(ends[axis][0] for axis in moving), min(ends[axis][1] for axis in moving)
    room = [(o[axis] - low[axis]).__class__(min(o[axis] - low[axis], high[axis] - o[axis])) for axis in range(3)]
    # Negative: outside a slab to which the ray is parallel.
    gaps = [arb(room[axis]) for axis in range(3) if axis not in moving]
    for i in moving:
        for j in moving:
            if i != j:
                across = abs(d[i] * d[j]) / 1
                gaps.append(arb((ends[j][1] - ends[i][0]) * across) / arb(d[i] * d[i] + d[j] * d[j]).sqrt())
    last = next(axis for axis in moving if ends[axis][1] == leave)
    behind = arb(leave * abs(d[last]))
    hit = all(not gap < 0 for gap in gaps) and leave > ZERO
    within = all(value >= ZERO for value in room)
    t = (enter if enter > ZERO else leave) if hit else abs(enter)
    corner = tuple(max(abs(a), abs(b)) for a, b in zip(low, high, strict=True))
    size = length(o) + length(corner) + arb(t) * length(d)
    noise = ball_limit(size, "float32")
    depth = min(room)
    start = "inside" if within else "outside"
    if -noise <= arb(depth) <= noise and all(arb(value) >= -noise for value in room):
        start = "on"
    if hit:
        clearance = gaps[0] if gaps else arb("inf")
        for gap in gaps[1:]:
            clearance = clearance.min(gap)
        if start == "outside":
            first = next(axis for axis in moving if ends[axis][0] == enter)
            clearance = clearance.min(arb(abs(enter * d[first])))
        clearance = clearance.min(behind)
    else:
        clearance = -behind
        for gap in gaps:
            clearance = clearance.max(-gap)
    times = {"t_in": enter, "t_out": leave} if enter <= leave else {}

    def error(noise: arb) -> arb | None:
        slack = {axis: noise / arb(abs(d[axis])) for axis in moving}
        if start == "outside":
            latest = [arb(ends[axis][0]) + slack[axis] for axis in moving if ends[axis][0] + exact(0.0) <= enter]
            first = next(axis for axis in moving if ends[axis][0] == enter)
            return _largest(latest, arb(enter) + slack[first]) - arb(enter)
        earliest = [arb(leave) - (arb(ends[axis][1]) - slack[axis]) for axis in moving]
        return _largest(earliest, slack[last])

    answer = _answer(hit, times, clearance, size, error, start=start)
    if not hit or start != "outside":
        return answer
    # The point has the error of t along the ray, and its own roundings.
    speed = length(d)
    point = dict(zip("xyz", (bounds(a + enter * b) for a, b in zip(o, d, strict=True)), strict=True))
    off = {name: upwards(arb(limit) * speed + ball_limit(size, name)) for name, limit in answer.limits["t"].items()}
    return replace(answer, values={**answer.values, **point}, limits={**answer.limits, "point": off})


def _largest(values: Sequence[arb], least: arb) -> arb:
    for value in values:
        least = least.max(value)
    return least


@certified
def plane(x: Inputs) -> Exact:
    """Return t of the plane through `point` with the normal `normal`, of any length.

    For inputs that are not finite either answer is accepted: they may be components along the plane, which only some
    formulas read.
    """
    if not all(isfinite(number) for name in ("o", "d") for number in x[name]):
        return degenerate()
    o, d, p, n = (vector(x[name]) for name in ("o", "d", "point", "normal"))
    return _flat(o, d, p, n, (), length(p))


@certified
def triangle(x: Inputs) -> Exact:
    """Return t of a triangle, edges included, seen from either side."""
    corners = [vector(x[name]) for name in "abc"]
    return _polygon(vector(x["o"]), vector(x["d"]), corners)


@certified
def square(x: Inputs) -> Exact:
    """Return t of the parallelogram center +- half_width +- half_height."""
    center, width, height = (vector(x[name]) for name in ("center", "half_width", "half_height"))
    corners = [
        plus(center, plus(scaled(width, fmpq(i)), scaled(height, fmpq(j))))
        for i, j in ((-1, -1), (1, -1), (1, 1), (-1, 1))
    ]
    return _polygon(vector(x["o"]), vector(x["d"]), corners)


def _polygon(o: Vector, d: Vector, corners: Sequence[Vector]) -> Exact:
    """Return t of a convex polygon, wound counter-clockwise as seen from its front."""
    normal = cross(minus(corners[1], corners[0]), minus(corners[-1], corners[0]))
    size = length(corners[0])
    for corner in corners[1:]:
        size = size.max(length(corner))
    edges = list(zip(corners, [*corners[1:], corners[0]], strict=True))
    return _flat(o, d, corners[0], normal, edges, size)


def _flat(
    o: Vector, d: Vector, point: Vector, normal: Vector, edges: Sequence[tuple[Vector, Vector]], shape: arb
) -> Exact:
    height, slope = dot(normal, minus(point, o)), dot(normal, d)
    if not any(normal) or not any(d):
        return degenerate()
    unit, speed = length(normal), length(d)
    apart = abs(arb(height)) / unit
    if slope == ZERO:
        # A ray along the plane misses it; one within rounding of the plane may hit it too.
        return _answer(False, {}, apart, length(o) + shape, lambda noise: None)
    t = height / slope
    sides = []
    for first, second in edges:
        edge = minus(second, first)
        side = dot(cross(minus(first, o), minus(second, o)), d) * (1 if slope > ZERO else -1)
        sides.append(arb(side) / (speed * length(edge)))  # the distance times the sine between ray and edge
    hit = t > ZERO and all(not side < 0 for side in sides)
    if hit:
        clearance = apart
        for side in sides:
            clearance = clearance.min(side)
    else:
        clearance = apart if t <= ZERO else arb(0)
        for side in sides:
            clearance = clearance.max(-side)
    cosine = abs(arb(slope)) / unit
    size = length(o) + shape + abs(arb(t)) * speed
    face = "front" if slope < ZERO else "back"
    if cosine / speed <= ball_limit(arb(1), "float32"):
        clearance = arb(0)  # rounding may turn such a ray away from the plane, or towards it
    return _answer(hit, {"t_in": t} if t > ZERO else {}, clearance, size, lambda noise: noise / cosine, face=face)
