"""The recipes of docs/architecture.md, followed in a copy of the package: `rayproof run` uses what they add."""

import os
import re
import shutil
import subprocess
import sys
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from rayproof.cases.families import select
from rayproof.cases.scene_json import save_scene
from rayproof.reports.results.document import load_results

pytestmark = [
    pytest.mark.process,
    pytest.mark.timeout(900),
]  # 30 s of one idle processor: the changed judge tests itself

CHECKOUT = Path(__file__).parents[1]
PAGE = (CHECKOUT / "docs" / "architecture.md").read_text(encoding="utf-8")
# Each recipe is a page, and a line of its folder's table; the metric registers itself.
PAGES = dict(re.findall(r"^```python\n# (\S+\.py)\n(.*?)^```", PAGE, re.MULTILINE | re.DOTALL))
LINES = {
    "tracer/formulas/__init__.py": PAGES.pop("tracer/formulas/__init__.py").strip(),
    "cases/families/__init__.py": re.findall(r'^    ("needles": .*)$', PAGE, re.MULTILINE)[0],
    "reference/__init__.py": re.findall(r'^    ("flat_grey": .*)$', PAGE, re.MULTILINE)[0],
}

EMPTY = replace(select(["primitives/sphere"])[0].scene, shapes=())


@pytest.fixture(scope="module")
def copy(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a copy of the package to which all recipes were added."""
    folder = tmp_path_factory.mktemp("copy")
    shutil.copy(CHECKOUT / "pyproject.toml", folder)
    for name in ("python", "cases", "tracer", "reference", "reports"):
        ignored = shutil.ignore_patterns("__pycache__")
        shutil.copytree(CHECKOUT / name, folder / name, symlinks=True, ignore=ignored)
    for name, code in PAGES.items():
        with (folder / name).open("a", encoding="utf-8") as file:
            file.write(f"\n\n{code}")
    for name, line in LINES.items():
        call = re.escape(line.partition(": ")[2].partition("(")[0])  # right(, Entry(: how the table's lines begin
        text, count = re.subn(
            rf'^( +)("[\w/]+": {call}\()',
            lambda first, line=line: f"{first[1]}{line}\n{first[0]}",
            (folder / name).read_text(encoding="utf-8"),
            count=1,
            flags=re.MULTILINE,
        )
        assert count == 1, name
        (folder / name).write_text(text, encoding="utf-8")
    return folder


def judged(copy: Path, out: Path, *words: object) -> tuple[int, Mapping[str, Any]]:
    """Return the exit code of `rayproof run` by the copy, and each case by its name."""
    words = ("run", *words, "--out", out, "--jobs", 1, "--timeout", 600)  # of one judge, which tests itself once
    code = f"import sys; from rayproof.reports.cli import main; sys.exit(main({[*map(str, words)]!r}))"
    environment = os.environ | {"PYTHONPATH": str(copy / "python")}
    done = subprocess.run([sys.executable, "-c", code], cwd=copy, env=environment, capture_output=True, text=True)
    assert done.returncode in (0, 1), done.stdout + done.stderr
    return done.returncode, {case["name"]: case for case in load_results(out)["cases"]}


def test_a_formula_a_family_a_reference_and_a_metric_take_part_in_a_run(copy: Path, tmp_path: Path) -> None:
    save_scene(EMPTY, tmp_path / "empty.json")
    words = ("primitives/sphere", "needles/2", tmp_path / "empty.json", "--configuration", "float64")

    code, cases = judged(copy, tmp_path / "out", *words, "--formula", "sphere/closest_point")

    assert code == 0
    assert [case["verdict"] for case in cases.values()] == ["pass"] * 3
    checks = {name: case["checks"] for name, case in cases.items()}
    for name in ("primitives/sphere", "needles/2"):
        assert {check.configuration for check in checks[name]} == {"float64/sphere=closest_point"}
    (empty,) = (checks[name] for name in checks if name not in ("primitives/sphere", "needles/2"))
    answered = {str(check.stage) for check in empty if check.reference == "flat_grey" and check.outcome == "pass"}
    assert answered == {"radiance"}
    images = [check.end_to_end for check in checks["primitives/sphere"] if check.end_to_end is not None]
    biases = [image.metrics["mean_bias"] for image in images if image.metrics]
    assert biases
    assert max(map(abs, biases)) < 1e-9


def test_the_added_reference_is_put_under_test(copy: Path, tmp_path: Path) -> None:
    save_scene(EMPTY, tmp_path / "empty.json")

    code, cases = judged(copy, tmp_path / "out", tmp_path / "empty.json", "--subject", "flat_grey")

    assert (code, [case["verdict"] for case in cases.values()]) == (0, ["pass"])
