"""Certified answers of cameras, normals, shadow rays and light, with their limits.

Limits; u is the unit roundoff, and the error of a vector is the length of the difference:

    camera's direction  16 u (1 + 1 / sin(F, up) + a q sec^2 a / (1 + q^2 tan^2 a) + tan a sqrt(aspect^2 + 1) cos). The
                        third term is the amplification of the angle of view, the last has the roundings of sx and sy; a
                        is half the angle of view, q the distance from the image's middle in half heights
    clipping            t times 32 u over the cosine to the axis
    normals             16 u; for placed shapes times cond(M) in the Frobenius norm
    irradiance          16 u Phi / (4 pi r^2), a cosine 16 u, a sum of n lights (n + 16) u times the sum of their sizes
    exitance, radiance  16 u of themselves
    shadow ray          a decision is required if light and blocker clear the plane of the hit, and each other, by more
                        than the error of the hit, 16 u (|o| + |p| + t |d|)
"""

from collections.abc import Callable, Mapping, Sequence

from flint import arb, fmpq

from rayproof.cases.rounding import PRECISIONS
from rayproof.reference.certified.fields import exact, precision
from rayproof.reference.certified.numbers import cross, dot, minus, plus, scaled, unit
from rayproof.reports.vectors import BITS, Exact, ball_limit, upwards
from rayproof.reports.vectors.check import EITHER
from rayproof.reports.vectors.shapes import Inputs, Vector, bounds, certified, length, triangle, vector

LARGEST = {"float32": arb(2) ** 128 * (1 - arb(2) ** -25), "float64": arb(2) ** 1023 * 2 * (1 - arb(2) ** -54)}
SMALLEST = {"float32": arb(2) ** -126, "float64": arb(2) ** -1022}


def balls(numbers: Sequence[float]) -> tuple[arb, arb, arb]:
    """Return three floats as balls."""
    x, y, z = (arb(number) for number in numbers)
    return x, y, z


def numbers_of(group: str, values: Mapping[str, arb], limit: Callable[[str], arb]) -> Exact:
    """Return an answer without a decision; a precision that cannot represent the numbers gets no limit."""
    limits = {}
    for name in PRECISIONS:
        sizes = [abs(value) for value in values.values() if not value.is_zero()]
        kept = all(SMALLEST[name] <= size <= LARGEST[name] for size in sizes) or group in ("direction", "normal")
        if kept:
            limits[name] = upwards(limit(name).max(SMALLEST[name]))
    return Exact(values={name: bounds(value) for name, value in values.items()}, limits={group: limits})


# The camera.


def axes(x: Inputs) -> tuple[Vector, Vector, Vector, arb]:
    """Return right, up and forward, and the sine of the angle between forward and the camera's `up`."""
    forward = unit(minus(balls(x["target"]), balls(x["eye"])))
    up = balls(x["up"])
    right = cross(forward, up)
    sine = dot(right, right).sqrt() / dot(up, up).sqrt()
    right = unit(right)
    return right, cross(right, forward), forward, sine


def image_point(x: Inputs) -> tuple[arb, arb, arb]:
    """Return (sx, sy) and the aspect from the inputs, or those of a pixel's centre."""
    if "column" not in x:
        return arb(x["sx"]), arb(x["sy"]), arb(x["aspect"])
    width, height = arb(x["width"]), arb(x["height"])
    sx, sy = (2 * arb(x["column"]) + 1) / width - 1, 1 - (2 * arb(x["row"]) + 1) / height
    return sx, sy, width / height


def tangent(x: Inputs) -> arb:
    """Return the tangent of half the vertical angle of view."""
    half = arb(exact(x["fovy"]) / 360)
    return half.sin_pi() / half.cos_pi()


def look(x: Inputs) -> tuple[Vector, Callable[[str], arb]]:
    """Return the unit direction and its limit."""
    right, up, forward, sine = axes(x)
    sx, sy, aspect = image_point(x)
    tan = tangent(x)
    direction = unit(plus(plus(forward, scaled(right, sx * aspect * tan)), scaled(up, sy * tan)))
    q = (sx * aspect * sx * aspect + sy * sy).sqrt()
    half = arb(exact(x["fovy"]) / 360) * arb.pi()
    view = half * q * (1 + tan * tan) / (1 + q * q * tan * tan)
    # sx and sy are differences with 1, so their absolute errors are u; they turn a ray by its distance from the axis.
    pixel = tan * (aspect * aspect + 1).sqrt() / (1 + q * q * tan * tan).sqrt()
    noise = 1 + 1 / sine + view + pixel
    return direction, lambda name: ball_limit(noise, name)


@certified
def direction(x: Inputs) -> Exact:
    """Return the unit direction of a camera's ray."""
    unit_direction, limit = look(x)
    return numbers_of("direction", dict(zip(("dx", "dy", "dz"), unit_direction, strict=True)), limit)


@certified
def clipped(x: Inputs) -> Exact:
    """Return the t of near and far along the given unit direction: `clip` is depth, shell or none."""
    near, far = arb(x["near"]), arb(x["far"])
    d, f = balls(x["direction"]), balls(x["forward"])
    cosine = dot(d, f)
    by = cosine if x["clip"] == "depth" else arb(1)
    ends = {"near": near / by, "far": far / by} if x["clip"] != "none" else {"near": arb(0)}
    slack = {name: ball_limit(2 / by, name) for name in PRECISIONS}
    limits = {end: {name: upwards(t * slack[name]) for name in PRECISIONS} for end, t in ends.items()}
    if x["clip"] == "none":
        limits = {"near": dict.fromkeys(PRECISIONS, 2.0**-126)}
    values = {f"t_{end}": bounds(t) for end, t in ends.items()}
    if x["clip"] == "none":
        values["t_far"], limits["far"] = (float("inf"), float("inf")), dict.fromkeys(PRECISIONS, 1.0)
    return Exact(values=values, limits=limits)


# Normals.
NORMAL: tuple[str, ...] = ("nx", "ny", "nz")


@certified
def sphere_normal(x: Inputs) -> Exact:
    """Return the unit normal outward at `p` of the sphere about `center`."""
    normal = unit(tuple(map(arb, minus(vector(x["p"]), vector(x["center"])))))
    return numbers_of("normal", dict(zip(NORMAL, normal, strict=True)), lambda name: ball_limit(arb(1), name))


@certified
def placed_normal(x: Inputs) -> Exact:
    """Return the unit normal in the world of the object-space normal `n`, by the inverse transpose of `matrix`."""
    m = [exact(number) for number in x["matrix"]]
    columns = [(m[i], m[4 + i], m[8 + i]) for i in range(3)]
    by = [cross(columns[1], columns[2]), cross(columns[2], columns[0]), cross(columns[0], columns[1])]
    det = dot(columns[0], by[0])
    n = vector(x["n"])
    turned = [sum((by[k][i] * n[k] for k in range(3)), fmpq(0)) / det for i in range(3)]
    normal = unit(tuple(map(arb, turned)))
    sizes = [arb(sum((dot(row, row) for row in rows), fmpq(0))).sqrt() for rows in (columns, by)]
    condition = sizes[0] * sizes[1] / abs(arb(det))
    return numbers_of("normal", dict(zip(NORMAL, normal, strict=True)), lambda name: ball_limit(condition, name))


@certified
def facing(x: Inputs) -> Exact:
    """Return `n`, turned against `d`."""
    n, d = vector(x["n"]), vector(x["d"])
    side = dot(n, d)
    size = length(n) * length(d)
    normal = dict(zip(NORMAL, ((-arb(c) if side > 0 else arb(c)) for c in n), strict=True))
    decided = {name for name in PRECISIONS if abs(arb(side)) > ball_limit(size, name)}
    answer = numbers_of("normal", normal, lambda name: ball_limit(length(n), name))
    return Exact(
        values=answer.values, limits={"normal": {k: v for k, v in answer.limits["normal"].items() if k in decided}}
    )


@certified
def box_normal(x: Inputs) -> Exact:
    """Return the outward normal of the face of the cube [-0.5, 0.5]^3 that the ray hits first."""
    o, d = vector(x["o"]), vector(x["d"])
    half = fmpq(1, 2)
    moving = [axis for axis in range(3) if d[axis] != 0]
    ends = {axis: sorted(((-half - o[axis]) / d[axis], (half - o[axis]) / d[axis])) for axis in moving}
    enter, leave = max(ends[axis][0] for axis in moving), min(ends[axis][1] for axis in moving)
    entering = enter > 0
    t = enter if entering else leave
    chosen = next(axis for axis in moving if ends[axis][0 if entering else 1] == t)
    sign = -1 if (d[chosen] > 0) == entering else 1
    size = length(o) + arb(1) + arb(t) * length(d)
    # The other faces' planes must be farther from the hit than the error of the hit.
    clear = min(abs(half - abs(o[axis] + t * d[axis])) for axis in range(3) if axis != chosen)
    normal = {name: arb(sign if axis == chosen else 0) for axis, name in enumerate(NORMAL)}
    cosine = arb(abs(d[chosen])) / length(d)
    limits = {
        name: upwards(ball_limit(arb(1), name)) for name in PRECISIONS if arb(clear) > ball_limit(size, name) / cosine
    }
    return Exact(values={name: bounds(value) for name, value in normal.items()}, limits={"normal": limits})


# Shadow rays: a ray that hits a surface, a light, and a blocking plane through `blocker`, parallel to the surface at
# the hit.


@certified
def visible(x: Inputs) -> Exact:
    """Return whether the light is visible from the ray's hit on the plane or the sphere."""
    o, d, light = balls(x["o"]), balls(x["d"]), balls(x["light"])
    point, normal = balls(x["point"]), balls(x["normal"])
    if x["radius"] != "":
        c, r = balls(x["center"]), arb(x["radius"])
        f = minus(o, c)
        a, h = dot(d, d), dot(f, d)
        t = (-h - (h * h - a * (dot(f, f) - r * r)).sqrt()) / a
        hit = plus(o, scaled(d, t))
        upward, size = unit(minus(hit, c)), dot(c, c).sqrt() + r
    else:
        t = dot(normal, minus(point, o)) / dot(normal, d)
        hit, upward, size = plus(o, scaled(d, t)), unit(normal), dot(point, point).sqrt()
    across = unit(normal)
    above = dot(upward, minus(light, hit))
    size = dot(o, o).sqrt() + size + abs(t) * dot(d, d).sqrt()
    gaps, lit = [abs(above)], bool(above > 0)
    if x["blocker"] != "":
        blocker = balls(x["blocker"])
        before, after = dot(across, minus(blocker, hit)), dot(across, minus(light, blocker))
        gaps += [abs(before), abs(after)]
        lit = lit and not (before > 0 and after > 0)
        size = size + dot(blocker, blocker).sqrt()
    # The error of a hit along the ray is that along the normal over the cosine; a blocker parallel to the surface only
    # depends on the latter.
    clearance = gaps[0]
    for gap in gaps[1:]:
        clearance = clearance.min(gap)
    decision = {name: str(int(lit)) if clearance > ball_limit(size, name) else EITHER for name in PRECISIONS}
    return Exact(decision=decision, clearance=float(clearance.mid()))


@certified
def above(x: Inputs) -> Exact:
    """Return whether a light in the direction `light` is above the horizon of a surface with the normal `normal`."""
    n, away = vector(x["normal"]), vector(x["light"])
    height, size = arb(dot(n, away)), length(n) * length(away)
    right = "1" if height > 0 else "0"
    return Exact(decision={name: right if abs(height) > ball_limit(size, name) else EITHER for name in PRECISIONS})


# Light.


def _value(value: arb, noise: arb, roundings: int = 16) -> Exact:
    return numbers_of("value", {"e": value}, lambda name: ball_limit(noise, name, roundings))


@certified
def facing_light(x: Inputs) -> Exact:
    """Return the irradiance of a surface that faces the light: Phi / (4 pi r^2)."""
    squared = arb(dot(vector(x["away"]), vector(x["away"])))
    e = arb(x["flux"]) / (4 * arb.pi() * squared)
    return _value(e, e)


@certified
def cosine(x: Inputs) -> Exact:
    """Return dot(N, L) with the unit vector L to the light."""
    n, away = vector(x["normal"]), vector(x["away"])
    return _value(arb(dot(n, away)) / length(away), arb(1))


@certified
def lit(x: Inputs) -> Exact:
    """Return Phi max(dot(N, L), 0) / (4 pi r^2), 0 for a light at the point."""
    n, away = vector(x["normal"]), vector(x["away"])
    squared, above = dot(away, away), dot(n, away)
    if squared == 0:
        return _value(arb(0), arb(0))
    e = arb(x["flux"]) / (4 * arb.pi() * arb(squared))
    return _value(e * arb(above) / arb(squared).sqrt() if above > 0 else arb(0), e)


@certified
def simplified(x: Inputs) -> Exact:
    """Return the lecture's simplified light, Phi max(dot(N, L), 0)."""
    n, away = vector(x["normal"]), vector(x["away"])
    above = dot(n, away)
    flux = arb(x["flux"])
    return _value(flux * arb(above) / length(away) if above > 0 else arb(0), flux)


@certified
def summed(x: Inputs) -> Exact:
    """Return the sum of the contributions `lights`, numbers with blanks between them."""
    parts = [exact(float(number)) for number in x["lights"].split()]
    total = sum(parts, fmpq(0))
    return _value(arb(total), arb(sum((abs(part) for part in parts), fmpq(0))), 16 + len(parts))


def _channels(values: Sequence[arb]) -> Exact:
    largest = values[0]
    for value in values[1:]:
        largest = largest.max(value)
    return numbers_of("value", dict(zip("rgb", values, strict=False)), lambda name: ball_limit(largest, name))


@certified
def exitance(x: Inputs) -> Exact:
    """Return albedo times irradiance, per channel."""
    return _channels([arb(exact(a) * exact(e)) for a, e in zip(x["albedo"], x["irradiance"], strict=True)])


@certified
def radiance(x: Inputs) -> Exact:
    """Return exitance / pi, per channel."""
    return _channels([arb(value) / arb.pi() for value in x["exitance"]])


@certified
def simplified_radiance(x: Inputs) -> Exact:
    """Return the exitance itself: the simplified model has no 1 / pi."""
    return _channels([arb(value) for value in x["exitance"]])


@certified
def dark(x: Inputs) -> Exact:
    """Return 1 if a ray along `d` sees the back of a one-sided surface with the normal `n`."""
    n, d = vector(x["n"]), vector(x["d"])
    side, size = arb(dot(n, d)), length(n) * length(d)
    right = "1" if side >= 0 else "0"
    return Exact(decision={name: right if abs(side) > ball_limit(size, name) else EITHER for name in PRECISIONS})


# The nearer of two triangles.


def nearest(x: Inputs) -> Exact:
    """Return the number of the nearer triangle, 1 or 2."""
    answers = [triangle({"o": x["o"], "d": x["d"], **{name: x[f"{name}{k}"] for name in "abc"}}) for k in (1, 2)]
    with precision(BITS):
        ends = [answer.values["t_in"] for answer in answers]
        right = "1" if ends[0][0] <= ends[1][0] else "2"
        decision = {}
        for name in PRECISIONS:
            limits = [answer.limits["t"].get(name) for answer in answers]
            gap = abs(ends[0][0] - ends[1][0])
            clear = all(limit is not None for limit in limits) and gap > sum(limit or 0.0 for limit in limits)
            decision[name] = right if clear else EITHER
    return Exact(decision=decision)
