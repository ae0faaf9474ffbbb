"""A run writes what it found before it waits for what only shows it."""

from pathlib import Path
from typing import Any

import pytest

from rayproof.reports.results.document import load_results
from rayproof.reports.run import suite
from rayproof.reports.run.options import RunOptions


@pytest.mark.process
def test_results_are_there_before_anybody_waits_for_a_picture(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    found: list[dict[str, Any]] = []

    def waiting(*_: object, **__: object) -> tuple[int, None]:
        found.append(load_results(tmp_path))
        return 0, None

    monkeypatch.setattr(suite, "draw_stills", waiting)
    monkeypatch.setattr(suite, "render_and_judge", lambda *_: ([], True, None))
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
