"""The table of mutants counts what is wrong, and complains of what contradicts its reasons."""

from typing import Any

from rayproof.cases.families import all_cases
from tests.harness.audit.mutants.campaign import LAST, markdown, ordered, score
from tests.harness.audit.records import MutantFinding

KILLED = "primitives/sphere: wrong"


def finding(name: str, **values: Any) -> MutantFinding:
    found: MutantFinding = {
        "name": f"mutant/camera.up/{name}",
        "field": "camera.up",
        "what": "does not matter here",
        "equivalent": None,
        "survives": None,
        "killed_by_radiance": KILLED,
        "killed_by_stages": KILLED,
        "stage": "ray",
        "killed_at_random": None,
        "judged": 1,
    }
    return found | values  # pyright: ignore[reportReturnType]


ALIVE = {"killed_by_radiance": None, "killed_by_stages": None, "stage": None}


def test_mutants_are_counted_by_field() -> None:
    table = score(
        [
            finding("negated"),
            finding("normalised", equivalent="its length is lost", **ALIVE),
            finding("squared", killed_by_radiance="combined/7: wrong"),
            finding("rounded", survives="too little", killed_by_radiance=None),
        ],
        scenes=10,
        errors=[],
    )

    assert (table["of"], table["equivalent"], table["killed_by_radiance"], table["killed_by_stages"]) == (3, 1, 2, 3)
    assert table["problems"] == []
    assert table["killed_by_new_families"] == 1
    assert "| `camera.up` | 4 | 1 | 2 | 3 | 1 | `rounded` |" in markdown(table)
    assert "* `camera.up/normalised`: its length is lost." in markdown(table)


def test_what_contradicts_a_reason_is_a_problem() -> None:
    table = score(
        [
            finding("a", equivalent="it is the same"),
            finding("b", equivalent="it is the same", **{**ALIVE, "killed_at_random": "random_wide/31/7: wrong"}),
            finding("c", **ALIVE),
            finding("d", survives="too little"),
        ],
        scenes=10,
        errors=["mutants e ...: out of time"],
    )

    assert [problem.split()[0] for problem in table["problems"]] == [
        *(f"mutant/camera.up/{name}" for name in "abcd"),
        "mutants",
    ]


def test_cases_that_were_made_for_survivors_come_last() -> None:
    families = [case.family for case in ordered(all_cases())]

    late = [family in LAST for family in families]
    assert any(late)
    assert late == sorted(late)
