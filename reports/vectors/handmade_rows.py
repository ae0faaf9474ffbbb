"""Rows made by hand: special values, faces of boxes, starts on surfaces and in middles, cases that users reported.

Each is (file, question, inputs, why, kind); a kind of "" is derived from the answer. Every number is a float32.
"""

from collections.abc import Iterator
from itertools import product

from rayproof.reports.vectors import Numbers

Vector = tuple[float, ...]
Made = tuple[str, str, dict[str, Numbers], str, str]
ORIGIN: Vector = (0.0, 0.0, 0.0)
UNIT_BOX: tuple[Vector, Vector] = ((-0.5, -0.5, -0.5), (0.5, 0.5, 0.5))
MIDDLE: Vector = (0.5, -0.25, 1.0)
REPORTS = {
    "middle of a sphere": "https://github.com/turanszkij/WickedEngine/issues/1695",
    "middle of a box": "https://github.com/stackgl/ray-aabb-intersection/issues/3",
    "1 mm": "https://github.com/ziotom78/pytracer/issues/22",
    "300 km": "https://github.com/mitsuba-renderer/mitsuba2/issues/171",
    "nested": "https://github.com/RayTracing/raytracing.github.io/issues/1130",
    "small triangles": "https://github.com/jbikker/tinybvh/pull/283",
}


def made() -> Iterator[Made]:
    """Yield all rows made by hand."""
    for part in (_spheres, _boxes, _planes, _squares, _triangles, _cameras, _normals, _light):
        yield from part()


def _sphere(o: Vector, d: Vector, why: str, center: Vector = ORIGIN, radius: float = 1.0, kind: str = "") -> Made:
    return "sphere", "distance", {"o": o, "d": d, "center": center, "radius": radius}, why, kind


def _spheres() -> Iterator[Made]:
    for speed in (1.0, 0.125, 3.0):
        yield _sphere((0.0, 0.0, -3.0), (0.0, 0.0, speed), f"Straight at the middle, a direction of length {speed:g}.")
        yield _sphere((0.25, 0.5, 0.0), (0.0, speed, 0.0), f"From inside, a direction of length {speed:g}.")
    yield _sphere((-2.0, 1.0, 0.0), (1.0, 0.0, 0.0), "Touches the outline exactly.")
    yield _sphere((1.0, 0.0, 0.0), (1.0, 0.0, 0.0), "From the surface outward: nothing ahead, or the start itself.")
    yield _sphere((1.0, 0.0, 0.0), (-1.0, 0.0, 0.0), "From the surface inward: the far side, or the start itself.")
    yield _sphere((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), "From the surface along it.")
    yield _sphere(ORIGIN, (0.0, 0.0, 0.0), "A direction of length 0.")
    yield _sphere((3.0, 0.25, 0.0), (1.0, 0.0, -0.0), "The sphere lies behind.", kind="behind")
    why = f"From the very middle ({REPORTS['middle of a sphere']})."
    yield _sphere(MIDDLE, (0.0, -1.0, 0.0), why, MIDDLE, 2.0, "reported")
    why = f"A sphere of 1 mm from 3 m ({REPORTS['1 mm']})."
    yield _sphere((0.0, -3.0, 0.0), (2.0**-13, 1.0, 0.0), why, radius=2.0**-10, kind="reported")
    for height in (3.0, 8e3, 2e5):
        why = f"A sphere of 300 km from {height:g} m above ({REPORTS['300 km']})."
        yield _sphere((0.0, 0.0, 3e5 + height), (0.0, 0.0625, -1.0), why, radius=3e5, kind="reported")
    for radius in (1.0, 1.015625, 1.984375):
        why = f"One of spheres around each other ({REPORTS['nested']})."
        yield _sphere((0.125, -0.125, 0.0), (0.5, 0.75, 0.25), why, radius=radius, kind="reported")


def _box(o: Vector, d: Vector, why: str, ends: tuple[Vector, Vector] = UNIT_BOX, kind: str = "") -> Made:
    return "box", "distance", {"o": o, "d": d, "min": ends[0], "max": ends[1]}, why, kind


def _boxes() -> Iterator[Made]:
    for axis, sign in product(range(3), (1.0, -1.0)):
        d = tuple(sign if k == axis else 0.0 for k in range(3))
        yield _box(ORIGIN, d, f"From the very middle ({REPORTS['middle of a box']}).", kind="reported")
        yield _box((0.25, 0.125, -0.25), d, "From inside, along an axis.")
        yield _box(tuple(-3 * c for c in d), d, "Straight at a face, along an axis.")
        yield _box(tuple(3 * c for c in d), d, "The box lies behind.", kind="behind")
        yield _box(tuple(0.5 * c for c in d), tuple(-c for c in d), "From a face inward.")
    for low, high in (((1.0, 2.0, 3.0), (1.5, 4.0, 3.25)), ((-8.0, 0.25, -2.0), (-4.0, 0.5, 6.0))):
        center = tuple((a + b) / 2 for a, b in zip(low, high, strict=True))
        for d in ((0.5, 0.75, 1.0), (-1.0, 0.25, 0.5), (0.0, -1.0, 0.125), (0.75, -0.5, -1.0)):
            o = tuple(c - 4 * e + 0.03125 for c, e in zip(center, d, strict=True))
            yield _box(o, d, "A box somewhere, of three sizes.", (low, high))
            yield _box(center, d, "From the middle of a box somewhere.", (low, high))


def in_faces() -> Iterator[tuple[Made, tuple[int, int, int]]]:
    """Yield rays in each face's plane, with zeros of both signs, and (axis, side, 1 for -0)."""
    for axis, side, minus in product(range(3), (-1, 1), (0, 1)):
        zero = -0.0 if minus else 0.0
        o, d = [0.0, 0.0, 0.0], [zero, zero, zero]
        o[axis], o[(axis + 1) % 3], o[(axis + 2) % 3] = side * 0.5, -2.0, 0.25
        d[(axis + 1) % 3] = 1.0
        why = f"In the {'high' if side > 0 else 'low'} face's plane, with {'-0' if minus else '+0'}."
        yield _box(tuple(o), tuple(d), why, kind="shared"), (axis, side, minus)


def _planes() -> Iterator[Made]:
    point = (1.0, -2.0, 0.5)
    for normal, side in product(((0.0, 0.0, 1.0), (1.0, 0.0, 0.0), (0.5, -0.25, 0.75), (-2.0, 1.0, 2.0)), (1.0, -1.0)):
        o = tuple(p + 3 * side * n + e for p, n, e in zip(point, normal, (0.25, 0.125, -0.5), strict=True))
        for way, why, kind in ((-side, "Straight at a plane.", ""), (side, "The plane lies behind.", "behind")):
            inputs: dict[str, Numbers] = {"o": o, "d": tuple(way * n for n in normal), "point": point, "normal": normal}
            yield "plane", "distance", inputs, why, kind


def _squares() -> Iterator[Made]:
    center, o = (0.5, 1.0, -2.0), (1.0, -2.0, 5.0)
    shapes = (
        ((1.0, 0.0, 0.0), (0.0, 2.0, 0.0)),
        ((1.0, 0.25, 0.0), (0.5, 1.0, 0.75)),
        ((4.0, 0.0, 0.0), (3.0, 0.5, 0.0)),
    )
    for (width, height), i, j in product(shapes, (-0.75, 0.0, 0.875, 1.25), (-0.9375, 0.5, 1.125)):
        target = (c + i * w + j * h for c, w, h in zip(center, width, height, strict=True))
        d = tuple((a - b) / 8 for a, b in zip(target, o, strict=True))
        inputs: dict[str, Numbers] = {"o": o, "d": d, "center": center, "half_width": width, "half_height": height}
        yield "square", "distance", inputs, "A parallelogram, inside it and beside it.", ""


def _triangle(o: Vector, d: Vector, why: str, side: float = 2.0, kind: str = "") -> Made:
    inputs: dict[str, Numbers] = {"o": o, "d": d, "a": ORIGIN, "b": (side, 0.0, 0.0), "c": (0.0, side, 0.0)}
    return "triangle", "distance", inputs, why, kind


def _triangles() -> Iterator[Made]:
    places = (
        ((0.5, 0.5), "Inside."),
        ((1.0, 0.0), "On an edge."),
        ((1.0, 1.0), "On the long edge."),
        ((0.0, 0.0), "On a vertex."),
        ((2.0, 0.0), "On a vertex."),
        ((1.0, -0.25), "Beside an edge."),
        ((1.25, 1.25), "Beside the long edge."),
        ((-0.5, 2.5), "Beside a vertex."),
    )
    for (place, why), z in product(places, (1.0, -1.0)):
        yield _triangle((*place, 2 * z), (0.0, 0.0, -z), why)
    yield _triangle((0.5, 0.5, -1.0), (0.0, 0.0, -1.0), "It lies behind.", kind="behind")
    yield _triangle((-1.0, 0.5, 0.0), (1.0, 0.0, 0.0), "In its plane.")
    yield _triangle((-1.0, 0.5, 1.0), (1.0, 0.0, 0.0), "Along its plane.")
    for power in (10, 11, 13, 17, 23):
        side = 2.0**-power
        why = f"A side of {side:.2g} m ({REPORTS['small triangles']})."
        yield _triangle((side / 4, side / 4, 1.0), (0.0, 0.0, -1.0), why, side, "reported")
    corners = {"a": (-1.0, -1.0), "b": (2.0, -1.0), "c": (-1.0, 2.0)}
    for o, d in (((0.25, 0.5, 4.0), (0.0, 0.0, -1.0)), ((0.5, -0.25, -4.0), (0.0, 0.0, 1.0))):
        inputs: dict[str, Numbers] = {"o": o, "d": d}
        for name, (x, y) in corners.items():
            inputs |= {f"{name}1": (x, y, 0.5), f"{name}2": (x, y, 1.0)}
        yield "nearest", "nearest", inputs, "Two triangles, half a unit apart.", ""


def _cameras() -> Iterator[Made]:
    place: dict[str, Numbers] = {"eye": (1.0, -4.0, 2.0), "target": (0.0, 0.5, 0.25), "up": (0.0, 0.25, 1.0)}
    pixels = ((64, 48, 0, 0), (64, 48, 63, 47), (64, 48, 12, 40), (97, 33, 48, 16), (97, 33, 5, 30))
    for pixel, fovy in product(pixels, (40.0, 100.0)):
        numbers = zip(("width", "height", "column", "row"), map(float, pixel), strict=True)
        inputs = place | {"fovy": fovy, "near": 0.125, "far": 128.0, **dict(numbers)}
        yield "camera_ray", "direction", inputs, "The centre of a pixel; row 0 is the top one.", ""


def _normals() -> Iterator[Made]:
    for axis, sign in product(range(3), (1.0, -1.0)):
        o = tuple(2 * sign if k == axis else 0.125 for k in range(3))
        d = tuple(-sign if k == axis else 0.0625 for k in range(3))
        yield "normals", "box", {"o": o, "d": d}, "Each face of a box.", ""
        inputs: dict[str, Numbers] = {"p": tuple(c / 2 + 1 for c in o), "center": (1.0, 1.0, 1.0)}
        yield "normals", "sphere", inputs, "Each side of a sphere.", ""


def _light() -> Iterator[Made]:
    for flux, away in product((1.0, 100.0), ((1.0, 2.0, 2.0), (-2.0, 1.0, 2.0), (0.5, 0.25, -1.0))):
        light: dict[str, Numbers] = {"flux": flux, "normal": (0.0, 0.0, 1.0), "away": away}
        yield "irradiance", "lit", light, "A light above or below the horizon.", ""
        yield "irradiance", "simplified", light, "The lecture's simplified light, above or below the horizon.", ""
    yield "irradiance", "sum", {"lights": "0.5 0.25 4 0.125"}, "Four lights.", ""
    for channels in ((4.0, 0.25, 0.5), (0.75, 0.5, 0.25), (2.0, 2.0, 2.0)):
        lit: dict[str, Numbers] = {"albedo": (0.75, 0.5, 0.25), "irradiance": channels}
        yield "radiance", "exitance", lit, "Three channels.", ""
        yield "radiance", "radiance", {"exitance": channels}, "Three channels.", ""
        yield "radiance", "simplified", {"exitance": channels}, "Three channels of the simplified model.", ""
