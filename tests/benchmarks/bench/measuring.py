"""One scene, all contenders: prepared, warmed, checked to agree in the image, then timed in interleaved rounds.

Ratios are taken within a round and their median reported with its bootstrap interval, since what disturbs one run
disturbs its neighbours too (Chen and Revels, "Robust benchmarking in noisy environments", 2016).
"""

import time
from dataclasses import dataclass, field

import numpy as np

from rayproof.cases.scene import Scene
from rayproof.reports.studies.compare.statistics import LEVEL, median_interval
from tests.benchmarks.bench import CONTENDERS, Prepared
from tests.benchmarks.bench.records import RatioRecord

OURS = "ours"
CONTROL = "ours_again"
DEFAULT = "ours_default"  # takes part where ours is by other formulas
MINIMAL = ("mitsuba_minimal", "mitsuba_minimal_frozen")
DIRECT = ("mitsuba_direct",)
DIFFERS = 1e-3  # of the brightest value: what float32 never explains off an edge
ROUNDS = (5, 31)  # odd, so that the median is one of the values
WARMING = 2  # runs that do not count: compiling, freezing, caches
BRIEF = 0.05  # s; what takes less is run once, uncounted, right before: it would pay for what others left in the caches
SLOWEST = 10.0  # s; a contender that takes longer for one run is left out


@dataclass(kw_only=True)
class Timed:
    """One contender on one scene."""

    name: str
    build_seconds: float = 0.0
    first_seconds: float = 0.0  # the first run: what it compiles
    seconds: list[float] = field(default_factory=list)  # one a round
    does: str = ""
    left_out: str | None = None
    brief: bool = False
    prepared: Prepared | None = None

    @property
    def median(self) -> float:
        """Return the median run time [s]."""
        return float(np.median(self.seconds))


def timed(scene: Scene, names: tuple[str, ...], *, budget: float) -> dict[str, Timed]:
    """Return the contenders' times on a scene; `budget` [s] is what the rounds may take, as far as rounds allow."""
    found = {name: _prepared(name, scene) for name in names}
    running = [one for one in found.values() if one.prepared is not None]
    generator = np.random.default_rng(len(running))
    start, done = time.perf_counter(), 0
    low, high = ROUNDS
    while done < high:
        for index in generator.permutation(len(running)):
            one = running[index]
            assert one.prepared is not None
            if one.brief:
                _once(one.prepared)
            one.seconds.append(_once(one.prepared))
        done += 1
        spent = time.perf_counter() - start
        if done >= low and done % 2 and spent + 2 * spent / done > budget:
            break
    return found


def _prepared(name: str, scene: Scene) -> Timed:
    """Return a contender that is warm, or why it is left out."""
    contender = CONTENDERS[name]
    one = Timed(name=name)
    one.left_out = contender.missing() or contender().unsupported(scene)
    if one.left_out is not None:
        return one
    prepared = contender().prepare(scene)
    one.build_seconds, one.does = prepared.build_seconds, prepared.does
    one.first_seconds = _once(prepared)
    if one.first_seconds > SLOWEST:
        one.left_out = f"one run takes {one.first_seconds:.0f} s"
        return one
    for _ in range(WARMING):
        seconds = _once(prepared)
        one.brief = seconds < BRIEF
        if seconds > SLOWEST / 2:
            break
    one.prepared = prepared
    return one


def _once(prepared: Prepared) -> float:
    """Run once and return the seconds that it took."""
    if prepared.ready is not None:
        prepared.ready()
    start = time.perf_counter()
    prepared.run()
    return time.perf_counter() - start


def ratio(found: dict[str, Timed], others: tuple[str, ...], *, over: str = OURS) -> RatioRecord | None:
    """Return the faster of `others` over `over`: median of the ratios within rounds, its interval, and who it is."""
    able = [found[name] for name in others if name in found and found[name].seconds]
    if not able or not found[over].seconds:
        return None
    best = min(able, key=lambda one: one.median)
    ratios = np.array(best.seconds) / np.array(found[over].seconds)
    return {
        "ratio": float(np.median(ratios)),
        "interval": list(median_interval(ratios.tolist(), level=LEVEL)),
        "by": best.name,
    }


def differing(found: dict[str, Timed]) -> float | None:
    """Return the share of pixels in which ours and the minimal kernel differ; None where one of them drew nothing."""
    ours, theirs = (_picture(found.get(name)) for name in (OURS, MINIMAL[0]))
    if ours is None or theirs is None:
        return None
    # Compared this way around NaN counts as different.
    same = np.abs(ours - theirs).max(axis=-1) <= DIFFERS * np.abs(theirs).max()
    return float(1 - same.mean())


def _picture(one: Timed | None) -> np.ndarray | None:
    if one is None or one.prepared is None or one.prepared.image is None:
        return None
    return np.asarray(one.prepared.image(), dtype=np.float64)
