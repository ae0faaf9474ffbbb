"""A closed form at one pixel."""

from cases.answers import Answers
from cases.case import PixelValue
from cases.scene import Scene
from reports.judge.expectations import EXPECTATIONS, Finding


@EXPECTATIONS.register("PixelValue")
def pixel_value(expectation: PixelValue, scene: Scene, answers: Answers, slack: float) -> Finding:
    """Compare one channel of one pixel."""
    image = answers[expectation.stage]
    return Finding(
        measured=float(image[expectation.row, expectation.column, expectation.channel]),
        expected=expectation.value,
        limit=(expectation.relative + slack) * abs(expectation.value),
        used=1,
    )
