"""What can be planted: enough, complete, and never in use unless named."""

import re
from pathlib import Path
from typing import Any

import pytest

from rayproof.cases.case import ITEMS
from rayproof.cases.families import all_cases
from rayproof.reports.results import outcomes
from tests.harness.audit.faults import altered, replaced
from tests.harness.audit.planted import candidates, first_round, later_round, planted, tables, tracer_faults

TRACER = tracer_faults()
CASES = all_cases()


def test_every_item_of_the_tracer_is_spoiled_by_some_fault() -> None:
    # Nothing of LIT-2 to LIT-4 is left to spoil that LIT-5's faults do not: they are strategies against one danger.
    spoiled = {item for fault in TRACER if fault.equivalent is None for item in fault.covers}

    assert set(ITEMS) - spoiled == {"LIT-2", "LIT-3", "LIT-4"}


def test_the_tables_of_the_document_are_those_of_the_declared_faults() -> None:
    text = (Path(__file__).parents[3] / "docs" / "faults.md").read_text(encoding="utf-8")
    (written,) = re.findall(r"tests\.harness\.audit\.planted -->\n\n(.*?)\n<!-- end -->", text, re.DOTALL)

    assert written == tables(), "write them anew: .venv/bin/python -m tests.harness.audit.planted"


def test_a_formula_of_ones_own_is_a_fault(tmp_path: Path) -> None:
    (tmp_path / "mine.py").write_text("def nearest_hit(ray, sphere, interval):\n    return interval.end\n")

    (fault,) = planted(f"sphere={tmp_path / 'mine.py'}:nearest_hit")

    assert fault.covers == ("HIT-1",)
    assert fault.configuration is not None
    assert fault.configuration.startswith("float32/sphere=")


def test_every_fault_has_a_case_that_could_show_it() -> None:
    assert [fault.name for fault in planted() if not candidates(fault, CASES)] == []


# Which cases a fault meets: named ones first, then one a family; a survivor meets new ones each round.


OF_ONE_SAMPLE = [case for case in all_cases() if case.samples == 1]


def test_at_first_each_fault_meets_a_few_cases_of_different_families() -> None:
    faults = planted("falloff/*")

    chosen = first_round(faults, OF_ONE_SAMPLE, families=4)

    for fault in faults:
        mine = [name for name, some in chosen.items() if fault in some]
        assert len(mine) == len({name.split("/")[0] for name in mine}) == 4
    # Faults of one kind share their cases: the references render each only once.
    assert len(chosen) == 4


def test_a_survivor_meets_what_it_has_not_met_and_at_last_nothing() -> None:
    (fault,) = planted("hidden/fault_never")
    seen: set[str] = set(first_round([fault], OF_ONE_SAMPLE, families=3))

    for _ in range(100):
        more = later_round([fault], OF_ONE_SAMPLE, {fault.name: seen}, most=20)
        assert not seen & set(more)
        if not more:
            break
        seen |= set(more)

    assert {case.name for case in OF_ONE_SAMPLE if set(case.covers) & set(fault.covers)} == seen


# A fault is in force inside its block and nowhere after it.


def test_a_function_is_replaced_wherever_it_was_imported_to() -> None:
    from rayproof.reports.run import totals

    right = outcomes.worst

    def wrong(found: Any) -> Any:
        return right(found)

    with replaced(right, wrong):
        assert outcomes.worst is wrong
        assert totals.worst is wrong
    assert outcomes.worst is totals.worst is right


def test_a_fault_that_would_not_be_planted_is_told() -> None:
    with pytest.raises(LookupError, match="no module holds"), replaced(object(), None):
        pass


def test_a_fault_is_taken_out_even_if_what_it_spoils_raises() -> None:
    right = outcomes.ledger

    with pytest.raises(TypeError), altered(outcomes, "ledger", None):
        outcomes.ledger([], planned=0)

    assert outcomes.ledger is right
