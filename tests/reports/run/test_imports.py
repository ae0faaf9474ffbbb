"""What a run of one case imports in its first process, which plans, records and publishes: counted, not timed."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.process

RUN = """
import json, sys
from rayproof.reports.cli import main

code = main(["run", "primitives/sphere", "--jobs", "1", "--out", sys.argv[1]])
json.dump({"code": code, "modules": sorted(sys.modules)}, open(sys.argv[2], "w"))
"""
MOST = 190  # of our modules
# Imported only by the processes that use them: workers that render or draw, and commands that plot.
HEAVY = {"skimage", "matplotlib", "pyvista", "trimesh", "scipy", "mitsuba", "drjit"}


def test_a_run_of_one_case_imports_few_modules_and_no_heavy_library(tmp_path: Path) -> None:
    """The second of two runs: what guards ask of the harness itself is asked once for each state of the code."""
    for _ in range(2):
        command = [sys.executable, "-c", RUN, str(tmp_path / "report"), str(tmp_path / "imported.json")]
        subprocess.run(command, check=True, capture_output=True, timeout=200)

    imported = json.loads((tmp_path / "imported.json").read_text())
    ours = [name for name in imported["modules"] if name.partition(".")[0] == "rayproof"]
    assert imported["code"] == 0
    assert HEAVY.isdisjoint(imported["modules"])
    assert len(ours) <= MOST, ours
