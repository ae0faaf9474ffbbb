"""One case with many faults: references render once, the tracer once a fault, and the judge says what it saw."""

from collections.abc import Mapping, Sequence
from functools import cache
from typing import Any

from rayproof.cases.case import Case
from rayproof.cases.scene import Scene
from rayproof.cases.stages import Stage
from rayproof.reference.analytic import Analytic
from rayproof.reports.audit.faults import FAULTS
from rayproof.reports.audit.oracle import PatientOracle
from rayproof.reports.audit.orders import REFERENCES, CaseOrder, CaseReport, Look, Sighting
from rayproof.reports.audit.planted import PlantedFault
from rayproof.reports.judge.judge_case import judge_case
from rayproof.reports.judge.renderers import Candidate, Witness
from rayproof.reports.paths.verdict import sentence
from rayproof.reports.results.outcomes import Outcome
from rayproof.reports.results.records import ConsistencyRecord
from rayproof.reports.run.messages import ReferenceTask, TracerTask
from rayproof.reports.run.tasks import handlers

USUAL = "float32"
BAD = (Outcome.FAIL, Outcome.REFERENCE_SUSPECT, Outcome.ERROR, Outcome.MISSING)


def work(order: CaseOrder) -> CaseReport:
    """Judge the order's case with each of its faults planted, and with the unchanged tracer."""
    case, oracle = order.case, PatientOracle()
    witnesses = {name: witness(name, case.scene) for name in REFERENCES}
    usual = candidate(USUAL, case.scene)
    sightings = []
    for fault in order.faults:
        try:
            if fault.where == "tracer":
                sightings.append(_of_tracer(case, fault, witnesses, oracle))
            else:
                sightings.append(_of_reference(case, fault, witnesses, usual))
        except Exception as error:  # one fault's fall must not cost the others their verdict
            sightings.append(_fallen(fault, case, error))
    healthy = [
        _sighting(
            name,
            case,
            judge(case, usual if name == USUAL else candidate(name, case.scene), list(witnesses.values()), oracle),
        )
        for name in order.healthy
    ]
    return CaseReport(sightings=tuple(sightings), healthy=tuple(healthy))


@cache
def _task(kind: str) -> Any:
    return handlers.handler(kind)


def candidate(configuration: str, scene: Scene) -> Candidate:
    """Return the tracer's answers by one configuration."""
    return _task("tracer")(TracerTask(scene=scene, configuration=configuration, samples=1))[0]


def witness(name: str, scene: Scene) -> Witness:
    """Return a reference's answers."""
    return _task(f"reference:{name}")(ReferenceTask(scene=scene, samples=1))[0]


def judge(case: Case, one: Candidate, witnesses: Sequence[Witness], oracle: Any) -> Any:
    """Return the verdict on one candidate."""
    return judge_case(case, [one], witnesses, oracle, {})


def _of_tracer(case: Case, fault: PlantedFault, witnesses: Mapping[str, Witness], oracle: PatientOracle) -> Sighting:
    """Judge the tracer with one wrong formula, or with a fault in one of its paths."""
    if fault.configuration is not None:
        one, differing = candidate(fault.configuration, case.scene), None
    else:
        one, differing = _on_a_path(case, fault)
    judged = judge(case, one, list(witnesses.values()), oracle)
    if differing is not None and judged.outcome is not Outcome.FAIL:
        return Sighting(
            fault=fault.name,
            case=case.name,
            outcome=Outcome.FAIL,
            stage=Stage(str(differing["stage"])),
            item=None,
            blamed="tracer",
            reason=sentence(differing),
        )
    looks = {name: _look(judged, name, one, fault) for name, one in witnesses.items()}
    return _sighting(fault.name, case, judged, looks)


def _on_a_path(case: Case, fault: PlantedFault) -> tuple[Candidate, ConsistencyRecord | None]:
    """Return what the tracer answers with one of its paths spoilt, and the first of its routes that differs."""
    task = TracerTask(scene=case.scene, configuration=fault.precision, samples=1, routes=fault.routes)
    with FAULTS[fault.name]():
        one, _, _, consistency, _ = _task("tracer")(task)
    return one, next((entry for entry in consistency if entry["verdict"] == Outcome.FAIL), None)


def _of_reference(case: Case, fault: PlantedFault, witnesses: Mapping[str, Witness], usual: Candidate) -> Sighting:
    """Judge the unchanged tracer while a reference is spoilt; the oracle too, if that is the one."""
    with FAULTS[fault.name]():
        spoilt = {name: witness(name, case.scene) if name in fault.who else one for name, one in witnesses.items()}
        judged = judge(case, usual, list(spoilt.values()), Analytic())
    return _sighting(fault.name, case, judged)


def _fallen(fault: PlantedFault, case: Case, error: Exception) -> Sighting:
    """Return the sighting of a fault that could not be judged."""
    reason = f"{type(error).__name__}: {error}".splitlines()[0]
    return Sighting(
        fault=fault.name, case=case.name, outcome=Outcome.ERROR, stage=None, item=None, blamed=None, reason=reason
    )


def _sighting(name: str, case: Case, judged: Any, looks: dict[str, Look] | None = None) -> Sighting:
    """Sum a verdict up: who is blamed, and at which stage."""
    order = list(Stage)
    suspects = [check for check in judged.checks if check.outcome is Outcome.REFERENCE_SUSPECT]
    stage, blamed = judged.stage, None
    if judged.outcome is Outcome.FAIL:
        blamed = "tracer"
    elif suspects:
        stage = min((check.stage for check in suspects), key=order.index)
        blamed = ", ".join(sorted({check.suspected or check.reference for check in suspects}))
    return Sighting(
        fault=name,
        case=case.name,
        outcome=judged.outcome,
        stage=stage if judged.outcome in BAD else None,
        item=judged.item,
        blamed=blamed,
        reason=judged.reason,
        looks=looks or {},
    )


def _look(judged: Any, name: str, one: Witness, fault: PlantedFault) -> Look:
    """Return what the checks against one reference alone said."""
    order = list(Stage)
    failed = [check for check in judged.checks if check.reference == name and check.outcome is Outcome.FAIL]
    failed.sort(key=lambda check: (not check.alone, order.index(check.stage)))
    return Look(
        kills=bool(failed),
        stage=failed[0].stage if failed else None,
        answers=fault.stage is not None and one.answers_at(fault.stage) and one.error is None,
    )
