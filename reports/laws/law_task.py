"""One law on one case, in a worker: ask the subject, judge each relation."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from rayproof.cases.laws import LAWS
from rayproof.cases.laws.relations import Relation, lit_from_the_eye
from rayproof.cases.scene import Scene
from rayproof.cases.stages import Stage, exr_channels
from rayproof.reports.laws.asking import Asked, SubjectError, UnansweredError, renderer
from rayproof.reports.laws.judging import Judged, judge
from rayproof.reports.laws.orders import Exhibit, LawOrder, LawReport
from rayproof.reports.processes.worker import serve
from rayproof.reports.run.llvm import choose_packaged_llvm

SIDES = (41, 31)  # px, at most: odd, so that there is a central pixel


def serve_laws(kind: str, connection: Any) -> None:
    """Answer orders until the other end closes."""
    choose_packaged_llvm()
    serve(kind, connection, handlers=lambda _: worker())


def worker() -> Callable[[LawOrder], LawReport]:
    """Return what does orders; it remembers what the last subject answered."""
    last: dict[tuple[Any, ...], Asked] = {}

    def work(order: LawOrder) -> LawReport:
        key = (order.subject, order.configuration, order.stages)
        if key not in last:
            last.clear()
            last[key] = Asked(renderer(order.subject, order.configuration), order.stages)
        return obey(order, last[key])

    return work


def small(scene: Scene) -> Scene:
    """Return the scene in a small image, since a law holds for any size, and lit, since else nothing is radiant."""
    if not scene.lights:
        scene = lit_from_the_eye(scene)
    width, height = min(scene.camera.width, SIDES[0]), min(scene.camera.height, SIDES[1])
    return replace(scene, camera=replace(scene.camera, width=width, height=height))


def obey(order: LawOrder, ask: Asked) -> LawReport:
    """Return what becomes of one law on one case."""
    report = LawReport(law=order.law, case=order.case, configuration=order.configuration)
    before = ask.scenes
    relations: list[tuple[Relation, Judged]] = []
    try:
        for relation in LAWS[order.law](small(order.scene), ask):
            if relation.stage in order.stages:
                relations.append((relation, judge(relation, ask.precision, ask.resolutions.get(relation.stage))))
    except UnansweredError as reason:
        return replace(report, unsupported=str(reason), scenes=ask.scenes - before)
    except SubjectError as problem:
        return replace(report, error=str(problem), scenes=ask.scenes - before)
    exhibit = _exhibit(relations) if order.keep else None
    judged = tuple(one for _, one in relations)
    return replace(report, judged=judged, scenes=ask.scenes - before, exhibit=exhibit)


def _exhibit(relations: Sequence[tuple[Relation, Judged]]) -> Exhibit | None:
    """Return the first change that breaks the law, else the first of all; only images of the stages' own channels."""
    shown = [(one, judged) for one, judged in relations if one.stage is not Stage.CAMERA]
    if not shown:
        return None
    chosen = next((one for one, judged in shown if judged.alarm), shown[0][0])
    lights = len(chosen.changed.lights)
    together = {
        one.stage: one
        for one, _ in shown
        if one.what == chosen.what
        and one.expected.shape == one.measured.shape
        and one.expected.shape[:2] == chosen.expected.shape[:2]
        and one.expected.shape[2] == len(exr_channels(one.stage, lights=lights))
    }
    return Exhibit(
        what=chosen.what,
        changed=chosen.changed,
        expected={stage: np.asarray(one.expected, dtype=np.float64) for stage, one in together.items()},
        measured={stage: np.asarray(one.measured, dtype=np.float64) for stage, one in together.items()},
    )
