"""Asking a subject in a worker of its own: whatever it does then, it does not do to the command line."""

from rayproof.cases.scene import Scene
from rayproof.reports.judge.answers import Candidate
from rayproof.reports.processes.pool import Pool
from rayproof.reports.processes.worker import Reply
from rayproof.reports.run.messages import QuestionTask, SubjectTask
from rayproof.reports.run.tasks import serve_run
from rayproof.reports.run.tasks.kinds import UNDER_TEST
from rayproof.reports.subjects import PROGRAM, Subject
from rayproof.reports.subjects.capabilities import Capabilities
from rayproof.reports.subjects.keeping import Keep

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


def answered(subject: Subject, scene: Scene, *, keep: Keep | None = None) -> Candidate:
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
