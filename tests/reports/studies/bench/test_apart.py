"""A scene that is timed in a process of its own costs nobody else anything when it fails."""

import pytest

from rayproof.reports.studies.bench import apart
from rayproof.reports.studies.bench.apart import BenchError, Task, timed_apart


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


def test_while_one_is_timed_no_other_process_is_at_work(monkeypatch: pytest.MonkeyPatch) -> None:
    class Fake:
        def __init__(self, task: Task) -> None:
            self._name = task.scene
            log.append(f"{self._name} loads")

        def time(self) -> None:
            log.append(f"{self._name} is timed")

        def entry(self) -> dict:
            log.append(f"{self._name} is judged")
            return {"name": self._name}

        def close(self) -> None:
            log.append(f"{self._name} ends")

    log: list[str] = []
    monkeypatch.setattr(apart, "_Apart", Fake)

    assert list(timed_apart([task("a"), task("b")])) == [{"name": "a"}, {"name": "b"}]

    assert log.index("a is timed") < log.index("b loads") < log.index("a ends") < log.index("b is timed")


def test_who_stops_listening_leaves_no_process(monkeypatch: pytest.MonkeyPatch) -> None:
    ended = []

    class Fake:
        def __init__(self, task: Task) -> None:
            self._name = task.scene

        def time(self) -> None:
            pass

        def entry(self) -> dict:
            return {}

        def close(self) -> None:
            ended.append(self._name)

    monkeypatch.setattr(apart, "_Apart", Fake)
    entries = timed_apart([task("a"), task("b"), task("c")])

    next(entries)
    entries.close()

    assert set(ended) == {"a", "b"}
