"""The tracer's task: render a scene by one configuration."""

from typing import Any

from cases.answers import Answers
from reports.judge.oracle import stages_of
from reports.judge.parties import Candidate
from reports.judge.supersampled import finer
from reports.run.clearances import shadow_epsilons
from reports.run.orders import TracerTask
from tracer.configuration import Configuration
from tracer.render import render
from tracer.versions import versions


def prepare() -> None:
    """Load what any scene needs: the backend and the formulas of the default configuration."""
    versions()
    for formula in Configuration().chosen:
        formula.load()


def trace(task: TracerTask) -> tuple[Candidate, dict[str, str], tuple[str, ...], list[dict[str, Any]]]:
    """Return what the tracer answered, the versions of what computed it, no notes, and how its other routes compare."""
    configuration = Configuration.parse(task.configuration)
    answers = render(task.scene, stages_of(task.scene), configuration)
    fine = None
    if task.samples > 1:
        fine = render(finer(task.scene, task.samples), stages_of(task.scene), configuration)
    candidate = Candidate(
        name=configuration.name,
        precision=configuration.precision,
        items=configuration.items,
        shadow_epsilon=shadow_epsilons(task.scene, answers, configuration),
        answers=answers,
        fine=fine,
    )
    return candidate, versions(), (), _consistency(task, configuration, answers)


def _consistency(task: TracerTask, configuration: Configuration, answers: Answers) -> list[dict[str, Any]]:
    if not task.routes:
        return []
    from reports.paths.routes import compare, suiting

    return [
        compare(route, task.scene, configuration, answers) for route in suiting(task.routes, task.scene, configuration)
    ]
