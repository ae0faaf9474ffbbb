"""One law on one case, in a worker: ask the subject, judge each relation."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

from cases.laws import LAWS
from cases.relations import Relation
from cases.scene import Scene
from cases.stages import Stage
from reports.laws.asking import Asked, SubjectError, UnansweredError, renderer
from reports.laws.judging import judge, ratios
from reports.laws.orders import Exhibit, LawOrder, LawReport
from reports.run.llvm import choose_packaged_llvm
from reports.run.worker import serve

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
    """Return the scene in a small image: a law holds for any size."""
    width, height = min(scene.camera.width, SIDES[0]), min(scene.camera.height, SIDES[1])
    return replace(scene, camera=replace(scene.camera, width=width, height=height))


def obey(order: LawOrder, ask: Asked) -> LawReport:
    """Return what becomes of one law on one case."""
    report = LawReport(law=order.law, case=order.case, configuration=order.configuration)
    before = ask.scenes
    judged, exhibit = [], None
    try:
        for relation in _relations(order, ask):
            one = judge(relation, ask.precision, ask.resolutions.get(relation.stage))
            judged.append(one)
            if order.keep and one.alarm and exhibit is None and relation.stage is not Stage.CAMERA:
                exhibit = _exhibit(relation, ask)
    except UnansweredError as reason:
        return replace(report, unsupported=str(reason), scenes=ask.scenes - before)
    except SubjectError as problem:
        return replace(report, error=str(problem), scenes=ask.scenes - before)
    return replace(report, judged=tuple(judged), scenes=ask.scenes - before, exhibit=exhibit)


def _relations(order: LawOrder, ask: Asked) -> Iterator[Relation]:
    for relation in LAWS[order.law](small(order.scene), ask):
        if relation.stage in order.stages:
            yield relation


def _exhibit(relation: Relation, ask: Asked) -> Exhibit:
    over = ratios(relation, ask.precision, ask.resolutions.get(relation.stage))
    return Exhibit(
        stage=relation.stage,
        scene=relation.scene,
        changed=relation.changed,
        expected=relation.expected.astype(float).tobytes(),
        measured=relation.measured.astype(float).tobytes(),
        shape=relation.expected.shape,
        over=over.max(axis=-1).tobytes(),
    )
