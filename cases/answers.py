"""What a renderer is asked and what it answers: the contract that the tracer and every reference keep.

An answer is a dictionary from stage to array. Image stages are float64 arrays of shape (height, width, channels)
with row 0 at the top, whatever precision computed them; `visibility` has one channel per light (none without
lights); `object` holds (shape index, face index). `Stage.CAMERA` is no image; its answer is a dictionary:

    view, view_inverse               (4, 4)   world -> camera [m] and back
    projection, projection_inverse   (4, 4)   camera -> clip and back
    frustum_corners                  (8, 3)   world [m]; near plane first, then far; in each (sx, sy) =
                                              (-1, -1), (1, -1), (1, 1), (-1, 1)
    ndc                              (height, width, 2)   (sx, sy) of each pixel centre
    pixel                            (height, width, 2)   (px, py) taken back from `ndc`

The camera space of `view` has x right, y up and z forward (depth along F), so that w = depth in clip space.
"""

from collections.abc import Collection
from dataclasses import dataclass
from typing import Any, Protocol

from rayproof.cases.scene import Scene
from rayproof.cases.stages import Stage

Answers = dict[Stage, Any]


@dataclass(frozen=True, kw_only=True)
class Resolution:
    """How finely a program's output resolves a stage, where that is coarser than its arithmetic."""

    relative: float  # of the value
    absolute: float  # in the stage's unit: half a step of a 16-bit format, or the like
    because: str  # which format or setting, in words


class Reference(Protocol):
    """An independent renderer. Its class docstring says what its word is worth."""

    # One word for its arithmetic ("float64", "float32"): limits are built from it.
    precision: str

    def version(self) -> str:
        """Return program and version, for the report."""
        ...

    def unsupported(self, scene: Scene, stage: Stage) -> str | None:
        """Return a sentence that says why it cannot answer here, or None if it can."""
        ...

    def render(self, scene: Scene, stages: Collection[Stage], *, samples: int = 1) -> Answers:
        """Answer `stages`; with samples > 1, radiance only, the mean over samples x samples points per pixel.

        The points are the centres of a regular subdivision of the pixel.
        """
        ...
