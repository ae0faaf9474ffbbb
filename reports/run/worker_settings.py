"""The workers of a run that puts another renderer than the tracer under test, or that nobody started early."""

from pathlib import Path

from rayproof.reports.processes.pool import Pool
from rayproof.reports.run.tasks import serve_run
from rayproof.reports.run.tasks.kinds import JUDGE, UNDER_TEST
from rayproof.reports.subjects import PROGRAM, Subject

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
