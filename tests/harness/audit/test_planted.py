"""What can be planted: enough, complete, and never in use unless named."""

import re
import sys
from pathlib import Path
from typing import Any

import pytest

from rayproof.cases.case import ITEMS
from rayproof.cases.families import all_cases
from rayproof.cases.scene import Scene, Square
from rayproof.cases.stages import Stage
from rayproof.reference import radiance
from rayproof.reports.results import outcomes
from rayproof.tracer.configuration import Configuration
from tests.harness.audit.faults import FAULTS, altered, replaced
from tests.harness.audit.planted import candidates, first_round, later_round, planted, tables, tracer_faults
from tests.reports.judge.scenes import SCENE

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


def test_the_tables_of_the_document_are_those_of_the_declared_faults() -> None:
    text = (Path(__file__).parents[3] / "docs" / "faults.md").read_text(encoding="utf-8")
    (written,) = re.findall(r"tests\.harness\.audit\.planted -->\n\n(.*?)\n<!-- end -->", text, re.DOTALL)

    assert written == tables(), "write them anew: .venv/bin/python -m tests.harness.audit.planted"


def test_an_unknown_pattern_is_told() -> None:
    with pytest.raises(LookupError, match="no planted fault matches 'nothing'"):
        planted("nothing")


def test_a_formula_of_ones_own_is_a_fault(tmp_path: Path) -> None:
    (tmp_path / "mine.py").write_text("def nearest_hit(ray, sphere, interval):\n    return interval.end\n")

    (fault,) = planted(f"sphere={tmp_path / 'mine.py'}:nearest_hit")

    assert fault.covers == ("HIT-1",)
    assert fault.configuration is not None
    assert fault.configuration.startswith("float32/sphere=")


@pytest.mark.parametrize("fault", [fault for fault in planted() if not fault.on_guard], ids=lambda fault: fault.name)
def test_every_fault_has_a_case_that_could_show_it(fault) -> None:
    assert candidates(fault, CASES)


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


def test_cases_that_a_fault_names_come_first() -> None:
    (fault,) = planted("basis/fault_up_as_given")

    assert "cameras/slanted_up" in first_round([fault], OF_ONE_SAMPLE, families=1)


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


def _state() -> dict[str, dict[str, int]]:
    """Return the identity of everything that the project's modules and their classes hold, by holder and name."""
    found: dict[str, dict[str, int]] = {}
    for module in list(sys.modules.values()):
        name = module.__name__
        if name.split(".", 1)[0] != "rayproof":
            continue
        found[name] = _identities(module)
        for value in list(vars(module).values()):
            if isinstance(value, type) and value.__module__ == name:
                found[f"{name}.{value.__qualname__}"] = _identities(value)
    return found


def _identities(holder: Any) -> dict[str, int]:
    return dict(zip(vars(holder), map(id, vars(holder).values()), strict=True))


@pytest.mark.parametrize("name", list(FAULTS))
def test_a_fault_changes_something_and_is_taken_out_again(name: str) -> None:
    before = _state()

    with FAULTS[name]():
        during = _state()

    assert during != before
    after = _state()
    assert all(held.items() <= after[holder].items() for holder, held in before.items())


def test_a_function_is_replaced_wherever_it_was_imported_to() -> None:
    from rayproof.reports.run import totals

    right = outcomes.worst

    def wrong(found: Any) -> Any:
        return right(found)

    with replaced(right, wrong):
        assert outcomes.worst is wrong
        assert totals.worst is wrong
    assert outcomes.worst is totals.worst is right


def test_what_was_kept_of_right_answers_is_forgotten_and_so_is_what_was_kept_of_wrong_ones() -> None:
    scene = Scene(camera=SCENE.camera, shapes=(Square(albedo=(0.5, 0.5, 0.5)),))

    def refused() -> bool:
        return radiance.refusal(scene, Stage.OBJECT) is not None

    assert not refused()
    with altered(radiance, "COARSEST", 1e-9):
        assert refused()
    assert not refused()


def test_a_fault_that_would_not_be_planted_is_told() -> None:
    with pytest.raises(LookupError, match="no module holds"), replaced(object(), None):
        pass


def test_a_fault_is_taken_out_even_if_what_it_spoils_raises() -> None:
    right = outcomes.ledger

    with pytest.raises(TypeError), altered(outcomes, "ledger", None):
        outcomes.ledger([], planned=0)

    assert outcomes.ledger is right
