"""A closed form at one pixel."""

from rayproof.cases.case import PixelValue
from rayproof.cases.scene import Scene
from rayproof.cases.stages import StageImages
from rayproof.reports.judge.comparison.expectations import EXPECTATIONS, Finding


@EXPECTATIONS.register("PixelValue")
def pixel_value(expectation: PixelValue, scene: Scene, answers: StageImages, slack: float) -> Finding:
    """Compare one channel of one pixel."""
    image = answers[expectation.stage]
    return Finding(
        measured=float(image[expectation.row, expectation.column, expectation.channel]),
        expected=expectation.value,
        limit=(expectation.relative + slack) * abs(expectation.value),
        used=1,
    )
