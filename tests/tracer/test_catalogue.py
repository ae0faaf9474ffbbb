"""The table of formulas: complete facts, one default a slot, every item covered, every function of a page listed."""

import importlib
import inspect
import pkgutil

import pytest

from rayproof.cases.case import ITEMS
from rayproof.tracer import formulas
from rayproof.tracer.formulas import FORMULAS, TABLE

# Each erratum that prints a formula, except where the printed form is text only (E16) or a choice (E8, E12).
ERRATA = ("E1", "E2", "E3", "E4", "E5", "E6", "E7", "E9", "E10", "E11", "E13", "E14", "E15", "E17")
MOVED = [entry for entry in TABLE.values() if "moved" in entry.facts]  # shadow rays that move by a length of their own


def test_every_item_is_covered_by_a_right_formula() -> None:
    covered = {item for formula in FORMULAS.values() if formula.kind == "right" for item in formula.covers}

    assert covered == set(ITEMS)


def test_every_function_of_a_page_is_in_the_table() -> None:
    """A formula that nobody lists would be a formula that nobody tests."""
    named = {entry.path for entry in TABLE.values()} | {entry.facts["moved"].path for entry in MOVED}
    pages = [page.name for page in pkgutil.walk_packages(formulas.__path__, prefix="") if page.name != "own_file"]
    pages += [f"mistakes.{page.name}" for page in pkgutil.iter_modules([f"{formulas.__path__[0]}/mistakes"])]
    found = set()
    for page in pages:
        module = importlib.import_module(f"{formulas.__name__}.{page}")
        functions = inspect.getmembers(module, inspect.isfunction)
        found |= {
            f"{page}:{name}"
            for name, function in functions
            if function.__module__ == module.__name__ and not name.startswith("_")
        }

    assert found - {"mistakes:mistake"} == named


def test_every_default_is_right() -> None:
    assert {FORMULAS[f"{slot}/{variant}"].kind for slot, variant in FORMULAS.slots.items()} == {"right"}


@pytest.mark.parametrize("erratum", ERRATA)
def test_every_printed_wrong_form_is_kept_as_a_control(erratum: str) -> None:
    assert erratum in {formula.erratum for formula in FORMULAS.values() if formula.kind == "control"}


def test_a_formula_that_leaks_is_right_elsewhere_or_a_control_and_no_default() -> None:
    leaking = [formula for formula in FORMULAS.values() if formula.leaks]

    assert {formula.slot for formula in leaking} == {"triangle"}
    assert "triangle/moeller_trumbore" in {formula.name for formula in leaking}
    assert not [formula.name for formula in leaking if formula.default or formula.kind == "fault"]
