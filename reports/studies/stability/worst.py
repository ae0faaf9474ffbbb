"""The search for a formula's worst inputs by evolution; genomes of rays and shapes, judged by certified truth.

For an intersection a genome encodes the ray's target on a shape, its distance from an edge, the angle of incidence, the
ray's origin and the length of its direction, and the position of the shape. Some genes snap directions to axes, points
to edges and origins to neighbouring floats. For other slots `breeds.py` changes the inputs that ladders draw. The score
of an error is the error over its limit; the score of a wrong decision is its distance from the nearest edge in
roundings of all inputs, over the limit.
Source: Storn and Price, "Differential Evolution" (1997), by SciPy.
"""

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, cast

import numpy as np

from rayproof.cases.ladders import DTYPES, Inputs, Ladder, all_ladders, rounded
from rayproof.cases.placement import unit
from rayproof.cases.rounding import UNIT_ROUNDOFF
from rayproof.reference.certified.bundles import floats
from rayproof.reference.certified.meetings import SHAPES, towards
from rayproof.reports.judge.forward.limits import HIT
from rayproof.reports.results.files import several
from rayproof.reports.studies.stability.breeds import LadderBreed, ladders_of
from rayproof.reports.studies.stability.questions import QUESTIONS
from rayproof.reports.studies.stability.shapes import Conditioned
from rayproof.tracer.formulas import Formula

ERROR_LIMIT = 4.0  # K u, the ladders' gate
POPULATION, GENERATIONS = 2048, 40
KEPT = 100
FINEST = {"float32": -26.0, "float64": -55.0}  # least distance of a target from an edge: log2, relative to the shape
GENES = 24
LONGEST = 2.0**20  # m: the largest length, so that products of four lengths are float32 numbers
Genome = np.ndarray  # (genes, rays) in [0, 1]


@dataclass(frozen=True, kw_only=True)
class Worst:
    """The worst inputs of a search, the worst first."""

    ladder: Ladder  # the ladder that asks about such inputs
    inputs: Inputs  # (inputs,) or (inputs, 3)
    scores: np.ndarray  # in units of the limit
    kinds: tuple[str, ...]  # error, false hit, false miss; wrong decision, no number
    ties: Inputs  # inputs of exact ties that the formula decides differently from exact mathematics
    tried: int


@dataclass(frozen=True, kw_only=True)
class ShapeBreed:
    """Rays and shapes, bred for an intersection formula."""

    ladder: Ladder
    formula: Formula
    precision: str
    genes: int = GENES
    population: int = POPULATION

    def decoded(self, genomes: Genome) -> Inputs:
        """Return the inputs of genomes."""
        return decoded(self.formula.slot, genomes, self.precision)

    def judged(self, inputs: Inputs) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the score of each ray, its kind, and whether it is an exact tie that the formula decides wrongly."""
        return judged(self.ladder, self.formula, inputs, self.precision)


Breed = ShapeBreed | LadderBreed


def breeds_of(formula: Formula, precision: str, seed: int) -> Sequence[Breed]:
    """Return the breeds for a formula's worst inputs: of rays and shapes, or of the inputs of ladders.

    Raises:
        LookupError: no ladder asks the formula's slot for a number, or for a decision whose clearance can be counted.

    """
    for ladder in all_ladders():
        about = ladder.question, ladder.options.get("shape")
        if about == ("distance", formula.slot) and formula.slot in ladder.slots:
            return [ShapeBreed(ladder=ladder, formula=formula, precision=precision)]
    ladders = ladders_of(formula, precision)
    if not ladders:
        raise LookupError(f"worst knows no inputs of the slot {formula.slot}")
    return [LadderBreed(ladder=ladder, formula=formula, precision=precision, seed=seed) for ladder in ladders]


def search(breed: Breed, *, seconds: float, seed: int, tell: Callable[[str], None]) -> Worst:
    """Return the worst inputs that evolution finds within a time limit [s]; at least one generation is tried."""
    from scipy.optimize import differential_evolution

    generator = np.random.default_rng(seed)
    end = time.monotonic() + seconds
    archive = _Archive()

    def cost(genomes: Genome) -> np.ndarray:
        inputs = breed.decoded(genomes)
        scores, kinds, tied = breed.judged(inputs)
        archive.add(inputs, scores, kinds, tied)
        return -scores

    def late(*_: Any, **__: Any) -> bool:
        tell(f"{breed.ladder.name}: {archive.tried} inputs, the worst at {archive.best:.3g} limits")
        return time.monotonic() >= end

    while archive.tried == 0 or time.monotonic() < end:
        first = cast("Any", generator.random((breed.population, breed.genes)))
        differential_evolution(
            cost, [(0.0, 1.0)] * breed.genes, init=first, maxiter=GENERATIONS, tol=0.0,
            mutation=(0.3, 0.9), recombination=0.6, updating="deferred", vectorized=True, polish=False, callback=late,
            rng=generator,
        )  # fmt: skip
    return archive.worst(breed.ladder)


def judged(
    ladder: Ladder, formula: Formula, inputs: Inputs, precision: str
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the score of each ray, its kind, and whether it is an exact tie that the formula decides wrongly."""
    question = QUESTIONS[ladder.question]()
    truth = question.truth(ladder, inputs, np.zeros(len(inputs["o"]), dtype=int))
    answer = question.answer(ladder, formula, inputs, precision)
    grades = question.grade(ladder, inputs, truth, answer, precision)
    wrong = grades.false_hit | grades.false_miss | grades.invalid
    clear = clearance(str(ladder.options["shape"]), inputs, precision)
    error = np.nan_to_num(distance_error(truth.facts, answer["t"], precision), nan=0.0) / ERROR_LIMIT
    # Within a few roundings of an edge either answer is right, such as either root for an origin on a sphere.
    error = np.where(clear > HIT, error, 0.0)
    scores = np.where(wrong, clear / HIT, error)
    kinds = np.select([grades.false_hit, wrong], ["false hit", "false miss"], "error")
    counted = grades.counted & np.isfinite(scores)
    return np.where(counted, scores, 0.0), kinds, wrong & counted & (clear == 0)


def distance_error(facts: Mapping[str, Any], t: np.ndarray, precision: str) -> np.ndarray:
    """Return the shift of the surface that makes a ray hit it at `t`, in roundings of all inputs; NaN without a hit.

    One rounding of all inputs moves the surface by u (|o - c| + |t d| + size). A shift of the surface moves a hit by
    the shift over n . d, or, near a tangent of a sphere, by the root of its parabola. The ladders' K weighs the
    components separately; a formula that rotates the ray or the shape cannot meet such a limit.
    """
    hit, x = facts["hit"], facts["given"]
    with np.errstate(all="ignore"):
        off = abs((hit.t - floats(np.ldexp(t, facts["shift"]))).high)
    center = x[facts["shape"].center] if facts["shape"].center else 0.0
    edges = [np.linalg.norm(x[corner] - x["a"], axis=1) for corner in "bc"] if "b" in x else []
    size = np.max(edges, axis=0) if edges else hit.size
    reach = np.linalg.norm(x["o"] - center, axis=1) + np.linalg.norm(hit.t.high[:, None] * x["d"], axis=1) + size
    slope = abs(np.sum(hit.normal * x["d"], axis=1))
    bend = np.sum(x["d"] ** 2, axis=1) / x["r"] if "r" in x else 0.0
    with np.errstate(all="ignore"):
        moved = np.where(off * bend <= slope, slope * off - bend * off**2 / 2, bend * off**2 / 2)
        return moved / (reach * UNIT_ROUNDOFF[precision])


def clearance(shape: str, inputs: Inputs, precision: str) -> np.ndarray:
    """Return the distance of a ray from the nearest edge where its answer changes, in roundings of every input.

    A vector is rounded as a whole: each component by u times the length, as in a rotation.
    """
    numbers = {name: _whole(array) for name, array in inputs.items()}
    if shape == "cube":
        numbers["towards"] = tuple(Conditioned(sign, 0.0) for sign in towards(inputs["d"]).T)
    with np.errstate(all="ignore"):
        predicates = SHAPES[shape]().predicates(numbers)
        clearances = [abs(value.value) / (value.weight * UNIT_ROUNDOFF[precision]) for value in predicates.values()]
    # A value of 0 with weight 0 is exact, such as a direction's component along an axis perpendicular to it: no edge.
    return np.min([np.where(np.isnan(value), np.inf, value) for value in clearances], axis=0)


def _whole(array: np.ndarray) -> Any:
    if array.ndim == 1:
        return Conditioned(array)
    length = np.linalg.norm(array, axis=1)
    return tuple(Conditioned(component, length) for component in array.T)


class _Archive:
    """The worst of all tried inputs."""

    def __init__(self) -> None:
        self.tried = 0
        self._found: Inputs = {}
        self._ties: Inputs = {}
        self._scores, self._kinds = np.empty(0), np.empty(0, dtype=object)

    @property
    def best(self) -> float:
        """Return the largest score."""
        return float(self._scores.max(initial=0.0))

    def add(self, inputs: Inputs, scores: np.ndarray, kinds: np.ndarray, tied: np.ndarray) -> None:
        """Add tried inputs; equal rays count once."""
        self.tried += len(scores)
        joined = {name: np.concatenate([self._found.get(name, array[:0]), array]) for name, array in inputs.items()}
        scores, kinds = np.concatenate([self._scores, scores]), np.concatenate([self._kinds, kinds])
        rows = np.concatenate([array.reshape(len(scores), -1) for array in joined.values()], axis=1)
        order = np.argsort(-scores, kind="stable")[: 4 * KEPT]
        _, first = np.unique(rows[order], axis=0, return_index=True)
        order = order[np.sort(first)][:KEPT]
        self._found = {name: array[order] for name, array in joined.items()}
        self._scores, self._kinds = scores[order], kinds[order]
        room = KEPT - len(next(iter(self._ties.values()), ()))
        picked = np.flatnonzero(tied)[:room]
        self._ties = {n: np.concatenate([self._ties.get(n, array[:0]), array[picked]]) for n, array in inputs.items()}

    def worst(self, ladder: Ladder) -> Worst:
        """Return the worst inputs."""
        kinds = tuple(map(str, self._kinds))
        return Worst(
            ladder=ladder, inputs=self._found, scores=self._scores, kinds=kinds, ties=self._ties, tried=self.tried
        )


def common(worst: Worst) -> list[str]:
    """Return the common properties of the worst inputs, as texts."""
    x, count, shape = worst.inputs, len(worst.scores), worst.ladder.options.get("shape")
    if not count:
        return []
    texts = [", ".join(several(worst.kinds.count(kind), kind) for kind in dict.fromkeys(worst.kinds))]
    if "o" not in x:
        sizes = {name: np.linalg.norm(array.reshape(count, -1), axis=1) for name, array in x.items()}
        return [*texts, *(f"{name} {_most(size)}" for name, size in sizes.items() if size.max() > 1.01 * size.min())]
    center = x["c"] if shape == "sphere" else (x["a"] + x["b"] + x["c"]) / 3 if shape == "triangle" else 0.0
    size = x["r"] if shape == "sphere" else np.linalg.norm(x["b"] - x["a"], axis=1) if shape == "triangle" else 1.0
    texts.append(f"{_most(np.linalg.norm(x['o'] - center, axis=1) / size)} sizes away (80 % of them)")
    zero = int(np.sum(np.any(x["d"] == 0, axis=1)))
    texts += [f"{zero} of {count} run across an axis"] if zero else []
    if shape == "triangle":
        edges = [np.linalg.norm(x[a] - x[b], axis=1) for a, b in ("ab", "bc", "ca")]
        area = np.linalg.norm(np.cross(x["b"] - x["a"], x["c"] - x["a"]), axis=1)
        aspect = np.max(edges, axis=0) ** 2 / np.maximum(area, np.finfo(float).tiny)
        texts.append(f"triangles {_most(aspect)} times longer than high")
    return texts


def _most(values: np.ndarray) -> str:
    """Return the range of the central 80 % of values, as text."""
    return "from {:.2g} to {:.2g}".format(*np.quantile(values, (0.1, 0.9)))


# Genomes decoded to rays and shapes; every number is exact in the precision.


def decoded(slot: str, genomes: Genome, precision: str) -> Inputs:
    """Return the inputs of genomes (genes, rays)."""
    gene = iter(np.clip(genomes, 0.0, 1.0))
    d = _direction(next(gene), next(gene))
    snapped = np.stack([next(gene) < 0.12 for _ in range(3)], axis=1)
    d = np.where(snapped & ~np.all(snapped, axis=1, keepdims=True), 0.0 * d, d)  # zeros of both signs
    d = unit(d)
    far = _power(next(gene), -20.0, 20.0)
    speed = _usually(next(gene), -3.0, 3.0)
    steps = np.stack([np.round((next(gene) - 0.5) * 6) for _ in range(3)], axis=1)
    grazing = _usually(next(gene), -20.0, 0.0)
    edge = _power(next(gene), FINEST[precision], 0.0) * np.where(next(gene) < 0.5, -1.0, 1.0)
    near = next(gene) < 0.6  # aimed at an edge; else anywhere
    place = (
        _direction(next(gene), next(gene))
        * np.where((moved := next(gene)) < 0.4, 0.0, _power(moved, -20.0, 16.0))[:, None]
    )
    across, along = next(gene), next(gene)
    size = _usually(next(gene), -8.0, 8.0)
    build = {"sphere": _sphere, "triangle": _triangle}.get(slot, _unit_shape)
    target, d, size, own = build(slot, d, grazing, edge, near, place, across, along, size, list(gene))
    d = d * speed[:, None]
    o = (target - d * (far * size / speed)[:, None]).astype(DTYPES[precision])
    o = np.clip(o, -LONGEST, LONGEST)
    for _ in range(3):  # move by up to three floats
        o = np.where(abs(steps) > _, np.nextafter(o, np.where(steps < 0, -np.inf, np.inf).astype(o.dtype)), o)
    inputs = {"o": o, "d": d} | own
    return {name: rounded(array, precision) for name, array in inputs.items()}


def _direction(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    height, angle = 2 * first - 1, 2 * np.pi * second
    flat = np.sqrt(np.maximum(0.0, 1 - height**2))
    return np.stack([flat * np.cos(angle), flat * np.sin(angle), height], axis=1)


def _power(gene: np.ndarray, low: float, high: float) -> np.ndarray:
    return 2.0 ** (low + (high - low) * gene)


def _usually(gene: np.ndarray, low: float, high: float) -> np.ndarray:
    """Return 1 for half of the genes, and a power of two for the other half."""
    return np.where(gene < 0.5, 1.0, _power(2 * gene - 1, low, high))


def _beside(direction: np.ndarray, angle: np.ndarray) -> np.ndarray:
    """Return unit vectors perpendicular to directions, rotated about them by an angle [turns]."""
    least = np.eye(3)[np.argmin(abs(direction), axis=1)]
    first = np.cross(direction, least)
    first = unit(first)
    turn = 2 * np.pi * angle[:, None]
    return first * np.cos(turn) + np.cross(direction, first) * np.sin(turn)


def _sphere(
    slot: str, d: Any, grazing: Any, edge: Any, near: Any, place: Any, across: Any, along: Any, size: Any, rest: Any
) -> Any:
    impact = np.where(near, 1.0 + edge, 1.5 * along)
    target = place + _beside(d, across) * (impact * size)[:, None]
    return target, d, size, {"c": place, "r": size}


def _triangle(
    slot: str, d: Any, grazing: Any, edge: Any, near: Any, place: Any, across: Any, along: Any, size: Any, rest: Any
) -> Any:
    normal = _direction(rest[0], rest[1])
    first = _beside(normal, rest[2])
    second = np.cross(normal, first) * _usually(rest[3], -18.0, 0.0)[:, None]
    corners = [place + corner * size[:, None] for corner in (0 * first, first, first * along[:, None] + second)]
    a, b, c = (corner.astype(np.float32).astype(np.float64) for corner in corners)
    weight = np.where(near, edge, across)[:, None]
    target = a + (b - a) * along[:, None] * (1 - weight) + (c - a) * weight
    return target, _tilted(d, normal, grazing), size, {"a": a, "b": b, "c": c}


def _unit_shape(
    slot: str, d: Any, grazing: Any, edge: Any, near: Any, place: Any, across: Any, along: Any, size: Any, rest: Any
) -> Any:
    axis = (rest[0] * 3).astype(int).clip(0, 2) if slot == "cube" else np.full(len(across), 2)
    side = np.where(rest[1] < 0.5, -0.5, 0.5) if slot == "cube" else np.zeros(len(across))
    inside = [np.where(near, 0.5 + edge, 1.2 * (across - 0.5)), 1.2 * (along - 0.5)]
    target = np.empty((len(across), 3))
    rows = np.arange(len(across))
    for number, value in enumerate([side, *inside]):
        target[rows, (axis + number) % 3] = value
    if slot == "plane":
        target[:, :2] += place[:, :2]
    return target, _tilted(d, np.eye(3)[axis], grazing), np.ones(len(across)), {}


def _tilted(d: Any, normal: Any, grazing: Any) -> Any:
    """Return directions with their component along a normal multiplied by `grazing`."""
    part = np.sum(d * normal, axis=1, keepdims=True)
    return d - normal * part * (1 - grazing[:, None])
