"""Planted fault: the camera's limits multiplied by 1000."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from rayproof.reports.faults import FAULTS
from rayproof.reports.faults.patching import replaced
from rayproof.reports.judge import camera


@FAULTS.register("judge/camera_limit_times_1000", where="judge", stage=None)
@contextmanager
def camera_limit_times_1000() -> Iterator[None]:
    """Scale the camera's limits by 1000."""
    right = camera.scales

    def wrong(*arguments: Any) -> dict[str, Any]:
        return {part: 1000 * size for part, size in right(*arguments).items()}

    with replaced(right, wrong):
        yield
