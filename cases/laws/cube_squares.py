"""A cube is six squares."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from rayproof.cases.changes import coincide, matrix
from rayproof.cases.laws import LAWS
from rayproof.cases.placement import compose, rotation, translation
from rayproof.cases.relations import Ask, Relation, related
from rayproof.cases.scene import Cube, Matrix, Scene, Shape, Square
from rayproof.cases.stages import Stage


def sides() -> tuple[Matrix, ...]:
    """Return the six placements of a square, facing outward on the unit cube."""
    turns = [rotation((1, 0, 0), angle) for angle in (0, 90, 180, 270)]
    turns += [rotation((0, 1, 0), angle) for angle in (90, 270)]
    # Whole numbers, so that each side lies exactly in its plane.
    return tuple(matrix(np.round(compose(turn, translation(0, 0, 0.5)), 6)) for turn in turns)


@LAWS.register("cube_squares", stage=Stage.NORMAL, implicates=("HIT-3", "HIT-7", "NRM-2", "NRM-3"))
def cube_squares(scene: Scene, ask: Ask) -> Iterator[Relation]:
    """Put six squares that face outward in every cube's place: nothing changes but which shape is seen.

    Proof: the six are the cube's surface, and a ray meets it first where it meets the first of them.
    Source: specification, HIT-3 and HIT-7.
    """
    if any(isinstance(shape, Cube) for shape in scene.shapes) and not coincide(scene):
        shapes: list[Shape] = []
        owners: list[int] = []
        for index, shape in enumerate(scene.shapes):
            made: tuple[Shape, ...] = (shape,)
            if isinstance(shape, Cube):
                made = tuple(
                    Square(
                        albedo=shape.albedo,
                        to_world=matrix(np.asarray(shape.to_world) @ np.asarray(side)),
                        two_sided=shape.two_sided,
                    )
                    for side in sides()
                )
            shapes += made
            owners += [index] * len(made)
        numbers = np.array([*owners, -1], dtype=float)

        def owned(image: np.ndarray) -> np.ndarray:
            return np.stack([numbers[image[..., 0].astype(int)], image[..., 1]], axis=-1)

        changed = replace(scene, shapes=tuple(shapes))
        yield from related(ask, scene, changed, what="every cube made of six squares", after={Stage.OBJECT: owned})
