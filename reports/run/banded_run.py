"""A case whose image is judged in bands of rows: each goes through the pool as a case, and they become one record."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from rayproof.reports.results.records import CaseRecord
from rayproof.reports.run.case_run import CaseRun
from rayproof.reports.run.plan import PlannedCase

AT_ONCE = 2  # bands under way, so that renderers work while one is judged

Finished = Callable[[Any, CaseRecord], None]
Merging = Callable[[PlannedCase, list[CaseRecord]], CaseRecord]


class BandedRun:
    """Put a case's bands through the pool, a few at once; `finished` gets the record of all of them."""

    def __init__(
        self,
        planned: PlannedCase,
        bands: tuple[tuple[int, int], ...],
        *,
        run: Callable[[PlannedCase, Finished], CaseRun],
        merged: Merging,
        finished: Finished,
    ) -> None:
        self.planned = planned
        self._bands, self._run, self._merged, self._finished = bands, run, merged, finished
        self._started = 0
        self._records: dict[str, CaseRecord] = {}

    @property
    def about(self) -> str:
        """Return how far it has come."""
        return f"{len(self._records)} of {len(self._bands)} bands judged"

    def start(self) -> None:
        """Submit the first bands."""
        for _ in range(min(AT_ONCE, len(self._bands))):
            self._next()

    def _next(self) -> None:
        rows = self._bands[self._started]
        self._started += 1
        self._run(band(self.planned, rows), self._one).start()

    def _one(self, run: CaseRun, record: CaseRecord) -> None:
        self._records[run.planned.case.name] = record
        if self._started < len(self._bands):
            self._next()
        elif len(self._records) == len(self._bands):
            in_order = [self._records[band(self.planned, rows).case.name] for rows in self._bands]
            self._finished(self, self._merged(self.planned, in_order))


def band(planned: PlannedCase, rows: tuple[int, int]) -> PlannedCase:
    """Return a planned case of which only these rows of the image are drawn and judged."""
    scene = planned.case.scene
    part = replace(scene, camera=replace(scene.camera, rows=rows))
    case = replace(planned.case, scene=part, name=f"{planned.case.name}/rows-{rows[0]}-{rows[1]}")
    # The tracer's other routes render whole images.
    return replace(planned, case=case, routes=())
