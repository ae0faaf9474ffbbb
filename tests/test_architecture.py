"""The shape of the whole: who imports whom, what is governed, and that the first command stays quick."""

import importlib
import re
import subprocess
import sys
from pathlib import Path

import pytest

import launcher

CHECKOUT = Path(__file__).parents[1]
BIN = Path(sys.executable).parent
HEAVY = ("cyclopts", "drjit", "matplotlib", "mitsuba", "numpy", "pyvista", "rich", "skimage", "trimesh")


def output(*command: str) -> str:
    """Run a command in the checkout; fail with what it printed if it does not end with 0."""
    done = subprocess.run(command, cwd=CHECKOUT, capture_output=True, text=True)
    if done.returncode != 0:
        pytest.fail(f"{' '.join(command)} ended with {done.returncode}\n{done.stdout}{done.stderr}", pytrace=False)
    return done.stdout


@pytest.mark.parametrize("package", ["cases", "reference", "reports", "tracer"])
def test_the_packages_come_from_this_checkout(package: str) -> None:
    module = importlib.import_module(f"rayproof.{package}")

    assert Path(str(module.__file__)).resolve().parent == CHECKOUT / package


@pytest.mark.process
def test_the_import_contracts_hold() -> None:
    output(str(BIN / "lint-imports"), "--no-cache")


@pytest.mark.process
def test_the_code_is_formatted() -> None:
    output(str(BIN / "ruff"), "format", "--check", ".")


@pytest.mark.process
def test_ruff_finds_nothing() -> None:
    output(str(BIN / "ruff"), "check", ".")


@pytest.mark.process
@pytest.mark.timeout(900)  # 80 s of one idle processor, and others' tests beside it
def test_the_types_check() -> None:
    output(str(BIN / "basedpyright"), "--pythonpath", sys.executable)


@pytest.mark.process
def test_help_imports_nothing_heavy() -> None:
    code = f"""
import sys
from rayproof.reports.cli import main
assert main(["--help"]) == 0
sys.exit(", ".join(name for name in {HEAVY} if name in sys.modules) or 0)
"""

    output(sys.executable, "-c", code)


def test_the_readme_begins_with_the_two_commands() -> None:
    fence = re.search(r"^```\w*\n(.*?)^```", (CHECKOUT / "README.md").read_text(), re.MULTILINE | re.DOTALL)

    assert fence is not None
    assert fence.group(1).splitlines() == ["./rayproof run", "./rayproof test"]


EXTRAS = [f"requirements-{name}.txt" for name in launcher.EXTRAS]


def pins(name: str) -> set[str]:
    """Return the pinned versions of a lock file, environment markers included."""
    return set(re.findall(r"^[a-z0-9].*?==[^\\\n]+", (CHECKOUT / name).read_text(), re.MULTILINE))


def test_the_development_lock_holds_the_other_ones() -> None:
    assert pins("requirements.txt")
    for extra in EXTRAS:
        assert pins("requirements.txt") < pins(extra) < pins("requirements-dev.txt")


@pytest.mark.parametrize("name", ["requirements.txt", *EXTRAS, "requirements-dev.txt"])
def test_the_lock_hashes_everything_and_names_no_address(name: str) -> None:
    text = (CHECKOUT / name).read_text()

    assert "://" not in text
    assert len(re.findall(r"==[^\\\n]+\\\n    --hash=sha256:", text)) == len(pins(name))


def test_the_house_stays_within_its_ceilings() -> None:
    # Later work makes room before it adds. The goal was 340 files and 64 000 lines; these are what was reached, with
    # the commands `vectors` and `shrink`. They go down with the house. test_docs_names.py holds the documents' words.
    product = [
        file for package in ("cases", "tracer", "reference", "reports") for file in (CHECKOUT / package).rglob("*.py")
    ]
    lines = sorted(len(file.read_text(encoding="utf-8").splitlines()) for file in product)
    scripts = [file for file in (CHECKOUT / "reports" / "publish").rglob("*.js") if "vendor" not in file.parts]

    assert len(product) <= 382
    assert sum(lines) <= 82_470
    assert lines[len(lines) // 2] >= 120
    assert lines[-1] <= 500
    assert len(scripts) <= 20
