"""Rays at triangles, at planes and at squares."""

import numpy as np

from rayproof.cases.ladders.draws import across, directions, rounded
from rayproof.cases.ladders.ladder import Draw, Inputs

SHEET = 33  # vertices along a side of the jittered sheet


def _unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


def _aimed(
    corners: list[np.ndarray],
    weights: np.ndarray,
    generator: np.random.Generator,
    precision: str,
    *,
    distance: float = 3.0,
    cosine: np.ndarray | None = None,
) -> Inputs:
    """Return rays at the barycentric `weights` (rays, 3) of triangles, from `distance` m, at random or given angles."""
    count = len(weights)
    corners = [rounded(corner, precision) for corner in corners]
    target = sum(corner * weights[:, i : i + 1] for i, corner in enumerate(corners))
    normal = _unit(np.cross(corners[1] - corners[0], corners[2] - corners[0]))
    slope = (np.sqrt(generator.uniform(0.1, 1.0, count)) if cosine is None else cosine)[:, None]
    side = np.where(generator.random(count) < 0.5, -1.0, 1.0)[:, None]
    direction = side * slope * normal + np.sqrt(1 - slope**2) * across(normal, generator)
    origin = rounded(target - direction * distance, precision)
    return {
        "o": origin,
        "d": rounded(_unit(target - origin), precision),
        **dict(zip("abc", corners, strict=True)),
    }


def _weights(count: int, generator: np.random.Generator) -> np.ndarray:
    """Return weights of points inside, uniformly distributed."""
    return generator.dirichlet((1.0, 1.0, 1.0), count)


def _triangles(count: int, generator: np.random.Generator, *, aspect: float = 1.0) -> list[np.ndarray]:
    """Return corners of randomly turned triangles with a unit base and a height of 1 / aspect."""
    along = directions(count, generator)
    upwards = across(along, generator)
    start = directions(count, generator)
    third = start + along * generator.uniform(0.2, 0.8, (count, 1)) + upwards / aspect
    return [start, start + along, third]


def slivers(aspect: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
    """Return rays at points inside triangles of this aspect."""
    return _aimed(_triangles(count, generator, aspect=aspect), _weights(count, generator), generator, precision)


def well_shaped(distance: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
    """Return rays at points inside and around unit triangles from `distance` m."""
    weights = 2 * _weights(count, generator) - 1 / 3
    return _aimed(_triangles(count, generator), weights, generator, precision, distance=distance)


def grazing(cosine: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
    """Return rays at points inside unit triangles at this cosine of incidence."""
    slope = np.full(count, cosine)
    return _aimed(_triangles(count, generator), _weights(count, generator), generator, precision, cosine=slope)


def around(margin: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
    """Return rays that pass a sliver by a margin [m] in its plane, 300 m ahead at 0.5 degrees, 500 m from the origin.

    Its sides are 11.2, 9.75 and 1.47 m.
    Source: Lam, Incorrect intersection results, https://github.com/RenderKit/embree/issues/387 (2022).
    """
    long, middle, short = 11.2, 9.75, 1.47
    along = (long**2 + middle**2 - short**2) / (2 * long)
    x = directions(count, generator)
    y = across(x, generator)
    first = 500 * directions(count, generator)
    corners = [first, first + long * x, first + along * x + np.sqrt(middle**2 - along**2) * y]
    # Each ray meets the plane beside one of the three sides.
    side, share = generator.integers(3, size=count), generator.uniform(0, 1, (count, 1))
    start = np.choose(side[:, None], corners)
    edge = np.choose(side[:, None], corners[1:] + corners[:1]) - start
    target = start + share * edge + margin * _unit(np.cross(edge, np.cross(x, y)))
    heading, grazing = generator.uniform(0, 2 * np.pi, (count, 1)), np.radians(0.5)
    above = np.where(generator.random((count, 1)) < 0.5, -1.0, 1.0) * np.sin(grazing)
    direction = above * np.cross(x, y) + np.cos(grazing) * (np.cos(heading) * x + np.sin(heading) * y)
    corners = [rounded(corner, precision) for corner in corners]
    origin = rounded(target - 300 * direction, precision)
    return {"o": origin, "d": rounded(_unit(target - origin), precision), **dict(zip("abc", corners, strict=True))}


def translated(offset: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
    """Return rays at points well inside unit triangles, all moved by `offset` m."""
    moved = [corner + offset * np.array([[0.6, -0.48, 0.64]]) for corner in _triangles(count, generator)]
    weights = 0.1 + 0.7 * _weights(count, generator)
    return _aimed(moved, weights, generator, precision, cosine=np.sqrt(generator.uniform(0.3, 1.0, count)))


def scaled(scale: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
    """Return unit triangles and eyes scaled by `scale`, unit directions."""
    drawn = _aimed(_triangles(count, generator), 2 * _weights(count, generator) - 1 / 3, generator, precision)
    return drawn | {name: rounded(drawn[name] * scale, precision) for name in "oabc"}


def sized(size: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
    """Return rays at points well inside triangles of this size, from 3 m."""
    start, *others = _triangles(count, generator)
    corners = [start, *(start + (corner - start) * size for corner in others)]
    weights = 0.1 + 0.7 * _weights(count, generator)
    # The eye stays as near to the world's origin as the point that it sees, however large the triangle.
    target = sum(corner * weights[:, i : i + 1] for i, corner in enumerate(corners))
    moved = [corner - target + start for corner in corners]
    return _aimed(moved, weights, generator, precision, cosine=np.sqrt(generator.uniform(0.3, 1.0, count)))


def layers(gap: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
    """Return rays at points well inside unit triangles, and the same triangles moved by `gap` m to either side."""
    weights = 0.1 + 0.7 * _weights(count, generator)
    drawn = _aimed(_triangles(count, generator), weights, generator, precision)
    normal = _unit(np.cross(drawn["b"] - drawn["a"], drawn["c"] - drawn["a"]))
    side = np.where(generator.random(count) < 0.5, -gap, gap)[:, None]
    return drawn | {f"{name}2": rounded(drawn[name] + side * normal, precision) for name in "abc"}


def tiles(*, far: bool = False, moved: bool = False, grazing: bool = False) -> Draw:
    """Return a draw of right triangles in a flat sheet of cells, each with a ray at a point near its border.

    Sides and sheet lie along the axes, so that boxes have no thickness and their corners are those of the triangles.
    Four rays in a row start from one point. The value is the distance of the eye in sheets, how far everything is moved
    in sheets, or the cosine of incidence, at which rays go along one axis with the other component +0 or -0.
    """

    def draw(value: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
        cells = int(np.ceil(np.sqrt(count)))
        place = np.stack(np.divmod(generator.permutation(cells * cells)[:count], cells), axis=1) / cells - 0.5
        flat, side = np.zeros((count, 1)), 0.9 / cells
        shift = value * np.array([0.6, -0.48, 0.64]) if moved else np.zeros(3)
        # Meshes have float32 corners.
        corners = [
            rounded(np.concatenate([place + np.array(step) * side, flat], axis=1) + shift, "float32")
            for step in ((0, 0), (1, 0), (0, 1))
        ]
        weights = 0.02 + 0.94 * generator.dirichlet((0.3, 0.3, 0.3), count)
        target = sum(corner * weights[:, i : i + 1] for i, corner in enumerate(corners))
        groups = -(-count // 4)
        eye = np.repeat(directions(groups, generator) * (3 * value if far else 3.0), 4, axis=0)[:count] + shift
        eye[:, 2] = shift[2] + np.repeat(np.where(generator.random(groups) < 0.5, -1.0, 1.0), 4)[:count] * (
            abs(eye[:, 2] - shift[2]) + 0.1
        )
        origin = rounded(eye, precision)
        if grazing:
            # Each its own origin then: rays along one axis that meet different triangles cannot share one.
            along = generator.integers(2, size=count)
            direction = np.where(generator.random((count, 3)) < 0.5, -0.0, 0.0)
            direction[np.arange(count), along] = 1.0
            direction[:, 2] = -value
            origin = rounded(target - 3.0 * direction, precision)
            return {"o": origin, "d": rounded(direction, precision), **dict(zip("abc", corners, strict=True))}
        return {"o": origin, "d": rounded(_unit(target - origin), precision), **dict(zip("abc", corners, strict=True))}

    return draw


def degenerate(kind: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
    """Return triangles without area: 1 a point, 2 two equal corners, 3 a middle corner, 4 a zero-length direction."""
    whole = generator.integers(-8, 9, size=(3, count, 3)).astype(np.float64)
    a, step = whole[0], whole[1] + 16
    b, c = {1: (a, a), 2: (a + step, a + step), 3: (a + 2 * step, a + step)}.get(int(kind), (a + step, a + whole[2]))
    weights = _weights(count, generator)[..., None]
    target = a * weights[:, 0] + b * weights[:, 1] + c * weights[:, 2]
    origin = rounded(target + 40 * directions(count, generator), precision)
    direction = np.zeros((count, 3)) if kind == 4 else rounded(_unit(target - origin), precision)
    return {"o": origin, "d": direction, "a": a, "b": b, "c": c}


def plane_grazing(cosine: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
    """Return rays from about 1 m above z = 0 at this cosine of incidence."""
    turn = generator.uniform(0, 2 * np.pi, count)
    flat = np.sqrt(1 - cosine**2)
    direction = np.stack([flat * np.cos(turn), flat * np.sin(turn), np.full(count, -cosine)], axis=1)
    return {
        "o": rounded(generator.uniform(0.5, 1.5, (count, 3)), precision),
        "d": rounded(direction, precision),
    }


def plane_far(distance: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
    """Return rays at z = 0 from `distance` m."""
    direction = directions(count, generator)
    direction[:, 2] = -abs(direction[:, 2]) - 0.05
    return {
        "o": rounded(generator.uniform(0.5, 1.5, (count, 3)) * distance, precision),
        "d": rounded(_unit(direction), precision),
    }


def plane_parallel(kind: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
    """Return rays along z = 0: 1 above it, 2 in it, 3 in it from z = -0; with d.z = +0 and -0. All miss."""
    drawn = plane_far(1.0, count, generator, precision)
    drawn["d"][:, 2] = np.where(generator.random(count) < 0.5, 0.0, -0.0)
    if kind > 1:
        drawn["o"][:, 2] = 0.0 if kind == 2 else -0.0
    return drawn


def border(spacings: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
    """Return rays that meet z = 0 about `spacings` roundoffs inside or outside the unit square's border."""
    u = 2.0**-24 if precision == "float32" else 2.0**-53
    hit = generator.uniform(-0.45, 0.45, (count, 3))
    side = np.where(generator.random(count) < 0.5, -0.5, 0.5)
    off = 1 + spacings * u * generator.uniform(-1, 1, count)
    axis = generator.integers(2, size=count)
    hit[np.arange(count), axis] = side * off
    hit[:, 2] = 0.0
    # Powers of two along the ray make the point that it meets a float, so that it can lie this close.
    direction = generator.integers(-3, 4, (count, 3)) / 4.0
    direction[:, 2] = -1.0
    hit = rounded(hit, precision)
    return {"o": rounded(hit - direction, precision), "d": direction}


def sheet(fan: str, *, scaled_by_value: bool) -> Draw:
    """Return a draw of rays at inner edges or vertices of a jittered sheet, its value a translation or a scale."""

    def draw(value: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
        offset, scale = (0.0, value) if scaled_by_value else (value, 1.0)
        return _sheet(fan, offset, scale, count, generator, precision)

    return draw


def _sheet(fan: str, offset: float, scale: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
    # Fewer, larger cells far from the origin: a cell must be many float spacings wide.
    rows, columns = np.meshgrid(np.arange(SHEET), np.arange(SHEET), indexing="ij")
    vertices = np.stack([rows, columns, np.zeros_like(rows)], axis=-1) + generator.uniform(
        -0.25, 0.25, (SHEET, SHEET, 3)
    )
    turn = np.linalg.qr(generator.normal(size=(3, 3)))[0]
    vertices = rounded((vertices @ turn + offset * np.array([0.6, -0.48, 0.64])) * scale, precision)
    if fan == "edge":
        i, j = generator.integers(1, SHEET - 2, (2, count))
        steps = np.array(
            [[(0, 0), (1, 1), (0, 1), (1, 0)], [(0, 0), (0, 1), (-1, 0), (1, 1)], [(0, 0), (1, 0), (1, 1), (0, -1)]]
        )
        step = steps[generator.integers(3, size=count)]
        corners = [vertices[i + step[:, k, 0], j + step[:, k, 1]] for k in range(4)]
        share = generator.uniform(0.05, 0.95, (count, 1))
        target = corners[0] * (1 - share) + corners[1] * share
    else:
        i, j = generator.integers(1, SHEET - 1, (2, count))
        ring = ((0, 0), (0, 1), (1, 1), (1, 0), (0, -1), (-1, -1), (-1, 0))
        corners = [vertices[i + a, j + b] for a, b in ring]
        target = corners[0]
    normal = turn[2]
    direction = -normal * generator.uniform(0.5, 1.0, (count, 1)) + across(np.tile(normal, (count, 1)), generator) * 0.7
    origin = rounded(target - direction * 20 * scale, precision)
    aimed = rounded(_unit(target - origin), precision)
    return {"o": origin, "d": aimed} | {f"p{k}": corner for k, corner in enumerate(corners)}
