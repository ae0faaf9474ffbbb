"""The worker processes of a run: which kinds there are, how many of each, and how long each may take.

The tracer's worker is started first, since its imports take as long as those of all others.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from rayproof.cases.scene import Scene
from rayproof.reports.judge.answers import Answers
from rayproof.reports.processes.pool import Pool
from rayproof.reports.processes.worker import Channel, Reply, serve
from rayproof.reports.run.messages import JUDGE, TRACING, UNDER_TEST, QuestionTask, SubjectTask
from rayproof.reports.subjects import PROGRAM, Subject
from rayproof.reports.subjects.calls import Keep
from rayproof.reports.subjects.protocol import Capabilities


def serve_run(kind: str, connection: Channel) -> None:
    """Answer a run's tasks of one kind in a worker; what they need is imported there, and nowhere else."""
    from rayproof.reports.run.worker_tasks import handler

    serve(kind, connection, handler)


@contextmanager
def early_workers(*, jobs: int, timeout: float) -> Iterator[Pool]:
    """Start the tracer's worker while the request is still being read; all workers end with the block."""
    # Judging is the longest part and shares nothing: it may take every processor.
    pool = Pool(jobs=jobs, timeout=timeout, copies={JUDGE: jobs}, target=serve_run)
    pool.prepare(TRACING)
    try:
        yield pool
    finally:
        pool.close()


# A program of the user's may sleep; that of a reference that does says so.
MAY_SLEEP = (PROGRAM,)
RELIEF = 10.0  # s that a reference may take for one case before another of it renders the others
PATIENCE = 120.0  # s for references and the judge, where --timeout speaks of another program's renders


def sleeping() -> frozenset[str]:
    """Return the kinds of workers whose programs sleep for most of a call, as references or under test."""
    from rayproof.reference import REFERENCES

    names = [name for name in REFERENCES if REFERENCES.about(name).get("sleeps", False)]
    return frozenset(f"{role}{name}" for name in names for role in ("reference:", UNDER_TEST))


def workers(subject: Subject, *, jobs: int, timeout: float, folder: Path | None = None) -> Pool:
    """Return a pool, none of whose workers has started; they have their temporary files in `folder`, if it is given."""
    copies = {JUDGE: jobs, PROGRAM: jobs}
    if subject.is_tracer:
        return Pool(jobs=jobs, timeout=timeout, copies=copies, folder=folder, target=serve_run)
    return Pool(
        target=serve_run,
        jobs=jobs,
        timeout=max(PATIENCE, timeout),
        copies=copies,
        may_sleep=MAY_SLEEP,
        # A program's own limit ends it, with a reason; it may be called twice for a case, and its image is to be read.
        timeouts={PROGRAM: 2 * subject.seconds + PATIENCE, f"{UNDER_TEST}{subject.name}": timeout},
        folder=folder,
    )


LONGEST = 30.0  # s; a program that starts more slowly need not be asked


def ask(subject: Subject) -> Capabilities:
    """Return what the program declares; nothing if it does not know the question.

    Raises:
        ValueError: its answer is not as the protocol asks.

    """
    seconds = min(LONGEST, subject.seconds)
    reply = _reply(PROGRAM, QuestionTask(subject=subject, seconds=seconds), timeout=2 * LONGEST)
    if isinstance(reply.value, Capabilities):
        return reply.value
    raise ValueError(reply.value if reply.error is None else reply.error)


def answered(subject: Subject, scene: Scene, *, keep: Keep | None = None) -> Answers:
    """Return what a subject that is not the tracer answers to a scene; a program's call is kept in a folder, if given.

    Raises:
        ValueError: its worker crashed or ran out of time; what a program comes to is the candidate's error.

    """
    kind = PROGRAM if subject.name == PROGRAM else f"{UNDER_TEST}{subject.name}"
    task = SubjectTask(scene=scene, samples=1, case="call", subject=subject, keep=keep)
    reply = _reply(kind, task, timeout=2 * subject.seconds + LONGEST)
    if reply.error is not None:
        raise ValueError(reply.error)
    return reply.value[0]


def _reply(kind: str, task: QuestionTask | SubjectTask, *, timeout: float) -> Reply:
    pool = Pool(jobs=1, timeout=timeout, target=serve_run)
    replies: list[Reply] = []
    try:
        pool.submit(kind, task, replies.append)
        while not replies:
            pool.step()
    finally:
        pool.close()
    return replies[0]
