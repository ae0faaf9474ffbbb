"""Polygons of mesh files, cut into triangles: convex polygons as fans, others by their ears.

Sources: G. H. Meisters, Polygons Have Ears, American Mathematical Monthly 82 (1975); J. R. Shewchuk, Adaptive Precision
Floating-Point Arithmetic and Fast Robust Geometric Predicates (1997): a filter in floats, then exact numbers.
"""

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from fractions import Fraction

import numpy as np

from rayproof.cases.foreign_files import LIMITS

DECIMALS = 1e-6  # relative: coordinates in text have six significant digits or more (C's %f and %g)
MOST_CORNERS = 100_000  # of one polygon
AT_ONCE = 2**18  # corners of polygons that are tested together, with 200 bytes each
# Limit of the steps to cut a file's polygons, of about 10 ns each: the comparison of a corner with an edge is one step.
# 50 000 concave quadrilaterals take no more, nor does a polygon of 30 000 corners.
STEPS, STEPS_A_CORNER = 5 * 10**8, 300
OF_ARRAYS, OF_A_TURN, OF_AN_EXACT_TURN = 1000, 100, 1000  # steps, at least, per operation


@dataclass(kw_only=True)
class PolygonMesh:
    """The content of a file: its vertices, and its polygons one after another with the line or row of each."""

    vertices: np.ndarray  # (n, 3) float64 [m]
    sizes: list[int] = field(default_factory=list)  # corners of each polygon
    corners: list[int] = field(default_factory=list)  # indices of vertices, of all polygons
    places: list[int] = field(default_factory=list)  # line or row of each polygon
    place: str = "line"  # unit of `places`
    others: Counter[str] = field(default_factory=Counter)  # names, in plural, of other content of the file
    notes: list[str] = field(default_factory=list)  # other facts to report about the file
    triangles: int = 0  # number of triangles of all polygons

    def add(self, corners: Sequence[int], place: int) -> None:
        """Add a polygon; raise ValueError if the file contains too many."""
        self.count(max(0, len(corners) - 2))
        self.sizes.append(len(corners))
        self.corners += corners
        self.places.append(place)

    def count(self, triangles: int) -> None:
        """Count triangles before they are built; raise ValueError if there are more than the limit."""
        self.triangles += triangles
        if self.triangles > LIMITS["triangles"]:
            raise ValueError(f"holds more than {LIMITS['triangles']} triangles")


@dataclass(kw_only=True)
class Steps:
    """The count and the limit of steps to cut a file's polygons into triangles."""

    most: int
    taken: int = 0
    place: str = ""  # place in the file of the polygon that is being cut, for messages

    def take(self, count: int) -> None:
        """Take `count` steps; raise ValueError, which names the polygon's place, if fewer are left."""
        self.taken += count
        if self.taken > self.most:
            raise ValueError(
                f"{self.place}: the polygons up to it take more than {self.most} steps to cut into triangles"
            )


def triangles_of(polygons: PolygonMesh) -> tuple[np.ndarray, list[str]]:
    """Return the triangles (m, 3) int64 of all polygons in order, and sentences about facts to report.

    A convex polygon becomes a fan about its first corner; any other is cut by ears, projected along its area vector.

    Raises:
        ValueError: an index is out of range, a polygon crosses itself, or there is no polygon.

    """
    sizes, corners = np.array(polygons.sizes, dtype=np.int64), np.array(polygons.corners, dtype=np.int64)
    starts = np.cumsum(sizes) - sizes
    outside = (corners < 0) | (corners >= len(polygons.vertices))
    if outside.any():
        entry = int(np.flatnonzero(outside)[0])
        at = polygons.places[int(np.searchsorted(starts, entry, side="right")) - 1]
        name = int(corners[entry]) + (polygons.place == "line")  # an OBJ file counts from 1
        raise ValueError(f"{polygons.place} {at}: names vertex {name}, where {len(polygons.vertices)} are")
    enough = sizes >= 3
    if not enough.any():
        raise ValueError(f"holds {_held(polygons, len(sizes))} and no polygon of three or more corners")
    pieces: list[np.ndarray] = []
    order: list[np.ndarray] = []
    bent: list[int] = []
    if (largest := int(sizes.max())) > MOST_CORNERS:
        at = polygons.places[int(sizes.argmax())]
        raise ValueError(f"{polygons.place} {at}: a polygon has {largest} corners; at most {MOST_CORNERS} are read")
    steps = Steps(most=STEPS + STEPS_A_CORNER * len(corners))
    for rows in _alike(sizes):
        size = int(sizes[rows[0]])
        faces = corners[starts[rows, None] + np.arange(size)]
        if size > 3:
            convex, flat = _shapes(polygons.vertices[faces])
            bent += rows[~flat].tolist()
            cut = np.flatnonzero(~convex)
            for place in cut.tolist():
                at = f"{polygons.place} {polygons.places[rows[place]]}"
                pieces.append(faces[place][cut_by_ears(polygons.vertices[faces[place]], at, steps)])
                order.append(np.full(len(pieces[-1]), rows[place]))
            rows, faces = rows[convex], faces[convex]
        fans = np.stack([np.broadcast_to(faces[:, :1], (len(faces), size - 2)), faces[:, 1:-1], faces[:, 2:]], axis=-1)
        pieces.append(fans.reshape(-1, 3))
        order.append(np.repeat(rows, size - 2))
    triangles = np.concatenate(pieces)[np.argsort(np.concatenate(order), kind="stable")]
    notes = list(polygons.notes)
    if not enough.all():
        at = polygons.places[int(np.flatnonzero(~enough)[0])]
        notes.append(f"{int((~enough).sum())} faces of fewer than three corners, the first in {polygons.place} {at}")
    if bent:
        notes.append(
            f"that {len(bent)} polygons are not flat, the first in {polygons.place} {polygons.places[min(bent)]}: "
            "triangles stand in their place"
        )
    return triangles, notes


def _alike(sizes: np.ndarray) -> Iterator[np.ndarray]:
    """Yield rows of polygons with the same number of corners, three or more; few enough to be tested together."""
    by_size = np.argsort(sizes, kind="stable")
    for rows in np.split(by_size, np.flatnonzero(np.diff(sizes[by_size])) + 1):
        if (size := int(sizes[rows[0]])) >= 3:
            together = max(1, AT_ONCE // size)
            for start in range(0, len(rows), together):
                yield rows[start : start + together]


def _held(polygons: PolygonMesh, faces: int) -> str:
    held = {"vertices": len(polygons.vertices), "faces of fewer than three corners": faces} | polygons.others
    return ", ".join(f"{count} {what}" for what, count in held.items() if count) or "nothing"


def _shapes(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the masks of convex polygons (k, n, 3), and of flat ones to within the digits of coordinates in text."""
    scale = _scale(points - points[:, :1])
    centered = (points - points[:, :1]) * scale
    following = np.roll(centered, -1, axis=1)
    area = np.cross(centered, following).sum(axis=1)  # twice the area vector
    turns = np.cross(following - centered, np.roll(following, -1, axis=1) - following)
    turned = (turns * area[:, None]).sum(axis=-1)
    length = np.linalg.norm(area, axis=-1)
    # Turning the same way at every corner, and once around in all: a star turns twice.
    edges = following - centered
    angles = np.arctan2(np.linalg.norm(turns, axis=-1), (edges * np.roll(edges, -1, axis=1)).sum(axis=-1)).sum(axis=1)
    convex = (turned > 0).all(axis=1) & (angles < 3 * np.pi)
    height = np.abs((centered * area[:, None]).sum(axis=-1)).max(axis=1)
    flat = height <= 4 * DECIMALS * (np.abs(points) * scale).max(axis=(1, 2)) * length
    return convex, flat


def _scale(centered: np.ndarray) -> np.ndarray:
    """Return powers of two (k, 1, 1) that scale polygons (k, n, 3) to sizes of about 1, to avoid overflow."""
    return np.exp2(-np.clip(np.frexp(np.abs(centered).max(axis=(1, 2), keepdims=True))[1], -128, 128).astype(float))


def cut_by_ears(points: np.ndarray, place: str, steps: Steps) -> np.ndarray:
    """Return the triangles (n - 2, 3) of one polygon (n, 3), as indices of its corners.

    Raises:
        ValueError: the polygon crosses itself, or takes more than the `steps` left; `place` names it.

    """
    steps.place = place
    centered = (points - points[0]) * _scale((points - points[0])[None])[0]
    area = np.cross(centered, np.roll(centered, -1, axis=0)).sum(axis=0)
    axis = int(np.abs(area).argmax())
    kept = [(axis + 1) % 3, (axis + 2) % 3]  # this order keeps the orientation along the axis
    flat = centered[:, kept] if area[axis] >= 0 else centered[:, kept[::-1]]
    fan = np.array([[0, k, k + 1] for k in range(1, len(points) - 1)])
    if not area.any():
        spread = np.linalg.svd(centered, compute_uv=False)
        if spread[1] <= 4 * DECIMALS * spread[0]:
            return fan  # all corners in one line: it is invisible
        raise ValueError(f"{place}: the polygon crosses itself: its parts cancel to an area of 0")
    _refuse_crossing(flat, place, steps)
    corners = np.arange(len(points))
    before, after = np.roll(corners, 1), np.roll(corners, -1)
    left, ears = np.ones(len(points), dtype=bool), np.zeros(len(points), dtype=bool)
    triangles: list[tuple[int, int, int]] = []
    start = 0
    while len(triangles) < len(points) - 3:
        if not ears.any():  # at first, and if it touches itself: otherwise a cut changes only its neighbours
            for at in np.flatnonzero(left).tolist():
                ears[at] = _is_ear(flat, left, (before[at], at, after[at]), steps)
            if not ears.any():
                raise ValueError(f"{place}: the polygon crosses itself or touches itself in a way that has no inside")
        cuttable = np.flatnonzero(ears)
        ear = int(cuttable[np.searchsorted(cuttable, start) % len(cuttable)])
        first, start = int(before[ear]), int(after[ear])
        triangles.append((first, ear, start))
        left[ear] = ears[ear] = False
        after[first], before[start] = start, first
        for at in (first, start):
            ears[at] = _is_ear(flat, left, (before[at], at, after[at]), steps)
    first, second, third = np.flatnonzero(left).tolist()
    return np.array([*triangles, (first, second, third)], dtype=np.int64)


def _is_ear(flat: np.ndarray, left: np.ndarray, corners: tuple[int, int, int], steps: Steps) -> bool:
    """Return whether the second of three successive corners can be cut off; `left` is the mask of remaining corners."""
    a, b, c = (flat[corner] for corner in corners)
    turn = _orientation(steps, a, b, c)
    if turn == 0:
        return True  # a triangle without area can be cut off, even if other corners are on it
    if turn < 0:
        return False
    steps.take(OF_ARRAYS + len(flat))
    points = flat[left]
    # The ear's own corners do not prevent the cut, nor does a corner at the same point, as in a bridge to a hole.
    same = (points == a).all(axis=1) | (points == b).all(axis=1) | (points == c).all(axis=1)
    boxed = (points >= np.minimum(np.minimum(a, b), c)).all(axis=1) & (points <= np.maximum(np.maximum(a, b), c)).all(
        axis=1
    )
    return not any(
        _orientation(steps, a, b, point) >= 0
        and _orientation(steps, b, c, point) >= 0
        and _orientation(steps, c, a, point) >= 0
        for point in points[boxed & ~same]
    )


def _orientation(steps: Steps, a: np.ndarray, b: np.ndarray, c: np.ndarray) -> int:
    """Return the sign of the turn from a to b to c in the plane, exactly."""
    steps.take(OF_A_TURN)
    first, second = (b[0] - a[0]) * (c[1] - a[1]), (b[1] - a[1]) * (c[0] - a[0])
    if abs(first - second) > 4 * 2.0**-53 * (abs(first) + abs(second)):
        return 1 if first > second else -1
    steps.take(OF_AN_EXACT_TURN)
    (ax, ay), (bx, by), (cx, cy) = (map(Fraction, map(float, point)) for point in (a, b, c))
    exact = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
    return (exact > 0) - (exact < 0)


def _refuse_crossing(flat: np.ndarray, place: str, steps: Steps) -> None:
    """Raise ValueError if two edges cross inside both; edges that touch or overlap do not cross."""
    ends = np.roll(flat, -1, axis=0)
    for edge in range(len(flat) - 2):
        steps.take(OF_ARRAYS + len(flat) - edge)
        a, b = flat[edge], ends[edge]
        c, d = flat[edge + 2 :], ends[edge + 2 :]
        near = (np.minimum(c, d) < np.maximum(a, b)).all(axis=1) & (np.maximum(c, d) > np.minimum(a, b)).all(axis=1)
        for candidate in np.flatnonzero(near).tolist():
            sides = _orientation(steps, a, b, c[candidate]) * _orientation(steps, a, b, d[candidate])
            if (
                sides < 0
                and _orientation(steps, c[candidate], d[candidate], a)
                * _orientation(steps, c[candidate], d[candidate], b)
                < 0
            ):
                raise ValueError(f"{place}: the polygon crosses itself: its edges {edge} and {edge + 2 + candidate} do")
