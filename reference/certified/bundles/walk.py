"""Whole images by bundles: pixels that suspect the same walk together, and part where their decisions do.

The geometry is the balls' own, in another field. A pixel whose decision or value the radii leave open is handed back.
"""

from collections import defaultdict
from collections.abc import Sequence
from typing import Any

import numpy as np

from rayproof.cases.scene import Scene
from rayproof.cases.stages import IMAGE_STAGES, Stage
from rayproof.reference.certified.bundles.field import Bundles, PartedError, constant
from rayproof.reference.certified.bundles.numbers import Bundle
from rayproof.reference.certified.camera_frame import view_of
from rayproof.reference.certified.fields import Balls, UndecidedError, Vector, precision
from rayproof.reference.certified.light_paths import Path, Suspects
from rayproof.reference.certified.truths import ABOUT_ZERO, NARROW, POSITION
from rayproof.reference.certified.worlds import World

BITS = 192  # of the balls that constants are made from
# Balls take 60 us a pixel; a bundle's numbers take some 3 ms to move, however few they are.
FEWEST = 32


def walked(
    scene: Scene, points: np.ndarray, suspects: Sequence[Suspects], last: Stage, widths: Sequence[int]
) -> tuple[np.ndarray, np.ndarray]:
    """Return all stages up to `last` at image points (N, 2) [px], one row each, and which rows (N,) are certain.

    `widths` are the stages' numbers of channels. A certain row holds float64 numbers within one ulp of the truth.
    """
    table, certain = np.full((len(points), sum(widths)), np.nan), np.zeros(len(points), dtype=bool)
    together: dict[int, list[int]] = defaultdict(list)
    for row, suspect in enumerate(suspects):
        together[id(suspect)].append(row)
    waiting = [np.array(rows) for rows in together.values() if len(rows) >= FEWEST]
    if not waiting:
        return table, certain
    number = IMAGE_STAGES.index(last)
    with precision(BITS), np.errstate(all="ignore"):
        world, directions = World(scene, Bundles()), _directions(scene, points)
        while waiting:
            rows = waiting.pop()
            path = Path(world, _some(directions, rows), number)
            try:
                decisions = path.decide(suspects[rows[0]], leave_open=False)
            except PartedError as parted:
                parts = [rows[parted.signs == sign] for sign in (-1, 0, 1)]
                waiting += [part for part in parts if len(part) >= FEWEST]
                continue
            except UndecidedError:
                continue
            table[rows], certain[rows] = _told(path.values(decisions)[: number + 1], path.t, len(rows), widths)
    return table, certain


def _directions(scene: Scene, points: np.ndarray) -> Vector:
    """Return the directions of depth 1 through image points (N, 2) [px]."""
    camera = scene.camera
    view = view_of(camera, Balls(BITS))
    half = np.zeros(len(points))
    x = Bundle(2 * points[:, 0], half, half) / camera.width - 1
    y = 1 - Bundle(2 * points[:, 1], half, half) / camera.height
    x, y = x * constant(view.half_width), y * constant(view.half_height)
    axes = zip(view.forward, view.right, view.up, strict=True)
    one, two, three = (x * constant(right) + y * constant(up) + constant(forward) for forward, right, up in axes)
    return (one, two, three)


def _some(vector: Vector, rows: np.ndarray) -> Vector:
    return (vector[0][rows], vector[1][rows], vector[2][rows])


def _told(values: Sequence[Sequence[Any]], t: Any, count: int, widths: Sequence[int]) -> tuple[np.ndarray, np.ndarray]:
    """Return the values as float64 rows, and which rows are as narrow as `truths.narrow` asks."""
    table, narrow = np.empty((count, sum(widths))), np.ones(count, dtype=bool)
    column = 0
    for number, stage in enumerate(values):
        balls = [value for value in stage if isinstance(value, Bundle)]
        largest = np.max([np.broadcast_to(np.abs(ball.high), count) for ball in balls], axis=0) if balls else 0.0
        if number == POSITION:
            largest = np.maximum(largest, np.abs(t.high) if isinstance(t, Bundle) else 0)
        for value in stage:
            if isinstance(value, Bundle):
                close = value.radius <= np.abs(value.high) * 2.0**-NARROW
                narrow &= close | (value.radius <= largest * 2.0 ** -(NARROW + ABOUT_ZERO))
                table[:, column] = value.high
            else:
                table[:, column] = value
            column += 1
    return table, narrow
