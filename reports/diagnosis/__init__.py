"""Known mistakes of ray tracers (`Mistake`, `Way`, `Fit`), and the search for those that explain a renderer's failures.

To add one, register a `Mistake` in a file of `reports/diagnosis/mistakes`. It says in a verb phrase what the renderer
does ("leaves out 1/pi"), which items of the specification that concerns, and how such a renderer answers: one or more
ways, since what one mistake shows depends on the right formulas around it. A way is a changed question to the oracle,
stages computed wrongly from the oracle's right ones, or wrong formulas of the tracer, or several of these; or right
answers that are written wrongly, which is asked before everything else.

A mistake that has no list of ways is `fitted`: its ways are made from some of the renderer's failing cases.

A mistake is named only if the renderer's pixels are those of one of its ways, in failing and in passing cases alike,
and if enough pixels tell that way from the right answer. docs/diagnosis.md says what counts as the same.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from rayproof.cases.registry import Registry
from rayproof.cases.scene import Scene
from rayproof.cases.stages import Stage, StageImages
from rayproof.reports.judge.forward.limits import Roundoff

if TYPE_CHECKING:
    from rayproof.reports.diagnosis.fits import Fitting
    from rayproof.reports.diagnosis.trials import Evidence


@dataclass(frozen=True, kw_only=True)
class Given:
    """The inputs from which a wrong stage is computed."""

    scene: Scene
    answers: StageImages  # the stages before, as the renderer with this mistake has them; after them the right ones
    right: np.ndarray  # this stage as it follows rightly from those before, (height, width, channels)
    parameter: float  # the estimated parameter of a mistake that has one, else 0


@dataclass(frozen=True, kw_only=True)
class Answered:
    """The answers of a way to a scene."""

    scene: Scene  # the question that was answered
    answers: StageImages
    limits: Mapping[Stage, np.ndarray]  # (height, width) or (height, width, 3)
    edge: np.ndarray  # (height, width): something else begins within a pixel
    rounding: Roundoff  # the renderer's, of which the limits are


# NaN where rounding alone says what such a renderer answers. One that has a parameter may say itself what it is `at`
# one, one that others of its kind change the same sum or rays what both are: `followed_by`.
Wrong = Callable[[Given], np.ndarray]


# How right answers lie in the file: these answers and the renderer's own images in, what is written out.
Stored = Callable[[Answered, StageImages], Answered]


@dataclass(frozen=True, kw_only=True)
class Way:
    """One way in which a renderer with the mistake may answer."""

    asked: Callable[[Scene], Scene] | None = None  # the question that it answers instead
    stages: Mapping[Stage, Wrong] = field(default_factory=dict)  # stages that it computes wrongly
    formulas: Mapping[str, str] = field(default_factory=dict)  # the tracer's, slot to variant, where they answer
    shading: str | None = None  # the one model of light that it computes wrongly; None is whichever a scene has
    stored: Stored | None = None  # all of its answers are right, and are written wrongly
    parts: "tuple[Way, ...]" = ()  # of two mistakes at once: each alone
    says: str | None = None  # what a renderer that answers so does, where the mistake's phrase is too general


@dataclass(frozen=True, kw_only=True)
class Fit:
    """How a mistake's parameter is estimated from a case: one number for each pixel that speaks of it."""

    samples: Callable[[Scene, StageImages, StageImages], np.ndarray]  # scene, the oracle's answers, the renderer's
    nothing: float  # the parameter of a renderer without the mistake
    grid: tuple[float, ...] = ()  # instead: values to try, between the best of which the parameter is sought


@dataclass(frozen=True, kw_only=True)
class Mistake:
    """One known mistake. Raises ValueError without a way."""

    says: str  # a verb phrase of which the renderer is the subject; {0} stands for the parameter
    items: tuple[str, ...]
    ways: tuple[Way, ...]
    fit: Fit | None = None
    named: Mapping[float, str] = field(default_factory=dict)  # phrases for parameters that have a name
    # Where roundings decide the pixels: whether a case looks so, contradicts it, or says nothing.
    seen: "Callable[[Evidence], bool | None] | None" = None
    seen_in: int = 3  # failing cases that must look so, or all of fewer
    # Makes ways from failing cases, after all other mistakes were asked; `ways` is an example then.
    fitted: "Callable[[Sequence[Fitting]], Iterator[Way]] | None" = None

    def __post_init__(self) -> None:
        if not self.ways:
            raise ValueError(f"a mistake needs a way to answer: {self.says}")

    def sentence(self, parameter: float) -> str:
        """Return the verb phrase with its parameter, by its name where it has one."""
        for value, phrase in self.named.items():
            if abs(parameter - value) <= NAMED * abs(value):
                return phrase
        return self.says.format(f"{parameter:.4g}")


NAMED = 1e-4  # a fitted parameter so near to a number that has a name, relatively, is that number
MISTAKES: Registry[Mistake] = Registry("mistake", package="rayproof.reports.diagnosis.mistakes")
