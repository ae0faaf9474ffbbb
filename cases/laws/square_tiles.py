"""A square is nine smaller ones."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from rayproof.cases.changes import coincide, placed
from rayproof.cases.laws import LAWS
from rayproof.cases.placement import compose, scaling, translation
from rayproof.cases.relations import Ask, Conditions, Relation, related
from rayproof.cases.scene import Scene, Shape, Square
from rayproof.cases.stages import Stage

THIRDS = (-1 / 3, 0.0, 1 / 3)


def pieces(scene: Scene) -> tuple[Scene, np.ndarray]:
    """Return the scene with every square as nine, and which shape each new one was."""
    shapes: list[Shape] = []
    owners: list[int] = []
    for index, shape in enumerate(scene.shapes):
        tiles: tuple[Shape, ...] = (shape,)
        if isinstance(shape, Square):
            small = scaling(1 / 3, 1 / 3, 1)
            tiles = tuple(placed(shape, compose(translation(x, y, 0), small)) for y in THIRDS for x in THIRDS)
        shapes += tiles
        owners += [index] * len(tiles)
    return replace(scene, shapes=tuple(shapes)), np.array([*owners, -1])


@LAWS.register("square_tiles", stage=Stage.OBJECT, implicates=("HIT-7", "HIT-8", "XF-1", "HIT-9"))
def square_tiles(scene: Scene, ask: Ask) -> Iterator[Relation]:
    """Lay every square out with nine tiles: nothing changes but which one is seen.

    Proof: the nine tile it, in its plane and facing as it does; a seam is met by no pixel but by chance.
    Source: specification, HIT-7.
    """
    if any(isinstance(shape, Square) for shape in scene.shapes) and not coincide(scene):
        changed, owners = pieces(scene)

        def owned(image: np.ndarray) -> np.ndarray:
            return np.stack([owners[image[..., 0].astype(int)].astype(float), image[..., 1]], axis=-1)

        yield from related(
            ask,
            scene,
            changed,
            what="every square laid out with nine",
            after={Stage.OBJECT: owned},
            conditions=Conditions(factor=3.0),
        )
