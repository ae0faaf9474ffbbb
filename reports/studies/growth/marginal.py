"""What each further case costs: linear growth has the same price from one size to the next."""

from collections.abc import Sequence
from itertools import pairwise
from typing import Any

COSTS = ("seconds", "processor_seconds", "peak_bytes", "folder_bytes")


def marginal(rows: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """Return, for each row but the smallest of its kind, the cost of each case beyond the next smaller row's."""
    found = []
    for when in dict.fromkeys(row["when"] for row in rows):
        grown = sorted((row for row in rows if row["when"] == when), key=lambda row: row["cases"])
        for small, large in pairwise(grown):
            more = large["cases"] - small["cases"]
            each = {name: (large[name] - small[name]) / more for name in COSTS}
            found.append({"when": when, "from": small["cases"], "to": large["cases"], **each})
    return found
