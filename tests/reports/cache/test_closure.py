"""What a module imports, read from the sources: all that Python's parser finds, and what a module lists or names."""

import ast
from pathlib import Path

import pytest

from rayproof import ROOT
from rayproof.reports.cache import guards, judgements, references
from rayproof.reports.cache.closure import closure
from rayproof.reports.run import plan

FOR_TYPES = "TYPE_CHECKING"  # under this nothing is imported
KINDS = {kind.__name__.rpartition(".")[2]: kind.CODE for kind in (guards, judgements, references, plan)}


def imported(path: Path) -> set[Path]:
    """Return the files of ours that one file imports, by Python's parser."""
    names: set[str] = set()
    tree = ast.parse(path.read_bytes())
    tree.body = [node for node in tree.body if not (isinstance(node, ast.If) and ast.unparse(node.test) == FOR_TYPES)]
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            assert node.level == 0, f"{path}: a relative import, which nobody reads"
            names |= {node.module, *(f"{node.module}.{alias.name}" for alias in node.names)}
    ours = [ROOT.joinpath(*name.split(".")[1:]) for name in names if name.split(".")[0] == "rayproof"]
    files = [file for place in ours for file in (place.with_suffix(".py"), place / "__init__.py")]
    return {file for file in files if file.is_file()}


@pytest.mark.parametrize("modules", KINDS.values(), ids=KINDS.keys())
def test_everything_that_a_file_of_a_key_imports_is_part_of_the_key(modules: tuple[str, ...]) -> None:
    files = set(closure(modules))

    missing = {path: rest for path in files if path.suffix == ".py" and (rest := imported(path) - files)}

    assert len(files) > 50
    assert not missing


def test_what_a_registry_lists_and_data_beside_a_module_are_part_of_it() -> None:
    names = {path.relative_to(ROOT).as_posix() for path in closure(("rayproof.reports.judge.judge_case",))}

    assert {"reports/judge/comparison/metrics/root_mean_square.py", "reports/judge/panel/findings.json"} <= names


def test_what_the_package_offers_to_type_checkers_is_part_of_no_key() -> None:
    reports = ROOT / "reports"

    assert not any(path.is_relative_to(reports) for path in closure(("rayproof.tracer.render",)))


def test_packages_told_otherwise_are_left_out() -> None:
    assert not any(path.is_relative_to(ROOT / "tracer") for path in closure(plan.CODE, without=("rayproof.tracer",)))


def test_a_module_that_is_not_there_is_told() -> None:
    with pytest.raises(LookupError, match=r"no module is called rayproof\.reports\.gone"):
        closure(("rayproof.reports.gone",))
