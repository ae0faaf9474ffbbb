"""Family `combined`: every pair of settings of camera, shape, placement, light and clipping together (covering array).

A mistake that needs two settings at once (an oblique `up` in a wide image, a mesh of centimetres under a mirror) is not
visible in a case that varies one of them. So every two values of different settings occur together in a lit scene: a
shape that fills the view, and a backdrop on which its shadow falls. The rows come from a deterministic greedy search
after Cohen, Dalal, Fredman and Patton, The AETG system, IEEE Transactions on Software Engineering 23 (1997): of the
rows that begin with a missing pair, the first with the most missing pairs is taken.

All lengths are in sizes of the shape, so that no pair is impossible; three settings may be, see `_possible`.
"""

from collections import Counter
from collections.abc import Iterator
from dataclasses import replace
from itertools import combinations
from math import cos, radians, sin, tan
from typing import Any, cast

import numpy as np

from rayproof.cases.case import Case, covering
from rayproof.cases.placement import compose, mapped, rotation, scaling, shear, translation, unit
from rayproof.cases.scene import (
    IDENTITY,
    SHADINGS,
    Camera,
    Clip,
    Cube,
    Matrix,
    Mesh,
    Plane,
    PointLight,
    Rgb,
    Scene,
    Shading,
    Shape,
    Sphere,
    Square,
    Triangle,
    Vector,
)

KINDS = {"sphere": Sphere, "cube": Cube, "square": Square, "plane": Plane, "triangle": Triangle, "mesh": Mesh}
# The values of each setting; settings that restrict each other come first.
SETTINGS: dict[str, tuple[str, ...]] = {
    "shape": tuple(KINDS),
    "matrix": ("none", "turned", "stretched", "sheared", "mirrored"),
    "size": ("1cm", "1m", "100m"),
    "eye": ("origin", "near", "far"),
    "attitude": ("level", "steep", "rolled"),
    "image": ("square", "portrait", "2to1", "wider", "odd"),
    "lights": ("one", "three", "near", "far", "coloured"),
    "up": ("perpendicular", "tilted", "short", "long"),
    "fovy": ("15", "45", "90"),
    "clip": ("depth", "shell", "none"),
    "shading": SHADINGS,
    "sides": ("one", "two"),
}
SIZES = {"1cm": 0.01, "1m": 1.0, "100m": 100.0}  # m
IMAGES = {"square": (44, 44), "portrait": (32, 60), "2to1": (64, 32), "wider": (90, 26), "odd": (51, 37)}  # px
EYES: dict[str, Vector] = {"origin": (0.0, 0.0, 0.0), "near": (0.9, -0.7, 0.5), "far": (30.0, -32.0, 24.0)}  # sizes
ALONG_X: Matrix = ((0, 0, -1, 0), (-1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 0, 1))  # axes of a camera that looks along +x
CUT = 0.8  # of the way from the image's middle to a corner, clipping begins
BEHIND = 1.25  # sizes from the shape's middle to the backdrop
WARM: Rgb = (1.0, 0.35, 0.1)
WHITE: Rgb = (1.0, 1.0, 1.0)
# Positions of lights relative to the shape's middle (right, up and towards the eye, in sizes), and their colours.
LIGHTS: dict[str, tuple[tuple[tuple[float, float, float], Rgb], ...]] = {
    "one": (((1.6, 1.2, 3.4), WHITE),),
    "three": (((1.5, 1.4, 3.0), WHITE), ((-2.2, 0.6, 2.9), (0.5, 0.5, 0.5)), ((0.4, -1.7, 4.1), (0.7, 0.7, 0.7))),
    "near": (((0.3, 0.25, 0.95), WHITE),),
    "far": (((420.0, 330.0, 850.0), WHITE),),
    "coloured": (((-1.5, 1.3, 3.1), WARM),),
}
POWER = {"inverse_square": 40.0, "simplified": 0.8}  # W per square metre of distance, or the light's RGB
ALBEDO: Rgb = (0.75, 0.45, 0.3)
TRIANGLE = np.array(((-0.62, -0.5, 0.05), (0.66, -0.42, -0.1), (-0.04, 0.7, 0.08)))

Row = dict[str, str]
Pair = frozenset[tuple[str, str]]
STARTS = 8  # the number of missing pairs that are tried as the beginning of a row


def _possible(row: Row) -> bool:
    """Return whether a row, or its chosen part, has a lit scene.

    Without a matrix a cube and a square are 1 m large and about the origin, and the plane is z = 0. So the eye cannot
    be in the origin, which is inside them, nor far away from a cube or a square. A level view shows no face of a square
    in z = 0, and a horizon of the plane.
    """
    if row.get("matrix") != "none" or row.get("shape") not in ("cube", "square", "plane"):
        return True
    if row.get("eye") == "origin" or (row["shape"] != "cube" and row.get("attitude") == "level"):
        return False
    return row["shape"] == "plane" or (row.get("size") in (None, "1m") and row.get("eye") in (None, "near"))


def pairs(row: Row) -> list[Pair]:
    """Return every pair of settings of a row with their values."""
    return [frozenset(two) for two in combinations(row.items(), 2)]


def rows() -> list[Row]:
    """Return rows that have every pair of values of two settings."""
    missing = {
        frozenset(((first, choice), (second, another))): None
        for first, second in combinations(SETTINGS, 2)
        for choice in SETTINGS[first]
        for another in SETTINGS[second]
    }
    chosen: list[Row] = []
    while missing:
        used = Counter(item for row in chosen for item in row.items())
        tried = [_filled(dict(start), missing, used) for start in list(missing)[:STARTS]]
        chosen.append(max(tried, key=lambda row: sum(pair in missing for pair in pairs(row))))
        for pair in pairs(chosen[-1]):
            missing.pop(pair, None)
    return chosen


def _filled(row: Row, missing: dict[Pair, None], used: Counter[tuple[str, str]]) -> Row:
    """Return a row with the given beginning; each further value has the most missing pairs with the values before it.

    Among equals, the least used value is taken.
    """
    for name, values in SETTINGS.items():
        if name not in row:
            before = list(row.items())
            possible = [(name, value) for value in values if _possible({**row, name: value})]
            best = max(
                possible, key=lambda item: (sum(frozenset((item, old)) in missing for old in before), -used[item])
            )
            row[name] = best[1]
    return {name: row[name] for name in SETTINGS}


def pebble() -> tuple[np.ndarray, np.ndarray]:
    """Return a bumpy octahedron of 512 faces, some 1 across: of its centimetre size no face is 1 mm^2 large."""
    corners = np.concatenate([np.eye(3), -np.eye(3)])
    faces = np.array([(0, 1, 2), (1, 3, 2), (3, 4, 2), (4, 0, 2), (1, 0, 5), (3, 1, 5), (4, 3, 5), (0, 4, 5)])
    for _ in range(3):
        whole = corners[faces]
        middles = (whole + whole[:, (1, 2, 0)]) / 2
        first, second, third = (np.stack([whole[:, k], middles[:, k], middles[:, k - 1]], axis=1) for k in range(3))
        every = np.concatenate([first, second, third, middles]).reshape(-1, 3)
        corners, indices = np.unique(every, axis=0, return_inverse=True)
        faces = indices.reshape(-1, 3)
    sphere = unit(corners)
    bumps = 0.04 * np.sin(5 * sphere[:, 0] + 1) * np.sin(4 * sphere[:, 1] + 2) * np.sin(6 * sphere[:, 2])
    return (0.5 + bumps[:, None]) * sphere, faces


def _attitude(row: Row, azimuth: float) -> Matrix:
    """Return the rotation from the camera's axes (right, up, towards the eye) into the world."""
    pitch, roll = {"level": (0, 0), "steep": (-63, 0), "rolled": (-37, 58)}[row["attitude"]]
    return compose(
        rotation((0, 0, 1), azimuth), rotation((0, 1, 0), -pitch), ALONG_X, rotation((0, 0, 1), roll)
    )  # fmt: skip


def _upward(row: Row, axes: np.ndarray) -> np.ndarray:
    """Return `up`: across the view; the world's vertical, or leaning where that is across; of another length."""
    if row["up"] == "tilted" and row["attitude"] == "steep":
        return np.array((0.0, 0.0, 1.0))
    lean = 0.0 if row["up"] == "perpendicular" else 0.6
    length = {"short": 0.1, "long": 10.0}.get(row["up"], 1.0)
    return length * (axes @ (0.0, cos(lean), sin(lean)))


def _matrix(row: Row, place: Matrix) -> Matrix:
    """Return the shape's matrix: its z axis towards the eye or, of a flat shape with two sides, away from it."""
    away = row["sides"] == "two" and row["shape"] in ("square", "plane", "triangle")
    deformed = {
        "turned": IDENTITY,
        "stretched": scaling(1.3, 0.8, 1.1),
        "sheared": shear(xy=0.4, xz=0.3, yz=-0.25),
        "mirrored": scaling(-1.1, 1.0, 0.9),
    }[row["matrix"]]
    return compose(place, rotation((0, 1, 0), 180.0 * away), rotation((0.5, -0.8, 0.3), 24), deformed)


def _shape(row: Row, place: Matrix) -> Shape:
    """Return the shape of a row; without a matrix its own numbers, if it has any, give it place and size."""
    bare = row["matrix"] == "none"
    about: Any = {"albedo": ALBEDO, "two_sided": row["sides"] == "two"}
    about["to_world"] = IDENTITY if bare else _matrix(row, place)
    inner = np.asarray(place if bare else IDENTITY)
    if row["shape"] == "sphere":
        about |= {"center": tuple(inner[:3, 3]), "radius": float(np.linalg.norm(inner[:3, 0])) / 2}
    elif row["shape"] in ("triangle", "mesh"):
        corners, faces = pebble() if row["shape"] == "mesh" else (TRIANGLE, None)
        about["vertices"] = corners @ inner[:3, :3].T + inner[:3, 3]
        about |= {} if faces is None else {"faces": faces}
    return KINDS[row["shape"]](**about)


def _far(camera: Camera, axes: np.ndarray, wall: Shape, clip: str) -> float:
    """Return the clip distance that cuts a flat wall at the deepest of four points near the image's corners."""
    matrix, slope = np.asarray(wall.to_world), tan(camera.alpha)
    normal = np.cross(matrix[:3, 0], matrix[:3, 1])
    depths = []
    for x, y in ((-CUT, -CUT), (CUT, -CUT), (-CUT, CUT), (CUT, CUT)):
        ray = axes @ (x * slope * camera.aspect, y * slope, -1.0)
        depth = normal @ (matrix[:3, 3] - camera.eye) / (normal @ ray)
        depths.append(depth * (np.linalg.norm(ray) if clip == "shell" else 1.0))
    return float(max(depths))


def scene(row: Row, azimuth: float) -> Scene:
    """Return the scene of a row, seen in a direction [degrees from +x towards +y]."""
    size, fovy, (width, height) = SIZES[row["size"]], float(row["fovy"]), IMAGES[row["image"]]
    attitude = _attitude(row, azimuth)
    axes = np.asarray(attitude)[:3, :3]
    distance = size * (0.35 + 0.62 / tan(radians(fovy / 2)))
    eye = size * np.array(EYES[row["eye"]])
    middle = eye - distance * axes[:, 2]
    if row["matrix"] == "none" and row["shape"] in ("cube", "square", "plane"):
        # The shape cannot be moved before the eye, so the eye is moved before the shape, on its upper side.
        middle = size * np.array((0.03, -0.02, 0.0)) + (row["eye"] == "far") * eye * (1, 1, 0)
        eye = middle + distance * axes[:, 2]
    place = compose(translation(*middle), attitude, scaling(size, size, size))
    shape = _shape(row, place)
    # If the shape is a plane, the other shape is in front of it; otherwise the other shape is the backdrop.
    ahead, width_of_other = (0.45, 0.4) if row["shape"] == "plane" else (-BEHIND, 60.0)
    turned = compose(
        translation(0, 0, ahead), rotation((0.6, 0.8, 0.1), 14), scaling(width_of_other, width_of_other, 1)
    )
    square = Square(albedo=(0.35, 0.55, 0.7), to_world=compose(place, turned))
    lights = []
    for offset, color in LIGHTS[row["lights"]]:
        power = POWER[row["shading"]]
        if row["shading"] == "inverse_square":
            power *= (size * float(np.linalg.norm(offset))) ** 2
        red, green, blue = color
        lights.append(PointLight(position=mapped(place, offset), flux=(power * red, power * green, power * blue)))
    camera = Camera(
        eye=tuple(eye),
        target=tuple(middle),
        up=tuple(_upward(row, axes)),
        fovy=fovy,
        width=width,
        height=height,
        near=0.02 * size,
        far=1e6 * size,
    )
    wall = shape if row["shape"] == "plane" else square
    return Scene(
        camera=replace(camera, far=_far(camera, axes, wall, row["clip"])),
        shapes=(shape, square),
        lights=tuple(lights),
        shading=cast(Shading, row["shading"]),
        clip=cast(Clip, row["clip"]),
    )


def combined() -> Iterator[Case]:
    """Yield a case per row of the covering array."""
    for index, row in enumerate(rows()):
        built = scene(row, azimuth=31 + 67.3 * index)
        yield Case(
            name=f"combined/{index:02}_{row['shape']}_{row['matrix']}",
            scene=built,
            stresses=f"All pairs: {', '.join(f'{name} {value}' for name, value in row.items())}.",
            covers=covering(built),
            least_interior=1700,
        )
