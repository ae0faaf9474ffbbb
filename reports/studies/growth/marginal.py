"""What each further case costs: linear growth has the same price from one size to the next."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

from rayproof.reports.studies.growth.measuring import SuiteCost


@dataclass(frozen=True, kw_only=True)
class Further:
    """What one case more costs, between suites of two sizes."""

    when: str
    fewer: int  # cases of the smaller suite
    more: int  # and of the larger one
    seconds: float
    processor_seconds: float
    peak_bytes: float
    folder_bytes: float


def marginal(rows: Sequence[SuiteCost]) -> list[Further]:
    """Return, for each row but the smallest of its kind, the cost of each case beyond the next smaller row's."""
    found = []
    for when in dict.fromkeys(row.when for row in rows):
        grown = sorted((row for row in rows if row.when == when), key=lambda row: row.cases)
        for small, large in pairwise(grown):
            more, one, other = large.cases - small.cases, small.cost, large.cost
            found.append(
                Further(
                    when=when,
                    fewer=small.cases,
                    more=large.cases,
                    seconds=(other.seconds - one.seconds) / more,
                    processor_seconds=(other.processor_seconds - one.processor_seconds) / more,
                    peak_bytes=(other.peak_bytes - one.peak_bytes) / more,
                    folder_bytes=(other.folder_bytes - one.folder_bytes) / more,
                )
            )
    return found
