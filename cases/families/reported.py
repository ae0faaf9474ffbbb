"""Family `reported`: scenes of mistakes that users reported to other renderers; a function's docstring has the address.

Each scene is built from the description in a report and is as small as possible: boxes of a tree that share a middle,
an epsilon relative to the distance of the light, a ray in the plane of a face.
"""

from collections.abc import Iterator
from dataclasses import replace
from itertools import combinations
from math import pi

import numpy as np

from rayproof.cases.case import FEW_EXPLAINED, Case, Expectation, Flux, UniformValue, covering
from rayproof.cases.placement import camera_around, compose, rotation, scaling, translation
from rayproof.cases.rounding import gamma
from rayproof.cases.scene import Camera, Cube, Mesh, PointLight, Rgb, Scene, Shape, Sphere, Square, Vector
from rayproof.cases.stages import Stage

ALBEDO: Rgb = (0.7, 0.5, 0.35)
FLOOR = Square(albedo=(0.5, 0.6, 0.65), to_world=compose(translation(0.05, 0.1, -1.2), scaling(14, 14, 1)))
LIGHT = PointLight(position=(2.3, -2.6, 4.1), flux=(420.0, 380.0, 330.0))
VIEW = camera_around((0.0, 0.0, -0.2), distance=5, azimuth=-61, elevation=38, width=56, height=42, fovy=38)
NESTED = 64  # shapes in each other
IDENTICAL = 1000  # triangles in one place
CELLS = 24  # per side of a sheet of small triangles
SMALL = 2e-4  # m, a small triangle's side
MIDDLE: Vector = (0.5, -0.25, 1.0)  # m, of the rooms that are seen and lit from their middle
ROOM = 4.0  # m, a side and a diameter
FACE = 48  # px, a side of a cube's face seen from its middle
ROUNDINGS = 80  # of camera ray (20), hit (15), shadow ray (15), cosine and falloff (15), and the slant of the hit (15)
GAP = 1e-3  # m, between a cube and the floor


def _case(
    name: str,
    stresses: str,
    scene: Scene,
    least_interior: int,
    *,
    most_explained: float = FEW_EXPLAINED,
    expectations: tuple[Expectation, ...] = (),
) -> Case:
    return Case(
        name=f"reported/{name}",
        scene=scene,
        stresses=stresses,
        covers=covering(scene),
        least_interior=least_interior,
        most_explained=most_explained,
        expectations=expectations,
    )


def _inside() -> tuple[Camera, tuple[PointLight, ...]]:
    """Return a camera and a light near the origin."""
    camera = Camera(
        eye=(0.1, -0.15, 0.05), target=(1, 0.7, 0.2), up=(0, 0.2, 1), fovy=75, width=52, height=40, near=0.01, far=50
    )
    return camera, (PointLight(position=(-0.2, 0.25, 0.3), flux=(30.0, 25.0, 20.0)),)


def _grey(index: int) -> Rgb:
    """Return the albedo of shape `index`, one of seven in turn, so that neighbours have different albedos."""
    return (0.25 + 0.1 * (index % 7), 0.85 - 0.1 * (index % 7), 0.3 + 0.08 * (3 * index % 7))


def icosahedron() -> tuple[np.ndarray, np.ndarray]:
    """Return the 12 vertices on the unit sphere and the 20 faces, counter-clockwise seen from outside."""
    golden = (1 + 5**0.5) / 2
    corners = np.array([np.roll((0, a, b * golden), turn) for turn in range(3) for a in (-1, 1) for b in (-1, 1)])
    faces = []
    for face in combinations(range(12), 3):
        first, second, third = corners[list(face)]
        if max(np.linalg.norm(first - second), np.linalg.norm(second - third), np.linalg.norm(third - first)) < 2.1:
            outward = first @ np.cross(second, third) > 0
            faces.append(face if outward else face[::-1])
    return corners / np.linalg.norm(corners[0]), np.array(faces)


def small_triangles() -> Case:
    """Return a sheet of triangles of 0.2 mm. https://github.com/jbikker/tinybvh/pull/283 ."""
    x, y = np.meshgrid(np.arange(CELLS + 1.0), np.arange(CELLS + 1.0), indexing="ij")
    height = 0.8 * np.sin(0.31 * x + 0.4) * np.cos(0.23 * y)
    corners = SMALL * np.stack([x - CELLS / 2, y - CELLS / 2, height], axis=-1).reshape(-1, 3)
    first = (np.arange(CELLS)[:, None] * (CELLS + 1) + np.arange(CELLS)).ravel()
    across, diagonal = first + CELLS + 1, first + CELLS + 2
    faces = np.concatenate([np.stack([first, across, diagonal], 1), np.stack([first, diagonal, first + 1], 1)])
    sheet = Mesh(albedo=ALBEDO, vertices=corners, faces=faces)
    size = CELLS * SMALL
    camera = camera_around(
        (0, 0, 0), distance=2 * size, azimuth=-40, elevation=55, width=56, height=42, fovy=24, near=1e-4, far=1.0
    )
    light = PointLight(position=(size, -0.7 * size, 2 * size), flux=(1e-3, 8e-4, 6e-4))
    scene = Scene(camera=camera, shapes=(sheet,), lights=(light,))
    return _case("small_triangles", "Triangles of 0.2 mm: their determinants are far below any 1e-6.", scene, 1500)


def nested_spheres() -> Case:
    """Return spheres around each other and the eye. https://github.com/RayTracing/raytracing.github.io/issues/1130 ."""
    camera, lights = _inside()
    spheres = tuple(
        Sphere(albedo=_grey(index), radius=1 + index / NESTED, two_sided=True) for index in reversed(range(NESTED))
    )
    scene = Scene(camera=camera, shapes=spheres, lights=lights)
    return _case("nested_spheres", "Boxes of a tree that all hold each other: the innermost counts.", scene, 1900)


def nested_icosahedra() -> Case:
    """Return a mesh of icosahedra around each other and the eye. https://github.com/jbikker/tinybvh/pull/192 ."""
    camera, lights = _inside()
    corners, faces = icosahedron()
    sizes = np.arange(NESTED, 0, -1) / NESTED + 1
    mesh = Mesh(
        albedo=ALBEDO,
        vertices=(sizes[:, None, None] * corners).reshape(-1, 3),
        faces=(12 * np.arange(NESTED)[:, None, None] + faces).reshape(-1, 3),
        two_sided=True,
    )
    scene = Scene(camera=camera, shapes=(mesh,), lights=lights)
    return _case("nested_icosahedra", "A tree as deep as its triangles lie behind each other.", scene, 1900)


def identical_triangles() -> Case:
    """Return a mesh of a triangle that is repeated. https://github.com/hoverinc/ray-tracing-renderer/pull/81 ."""
    corners = np.array(((-0.6, -0.4, -0.3), (0.7, -0.3, 0.1), (0.0, 0.6, 0.4)))
    camera = replace(VIEW, width=24, height=18)  # in each pixel of the triangle any of a thousand faces is right
    mesh = Mesh(albedo=ALBEDO, vertices=corners, faces=np.tile((0, 1, 2), (IDENTICAL, 1)), two_sided=True)
    scene = Scene(camera=camera, shapes=(FLOOR, mesh), lights=(LIGHT,))
    return _case(
        "identical_triangles", "A tree that cannot split: all middles are one.", scene, 340, most_explained=0.07
    )


def unreferenced_vertices() -> Case:
    """Return a mesh with vertices far away that no face has. https://github.com/jbikker/tinybvh/issues/146 ."""
    corners, faces = icosahedron()
    away = ((1e6, 1e6, 1e6), (-1e6, 2e5, -1e6))
    mesh = Mesh(albedo=ALBEDO, vertices=np.concatenate([away[:1], corners, away[1:]]), faces=faces + 1)
    scene = Scene(camera=VIEW, shapes=(FLOOR, mesh), lights=(LIGHT,))
    return _case("unreferenced_vertices", "Vertices 1e6 m away that no face has make no box larger.", scene, 1900)


def middle_of_a_sphere() -> Case:
    """Return the eye and the light in a sphere's middle. https://github.com/turanszkij/WickedEngine/issues/1695 ."""
    sphere = Sphere(albedo=ALBEDO, center=MIDDLE, radius=ROOM / 2, two_sided=True)
    camera = Camera(eye=MIDDLE, target=(1.5, 0.5, 1.25), up=(0, 0, 1), fovy=100, width=52, height=40, near=0.1, far=50)
    light = PointLight(position=MIDDLE, flux=(300.0, 200.0, 100.0))
    expectations = tuple(
        UniformValue(
            stage=Stage.IRRADIANCE,
            shape=0,
            channel=channel,
            value=flux / (pi * ROOM**2),
            relative=gamma(ROUNDINGS, precision="float32"),
            because=f"the sphere's area receives all flux; {ROUNDINGS} float32 roundings",
        )
        for channel, flux in enumerate(light.flux)
    )
    scene = Scene(camera=camera, shapes=(sphere,), lights=(light,))
    return _case(
        "middle_of_a_sphere",
        "Eye and light in a sphere's middle.",
        scene,
        2000,
        expectations=expectations,
    )


def middle_of_a_cube(name: str, forward: Vector) -> Case:
    """Return the eye and the light in a cube's middle. https://github.com/stackgl/ray-aabb-intersection/issues/3 .

    The image is one face. The midpoint rule errs by area pixel^2 / 24 (max |E_xx| + max |E_yy|); both derivatives are
    largest in the middle of I h / d^3, 3 I / h^4 (Davis and Rabinowitz, Methods of Numerical Integration, 1984).
    """
    cube = Cube(albedo=ALBEDO, to_world=compose(translation(*MIDDLE), scaling(ROOM, ROOM, ROOM)), two_sided=True)
    x, y, z = np.add(MIDDLE, forward).tolist()
    up = (0.0, 0.0, 1.0) if forward[2] == 0 else (0.0, 1.0, 0.0)
    camera = Camera(eye=MIDDLE, target=(x, y, z), up=up, fovy=90, width=FACE, height=FACE, near=0.1, far=50)
    light = PointLight(position=MIDDLE, flux=(300.0, 200.0, 100.0))
    bound = (ROOM / FACE) ** 2 / 24 * ROOM**2 * 6 / (4 * pi) / (ROOM / 2) ** 4 * 6
    expectations = tuple(
        Flux(
            shape=0,
            face=-1,
            channel=channel,
            footprint=(ROOM / FACE) ** 2,
            value=flux / 6,
            relative=bound + gamma(ROUNDINGS, precision="float32"),
            because=f"a sixth of the flux; the midpoint rule's bound {bound:.2g} and {ROUNDINGS} float32 roundings",
        )
        for channel, flux in enumerate(light.flux)
    )
    scene = Scene(camera=camera, shapes=(cube,), lights=(light,))
    stresses = f"Eye and light in a cube's middle: {name} is one of six faces, and receives a sixth of the flux."
    return _case(f"middle_of_a_cube/{name}", stresses, scene, 2200, expectations=expectations)


def face_in_a_column() -> Case:
    """Return a cube's face in the plane of the middle column's rays. https://github.com/RenderKit/embree/pull/589 ."""
    wall = Square(
        albedo=(0.5, 0.6, 0.65), to_world=compose(translation(0.3, 2, 0.1), rotation((1, 0, 0), 90), scaling(9, 9, 1))
    )
    camera = Camera(
        eye=(0.5, -4, 0.3), target=(0.5, 0, 0.3), up=(0, 0, 1), fovy=28, width=51, height=39, near=0.1, far=50
    )
    light = PointLight(position=(1.9, -3.3, 2.6), flux=(420.0, 380.0, 330.0))
    scene = Scene(camera=camera, shapes=(Cube(albedo=ALBEDO), wall), lights=(light,))
    return _case(
        "face_in_a_column",
        "Rays in a face's plane to the last bit: 0 / 0 in its slab.",
        scene,
        1800,
        most_explained=0.025,
    )


def concentric_spheres(name: str) -> Case:
    """Return spheres of radius 1 and 1 + 4e-5. https://github.com/mitsuba-renderer/mitsuba3/pull/1871 ."""
    camera, lights = _inside() if name == "inside" else (VIEW, (LIGHT,))
    spheres = tuple(
        Sphere(albedo=_grey(3 * index), radius=radius, two_sided=True) for index, radius in enumerate((1.0, 1 + 4e-5))
    )
    shapes: tuple[Shape, ...] = spheres[::-1] if name == "inside" else (*spheres, FLOOR)
    scene = Scene(camera=camera, shapes=shapes, lights=lights)
    stresses = f"Two spheres 40 micrometres apart, seen from {name}: the nearer one counts."
    return _case(f"concentric_spheres/{name}", stresses, scene, 1800)


def _sphere(name: str, radius: float, distance: float, fovy: float, least_interior: int) -> Case:
    """Return a sphere about the origin, seen from a distance from its surface."""
    middle = radius if radius > distance else 0.0  # of the visible part
    camera = camera_around(
        (0.0, 0.0, middle),
        distance=distance,
        azimuth=-61,
        elevation=58,
        width=48,
        height=38,
        fovy=fovy,
        near=0.01 * distance,
        far=1e7,
    )
    place, power = (0.3 * distance, -0.3 * distance, middle + distance), distance**2
    light = PointLight(position=place, flux=(12 * power, 10 * power, 9 * power))
    scene = Scene(camera=camera, shapes=(Sphere(albedo=ALBEDO, radius=radius),), lights=(light,))
    stresses = f"A sphere of radius {radius:g} m from {distance:g} m away."
    return _case(f"sphere/{name}", stresses, scene, least_interior)


def small_sphere() -> Case:
    """Return a sphere of 1 mm seen from 3 m. https://github.com/ziotom78/pytracer/issues/22 ."""
    return _sphere("1mm_from_3m", 1e-3, 3.0, 0.045, 700)


def large_sphere(name: str, distance: float) -> Case:
    """Return a sphere of 300 km. https://github.com/mitsuba-renderer/mitsuba2/issues/171 .

    From 3 m nothing is decided, because rounding to float32 moves the surface by up to 0.6 m. The finding
    `pole_of_a_large_sphere` shows the report's mistake in Mitsuba 3, whose epsilon is too small where such a sphere
    touches the origin.
    """
    return _sphere(name, 3e5, distance, 40, 1500)


def contact_gap() -> Case:
    """Return a far light on a cube 1 mm above a floor.

    https://github.com/alecjacobson/computer-graphics-ray-tracing/issues/14 .
    """
    cube = Cube(albedo=ALBEDO, to_world=compose(translation(0, 0, -1.2 + 0.25 + GAP), scaling(0.5, 0.5, 0.5)))
    camera = camera_around((0.2, 0.2, -1.1), distance=1.3, azimuth=52, elevation=35, width=56, height=42, fovy=38)
    light = PointLight(position=(-5e3, -6e3, 7e3), flux=(1.1e9, 1e9, 9e8))
    scene = Scene(camera=camera, shapes=(FLOOR, cube), lights=(light,))
    return _case(
        "contact_gap", "A light 1e4 m away: an epsilon that is a share of the way skips the cube.", scene, 2000
    )


def reported() -> Iterator[Case]:
    """Yield the cases of every report."""
    yield small_triangles()
    yield nested_spheres()
    yield nested_icosahedra()
    yield identical_triangles()
    yield unreferenced_vertices()
    yield middle_of_a_sphere()
    for axis, letter in enumerate("xyz"):
        for sign, side in ((1.0, "plus"), (-1.0, "minus")):
            forward = [0.0, 0.0, 0.0]
            forward[axis] = sign
            yield middle_of_a_cube(f"{side}_{letter}", (forward[0], forward[1], forward[2]))
    yield face_in_a_column()
    yield concentric_spheres("outside")
    yield concentric_spheres("inside")
    yield small_sphere()
    yield large_sphere("300km_from_8km", 8e3)
    yield large_sphere("300km_from_200km", 2e5)
    yield contact_gap()
