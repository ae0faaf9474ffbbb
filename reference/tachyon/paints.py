"""What colours the surfaces get: their numbers, white, or what they are."""

from collections.abc import Callable

import numpy as np

from rayproof.cases.scene import Scene, Shape
from rayproof.reference.tachyon.models import Look
from rayproof.reference.tachyon.program import WHITE
from rayproof.reference.tachyon.sides import from_behind
from rayproof.reference.tachyon.surfaces import Facets, Surface


def numbered(shape: Shape, surface: Surface, index: int) -> list[Look]:
    """Shine with the shape's and the face's number, half a step above, for Tachyon cuts off."""
    faces = surface.numbers.tolist() if isinstance(surface, Facets) else [0]
    steps = [(index + 1, face % (WHITE + 1), face // (WHITE + 1)) for face in faces]
    return [Look(color=tuple((step + 0.5) / WHITE for step in triple), shines=True) for triple in steps]


def faces(codes: np.ndarray) -> np.ndarray:
    """Return (shape index, face index), -1 on a miss, from a picture (height, width, 3) of such colours."""
    shape = codes[..., 0] - 1
    face = np.where(shape >= 0, codes[..., 1] + codes[..., 2] * (WHITE + 1), -1)
    return np.stack([shape, face], axis=-1)


def white(shape: Shape, surface: Surface, index: int) -> list[Look]:
    """Reflect everything."""
    return [Look(color=(1.0, 1.0, 1.0), shines=False)] * _count(surface)


def diffuse(scene: Scene) -> Callable[[Shape, Surface, int], list[Look]]:
    """Return a paint of albedos in which one-sided surfaces that the eye is behind are black."""
    eye = np.asarray(scene.camera.eye, dtype=np.float64)

    def paint(shape: Shape, surface: Surface, index: int) -> list[Look]:
        black = (0.0, 0.0, 0.0)
        dark = from_behind(surface, eye) & (not shape.two_sided)
        return [Look(color=black if each else shape.albedo, shines=False) for each in dark.tolist()]

    return paint


def _count(surface: Surface) -> int:
    return len(surface.numbers) if isinstance(surface, Facets) else 1
