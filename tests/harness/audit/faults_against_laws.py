"""The tracer's planted faults before the laws: which law kills each, from the image alone and from all stages.

A law asks nobody but the spoilt tracer itself. Each fault meets the usual choice of law and case, in its order, until
its image breaks a law. Whether a survivor changes an image at all is found out beside the right tracer.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from rayproof.cases.case import Case
from rayproof.cases.families import all_cases, select
from rayproof.cases.laws import LAWS, USUAL
from rayproof.cases.laws.relations import Relation
from rayproof.cases.stages import Stage
from rayproof.reports.judge.laws import judge
from rayproof.reports.processes.pool import Pool
from rayproof.reports.processes.worker import Reply, serve
from rayproof.reports.run.law_task import Asked, check_law, small
from rayproof.reports.run.messages import TRACING, TracerTask
from rayproof.reports.run.worker_tasks import handler
from rayproof.tracer.kernel.compiler import choose_packaged_llvm
from tests.harness.audit.planted import PlantedFault, candidates
from tests.harness.audit.records import LawsScore

KIND = "laws"
LOOKED_AT = 6  # cases that could show a survivor, on which its image is compared with the right tracer's


@dataclass(frozen=True, kw_only=True)
class FaultOrder:
    """Put one fault to pairs of law and case."""

    fault: PlantedFault
    pairs: tuple[tuple[str, Case], ...]  # a law and a case
    cases: tuple[Case, ...]  # on which to see whether a survivor changes an image


@dataclass(frozen=True, kw_only=True)
class FaultReport:
    """The first pair that each kind of looking kills a fault by, in words, or None."""

    fault: PlantedFault
    image: str | None
    staged: str | None
    changes: str | None  # the case whose image it changes, or None if none was seen to
    error: str | None = None


def serve_faults(kind: str, connection: Any) -> None:
    """Answer orders until the other end closes."""
    choose_packaged_llvm()
    serve(kind, connection, handlers=lambda _: meet)


def traced_by(configuration: str) -> Asked:
    """Return the tracer by a configuration, as laws ask it."""
    trace = handler(TRACING)
    return Asked(lambda scene: trace(TracerTask(scene=scene, configuration=configuration, samples=1))[0])


def meet(order: FaultOrder) -> FaultReport:
    """Put one fault to the laws."""
    fault, image, staged = order.fault, None, None
    assert fault.configuration is not None
    ask = traced_by(fault.configuration)
    for law, case in order.pairs:
        broken = {relation.stage for relation in check_law(law, case.scene, ask, fault.configuration).alarms}
        words = f"{law}, {case.name}"
        staged = staged or (words if broken else None)
        if Stage.RADIANCE in broken and not LAWS.about(law).get("staged", False):
            image = words
            break
    changes = image or _changed(fault, ask, order.cases)
    return FaultReport(fault=fault, image=image, staged=staged, changes=changes)


def _changed(fault: PlantedFault, ask: Asked, cases: Sequence[Case]) -> str | None:
    """Return the first case whose image differs from the right tracer's by more than rounding, or None."""
    assert fault.configuration is not None
    right = traced_by(fault.configuration.split("/", maxsplit=1)[0])
    for case in cases:
        scene = small(case.scene)
        relation = Relation(
            stage=Stage.RADIANCE,
            expected=right(scene)[Stage.RADIANCE],
            measured=ask(scene)[Stage.RADIANCE],
            scene=scene,
            changed=scene,
            what="beside the right tracer",
        )
        if judge(relation, ask.precision).alarm:
            return case.name
    return None


def before_the_laws(
    faults: Sequence[PlantedFault], *, jobs: int, timeout: float, say: Callable[[str], None]
) -> LawsScore | None:
    """Return what laws say of the tracer's faults among `faults`, as audit.json has it; None if there are none."""
    wrong = [fault for fault in faults if fault.configuration is not None]
    if not wrong:
        return None
    pairs = tuple((law, select([name])[0]) for law, name in USUAL)
    cases = tuple(case for case in all_cases() if case.samples == 1)
    reports: list[FaultReport] = []
    pool = Pool(jobs=jobs, timeout=timeout * len(pairs), copies={KIND: jobs}, target=serve_faults)
    try:
        for fault in wrong:
            order = FaultOrder(fault=fault, pairs=pairs, cases=candidates(fault, cases)[:LOOKED_AT])

            def heard(reply: Reply, fault: PlantedFault = fault) -> None:
                report = reply.value or FaultReport(
                    fault=fault, image=None, staged=None, changes=None, error=reply.error
                )
                reports.append(report)
                say(f"laws: {fault.name}: {report.image or report.staged or _why(report)}")

            pool.submit(KIND, order, heard)
        while not pool.idle:
            pool.step()
    finally:
        pool.close()
    return summed_up(reports)


def _why(report: FaultReport) -> str:
    """Return the reason beside a fault that the image does not show."""
    if report.error is not None:
        return f"could not be asked: {report.error}"
    if report.fault.equivalent is not None:
        return f"equivalent: {report.fault.equivalent}"
    if report.changes is None:
        return "changes no image that was looked at" + (f"; its stages break {report.staged}" if report.staged else "")
    return f"changes the image of {report.changes} and breaks no law there"


def summed_up(reports: Sequence[FaultReport]) -> LawsScore:
    """Return the score: equivalent faults count apart, and from the image alone only faults that change one."""
    wanted = [one for one in reports if one.fault.equivalent is None]
    shown = [one for one in wanted if one.changes is not None]
    return {
        "killed_image": sum(one.image is not None for one in wanted),
        "of_image": len(shown),
        "killed_staged": sum(one.staged is not None for one in wanted),
        "of": len(wanted),
        "equivalent_killed": sorted(one.fault.name for one in reports if one.fault.equivalent and one.staged),
        "survivors": {one.fault.name: _why(one) for one in reports if one.image is None},
        "kills": {one.fault.name: {"image": one.image, "staged": one.staged} for one in reports if one.staged},
    }


def told(score: LawsScore | None) -> list[str]:
    """Return the score in words: which law kills each fault, and the proof or the reason beside each survivor."""
    if score is None:
        return []
    lines = [f"{name}: {kill['image'] or kill['staged']}" for name, kill in score["kills"].items()]
    lines += [f"{name}: {why}" for name, why in score["survivors"].items()]
    lines.append(
        f"Laws, no reference asked: {score['killed_image']} of {score['of_image']} faults that change an image killed "
        f"by the image alone, {score['killed_staged']} of {score['of']} by all stages, "
        f"{len(score['equivalent_killed'])} equivalent ones"
    )
    return lines
