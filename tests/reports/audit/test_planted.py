"""What can be planted: enough, complete, and never in use unless named."""

from pathlib import Path

import pytest

from rayproof.cases.case import ITEMS
from rayproof.cases.families import all_cases
from rayproof.reports.audit.planted import planted, tracer_faults
from rayproof.reports.audit.selection import candidates
from rayproof.tracer.configuration import Configuration

TRACER = tracer_faults()
CASES = all_cases()


def test_the_tracer_has_more_than_forty_faults_of_its_own() -> None:
    assert len([fault for fault in TRACER if fault.erratum is None and fault.equivalent is None]) > 40


def test_every_item_of_the_tracer_is_spoiled_by_some_fault() -> None:
    # Nothing of LIT-2 to LIT-4 is left to spoil that LIT-5's faults do not: they are strategies against one danger.
    spoiled = {item for fault in TRACER if fault.equivalent is None for item in fault.covers}

    assert set(ITEMS) - spoiled == {"LIT-2", "LIT-3", "LIT-4"}


def test_a_default_configuration_has_no_fault_and_a_faulty_one_names_it() -> None:
    assert Configuration().faults == Configuration().controls == ()
    assert Configuration.parse("float32/sphere=fault_far_root").faults == ("sphere/fault_far_root",)


@pytest.mark.parametrize("where", ["tracer", "reference", "loader", "judge", "run", "report"])
def test_faults_are_found_by_place(where: str) -> None:
    assert {fault.where for fault in planted(where)} == {where}


def test_the_document_names_every_fault() -> None:
    text = (Path(__file__).parents[3] / "docs" / "audit.md").read_text()

    assert [fault.name for fault in planted() if f"`{fault.name}`" not in text] == []


def test_an_unknown_pattern_is_told() -> None:
    with pytest.raises(LookupError, match="no planted fault matches 'nothing'"):
        planted("nothing")


@pytest.mark.parametrize("fault", [fault for fault in planted() if not fault.on_guard], ids=lambda fault: fault.name)
def test_every_fault_has_a_case_that_could_show_it(fault) -> None:
    assert candidates(fault, CASES)
