"""A point whose error is known and whose time is still to be taken."""

from dataclasses import dataclass, replace

import numpy as np

from rayproof.reports.studies.compare.statistics import LEVEL, median_interval
from rayproof.reports.studies.tradeoff.clocks import Launch
from rayproof.reports.studies.tradeoff.points import Point


@dataclass(frozen=True, kw_only=True)
class Entry:
    """A point and how to time it; until then its nanoseconds are NaN."""

    point: Point
    launch: Launch
    rays: int  # of a launch; pixels where samples are compared

    def timed(self, seconds: np.ndarray) -> Point:
        """Return the point, given the seconds of an odd number of launches."""
        each = seconds / self.rays * 1e9
        interval = median_interval(each.tolist(), level=LEVEL)
        return replace(self.point, nanoseconds=float(np.median(each)), nanoseconds_interval=interval)
