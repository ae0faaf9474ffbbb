"""The benchmark: our tracer's images per second beside other renderers', on the same scenes, interleaved.

To add a contender: a class in `contenders`, and a line in the table below:

    missing()            class method; a sentence why it cannot run here, or None. Imports nothing heavy
    unsupported(scene)   a sentence why it cannot draw this scene, or None
    prepare(scene)       a Prepared: the scene loaded, nothing rendered yet

The best time of `minimal` and of `direct` is what ours is divided into; the others are shown beside.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

import numpy as np

from rayproof.cases.registry import Entry, Table
from rayproof.cases.scene import Scene

if TYPE_CHECKING:
    from tests.benchmarks.bench.kernels import Kernel


@dataclass(frozen=True, kw_only=True)
class Prepared:
    """A scene that a contender has loaded."""

    build_seconds: float  # loading and building what rays are traced through
    run: Callable[[], None]  # render once, and come back when it is done
    image: Callable[[], np.ndarray] | None  # the last radiance, float32 (height, width, 3); None where it draws none
    does: str  # what one run is, in words
    kernels: Callable[[], tuple["Kernel", ...]] | None = None  # of one more run
    asked: Callable[[], list[np.ndarray]] | None = None  # which of its lanes, (lanes,) bool, ask for each branch
    ready: Callable[[], object] | None = None  # put in force what the process must be set to; takes none of the time


class Contender(Protocol):
    """A renderer in the benchmark."""

    @classmethod
    def missing(cls) -> str | None:
        """Return why it cannot run here, or None."""
        ...

    def unsupported(self, scene: Scene) -> str | None:
        """Return why it cannot draw this scene, or None."""
        ...

    def prepare(self, scene: Scene) -> Prepared:
        """Load the scene."""
        ...


CONTENDERS: Table[type[Contender]] = Table(
    "contender",
    package="tests.benchmarks.bench.contenders",
    entries={
        "mitsuba_direct": Entry("mitsuba:Direct"),
        "mitsuba_minimal": Entry("mitsuba:Minimal"),
        "mitsuba_minimal_frozen": Entry("mitsuba:MinimalFrozen"),
        "mitsuba_scalar": Entry("mitsuba:Scalar"),
        "ours": Entry("ours:Ours"),
        "ours_again": Entry("ours:OursAgain"),
        "ours_default": Entry("ours:OursByDefault"),
        "ours_float64": Entry("ours:OursDouble"),
        "radiance": Entry("references:Radiance"),
    },
)
