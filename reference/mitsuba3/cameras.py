"""The camera stage from Mitsuba's own matrices and from the ends of its rays.

Mitsuba's camera space has x to the left; its projection ends on the film, where x and y run from 0 at the top left
to 1.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from rayproof.cases.scene import Camera
from rayproof.reference.mitsuba3.tracing import pixel_centers
from rayproof.reference.mitsuba3.worlds import World

MIRROR = np.diag([-1.0, 1.0, 1.0, 1.0])
FILM_TO_CLIP = np.array([[2.0, 0, 0, -1], [0, -2.0, 0, 1], [0, 0, 1, 0], [0, 0, 0, 1]])
# Where the frustum's edges meet the film, in the order that the answer keeps.
FILM_CORNERS = np.array([(0.0, 1.0), (1.0, 1.0), (1.0, 0.0), (0.0, 0.0)])

Ends = Callable[[World, np.ndarray], tuple[np.ndarray, np.ndarray]]


def camera_answer(world: World, camera: Camera, ends: Ends) -> dict[str, np.ndarray]:
    """Return the matrices, the frustum's corners [m] and the pixels' coordinates, as `cases.stages` orders them."""
    to_world, to_film = world.sensor.world_transform(), world.sensor.projection_transform()
    # The film coordinates that Mitsuba is handed, in the precision that it takes.
    film = pixel_centers(camera).astype(np.float32).astype(np.float64)
    size, shape = (camera.width, camera.height), (camera.lines, camera.width)
    return {
        "view": MIRROR @ _matrix(to_world.inverse()),
        "view_inverse": _matrix(to_world) @ MIRROR,
        "projection": FILM_TO_CLIP @ _matrix(to_film) @ MIRROR,
        "projection_inverse": MIRROR @ _matrix(to_film.inverse()) @ np.linalg.inv(FILM_TO_CLIP),
        "frustum_corners": np.concatenate(ends(world, FILM_CORNERS)),
        "ndc": (film * (2.0, -2.0) + (-1.0, 1.0)).reshape(*shape, 2),
        "pixel": (film * size).reshape(*shape, 2),
    }


def _matrix(transform: Any) -> np.ndarray:
    return np.asarray(transform.matrix, dtype=np.float64).reshape(4, 4)
