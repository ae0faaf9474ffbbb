"""What a shape must tell, seen from an exact apex: where rays cross it, what it blocks of itself, its normals.

All questions are signs of polynomials in the ray, as exact mathematics would ask them; `questions` keeps their margins.
"""

from dataclasses import dataclass
from typing import Any, Protocol

from rayproof.reference.double_double.pair_arithmetic import Bool, Float, Pair
from rayproof.reference.double_double.questions import LOW_MARGIN, Questions
from rayproof.reference.double_double.vectors import Vector


@dataclass(frozen=True)
class Span:
    """Crossings count where low < t speed < high; None: 0, no end, 1."""

    low: Pair | None
    high: Pair | None
    speed: Pair | None

    @property
    def is_feeler(self) -> bool:
        """Return whether crossings count between a ray's ends alone, t = 0 and 1."""
        return self.low is None and self.high is not None

    def holds(self, t: Pair, scale: Float, where: Bool, ask: Questions) -> Bool:
        """Return where t counts; `scale` is what t was made of."""
        value = t if self.speed is None else t * self.speed
        scale = scale if self.speed is None else scale * self.speed.size()
        if self.low is None:
            inside = ask.is_positive(value, scale, where)
        else:
            inside = ask.is_less(self.low, value, where, scale + self.low.size())
        if self.high is not None:
            whole = scale + self.high.size()
            inside &= ask.is_less(value, self.high, where, whole)
            if self.is_feeler:
                # The end lies on the surface that was hit, and on whatever coincides with it: neither lies before it.
                inside &= (self.high - value).size() > LOW_MARGIN * whole
        if self.speed is not None:
            inside &= self.speed.is_positive()
        return inside


@dataclass(frozen=True)
class Crossing:
    """The smallest t that counts, where `hit`, and the face's number."""

    t: Pair
    hit: Bool
    face: Any


class Seen(Protocol):
    """A shape seen from an apex; segments start there."""

    is_convex: bool  # and so asked by `blocks_itself` alone what it blocks of itself

    def crossing(
        self, ray: Vector, span: Span, ask: Questions, asked: Bool, without: Any = None, only: Any = None
    ) -> Crossing:
        """Return the first crossing where it is asked for; of a mesh `without` one face, or with one `only`."""
        ...

    def blocks_itself(self, segment: Vector, ask: Questions, where: Bool) -> Bool:
        """Return where a convex shape lies between the apex and its own point at the segment's end."""
        ...

    def normal(self, segment: Vector, face: Any, ask: Questions, where: Bool) -> Vector:
        """Return the unit outward world normal at the segment's end."""
        ...
