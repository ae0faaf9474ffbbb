"""Cases on their way through a pool, a few at once: those of a run, or of a batch of one on another machine."""

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from pathlib import Path

from rayproof.cases.case import Case
from rayproof.reports.processes.pool import Pool
from rayproof.reports.results.records import CaseRecord
from rayproof.reports.run.cache_store import Store
from rayproof.reports.run.case_run import CaseRun
from rayproof.reports.run.demands import Demands
from rayproof.reports.run.plan import PlannedCase
from rayproof.reports.run.size import deadline
from rayproof.reports.run.verdict_memory import Memory
from rayproof.reports.subjects import Subject

# Cases on their way at once: so many that a stretch of cases that take the one under test long leaves enough to ask and
# to judge for the other processors, so few pixels that what they were answered, up to 2 KB each, is small in memory.
# Where a processor has nothing to do, because all of them wait for who is slow or sleeps, as many again.
AT_LEAST = 3
PIXELS = 2**17


@dataclass(frozen=True, kw_only=True)
class Source:
    """A user's own file with what it imports from beside it: the path that he wrote, and the contents by name."""

    path: str
    files: Mapping[str, bytes]


@dataclass(frozen=True, kw_only=True)
class Terms:
    """How each case of a run is put to the test, wherever that is done: plain data that travels between machines."""

    demands: Demands
    subject: Subject
    cached: bool  # what was answered and found before may be taken from the cache
    sources: tuple[Source, ...] = ()  # the user's own formulas, for machines that have not got them
    copies: tuple[tuple[str, str], ...] = ()  # there: the path of each, and where it lies
    patient: bool  # a case whose size is estimated to take longer than the pool's limit has longer


class CasesUnderWay:
    """Start cases and step the pool; `finished` gets each planned case and its record, whose files are in `folder`."""

    def __init__(
        self,
        terms: Terms,
        pool: Pool,
        *,
        folder: Path,
        store: Store | None,
        finished: Callable[[PlannedCase, CaseRecord], None],
    ) -> None:
        self._terms, self._pool, self._folder, self._finished = terms, pool, folder, finished
        self._memory = None if store is None else Memory(store, terms.demands)
        self._pixels: dict[str, int] = {}  # by name

    @property
    def has_room(self) -> bool:
        """Say whether another case may start."""
        pixels = self._pixels.values()
        return has_room(pixels) or (has_room(pixels, waiting=True) and self._pool.spare() > 0)

    @property
    def doing(self) -> list[str]:
        """Return the names of the cases."""
        return list(self._pixels)

    def start(self, one: PlannedCase) -> None:
        """Send a case on its way."""
        self._pixels[one.case.name] = _pixels(one.case)
        self._run(one, seconds=self._patience(one)).start()

    def step(self) -> None:
        """Wait a little for something to happen, and take it up."""
        self._pool.start()
        if self._memory is not None:
            self._memory.prepare()
        self._pool.step()

    def _run(self, planned: PlannedCase, *, seconds: float | None) -> CaseRun:
        demands = self._terms.demands
        return CaseRun(
            planned,
            demands.references,
            self._pool,
            folder=self._folder,
            require=demands.require,
            subject=self._terms.subject,
            memory=self._memory,
            own=demands.own,
            copies=self._terms.copies,
            images=demands.images,
            seconds=seconds,
            finished=self._done,
        )

    def _done(self, run: CaseRun, record: CaseRecord) -> None:
        del self._pixels[run.planned.case.name]
        self._finished(run.planned, record)

    def _patience(self, planned: PlannedCase) -> float | None:
        """Return how long each task of a case may take, or None where the user said."""
        if not self._terms.patient:
            return None
        about = {"candidates": len(planned.configurations), "references": len(self._terms.demands.references)}
        return deadline(planned.case, **about)


def has_room(pixels: Collection[int], *, waiting: bool = False) -> bool:
    """Say whether another case may start beside those under way, which have so many pixels each, or all wait."""
    times = 2 if waiting else 1
    return len(pixels) < times * AT_LEAST or sum(pixels) < times * PIXELS


def _pixels(case: Case) -> int:
    """Return how many pixels a case's largest image has, samples included."""
    return case.scene.camera.width * case.scene.camera.height * case.samples**2
