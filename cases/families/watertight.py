"""Family `watertight`: meshes whose inner edges and vertices are hit exactly by rays: nets, fans, slabs, canopies.

Every corner is a sum of few powers of two, so that float32 represents it exactly, and so is every ray's direction, up
to its length: a pixel's side is 2^-6 of the depth, and the camera's axes are whole numbers over 3 or 5. In exact
arithmetic a ray passes through its vertex or edge; for a computed ray, rounding decides which of the adjacent faces is
hit, but one of them must be hit.

Formulas of HIT-6 are not run on these cases: Cramer's rule rounds an edge differently in the two triangles that share
it, and is right if no ray is so close to an edge.
"""

import math
from collections.abc import Iterator

import numpy as np

from rayproof.cases.case import Case, Expectation, ShadowOutline, covering
from rayproof.cases.placement import compose, scaling, translation
from rayproof.cases.scene import Camera, Matrix, Mesh, PointLight, Scene, Shape, Square, Vector

SEED = 31
STEP = 2.0**-6  # of the depth: a pixel's side
ALBEDO = (0.7, 0.55, 0.4)
WALL_ALBEDO = (0.3, 0.6, 0.8)
# Three times a rotation, columns right, up and back: no axis of the view is an axis of the world.
AXES = np.array(((2.0, -1.0, 2.0), (2.0, 2.0, -1.0), (-1.0, 2.0, 2.0)))
# [px] One vertex for 13 pixels, and no edge between neighbours meets another pixel's centre.
ACROSS, UPWARD = (3.0, 1.0), (-1.0, 4.0)
ORIGIN, FAR_AWAY = (0.0, 0.0, 0.0), (60000.0, -70000.0, 40000.0)  # m
# Of a fan's hub [px]: pixels in the middle of its spokes, counter-clockwise, each the next but one a quarter turn on.
MIDDLES = ((4, 1), (2, 3), (-1, 4), (-3, 2), (-4, -1), (-2, -3), (1, -4), (3, -2))

Points = np.ndarray  # (n, 2) px from the middle of the image, rightwards and upwards
Corners = np.ndarray  # (n, 3) m


def camera(eye: Vector, *, width: int, height: int, far: float) -> Camera:
    """Return a camera with the axes of `AXES` whose pixels have sides of `STEP` of the depth."""
    target = np.asarray(eye) - far / 8 * AXES[:, 2]
    return Camera(
        eye=eye,
        target=target.tolist(),
        up=AXES[:, 1].tolist(),
        fovy=2 * math.degrees(math.atan(height * STEP / 2)),
        width=width,
        height=height,
        near=far / 256,
        far=far,
    )


def seen_at(eye: Vector, points: Points, thirds: np.ndarray) -> Corners:
    """Return the corners at image points and three times a depth [m], one for each (n,) or a common one.

    Raises:
        ValueError: float32 cannot represent a corner, so that its ray would miss it.

    """
    local = np.column_stack([STEP * points, np.full(len(points), -1.0)])
    corners = local * np.reshape(thirds, (-1, 1)) @ AXES.T + np.asarray(eye)
    if not np.array_equal(corners, corners.astype(np.float32)):
        raise ValueError("a corner is no float32 number")
    return corners


def centres(width: int, height: int) -> Points:
    """Return the centres of all pixels, row by row."""
    rows, columns = np.mgrid[:height, :width]
    return np.column_stack([columns.ravel() + 0.5 - width / 2, height / 2 - rows.ravel() - 0.5])


def cells(rows: int, columns: int) -> np.ndarray:
    """Return the two triangles (faces, 3) of each cell between `rows` times `columns` vertices, counter-clockwise."""
    corner = (np.arange(rows - 1)[:, np.newaxis] * columns + np.arange(columns - 1)).reshape(-1, 1)
    halves = np.array(((0, 1, columns + 1), (0, columns + 1, columns)))
    return np.concatenate([corner + half for half in halves])


def net(
    eye: Vector,
    *,
    width: int,
    height: int,
    thirds: float,
    across: tuple[float, float] = ACROSS,
    upward: tuple[float, float] = UPWARD,
    middles: bool = False,
    relief: float = 1 / 32,
) -> Mesh:
    """Return a net at random depths that covers the image, with a vertex at a pixel's centre wherever one is seen.

    With `middles` no vertex is, but the middle of each edge along `across`. `relief` is of the depth; its slopes are
    such that normals of neighbours are less than a right angle apart, so that no face shades another.
    """
    reach = np.arange(-max(width, height), max(width, height) + 1)
    i, j = (places.reshape(-1, 1) for places in np.meshgrid(reach, reach))
    points = centres(width, height)[0] % 1 + i * across + j * upward + np.multiply(across, 0.5 if middles else 0.0)
    faces = cells(len(reach), len(reach))
    beyond = (np.abs(points) > (width / 2 + 6, height / 2 + 6)).any(axis=1)
    used, numbers = np.unique(faces[~beyond[faces].any(axis=1)], return_inverse=True)
    depths = thirds * (1 + relief * np.random.default_rng(SEED).integers(0, 5, len(used)) / 4)
    return Mesh(albedo=ALBEDO, vertices=seen_at(eye, points[used], depths), faces=numbers.reshape(-1, 3))


def wall(eye: Vector, depth: float) -> Square:
    """Return a wall that fills the image at a depth [m], behind all else."""
    third, two = 1 / 3, 2 / 3  # `AXES` over 3
    turned: Matrix = ((two, -third, two, 0), (two, two, -third, 0), (-third, two, two, 0), (0, 0, 0, 1))
    place = np.asarray(eye) - depth / 3 * AXES[:, 2]
    return Square(albedo=WALL_ALBEDO, to_world=compose(translation(*place), turned, scaling(2 * depth, 2 * depth, 1.0)))


def beside(eye: Vector, thirds: float, flux: float) -> PointLight:
    """Return a light near the eye, to the right and above, whose `flux` [W] is that at a depth of 3 m."""
    place = np.asarray(eye) + thirds / 8 * (AXES[:, 0] + AXES[:, 1])
    return PointLight(position=place.tolist(), flux=(flux * thirds**2, 0.9 * flux * thirds**2, 0.8 * flux * thirds**2))


def fan(hub: tuple[float, float], count: int) -> tuple[Points, np.ndarray]:
    """Return image points and triangles of a fan around a hub, the first point."""
    middles = MIDDLES[:: 2 if count < len(MIDDLES) else 1]
    between = count // len(middles)
    rim = []
    for this, following in zip(middles, (*middles[1:], middles[0]), strict=True):
        rim.append(np.multiply(this, 2.0))
        start, end = math.atan2(this[1], this[0]), math.atan2(following[1], following[0])
        for part in range(1, between):
            turn = start + (end - start) % math.tau * part / between
            rim.append(np.round(8 * 64 * np.array((math.cos(turn), math.sin(turn)))) / 64)
    around = 1 + np.arange(count)
    return np.array([(0.0, 0.0), *rim]) + hub, np.column_stack([np.zeros(count, int), around, 1 + around % count])


def fans(hubs: tuple[tuple[tuple[float, float], int], ...], thirds: float) -> Mesh:
    """Return flat cones around hubs, with the same number of triangles each, as one mesh."""
    points, faces, depths, first = [], [], [], 0
    for hub, count in hubs:
        corners, triangles = fan(hub, count)
        points.append(corners)
        faces.append(first + triangles)
        depths += [thirds] + [thirds * (1 + 2 / 64)] * count
        first += len(corners)
    vertices = seen_at(ORIGIN, np.concatenate(points), np.array(depths))
    return Mesh(albedo=ALBEDO, vertices=vertices, faces=np.concatenate(faces))


def slab(half: int) -> Mesh:
    """Return a closed box with sides of 2 `half` m and a height of 1 m below z = 0, divided at whole metres."""
    squares = []
    for u in range(-half, half):
        for v in range(-half, half):
            squares.append(((u, v, 0), (u + 1, v, 0), (u + 1, v + 1, 0), (u, v + 1, 0)))
            squares.append(((u, v, -1), (u, v + 1, -1), (u + 1, v + 1, -1), (u + 1, v, -1)))
        # The four sides, each from its lower left corner, seen from outside.
        feet = (((u, -half), (u + 1, -half)), ((half, u), (half, u + 1)), ((u + 1, half), (u, half)))
        for start, end in (*feet, ((-half, u + 1), (-half, u))):
            squares.append(((*start, -1), (*end, -1), (*end, 0), (*start, 0)))
    vertices, numbers = np.unique(np.array(squares, dtype=float).reshape(-1, 3), axis=0, return_inverse=True)
    corners = numbers.reshape(-1, 4)
    return Mesh(albedo=ALBEDO, vertices=vertices, faces=np.concatenate([corners[:, :3], corners[:, [0, 2, 3]]]))


def canopy(camera: Camera, light: Vector, half: int) -> Mesh:
    """Return a net that shades a square of 2 `half` pixels a side on z = 0, with a vertex on the way to it.

    The camera is below it and looks straight down. The vertices of the border are half a pixel farther out.
    """
    pixel = STEP * camera.eye[2]
    along = np.concatenate([[-half], np.arange(-half + 0.5, half), [half]]) * pixel
    y, x = (grid.ravel() for grid in np.meshgrid(along, along, indexing="ij"))
    floor = np.column_stack([x, y, np.zeros(len(x))])
    share = np.random.default_rng(SEED).integers(128, 132, len(floor)).reshape(-1, 1) / 256
    return Mesh(
        albedo=ALBEDO, vertices=floor + share * (np.asarray(light) - floor), faces=cells(len(along), len(along))
    )


def looking_down(height: float, *, width: int, lines: int, up: Vector) -> Camera:
    """Return a camera so high [m] above z = 0 that looks straight down."""
    return Camera(
        eye=(0.0, 0.0, height),
        target=(0.0, 0.0, 0.0),
        up=up,
        fovy=2 * math.degrees(math.atan(lines * STEP / 2)),
        width=width,
        height=lines,
        near=0.25,
        far=4 * height,
    )


def _case(
    name: str,
    stresses: str,
    view: Camera,
    shapes: tuple[Shape, ...],
    light: PointLight,
    least_interior: int,
    *expectations: Expectation,
) -> Case:
    scene = Scene(camera=view, shapes=shapes, lights=(light,))
    return Case(
        name=f"watertight/{name}",
        scene=scene,
        stresses=stresses,
        covers=tuple("HIT-5" if item == "HIT-6" else item for item in covering(scene)),
        least_interior=least_interior,
        most_explained=0.15,
        expectations=expectations,
    )


def watertight() -> Iterator[Case]:
    """Yield nets near and far, fans, a square of two triangles, a net before a light, and a closed box."""
    width, height = 32, 24
    for place, eye, thirds in (("", ORIGIN, 1.0), ("_far_away", FAR_AWAY, 4096.0)):
        view = camera(eye, width=width, height=height, far=32 * thirds)
        where = "at the origin" if eye == ORIGIN else "1e5 m from the origin"
        for name, what in (("vertices", "a vertex"), ("middles", "the middle of an edge")):
            mesh = net(eye, width=width, height=height, thirds=thirds, middles=name == "middles")
            yield _case(
                name + place,
                f"A net at random depths, {where}: each 13th ray meets {what}, and no wall behind it shows.",
                view,
                (mesh, wall(eye, 6 * thirds)),
                beside(eye, thirds, 300.0),
                650,
            )
    hubs = (((-17.5, 9.5), 4), ((0.5, 9.5), 16), ((18.5, 9.5), 64), ((-8.5, -8.5), 256), ((9.5, -8.5), 1024))
    yield _case(
        "fans",
        "Fans of 4 to 1024 triangles, seen through their hubs and the middles of their edges.",
        camera(ORIGIN, width=56, height=38, far=32.0),
        (fans(hubs, 1.0), wall(ORIGIN, 6.0)),
        beside(ORIGIN, 1.0, 300.0),
        1900,
    )
    frame = np.array(((-14, -14), (14, -14), (14, 14), (-14, 14)), dtype=float)
    square = Mesh(albedo=ALBEDO, vertices=seen_at(ORIGIN, frame, np.ones(1)), faces=np.array(((0, 1, 2), (0, 2, 3))))
    yield _case(
        "diagonal",
        "A square of two triangles whose diagonal runs through 28 pixels' centres.",
        camera(ORIGIN, width=32, height=32, far=32.0),
        (square, wall(ORIGIN, 6.0)),
        beside(ORIGIN, 1.0, 300.0),
        900,
    )
    view, lamp, half = looking_down(4.0, width=32, lines=24, up=(0.0, 1.0, 0.0)), (1.0, -0.5, 16.0), 9
    size = half * STEP * view.eye[2]
    outline = ShadowOutline(
        shape=0,
        light=0,
        form="square",
        center=(0.0, 0.0),
        size=size,
        margin=9e-4,
        because="the net ends on the pyramid over this square whose top is the light",
    )
    yield _case(
        "shadow_rays",
        "A net between floor and light with a vertex on each shadow ray: below it the irradiance is 0 to the last bit.",
        view,
        (Square(albedo=WALL_ALBEDO, to_world=scaling(8.0, 8.0, 1.0)), canopy(view, lamp, half)),
        PointLight(position=lamp, flux=(4000.0, 3600.0, 3200.0)),
        700,
        outline,
    )
    yield _case(
        "whole_metres",
        "A closed mesh divided at whole metres, seen along an axis; through a gap its own far side would show.",
        looking_down(10.0, width=41, lines=31, up=(-4.0, 3.0, 0.0)),
        (slab(5),),
        PointLight(position=(2.0, 3.0, 12.0), flux=(3000.0, 2700.0, 2400.0)),
        1100,
    )
