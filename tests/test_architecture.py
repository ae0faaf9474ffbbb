"""The shape of the whole: who imports whom, what is locked, how many concepts there are, that --help stays quick."""

import ast
import importlib
import re
import subprocess
import sys
from collections import Counter
from collections.abc import Collection, Iterable
from functools import cache
from pathlib import Path

import pytest

import launcher
from rayproof.reports.cli import application

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


# Concepts that a reader has to know, and how many there may be. Later work lowers these numbers. Files, lines and words
# are not counted: nobody should join files or clip sentences to stay below a number.
PRODUCT = [
    file for package in ("cases", "tracer", "reference", "reports") for file in (CHECKOUT / package).rglob("*.py")
]
RECORDS = ("Struct", "TypedDict")  # bases of records, beside the decorator @dataclass


@cache
def class_definitions() -> tuple[ast.ClassDef, ...]:
    """Return every class of the product."""
    nodes = (node for file in PRODUCT for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))))
    return tuple(node for node in nodes if isinstance(node, ast.ClassDef))


def is_record(definition: ast.ClassDef, records: Collection[str]) -> bool:
    """Return whether a class is a dataclass, or derives from one of `records`."""
    decorators = [ast.unparse(decorator).partition("(")[0] for decorator in definition.decorator_list]
    bases = [ast.unparse(base).rpartition(".")[2] for base in definition.bases]
    return "dataclass" in [name.rpartition(".")[2] for name in decorators] or not set(records).isdisjoint(bases)


def record_definitions(definitions: Iterable[ast.ClassDef]) -> list[ast.ClassDef]:
    """Return the dataclasses, Structs and TypedDicts among classes, and the classes that derive from these."""
    records: list[ast.ClassDef] = []
    left = list(definitions)
    while more := [each for each in left if is_record(each, {*RECORDS, *(record.name for record in records)})]:
        records += more
        left = [definition for definition in left if definition not in more]
    return records


def test_few_class_names_are_defined_twice() -> None:
    count = Counter(definition.name for definition in class_definitions())

    assert len([name for name, times in count.items() if times > 1]) <= 58


def test_there_are_few_kinds_of_records() -> None:
    # A TypedDict whose keys are words of Python's is made by a call.
    made = sum(file.read_text(encoding="utf-8").count(" = TypedDict(") for file in PRODUCT)

    assert len(record_definitions(class_definitions())) + made <= 443


def test_records_are_counted() -> None:
    code = """
@dataclass(frozen=True)
class A: ...
class B(msgspec.Struct): ...
class C(D): ...
class D(TypedDict, total=False): ...
class E(Protocol): ...
"""
    definitions = [node for node in ast.parse(code).body if isinstance(node, ast.ClassDef)]

    assert sorted(record.name for record in record_definitions(definitions)) == ["A", "B", "C", "D"]


@pytest.mark.process
def test_a_run_of_one_case_imports_few_modules(tmp_path: Path) -> None:
    code = f"""
import sys
from rayproof.reports.cli import main
assert main(["run", "primitives/sphere", "--out", {str(tmp_path / "report")!r}]) == 0
print(sum(name.partition(".")[0] == "rayproof" for name in sys.modules))
"""

    assert int(output(sys.executable, "-c", code).splitlines()[-1]) <= 117


def test_run_has_few_options() -> None:
    names = [argument.name for argument in application()["run"].assemble_argument_collection()]

    assert sum(name.startswith("--") for name in names) <= 24
