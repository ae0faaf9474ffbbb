"""Where along a ray hits count: the clip interval of a camera ray (HIT-2), the open segment of a light feeler."""

from dataclasses import dataclass

from rayproof.reference.certified.fields import Field, Number


@dataclass(frozen=True, kw_only=True)
class Window:
    """low < t speed < high; None: no speed to multiply by (1), no upper end."""

    field: Field
    low: Number | None  # None: zero
    high: Number | None
    speed: Number | None

    def __contains__(self, t: Number) -> bool:
        """Return whether t lies strictly inside; raise UndecidedError."""
        value = t if self.speed is None else t * self.speed
        if self.field.sign(value if self.low is None else value - self.low) <= 0:
            return False
        return self.high is None or self.field.sign(self.high - value) > 0
