"""A member of the panel that does not start is missed: its checks are undecided, and the headline says so."""

import sys
from collections import Counter
from pathlib import Path

import pytest

from rayproof.reports.results.document import load_results
from rayproof.reports.results.headline import headline
from tests.reports.commands.conftest import Rayproof


@pytest.mark.process
@pytest.mark.references
def test_a_run_whose_radiance_does_not_start_says_so_and_plans_the_same_checks(
    rayproof: Rayproof, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "pyradiance").mkdir()
    (tmp_path / "pyradiance" / "__init__.py").touch()  # a package without its programs
    planned = []
    for places in (sys.path, [str(tmp_path), *sys.path]):  # workers look for packages where this process does
        monkeypatch.setattr(sys, "path", places)
        ended = rayproof("run", "primitives/square", "--no-cache", "--out", tmp_path / "out")
        assert ended.code == 0, ended.error
        results = load_results(tmp_path / "out")
        (case,) = results["cases"]
        planned.append(Counter((check.configuration, check.reference, check.stage) for check in case["checks"]))
        lost = {check.outcome.value for check in case["checks"] if check.reference == "radiance"}

    assert planned[0] == planned[1]
    assert lost == {"undecided"}
    assert "the panel lost Radiance (rtrace): pyradiance carries no oconv and no rtrace" in headline(results)
