"""Graded faults: one quantity wrong by a small relative amount, before the tracer alone, and which stages notice.

Lengths, angles and light are changed in the scene that the tracer is given, while the judge asks about the right one.
A tilted normal is made in the tracer's answers, from which the oracle continues what follows it.
"""

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from rayproof.cases.scene import Scene, Sphere
from rayproof.cases.stages import Stage, StageImages
from rayproof.reports.audit.case_task import candidate, judge, witness
from rayproof.reports.audit.oracle import PatientOracle
from rayproof.reports.audit.orders import GradedOrder, GradedReport
from rayproof.reports.judge.renderers import Candidate
from rayproof.reports.results.outcomes import Outcome

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


def work(order: GradedOrder) -> GradedReport:
    """Return the smallest amount that each stage's check against the oracle finds; larger ones are found as well."""
    case, oracle = order.case, PatientOracle()
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


def _tilted(scene: Scene, usual: Candidate, amount: float, oracle: PatientOracle) -> Candidate:
    """Return the tracer's answers with every normal turned by `amount` [rad], and what follows from that."""
    assert usual.answers is not None
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
