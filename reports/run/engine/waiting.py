"""The cases of a run that nobody has yet, in an order by which a worker gets those of one structure after each other.

Scenes of one structure share kernels, which a worker then compiles once. Only some are read ahead, so that a run of any
length is held in bounded memory.
"""

import itertools
from collections import deque
from collections.abc import Callable, Iterable, Iterator

from rayproof.reports.run.plan import PlannedCase

LARGEST = 200  # cases of a batch
AHEAD = 2000  # cases among which those of one structure are looked for
# Configurations, types of shapes, number of lights, shading, clipping, and samples a pixel.
Structure = tuple[tuple[str, ...], tuple[str, ...], int, str, str, int]


class Waiting:
    """The cases that nobody has yet, of which so many are read ahead as to find those of one structure."""

    def __init__(self, cases: Iterator[PlannedCase]) -> None:
        self._cases = cases
        self._by_structure: dict[Structure, deque[PlannedCase]] = {}
        self._count = 0
        self.more = True  # beyond those that are read
        self._read()

    def __bool__(self) -> bool:
        return self._count > 0

    @property
    def all(self) -> Iterator[PlannedCase]:
        """Yield those that are read."""
        return itertools.chain.from_iterable(self._by_structure.values())

    def take(
        self,
        structure: Structure | None,
        seconds: float,
        takes: Callable[[Iterable[PlannedCase]], float],
        taken: Iterable[Structure | None],
    ) -> tuple[tuple[PlannedCase, ...], Structure | None]:
        """Return cases of so many seconds, at least one, and their structure: this one as long as there are any.

        Otherwise one that nobody in `taken` has, if there is one, and the one of which there are most.
        """
        cases: list[PlannedCase] = []
        spent = 0.0
        while self._count and len(cases) < LARGEST and (not cases or spent < seconds):
            if structure not in self._by_structure:
                busy = set(taken)
                structure = max(self._by_structure, key=lambda one: (one not in busy, len(self._by_structure[one])))
            queue = self._by_structure[structure]
            one = queue.popleft()
            if not queue:
                del self._by_structure[structure]
            self._count -= 1
            cases.append(one)
            spent += takes((one,))
        self._read()
        return tuple(cases), structure

    def _read(self) -> None:
        while self.more and self._count < AHEAD:
            one = next(self._cases, None)
            if one is None:
                self.more = False
                return
            self._by_structure.setdefault(_structure(one), deque()).append(one)
            self._count += 1


def _structure(one: PlannedCase) -> Structure:
    """Return what decides which kernels a case needs, about: scenes that share it mostly share them."""
    scene = one.case.scene
    shapes = tuple(type(shape).__name__ for shape in scene.shapes)
    return one.configurations, shapes, len(scene.lights), scene.shading, scene.clip, one.case.samples
