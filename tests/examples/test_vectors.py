"""The examples of docs/vectors.md, one a language, answer the sphere's vectors without a failure."""

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from rayproof.reports.vectors.check import read_answers, scored
from rayproof.reports.vectors.files import as_read, write

EXAMPLES = Path(__file__).parents[2] / "examples" / "vectors"
# Suffix -> the command that makes a program of it, the one that runs it, the precision that it computes in.
LANGUAGES = {
    "py": ((), (sys.executable,), "float64"),
    "mjs": ((), ("node",), "float64"),
    "cpp": (("c++", "-std=c++17", "-O2", "-Wall", "-Wextra", "-Werror", "-ffp-contract=off", "-o"), (), "float32"),
    "rs": (("rustc", "-O", "-D", "warnings", "-o"), (), "float32"),
}


@pytest.mark.process
@pytest.mark.parametrize("suffix", LANGUAGES)
def test_an_example_answers_every_row(suffix: str, tmp_path: Path) -> None:
    build, start, precision = LANGUAGES[suffix]
    needed = (*build, *start)[0]
    if shutil.which(needed) is None:
        pytest.skip(f"{needed} is not installed")
    if subprocess.run([needed, "--version"], capture_output=True).returncode != 0:
        pytest.skip(f"{needed} is there and does not start: a compiler is to be chosen first")
    source = EXAMPLES / f"sphere.{suffix}"
    assert len(source.read_text().splitlines()) <= 60
    write(tmp_path, ["sphere"])
    program = [*start, str(source)] if start else [str(tmp_path / "program")]
    if build:
        subprocess.run([*build, str(tmp_path / "program"), str(source)], check=True, capture_output=True)

    said = subprocess.run([*program, str(tmp_path / "sphere.csv")], check=True, capture_output=True, text=True).stdout

    (tmp_path / "answers.csv").write_text(said)
    rows, _ = as_read(["sphere"])
    answers = read_answers(tmp_path / "answers.csv", rows)
    assert answers.name == source.name
    assert [v for v in scored(rows, (), answers, precision) if v.outcome != "passed"] == []


# Of the library that rayproof has anyway so many rows fail at float32's limits (docs/vectors.md).
@pytest.mark.process
def test_an_adapter_answers_as_the_table_says(tmp_path: Path) -> None:
    library, failing = "mitsuba", {"sphere": 4, "triangle": 1}
    write(tmp_path, ["sphere", "triangle"])
    rows, _ = as_read(["sphere", "triangle"])
    command = [sys.executable, str(EXAMPLES / "libraries" / "answers.py"), library, str(tmp_path)]
    subprocess.run(command, check=True, capture_output=True)
    found = {}
    for file in failing:
        answers = read_answers(tmp_path / f"{library}-{file}.csv", [name for name in rows if f"-{file}-" in name])
        found[file] = sum(verdict.outcome == "failed" for verdict in scored(rows, (), answers, "float32"))

    assert found == failing
