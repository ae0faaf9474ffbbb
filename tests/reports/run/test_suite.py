"""A run writes what it found before it waits for what only shows it."""

from pathlib import Path
from typing import Any, cast

import pytest

from rayproof.reports.results.document import load_results
from rayproof.reports.run import suite
from rayproof.reports.run.options import RunOptions
from rayproof.reports.run.workload import Execution


@pytest.mark.process
def test_results_are_there_before_anybody_waits_for_a_picture(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    found: list[dict[str, Any]] = []

    def waiting(*_: object, **__: object) -> tuple[int, None]:
        found.append(load_results(tmp_path))
        return 0, None

    monkeypatch.setattr(suite, "draw_stills", waiting)
    stopped = Execution(records=cast(Any, []), interrupted=True, stopped=None)
    monkeypatch.setattr(suite, "execute", lambda *_: stopped)
    suite.run(
        RunOptions(
            selectors=("primitives/sphere",),
            out=tmp_path,
            resume=False,
            require=(),
            jobs=1,
            timeout=1.0,
            configurations=(),
            json=None,
            cached=False,
        )
    )

    (results,) = found
    assert results["summary"]["planned"] == 1
    assert not results["finished"]
