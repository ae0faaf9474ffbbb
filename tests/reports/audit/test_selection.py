"""Which cases a fault meets: named ones first, then one a family; a survivor meets new ones each round."""

from rayproof.cases.families import all_cases
from rayproof.reports.audit.planted import planted
from rayproof.reports.audit.selection import first_round, later_round

CASES = [case for case in all_cases() if case.samples == 1]


def test_at_first_each_fault_meets_a_few_cases_of_different_families() -> None:
    faults = planted("falloff/*")

    chosen = first_round(faults, CASES, families=4)

    for fault in faults:
        mine = [name for name, some in chosen.items() if fault in some]
        assert len(mine) == len({name.split("/")[0] for name in mine}) == 4
    # Faults of one kind share their cases: the references render each only once.
    assert len(chosen) == 4


def test_cases_that_a_fault_names_come_first() -> None:
    (fault,) = planted("basis/fault_up_as_given")

    assert "cameras/slanted_up" in first_round([fault], CASES, families=1)


def test_a_survivor_meets_what_it_has_not_met_and_at_last_nothing() -> None:
    (fault,) = planted("hidden/fault_never")
    seen: set[str] = set(first_round([fault], CASES, families=3))

    for _ in range(100):
        more = later_round([fault], CASES, {fault.name: seen}, most=20)
        assert not seen & set(more)
        if not more:
            break
        seen |= set(more)

    assert {case.name for case in CASES if set(case.covers) & set(fault.covers)} == seen
