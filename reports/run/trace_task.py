"""The tracer's task: render a scene by one configuration."""

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


def trace(task: TracerTask) -> tuple[Candidate, dict[str, str]]:
    """Return what the tracer answered, and the versions of what computed it."""
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
    return candidate, versions()
