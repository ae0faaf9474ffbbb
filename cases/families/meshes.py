"""Families `meshes` (of trimesh: wavy sheets, slivers, rods, degenerate faces) and `models` (two real ones)."""

from collections.abc import Iterator
from dataclasses import replace
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path

import numpy as np

from rayproof.cases.case import Case, covering
from rayproof.cases.mesh_files import read_mesh
from rayproof.cases.placement import camera_around, compose, rotation, scaling, translation
from rayproof.cases.scene import IDENTITY, Matrix, Mesh, PointLight, Scene, Square

# Triangle meshes that trimesh makes: round, hollow, finely divided, degenerate and open.
SEED = 20060172
ALBEDO = (0.75, 0.55, 0.35)
FLOOR = Square(
    albedo=(0.5, 0.6, 0.7),
    to_world=compose(translation(0.1, 0.0, -1.3), rotation((0.4, 1.0, 0.3), 7), scaling(8, 7, 1)),
)
LIGHT = PointLight(position=(2.2, -1.9, 3.4), flux=(480.0, 400.0, 330.0))
TURN = rotation((0.5, 0.3, 0.9), 34)


def of_trimesh(made: object, to_world: Matrix = IDENTITY, *, two_sided: bool = False) -> Mesh:
    """Return a mesh with the vertices and faces that trimesh made."""
    vertices, faces = np.asarray(getattr(made, "vertices")), np.asarray(getattr(made, "faces"))  # noqa: B009
    return Mesh(albedo=ALBEDO, vertices=vertices, faces=faces, to_world=to_world, two_sided=two_sided)


def wavy_sheet(cells: int) -> Mesh:
    """Return an open two-sided sheet of 2 cells^2 triangles with a wavy and slightly random height."""
    generator = np.random.default_rng(SEED)
    across = np.linspace(-1.5, 1.5, cells + 1)
    x, y = np.meshgrid(across, across, indexing="ij")
    z = 0.3 * np.sin(2.3 * x + 0.4) * np.cos(1.9 * y) + generator.uniform(-0.03, 0.03, x.shape)
    vertices = np.stack([x.ravel(), y.ravel(), z.ravel()], axis=1)
    corner = (np.arange(cells)[:, None] * (cells + 1) + np.arange(cells)).ravel()
    right, above = corner + cells + 1, corner + 1
    faces = np.concatenate([np.stack([corner, right, right + 1], 1), np.stack([corner, right + 1, above], 1)])
    return Mesh(albedo=ALBEDO, vertices=vertices, faces=faces, to_world=TURN, two_sided=True)


def slivers(count: int) -> Mesh:
    """Return a waisted band of 2 count long triangles between two rings, the upper one turned by 100 degrees."""
    turns = 2 * np.pi * np.arange(count) / count
    rings = [(turns, -1.2), (turns + np.radians(100), 1.2)]
    vertices = np.concatenate(
        [np.stack([1.3 * np.cos(at), 1.3 * np.sin(at), np.full(count, z)], axis=1) for at, z in rings]
    )
    this, following = np.arange(count), np.roll(np.arange(count), -1)
    faces = np.concatenate(
        [
            np.stack([this, following, this + count], axis=1),
            np.stack([following, following + count, this + count], axis=1),
        ]
    )
    return Mesh(albedo=ALBEDO, vertices=vertices, faces=faces, to_world=TURN, two_sided=True)


def rods_across(sheet: Mesh, count: int) -> Mesh:
    """Return a sheet of about 3 m, and above it long thin faces in all directions that slant upward."""
    turns = 2 * np.pi * np.arange(count) / count + 0.2
    along = np.stack([np.cos(turns), np.sin(turns), np.zeros(count)], axis=1)
    across = np.stack([-np.sin(turns), np.cos(turns), np.zeros(count)], axis=1)
    up = np.array((0.0, 0.0, 1.0))
    corners = np.stack([0.4 * up - 2 * along, 2.4 * up + 2 * along - 0.1 * across, 2.4 * up + 2 * along], axis=1)
    corners = corners + 0.5 * across[:, np.newaxis]
    return replace(
        sheet,
        vertices=np.concatenate([sheet.vertices, corners.reshape(-1, 3)]),
        faces=np.concatenate([sheet.faces, len(sheet.vertices) + np.arange(3 * count).reshape(-1, 3)]),
    )


def with_degenerate_faces() -> Mesh:
    """Return an octahedron with additional faces that are a point, a line and a folded line."""
    around = ((1.0, 0, 0), (-1.0, 0, 0), (0, 0.9, 0), (0, -0.9, 0), (0, 0, 1.1), (0, 0, -1.1))
    aside = ((1.5, -0.5, 1.0), (1.0, -0.5, 1.0), (2.0, -0.5, 1.0))
    vertices = np.array((*around, *aside))
    solid = ((0, 2, 4), (2, 1, 4), (1, 3, 4), (3, 0, 4), (2, 0, 5), (1, 2, 5), (3, 1, 5), (0, 3, 5))
    empty = ((6, 6, 6), (6, 7, 8), (4, 4, 6), (7, 8, 7))
    return Mesh(albedo=ALBEDO, vertices=vertices, faces=np.array((*empty, *solid)), to_world=TURN)


def meshes() -> Iterator[Case]:
    """Yield one case per mesh; the largest at low resolution.

    Shared edges must not leak, concave meshes shade themselves, and triangles without area are never hit.
    """
    from trimesh.creation import box, icosphere, torus  # here, because it takes most of a second

    stretched = compose(TURN, scaling(1.2, 0.8, 1.0))
    ball = of_trimesh(icosphere(subdivisions=2), stretched)
    ring = of_trimesh(torus(0.9, 0.35, major_sections=32, minor_sections=16), TURN)
    mirrored = of_trimesh(torus(0.9, 0.35, major_sections=24, minor_sections=12), compose(TURN, scaling(-1, 1, 1)))
    divided = of_trimesh(box(extents=(1.5, 1.2, 1.7)).subdivide().subdivide().subdivide(), TURN)
    sheet = wavy_sheet(12)
    spoilt = with_degenerate_faces()
    large = ("LIT-4",)
    small = (*large, "HIT-5")
    convex = (*small, "LIT-2", "LIT-3")
    questions: tuple[tuple[str, str, Mesh, tuple[str, ...], int], ...] = (
        ("icosphere", "A convex mesh of 320 faces.", ball, convex, 3000),
        ("torus", "A hollow mesh of 1024 faces that shades itself.", ring, large, 2800),
        ("mirrored_torus", "A torus mirrored: normals do not follow the world's winding.", mirrored, large, 2800),
        (
            "divided_box",
            "Flat faces divided 64-fold: rays through inner edges must not leak.",
            divided,
            convex,
            3000,
        ),
        ("wavy_sheet", "An open two-sided sheet that shades itself, seen from both sides.", sheet, small, 3000),
        (
            "slivers",
            "Long slanting faces of an open band, which stand in a tree in parts.",
            slivers(60),
            large,
            2000,
        ),
        (
            "rods_above_a_sheet",
            "A few long slanting faces above many small ones, which alone are cut into parts.",
            rods_across(wavy_sheet(8), 7),
            large,
            1500,
        ),
        ("degenerate", "Faces that are points and lines: never hit, never a NaN.", spoilt, small, 3000),
    )
    camera = camera_around((0.1, 0.0, -0.2), distance=5.6, azimuth=-58, elevation=35, width=96, height=72, fovy=36)
    for name, stresses, mesh, more, least_interior in questions:
        scene = Scene(camera=camera, shapes=(FLOOR, mesh), lights=(LIGHT,))
        yield Case(
            name=f"meshes/{name}",
            scene=scene,
            stresses=stresses,
            covers=covering(scene, *more),
            least_interior=least_interior,
        )
    low = camera_around((0.0, 0.0, 0.0), distance=5.0, azimuth=-33, elevation=24, width=64, height=48, fovy=30)
    scene = Scene(camera=low, shapes=(of_trimesh(icosphere(subdivisions=5), stretched),), lights=(LIGHT,))
    yield Case(
        name="meshes/twenty_thousand_faces",
        scene=scene,
        stresses="A mesh of 20 480 faces, most of them smaller than a pixel, through the acceleration structure.",
        covers=covering(scene, "LIT-4"),
        least_interior=500,
    )
    under = camera_around((0.1, 0.0, -0.2), distance=1.9, azimuth=-58, elevation=-40, width=64, height=48, fovy=92)
    below = PointLight(position=(1.1, -1.4, -3.2), flux=(480.0, 400.0, 330.0))
    scene = Scene(camera=under, shapes=(wavy_sheet(8),), lights=(below,))
    yield Case(
        name="meshes/wavy_sheet_from_behind",
        scene=scene,
        stresses="An open two-sided sheet, seen and lit from the side that its normals point away from.",
        covers=covering(scene),
        least_interior=500,
    )


# Two real models, an ant and an airplane: thin parts, long triangles and pieces that pass through each other.
SIZE = 3.8  # m; the longest side of a model's box in the scene
MODELS_FLOOR = Square(
    albedo=(0.6, 0.6, 0.65),
    to_world=compose(translation(0.0, 0.1, -1.1), rotation((1.0, 0.2, 0.4), 6), scaling(9, 9, 1)),
)


def folder() -> Path:
    """Return the folder of PyVista's models; raise LookupError if PyVista is not installed."""
    try:
        return Path(str(distribution("pyvista").locate_file("pyvista/examples")))
    except PackageNotFoundError:
        raise LookupError("the models family needs the files of PyVista; install the project's requirements") from None


def model(name: str, turn: float) -> Mesh:
    """Return a model moved to the origin, scaled to SIZE and turned by `turn` degrees."""
    vertices, faces = read_mesh(f"{name}.ply", folder())
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    scale = SIZE / float((high - low).max())
    x, y, z = (-0.5 * (low + high)).tolist()
    placed = compose(
        rotation((0.2, 0.1, 1.0), turn), scaling(scale, scale, scale), translation(x, y, z)
    )  # fmt: skip
    return Mesh(albedo=(0.7, 0.5, 0.4), vertices=vertices.astype(np.float32), faces=faces, to_world=placed)


def models() -> Iterator[Case]:
    """Yield one case per model, over a floor on which its shadow falls.

    The models are files of PyVista's wheel, which is not imported for them.
    """
    for name, turn, least_interior in (("airplane", 35.0, 2500), ("ant", -50.0, 2500)):
        camera = camera_around((0.0, 0.0, -0.2), distance=5.5, azimuth=-65, elevation=40, width=96, height=72, fovy=33)
        light = PointLight(position=(1.4, -2.1, 4.2), flux=(520.0, 600.0, 450.0))
        scene = Scene(camera=camera, shapes=(MODELS_FLOOR, model(name, turn)), lights=(light,))
        yield Case(
            name=f"models/{name}",
            scene=scene,
            stresses=f"The {name} of PyVista: long thin triangles, concave and self-shading, over a floor.",
            covers=covering(scene, "LIT-4"),
            least_interior=least_interior,
        )
