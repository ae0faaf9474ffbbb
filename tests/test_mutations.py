"""What `.ci/mutations` draws: the same from the same seed, from all packages, each another program by one line."""

import ast
import sys
from importlib.machinery import SourceFileLoader
from importlib.util import module_from_spec, spec_from_loader
from pathlib import Path
from types import ModuleType

import pytest

CHECKOUT = Path(__file__).parents[1]


@pytest.fixture(scope="module")
def mutations() -> ModuleType:
    spec = spec_from_loader("mutations", SourceFileLoader("mutations", str(CHECKOUT / ".ci" / "mutations")))
    assert spec is not None
    assert spec.loader is not None
    module = sys.modules["mutations"] = module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_same_seed_draws_the_same_changes_and_each_is_another_program(mutations: ModuleType) -> None:
    possible = mutations.all_changes(CHECKOUT)
    drawn = mutations.drawn(possible, 60, seed=5)

    assert drawn == mutations.drawn(possible, 60, seed=5)
    assert drawn != mutations.drawn(possible, 60, seed=6)
    assert [change.file.partition("/")[0] for change in drawn[:4]] == list(mutations.PACKAGES)
    for change in drawn:
        right = (CHECKOUT / change.file).read_text(encoding="utf-8")
        wrong = change.made(right)
        differ = [one for one in zip(right.split("\n"), wrong.split("\n"), strict=True) if one[0] != one[1]]
        assert differ == [(change.before, change.after)]
        assert ast.dump(ast.parse(wrong)) != ast.dump(ast.parse(right)), change


def test_every_kind_of_change_is_made_and_what_nothing_runs_is_left(mutations: ModuleType) -> None:
    text = """def f(a: int | None = 3) -> int | None:
    if a is not None and a <= 4.5:
        return -a * "ä" + (a) ** (2)
    return True
"""

    found = [(change.line, change.after.strip()) for change in mutations.changes(text, "f.py")]

    assert found == [
        (1, "def f(a: int | None = 4) -> int | None:"),
        (2, "if (not (a is not None and a <= 4.5)):"),
        (2, "if a is None and a <= 4.5:"),
        (2, "if a is not None or a <= 4.5:"),
        (2, "if a is not None and a < 4.5:"),
        (2, "if a is not None and a <= 9.0:"),
        (3, 'return -a / "ä" + (a) ** (2)'),
        (3, 'return -a * "ä" - (a) ** (2)'),
        (3, 'return -a * "ä" + (a) * (2)'),
        (3, 'return -a * "ä" + (a) ** (3)'),
        (4, "return False"),
    ]


def test_the_tests_that_name_a_module_come_before_those_of_its_folder(mutations: ModuleType) -> None:
    found = mutations.tests_of(CHECKOUT, "tracer/trees/traversal.py")

    assert found[0] == "tests/tracer/test_acceleration.py"
    assert {"tests/tracer/trees/test_build.py"} < set(found)
    assert not any(name.startswith("tests/reports/") for name in mutations.tests_of(CHECKOUT, "cases/scene.py")[-3:])
