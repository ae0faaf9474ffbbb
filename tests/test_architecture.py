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


def test_no_class_name_is_defined_twice() -> None:
    count = Counter(definition.name for definition in class_definitions())

    assert [name for name, times in count.items() if times > 1] == []


def test_there_are_few_kinds_of_records() -> None:
    # A TypedDict whose keys are words of Python's is made by a call.
    made = sum(file.read_text(encoding="utf-8").count(" = TypedDict(") for file in PRODUCT)

    assert len(record_definitions(class_definitions())) + made <= 367


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


def names_in(node: ast.AST) -> set[str]:
    """Return the names, attributes and imported names in a part of a file."""
    nodes = [*ast.walk(node)]
    imported = (alias.name for each in nodes if isinstance(each, ast.ImportFrom) for alias in each.names)
    attributes = (each.attr for each in nodes if isinstance(each, ast.Attribute))
    return {*imported, *attributes, *(each.id for each in nodes if isinstance(each, ast.Name))}


def definitions(file: str) -> dict[str, set[str]]:
    """Return each function and variable of a file with the names that occur in it; of a method without its class."""
    found: dict[str, set[str]] = {}
    for node in ast.walk(ast.parse((CHECKOUT / file).read_text(encoding="utf-8"))):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            found[node.name] = found.get(node.name, set()) | names_in(node)
        elif isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name):
            found.setdefault(node.target.id, set())
    return found


def calls(file: str, function: str) -> set[str]:
    """Return the names in a function, and in the functions of the same file that it calls."""
    defined, reached, names = definitions(file), set[str](), {function}
    while following := (names & defined.keys()) - reached:
        reached |= following
        names |= {name for each in following for name in defined[each]}
    return names


def test_the_picture_of_a_case_s_way_is_that_of_the_code() -> None:
    text = (CHECKOUT / "docs" / "architecture.md").read_text(encoding="utf-8")
    picture = text[text.index("The way of a case") : text.index("* `rayproof run` fills")]
    rows = re.findall(r"^ {4}( *)(\S+) +(\w+/\S+\.py)", picture, re.MULTILINE)
    above: dict[int, tuple[str, str]] = {}  # by indentation: file and function
    for indentation, name, file in rows:
        function = name.rpartition(".")[2]
        assert function in definitions(file), f"{file} defines no {name}"
        if indentation:
            caller = above[len(indentation) - 2]
            assert function in calls(*caller), f"{caller} does not call {name}"
        above[len(indentation)] = (file, function)

    # The steps of a case stand in the order of their last calls.
    tree = ast.parse((CHECKOUT / "reports/run/case_pipeline.py").read_text(encoding="utf-8"))
    record = next(node for node in ast.walk(tree) if isinstance(node, ast.AsyncFunctionDef) and node.name == "record")
    lines: dict[str, int] = {}
    for node in ast.walk(record):
        if isinstance(node, ast.Attribute):
            lines[node.attr] = max(node.lineno, lines.get(node.attr, 0))
    steps = [name for indentation, name, _ in rows if len(indentation) == 12]
    assert len(steps) == 5
    assert steps == sorted(steps, key=lambda step: lines[step])


@pytest.mark.process
def test_a_run_of_one_case_imports_few_modules(tmp_path: Path) -> None:
    code = f"""
import sys
from rayproof.reports.cli import main
assert main(["run", "primitives/sphere", "--out", {str(tmp_path / "report")!r}]) == 0
print(sum(name.partition(".")[0] == "rayproof" for name in sys.modules))
"""

    assert int(output(sys.executable, "-c", code).splitlines()[-1]) <= 110


def test_run_has_few_options() -> None:
    names = [argument.name for argument in application()["run"].assemble_argument_collection()]

    assert sum(name.startswith("--") for name in names) <= 24
