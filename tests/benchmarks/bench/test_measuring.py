"""Measuring: ratios within rounds, pictures compared, what cannot run left out with its reason."""

# pyright: reportArgumentType=false, reportOperatorIssue=false, reportOptionalOperand=false, reportReturnType=false
# Records are incomplete on purpose.

import numpy as np
import pytest

from rayproof.cases.benchmark_scenes import chosen
from rayproof.cases.scene import Scene
from tests.benchmarks.bench import CONTENDERS, Prepared, measuring
from tests.benchmarks.bench.apart import BenchError, Task, timed_apart
from tests.benchmarks.bench.measuring import differing, ratio, timed
from tests.benchmarks.bench.records import compared

PICTURE = np.linspace(0, 1, 8 * 8 * 3).reshape(8, 8, 3)


def scene() -> Scene:
    return chosen(("sphere_and_floor",), quick=True)[0].scene(8, 8)


def contender(cost: float, *, picture: np.ndarray | None = PICTURE, refuses: str | None = None):
    """Return a contender that says it took `cost`, on a clock of its own."""

    class Fake:
        @classmethod
        def missing(cls) -> str | None:
            return None

        def unsupported(self, scene: Scene) -> str | None:
            return refuses

        def prepare(self, scene: Scene) -> Prepared:
            image = None if picture is None else lambda: np.asarray(picture)
            return Prepared(build_seconds=0.5, run=lambda: CLOCK.pass_by(cost), image=image, does="nothing")

    return Fake


class Clock:
    """Time that passes only when somebody says so."""

    def __init__(self) -> None:
        self.now = 0.0

    def pass_by(self, seconds: float) -> None:
        self.now += seconds

    def perf_counter(self) -> float:
        return self.now


CLOCK = Clock()


@pytest.fixture
def rivals(monkeypatch: pytest.MonkeyPatch):
    """Return a function that puts fakes into the registry."""
    monkeypatch.setattr(measuring, "time", CLOCK)

    def put(**fakes) -> tuple[str, ...]:
        CONTENDERS.load()
        monkeypatch.setattr(CONTENDERS, "_things", fakes)
        return tuple(fakes)

    return put


def test_the_ratio_is_theirs_over_ours_by_the_better_of_them(rivals) -> None:
    names = rivals(ours=contender(0.1), mitsuba_minimal=contender(0.5), mitsuba_minimal_frozen=contender(0.3))

    found = timed(scene(), names, budget=1.0)

    best = ratio(found, measuring.MINIMAL)
    assert best is not None
    assert best["ratio"] == pytest.approx(3)
    assert best["by"] == "mitsuba_minimal_frozen"
    assert len(found["ours"].seconds) % 2 == 1
    assert len(found["ours"].seconds) == len(found["mitsuba_minimal"].seconds)


@pytest.mark.parametrize(
    ("change", "share"),
    [(lambda image: image, 0.0), (lambda image: image + 2e-3 * (np.arange(8) == 0)[:, None, None], 1 / 8)],
)
def test_pixels_that_differ_are_counted(rivals, change, share: float) -> None:
    names = rivals(ours=contender(0.1, picture=change(PICTURE)), mitsuba_minimal=contender(0.1))

    assert differing(timed(scene(), names, budget=0.1)) == pytest.approx(share)


def entry(ratio: float, interval: tuple[float, float], control: tuple[float, float] = (0.98, 1.02)) -> dict:
    return {
        "name": "one", "width": 8, "height": 8, "ratio_minimal": ratio, "ratio_minimal_interval": list(interval),
        "control_interval": list(control),
    }  # fmt: skip


@pytest.mark.parametrize(
    ("new", "verdict"),
    [
        (entry(2.0, (1.9, 2.1)), "no difference shown"),
        (entry(1.5, (1.4, 1.6)), "slower"),
        (entry(3.0, (2.9, 3.1)), "faster"),
        (entry(1.5, (1.2, 1.95)), "no difference shown"),  # the intervals overlap
        (entry(1.5, (1.4, 1.6), control=(0.5, 1.6)), "no difference shown"),  # the control moves as much
    ],
)
def test_a_regression_needs_intervals_apart_and_a_quiet_control(new: dict, verdict: str) -> None:
    (change,) = compared({"scenes": [entry(2.0, (1.9, 2.1))]}, {"scenes": [new]})

    assert change["verdict"] == verdict
    assert change["change"] == pytest.approx(2.0 / new["ratio_minimal"])


def task(scene: str) -> Task:
    return Task(scene=scene, size=(16, 12), contenders=("ours",), machine=MACHINE, budget=0.0)


RATES = {"operations_per_second": 1e9, "divisions_per_second": 1e9, "roots_per_second": 1e9}
MACHINE = {"float32": RATES, "float64": RATES, "write_bytes_per_second": 1e9}


@pytest.mark.process
def test_what_goes_wrong_says_where_and_the_others_are_timed() -> None:
    wrong, right, wrong_again = timed_apart([task("no_such"), task("sphere_and_floor"), task("none_either")])

    assert isinstance(wrong, BenchError)
    assert str(wrong).startswith("no_such, 16x12: LookupError: no bench scene is called")
    assert not isinstance(right, BenchError)
    assert right["name"] == "sphere_and_floor"
    assert right["ours_ms"] > 0
    assert isinstance(wrong_again, BenchError)
