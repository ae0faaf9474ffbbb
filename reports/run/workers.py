"""The pool of a run: kinds of workers, how many of each, their deadlines, the tracer's early start.

The tracer's worker is started first, since its imports take as long as all others together.
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
    """Run the tasks of one kind in a worker; their modules are only imported there."""
    serve(kind, connection, handler)


@contextmanager
def early_workers(name: str, *, jobs: int, timeout: float) -> Iterator[Pool]:
    """Start the tracer's worker while the request is still being read; all workers end with the block.

    A program that stays alive is not started early, but by its first request.
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


# A user's program may sleep. The processor time of a program that stays alive is not known until it ends.
MAY_SLEEP = (PROGRAM,)
RELIEF = 10.0  # s of a reference for one case, after which a second worker renders its other cases
PATIENCE = 120.0  # s for references and the judge, if --timeout is for the renders of another program


def workers(subject: Subject, *, jobs: int, timeout: float, folder: Path | None = None) -> Pool:
    """Return a pool without started workers; their temporary files are in `folder`, if it is given."""
    copies = {JUDGE: jobs, PROGRAM: jobs, SERVED: jobs, FUNCTION: jobs}
    if subject.is_tracer:
        return Pool(jobs=jobs, timeout=timeout, copies=copies, folder=folder, target=serve_run)
    return Pool(
        target=serve_run,
        jobs=jobs,
        timeout=max(PATIENCE, timeout),
        copies=copies,
        may_sleep=MAY_SLEEP,
        # A program is stopped by its own limit, with a reason. It may be called twice for a case, and its image is
        # read. A program that stays alive is started before that.
        timeouts={
            f"{UNDER_TEST}{subject.name}": timeout,
            PROGRAM: 2 * subject.seconds + PATIENCE,
            **dict.fromkeys((SERVED, FUNCTION), 3 * subject.seconds + PATIENCE),
        },
        folder=folder,
    )


LONGEST = 30.0  # s; a program must start within it


def ask(subject: Subject, pool: Pool | None = None) -> Capabilities:
    """Return the capabilities that a program declares, or empty ones if it does not support the request.

    A program that stays alive does so in `pool`, if it is given.

    Raises:
        ValueError: its answer violates the protocol.

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
    """Return the answers to a scene of a subject other than the tracer; a program's call is kept in `keep`, if given.

    The callback gets two times [s]: of the start of a program that stays alive, and of the answer. A program that was
    started in `pool` is called there.

    Raises:
        ValueError: the worker crashed or ran out of time; a program's own failure is an error of its answers.

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
    reply_pool = pool or Pool(jobs=1, timeout=timeout, target=serve_run)
    try:
        reply_pool.prepare(kind)  # its imports are no part of the reply's time
        return reply_pool.reply(kind, task)
    finally:
        if pool is None:
            reply_pool.close()
