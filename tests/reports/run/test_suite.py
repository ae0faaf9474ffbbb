"""A run writes what it found before it waits for what only shows it."""

from pathlib import Path
from typing import Any

import pytest

from rayproof.reports.results.document import load_results
from rayproof.reports.run import suite
from rayproof.reports.run.request import RunRequest


def test_results_are_there_before_anybody_waits_for_a_picture(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    found: list[dict[str, Any]] = []

    class Waiting:
        """Drawing that has a picture to wait for when the run's cases are done."""

        pending, reason = True, None

        def __init__(self, *_: object, **__: object) -> None: ...

        def __enter__(self) -> "Waiting":
            return self

        def __exit__(self, *_: object) -> None:
            found.append(load_results(tmp_path))

        def tell(self, cases: object) -> None: ...

    monkeypatch.setattr(suite, "Drawing", Waiting)
    monkeypatch.setattr(suite, "stand_guards", lambda: None)
    monkeypatch.setattr(suite, "render_and_judge", lambda *_: ([], True, None))
    suite.run(
        RunRequest(
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
