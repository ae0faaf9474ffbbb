"""What a worker does: judge a case with faults, make a quantity ever less wrong, or run the judge's self-test."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from rayproof.cases.case import Case
from rayproof.cases.scene import Scene, Sphere
from rayproof.cases.stages import Stage, StageImages
from rayproof.reference.analytic import Analytic
from rayproof.reports.judge.answers import Answers
from rayproof.reports.judge.case import judge_case
from rayproof.reports.results.outcomes import Outcome
from rayproof.reports.run.worker_tasks import prepare, render_reference
from rayproof.reports.subjects import TRACER
from tests.harness.audit.faults import FAULTS
from tests.harness.audit.orders import (
    REFERENCES,
    CaseOrder,
    CaseReport,
    GradedOrder,
    GradedReport,
    GuardOrder,
    GuardReport,
    Look,
    Sighting,
)
from tests.harness.audit.planted import PlantedFault

USUAL = "float32"
BAD = (Outcome.FAIL, Outcome.REFERENCE_SUSPECT, Outcome.ERROR, Outcome.MISSING)


def judge_faults(order: CaseOrder) -> CaseReport:
    """Judge the order's case with each of its faults planted, and with the unchanged tracer."""
    case, oracle = order.case, Analytic()
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


def candidate(configuration: str, scene: Scene) -> Answers:
    """Return the tracer's answers by one configuration."""
    prepare(TRACER)
    from rayproof.reports.run.tracer_task import trace

    return trace(scene, configuration).answers


def witness(name: str, scene: Scene) -> Answers:
    """Return a reference's answers."""
    return render_reference(name, scene).answers


def judge(case: Case, one: Answers, witnesses: Sequence[Answers], oracle: Any) -> Any:
    """Return the verdict on one candidate."""
    return judge_case(case, [one], witnesses, oracle, {})


def _of_tracer(case: Case, fault: PlantedFault, witnesses: Mapping[str, Answers], oracle: Analytic) -> Sighting:
    """Judge the tracer with one wrong formula."""
    one = candidate(fault.configuration or USUAL, case.scene)
    judged = judge(case, one, list(witnesses.values()), oracle)
    looks = {name: _look(judged, name, one, fault) for name, one in witnesses.items()}
    return _sighting(fault.name, case, judged, looks)


def _of_reference(case: Case, fault: PlantedFault, witnesses: Mapping[str, Answers], usual: Answers) -> Sighting:
    """Judge the unchanged tracer while a reference is spoilt; the oracle too, if that is the one."""
    with FAULTS[fault.name]():
        spoilt = {name: witness(name, case.scene) if name in fault.who else one for name, one in witnesses.items()}
        judged = judge(case, usual, list(spoilt.values()), Analytic())
    return _sighting(fault.name, case, judged)


def _fallen(fault: PlantedFault, case: Case, error: Exception) -> Sighting:
    """Return the sighting of a fault that could not be judged."""
    reason = f"{type(error).__name__}: {error}".splitlines()[0]
    return Sighting(
        fault=fault.name, case=case.name, outcome=Outcome.ERROR, stage=None, items=(), blamed=None, reason=reason
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
        items=judged.blamed,
        blamed=blamed,
        reason=judged.reason,
        looks=looks or {},
    )


def _look(judged: Any, name: str, one: Answers, fault: PlantedFault) -> Look:
    """Return what the checks against one reference alone said."""
    order = list(Stage)
    failed = [check for check in judged.checks if check.reference == name and check.outcome is Outcome.FAIL]
    failed.sort(key=lambda check: (not check.alone, order.index(check.stage)))
    return Look(
        kills=bool(failed),
        stage=failed[0].stage if failed else None,
        answers=one.answers_at(fault.stage) and one.error is None,
    )


# Graded faults: one quantity wrong by a small relative amount, before the tracer alone, and which stages notice.
#
# Lengths, angles and light are changed in the scene that the tracer is given, while the judge asks about the right one.
# A tilted normal is made in the tracer's answers, from which the oracle continues what follows it.


NORMAL_TILT = "normal tilt"
AFTER_NORMAL = (Stage.VISIBILITY, Stage.IRRADIANCE, Stage.EXITANCE, Stage.RADIANCE)


def _fovy(scene: Scene, amount: float) -> Scene:
    return replace(scene, camera=replace(scene.camera, fovy=scene.camera.fovy * (1 + amount)))


def _flux(scene: Scene, amount: float) -> Scene:
    def brighter(flux: tuple[float, float, float]) -> tuple[float, float, float]:
        red, green, blue = flux
        return red * (1 + amount), green * (1 + amount), blue * (1 + amount)

    return replace(scene, lights=tuple(replace(light, flux=brighter(light.flux)) for light in scene.lights))


def _light_position(scene: Scene, amount: float) -> Scene:
    """Move the lights away from the point that the camera looks at, by a share of their distance from it."""
    target = scene.camera.target

    def moved(place: tuple[float, float, float]) -> tuple[float, float, float]:
        x, y, z = (p + amount * (p - t) for p, t in zip(place, target, strict=True))
        return x, y, z

    return replace(scene, lights=tuple(replace(light, position=moved(light.position)) for light in scene.lights))


def _radius(scene: Scene, amount: float) -> Scene:
    return replace(
        scene,
        shapes=tuple(
            replace(shape, radius=shape.radius * (1 + amount)) if isinstance(shape, Sphere) else shape
            for shape in scene.shapes
        ),
    )


def _albedo(scene: Scene, amount: float) -> Scene:
    def whiter(albedo: tuple[float, float, float]) -> tuple[float, float, float]:
        red, green, blue = albedo
        return red * (1 + amount), green * (1 + amount), blue * (1 + amount)

    return replace(scene, shapes=tuple(replace(shape, albedo=whiter(shape.albedo)) for shape in scene.shapes))


SCENES: dict[str, Callable[[Scene, float], Scene]] = {
    "fovy": _fovy,
    "flux": _flux,
    "light position": _light_position,
    "radius": _radius,
    "albedo": _albedo,
}
QUANTITIES = (*SCENES, NORMAL_TILT)


def grade(order: GradedOrder) -> GradedReport:
    """Return the smallest amount that each stage's check against the oracle finds; larger ones are found as well."""
    case, oracle = order.case, Analytic()
    truth = witness("analytic", case.scene)
    usual = candidate(order.precision, case.scene)
    smallest: dict[str, float] = {}
    standing = {stage.value for stage in Stage}
    for amount in order.amounts:
        if order.quantity == NORMAL_TILT:
            given = _tilted(case.scene, usual, amount, oracle)
        else:
            given = candidate(order.precision, SCENES[order.quantity](case.scene, amount))
        judged = judge(case, given, [truth], oracle)
        found = {check.stage.value for check in judged.checks if check.outcome is Outcome.FAIL}
        # A stage that missed a larger error has had its say: a smaller one that it finds is chance.
        standing &= found
        smallest |= dict.fromkeys(standing, amount)
        if not standing:
            break
    in_order = {stage.value: smallest[stage.value] for stage in Stage if stage.value in smallest}
    return GradedReport(quantity=order.quantity, precision=order.precision, smallest=in_order)


def _tilted(scene: Scene, usual: Answers, amount: float, oracle: Analytic) -> Answers:
    """Return the tracer's answers with every normal turned by `amount` [rad], and what follows from that."""
    kind = np.float64 if usual.precision == "float64" else np.float32
    normals = usual.answers[Stage.NORMAL]
    aside = np.cross(normals, (0.36, -0.48, 0.8))
    length = np.linalg.norm(aside, axis=-1, keepdims=True)
    aside = np.divide(aside, length, out=np.zeros_like(aside), where=length > 0)
    turned = math.cos(amount) * normals + math.sin(amount) * aside
    answers: StageImages = usual.answers | {Stage.NORMAL: turned.astype(kind).astype(np.float64)}
    for stage in AFTER_NORMAL:
        if stage in answers:
            answers[stage] = oracle.continue_from(scene, stage, answers).astype(kind).astype(np.float64)
    return replace(usual, answers=answers)


def ask_guard(order: GuardOrder) -> GuardReport:
    """Plant the order's fault, and return what the judge's self-test says of it."""
    from rayproof.reports.judge.limit_sentinels import BrokenJudgeError
    from rayproof.reports.judge.sentinels import stand_guard

    with FAULTS[order.fault.name]():
        try:
            stand_guard(Analytic())
        except BrokenJudgeError as broken:
            return GuardReport(fault=order.fault.name, stopped=str(broken))
    return GuardReport(fault=order.fault.name, stopped=None)
