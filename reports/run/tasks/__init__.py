"""The tasks that a run's workers carry out: ask a reference, trace, judge."""

from rayproof.reports.processes.channel import Channel
from rayproof.reports.processes.worker import serve


def serve_run(kind: str, connection: Channel) -> None:
    """Answer a run's tasks of one kind in a worker; what they need is imported there, and nowhere else."""
    from rayproof.reports.run.tasks.handlers import handler

    serve(kind, connection, handler)
