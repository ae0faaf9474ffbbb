"""Every source file, folder, module, option and case that a document names exists."""

import ast
import re
import subprocess
from functools import cache
from pathlib import Path, PurePosixPath

import pytest

from rayproof.cases.families import all_cases
from rayproof.reports.cli import COMMANDS, application
from tests.benchmarks.bench.__main__ import bench
from tests.benchmarks.growth.__main__ import growth
from tests.command_line import program
from tests.harness.audit.__main__ import audit
from tests.harness.paths.__main__ import paths
from tests.harness.soak.__main__ import soak
from tests.harness.verdicts.__main__ import verdicts

pytestmark = pytest.mark.process  # git lists the files

CHECKOUT = Path(__file__).parents[1]
PAGES = [CHECKOUT / name for name in ("README.md", "CONTRIBUTING.md", "SECURITY.md")]
PAGES += sorted((CHECKOUT / "docs").glob("*.md"))
TOP = r"cases|tracer|reference|reports|tests|docs|examples|python|\.ci"
NAMED_PATH = re.compile(rf"(?<![\w./-])((?:{TOP})/[\w./-]*)")
NAMED_MODULE = re.compile(r"(?<![\w./])(?:rayproof\.)?((?:cases|tracer|reference|reports|tests)(?:\.\w+)+)")
BARE = re.compile(r"[\w-]+\.(?:py|js|html|cpp|toml|yml)")
# Files that a run or a reader writes.
MADE_BY_A_USER = {"index.html", "report.html", "mine.py", "renderer.py", "rayproof.toml"}


@cache
def tracked() -> frozenset[str]:
    """Return the files of the checkout and the folders that hold them."""
    said = subprocess.run(
        ["git", "ls-files", "-co", "--exclude-standard"], cwd=CHECKOUT, capture_output=True, text=True, check=True
    )
    files = [file for file in said.stdout.splitlines() if (CHECKOUT / file).exists()]
    return frozenset([*files, *(str(folder) for file in files for folder in PurePosixPath(file).parents)])


def code_words(page: Path) -> list[str]:
    """Return what stands between backticks on a page, without fenced blocks."""
    return re.findall(r"`([^`\n]+)`", re.sub(r"^```.*?^```", "", page.read_text(), flags=re.MULTILINE | re.DOTALL))


def lost_paths(word: str) -> list[str]:
    """Return the paths in a word of code that no file or folder of the checkout has."""
    lost = []
    for path in NAMED_PATH.findall(word):
        is_file = re.search(r"\.[a-z0-9]+$", path)
        if (is_file or path.endswith("/")) and path.rstrip("/") not in tracked():
            lost.append(path)
    bare = BARE.fullmatch(word)
    if bare and word not in MADE_BY_A_USER and not any(PurePosixPath(file).name == word for file in tracked()):
        lost.append(word)
    return lost


def lost_modules(word: str) -> list[str]:
    """Return the dotted names in a word of code whose module exists, but not what they name in it."""
    lost = []
    for name in NAMED_MODULE.findall(word):
        parts = name.split(".")
        for length in range(len(parts), 0, -1):
            module = "/".join(parts[:length])
            file = next((path for path in (f"{module}.py", f"{module}/__init__.py") if path in tracked()), None)
            if file:
                inside = parts[length : length + 1]
                if inside and not re.search(rf"\b{inside[0]}\b", (CHECKOUT / file).read_text()):
                    lost.append(name)
                break
    return lost


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_files_and_modules_that_a_page_names_exist(page: Path) -> None:
    words = code_words(page)

    assert [name for word in words for name in (*lost_paths(word), *lost_modules(word))] == []


def test_modules_that_docstrings_name_exist() -> None:
    # Nothing else reads docstrings: a module that is moved stays named in the others'.
    lost = []
    for file in sorted(path for path in tracked() if path.endswith(".py") and not path.startswith("examples/")):
        for node in ast.walk(ast.parse((CHECKOUT / file).read_text(encoding="utf-8"))):
            if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef):
                words = re.findall(r"`([^`\n]+)`", ast.get_docstring(node) or "")
                names = (name for word in words for name in (*lost_paths(word), *lost_modules(word)))
                lost += [f"{file}: {name}" for name in names if not BARE.fullmatch(name)]  # other programs' files

    assert lost == []


@cache
def known_options() -> frozenset[str]:
    """Return the options of all commands, and those that scripts, harnesses and the test runner have."""
    options = {"--help", "--version", "--upgrade"}  # the last one is pip's
    app = application()
    for name in COMMANDS:
        if app[name].default_command is not None:
            for argument in app[name].assemble_argument_collection():
                options.update(argument.names)
        for inner in app[name]:
            if not inner.startswith("-"):
                for argument in app[name][inner].assemble_argument_collection():
                    options.update(argument.names)
    for command in (audit, bench, growth, paths, soak, verdicts):
        for argument in program(command).assemble_argument_collection(parse_docstring=False):
            options.update(argument.names)
    elsewhere = [*(CHECKOUT / ".ci").iterdir(), *(CHECKOUT / "tests").rglob("*.py"), *CHECKOUT.glob("examples/**/*.*")]
    elsewhere += [CHECKOUT / "launcher.py", CHECKOUT / "action.yml", *CHECKOUT.glob("reports/api/*.py")]
    for file in elsewhere:
        if file.is_file() and file.suffix not in (".png", ".ply"):
            options.update(re.findall(r"--[a-z][\w-]+", file.read_text(errors="ignore")))
    return frozenset(options)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_options_that_a_page_names_exist(page: Path) -> None:
    named = {option for word in code_words(page) for option in re.findall(r"(?<![\w-])--[a-z][\w-]+", word)}

    assert sorted(named - known_options()) == []


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_cases_that_a_page_names_exist_and_are_counted_right(page: Path) -> None:
    ids = {case.name for case in all_cases()}
    families = {case.split("/")[0] for case in ids}
    named = {word for word in code_words(page) if re.fullmatch(r"\w+/\w+", word) and word.split("/")[0] in families}
    named = {word for word in named if "/fault_" not in word}
    # "the suite's N cases", "all N cases", "N cases of the suite": other counts are of something else.
    counts = re.findall(
        r"(?:suite's|all|suite of|suite has|with) (\d+) cases|the (\d+) cases of the suite", page.read_text()
    )

    assert sorted(named - ids) == []
    assert {int(first or second) for first, second in counts} <= {len(ids)}
