"""Planted fault: the limits of exitance and radiance given the stage before multiplied by 1000."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from rayproof.reports.faults import FAULTS
from rayproof.reports.faults.patching import replaced
from rayproof.reports.judge import limits


@FAULTS.register("judge/continued_limit_times_1000", where="judge", stage=None)
@contextmanager
def continued_limit_times_1000() -> Iterator[None]:
    """Scale one kind of limit by 1000."""
    right = limits.continued_light_limit

    def wrong(*arguments: Any) -> Any:
        return 1000 * right(*arguments)

    with replaced(right, wrong):
        yield
