"""Adding up: killed, blamed right, seen by whom, and what must not be so."""

# pyright: reportArgumentType=false, reportOptionalSubscript=false, reportReturnType=false
# Records are incomplete on purpose.

from typing import Any

from rayproof.cases.stages import Stage
from rayproof.reports.results.outcomes import Outcome
from tests.harness.audit import findings
from tests.harness.audit.orders import LiarReport, Look, Sighting
from tests.harness.audit.planted import PlantedFault

FAULT = PlantedFault(name="slot/fault_x", where="tracer", stage=Stage.OBJECT, also=(Stage.DISTANCE,))


def sighting(outcome: Outcome = Outcome.FAIL, stage: Stage | None = Stage.OBJECT, **more: Any) -> Sighting:
    usual = Look(kills=outcome is Outcome.FAIL, stage=stage, answers=True)
    facts: dict[str, Any] = {
        "fault": FAULT.name,
        "case": "family/case",
        "outcome": outcome,
        "stage": stage,
        "items": (),
        "blamed": "tracer" if outcome is Outcome.FAIL else None,
        "reason": "",
        "looks": dict.fromkeys(("analytic", "mitsuba_scalar", "mitsuba_llvm"), usual),
    }
    return Sighting(**(facts | more))


def passing() -> Sighting:
    return sighting(Outcome.PASS, None)


def score(entry: dict[str, Any], *healthy: Sighting) -> dict[str, Any]:
    return findings.score([entry], healthy, [])


def test_a_fault_that_no_case_shows_survives() -> None:
    result = score(findings.by_cases(FAULT, [passing()]))

    assert (result["killed"], result["good"]) == (0, False)
    assert result["problems"] == ["slot/fault_x survives"]


def test_a_stage_that_the_fault_cannot_spoil_is_wrong_blame() -> None:
    entry = findings.by_cases(FAULT, [sighting(), sighting(stage=Stage.NORMAL)])

    assert not entry["blamed_right"]
    assert not score(entry)["good"]


def test_a_reference_under_suspicion_for_the_tracers_fault_is_wrong_blame() -> None:
    suspect = sighting(Outcome.REFERENCE_SUSPECT, blamed="analytic")

    assert not findings.by_cases(FAULT, [sighting(), suspect])["blamed_right"]


def test_a_reference_that_sees_a_fault_must_kill_it_alone() -> None:
    blind = {"analytic": Look(kills=True, stage=Stage.OBJECT, answers=True)}
    blind |= dict.fromkeys(("mitsuba_scalar", "mitsuba_llvm"), Look(kills=False, stage=None, answers=True))
    mute = blind | dict.fromkeys(("mitsuba_scalar", "mitsuba_llvm"), Look(kills=False, stage=None, answers=False))

    assert not score(findings.by_cases(FAULT, [sighting(looks=blind)]))["good"]
    assert score(findings.by_cases(FAULT, [sighting(looks=mute)]))["good"]


def test_an_equivalent_fault_counts_apart_and_must_not_be_killed() -> None:
    equivalent = PlantedFault(name="slot/fault_x", where="tracer", stage=Stage.OBJECT, equivalent="a proof")

    right, wrong = (score(findings.by_cases(equivalent, [one])) for one in (passing(), sighting()))

    assert (right["planted"], right["killed"], right["equivalent"], right["good"]) == (1, 0, 1, True)
    assert not wrong["good"]


def test_a_reference_fault_blamed_on_the_tracer_is_wrong_unless_a_guard_comes_first() -> None:
    fault = PlantedFault(name="reference/x", where="reference", stage=Stage.OBJECT, who=("analytic",))
    seen = [sighting(Outcome.REFERENCE_SUSPECT, blamed="analytic"), sighting()]

    assert not findings.by_cases(fault, seen)["blamed_right"]
    assert findings.by_cases(fault, seen, "the oracle is broken")["blamed_right"]


def test_items_are_right_if_every_case_that_blames_the_stage_leaves_one_of_the_faults_own() -> None:
    fault = PlantedFault(name="slot/fault_x", where="tracer", stage=Stage.OBJECT, covers=("HIT-1",))
    right, wrong, elsewhere = (
        sighting(items=("HIT-1", "HIT-2")),
        sighting(items=("HIT-9",)),
        sighting(items=("NRM-1",), stage=Stage.DISTANCE),
    )
    cases = {"right": [right, elsewhere], "wrong": [right, right, wrong], "never": [elsewhere]}

    entries = {name: findings.by_cases(fault, some) for name, some in cases.items()}
    result = findings.score(list(entries.values()), [], [])

    assert {name: entry["items_right"] for name, entry in entries.items()} == {
        "right": True,
        "wrong": False,
        "never": False,
    }
    assert entries["wrong"]["blamed_items"] == ["HIT-1", "HIT-2", "HIT-9"]
    assert (result["items_declared"], result["items_right"]) == (3, 1)
    assert findings.by_cases(FAULT, [right])["items_right"] is None


def test_a_liar_that_hides_something_spoils_the_score() -> None:
    facts = {"case": "family/case", "pixels": 100, "wide": 2, "epsilon": 3}
    honest = LiarReport(**facts, unseen=0, holes=())
    hidden = LiarReport(**facts, unseen=4, holes=("family/case: radiance",))

    good, bad = (findings.score([], [], [], lies=[report, honest]) for report in (honest, hidden))

    assert (good["good"], good["liar"]["spoiled_unseen"], good["liar"]["pixels"]) == (True, 0, 200)
    assert (bad["good"], bad["liar"]["spoiled_unseen"]) == (False, 4)
    assert bad["problems"] == ["a liar passes: family/case: radiance"]
