"""The pool of a run: kinds of workers, how many of each, their deadlines, the tracer's early start.

The tracer's worker is started first, since its imports take as long as those of all others.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

from rayproof.cases.scene import Scene
from rayproof.reports.judge.answers import Answers
from rayproof.reports.processes.pool import Pool
from rayproof.reports.processes.worker import Channel, Reply, serve
from rayproof.reports.run.case_answers import Render
from rayproof.reports.run.worker_tasks import (
    JUDGE,
    UNDER_TEST,
    ask_capabilities,
    handler,
    kind_of,
    render_subject,
)
from rayproof.reports.subjects import FUNCTION, PROGRAM, SERVED, TRACER, Subject
from rayproof.reports.subjects.protocol import Capabilities


def serve_run(kind: str, connection: Channel) -> None:
    """Answer a run's tasks of one kind in a worker; what they need is imported there, and nowhere else."""
    serve(kind, connection, handler)


@contextmanager
def early_workers(name: str, *, jobs: int, timeout: float) -> Iterator[Pool]:
    """Start the tracer's worker while the request is still being read; all workers end with the block.

    Of a program that stays alive, none; the request's questions start it.
    """
    if name == TRACER:
        # Judging is the longest part and shares nothing: it may take every processor.
        pool = Pool(jobs=jobs, timeout=timeout, copies={JUDGE: jobs}, target=serve_run)
        pool.prepare(TRACER)
    else:
        kind = name.partition(":")[0]
        pool = workers(Subject(name=kind, title=name, transport=kind, seconds=timeout), jobs=jobs, timeout=timeout)
    try:
        yield pool
    finally:
        pool.close()


# A program of the user's may sleep. What one computes that stays alive is not seen until it ends.
MAY_SLEEP = (PROGRAM,)
RELIEF = 10.0  # s that a reference may take for one case before another of it renders the others
PATIENCE = 120.0  # s for references and the judge, where --timeout speaks of another program's renders


def workers(subject: Subject, *, jobs: int, timeout: float, folder: Path | None = None) -> Pool:
    """Return a pool, none of whose workers has started; they have their temporary files in `folder`, if it is given."""
    copies = {JUDGE: jobs, PROGRAM: jobs, SERVED: jobs, FUNCTION: jobs}
    if subject.is_tracer:
        return Pool(jobs=jobs, timeout=timeout, copies=copies, folder=folder, target=serve_run)
    return Pool(
        target=serve_run,
        jobs=jobs,
        timeout=max(PATIENCE, timeout),
        copies=copies,
        may_sleep=MAY_SLEEP,
        # A program's own limit ends it, with a reason; it may be called twice for a case, and its image is to be read.
        # One that stays alive starts before that.
        timeouts={
            f"{UNDER_TEST}{subject.name}": timeout,
            PROGRAM: 2 * subject.seconds + PATIENCE,
            **dict.fromkeys((SERVED, FUNCTION), 3 * subject.seconds + PATIENCE),
        },
        folder=folder,
    )


LONGEST = 30.0  # s; a program that starts more slowly need not be asked


def ask(subject: Subject, pool: Pool | None = None) -> Capabilities:
    """Return what the program declares; nothing if it does not know the question.

    One that stays alive stays so in a `pool`.

    Raises:
        ValueError: its answer is not as the protocol asks.

    """
    seconds = subject.seconds if subject.stays else min(LONGEST, subject.seconds)
    task = partial(ask_capabilities, subject, seconds=seconds)
    reply = _reply(kind_of(subject), task, timeout=seconds + LONGEST, pool=pool)
    if isinstance(reply.value, Capabilities):
        return reply.value
    raise ValueError(reply.value if reply.error is None else reply.error)


def answered(
    subject: Subject,
    scene: Scene,
    *,
    keep: Path | None = None,
    told: Callable[[float, float], None] | None = None,
    pool: Pool | None = None,
) -> Answers:
    """Return what a subject that is not the tracer answers to a scene; a program's call is kept in a folder, if given.

    `told` gets how long it took [s]: the start of a program that stays alive, and the answer. One that was started in a
    `pool` is asked there.

    Raises:
        ValueError: its worker crashed or ran out of time; what a program comes to is the subject's error.

    """
    task = partial(render_subject, scene, 1, subject, keep)
    reply = _reply(kind_of(subject), task, timeout=3 * subject.seconds + LONGEST, pool=pool)
    if reply.error is not None:
        raise ValueError(reply.error)
    render: Render = reply.value
    if told is not None:
        start, last_start = (
            (0.0, 0.0) if render.standing is None else (render.standing.start, render.standing.last_start)
        )
        told(last_start, reply.seconds - start)
    return render.answers


def _reply(kind: str, task: partial[Any], *, timeout: float, pool: Pool | None = None) -> Reply:
    asked = pool or Pool(jobs=1, timeout=timeout, target=serve_run)
    try:
        asked.prepare(kind)  # its imports are no part of the reply's time
        return asked.reply(kind, task)
    finally:
        if pool is None:
            asked.close()
