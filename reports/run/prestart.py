"""The tracer's worker, started first of all: its imports take as long as those of everything else."""

from collections.abc import Iterator
from contextlib import contextmanager

from rayproof.reports.processes.pool import Pool
from rayproof.reports.run.tasks import serve_run
from rayproof.reports.run.tasks.kinds import JUDGE, TRACING


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
