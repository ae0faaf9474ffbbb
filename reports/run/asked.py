"""Asking a program what it can, in a worker of its own: whatever it does then, it does not do to the command line."""

from reports.run.orders import QuestionTask
from reports.run.pool import Pool
from reports.run.worker import Reply
from reports.subjects import PROGRAM, Subject
from reports.subjects.capabilities import Capabilities

LONGEST = 30.0  # s; a program that starts more slowly need not be asked


def ask(subject: Subject) -> Capabilities:
    """Return what the program declares; nothing if it does not know the question.

    Raises:
        ValueError: its answer is not as the protocol asks.

    """
    seconds = min(LONGEST, subject.seconds)
    pool = Pool(jobs=1, timeout=2 * LONGEST)
    replies: list[Reply] = []
    try:
        pool.submit(PROGRAM, QuestionTask(subject=subject, seconds=seconds), replies.append)
        while not replies:
            pool.step()
    finally:
        pool.close()
    (reply,) = replies
    if isinstance(reply.value, Capabilities):
        return reply.value
    raise ValueError(reply.value if reply.error is None else reply.error)
