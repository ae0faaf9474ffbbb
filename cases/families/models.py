"""Two real models, an ant and an airplane: thin parts, long triangles and pieces that pass through each other.

PyVista's wheel carries them; they are found beside its other files without importing it.
"""

from collections.abc import Iterator
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path

import numpy as np

from rayproof.cases.case import Case, covering
from rayproof.cases.families import CASE_FAMILIES
from rayproof.cases.mesh_files import read_mesh
from rayproof.cases.placement import camera_around, compose, rotation, scaling, translation
from rayproof.cases.scene import Mesh, PointLight, Scene, Square

SIZE = 3.8  # m; the longest side of a model's box in the scene
FLOOR = Square(
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


@CASE_FAMILIES.register("models")
def models() -> Iterator[Case]:
    """Yield one case per model, over a floor that takes its shadow."""
    for name, turn, least_interior in (("airplane", 35.0, 2500), ("ant", -50.0, 2500)):
        camera = camera_around((0.0, 0.0, -0.2), distance=5.5, azimuth=-65, elevation=40, width=96, height=72, fovy=33)
        light = PointLight(position=(1.4, -2.1, 4.2), flux=(520.0, 600.0, 450.0))
        scene = Scene(camera=camera, shapes=(FLOOR, model(name, turn)), lights=(light,))
        yield Case(
            name=f"models/{name}",
            scene=scene,
            stresses=f"The {name} of PyVista: long thin triangles, concave and self-shading, over a floor.",
            covers=covering(scene, "LIT-4"),
            least_interior=least_interior,
            most_edge=0.06,
        )
