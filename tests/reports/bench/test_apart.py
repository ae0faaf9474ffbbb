"""A scene that is timed in a process of its own costs nobody else anything when it fails."""

import pytest

from reports.bench.apart import BenchError, Task, timed_apart


def test_what_goes_wrong_says_where() -> None:
    task = Task(scene="no_such", size=(64, 48), contenders=("ours",), machine={}, budget=0.0)

    with pytest.raises(BenchError, match=r"no_such, 64x48: LookupError: no bench scene is called"):
        timed_apart(task)
