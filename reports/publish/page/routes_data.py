"""What the front page shows of the tracer's routes: each other one of a run beside the judged one, over all cases."""

from typing import TypedDict

from rayproof.reports.results.json_numbers import number
from rayproof.reports.results.outcomes import Outcome
from rayproof.reports.results.records import CaseRecord

NAMED = 8  # cases in which a route differs

# "with" is a word of Python's, so that this is written as a table.
RouteRow = TypedDict(
    "RouteRow",
    {
        "path": str,
        "configuration": str,
        "with": str | None,
        "how": str | None,
        "cases": int,  # in which it was compared
        "pixels": int,
        "worst": float | None,  # difference over its limit
        "where": str | None,  # the case of the worst
        "failed": list[str],  # cases in which it differs
    },
)


class Routes:
    """The comparisons of a run's routes, taken up case by case."""

    def __init__(self) -> None:
        self._rows: dict[tuple[str, str], RouteRow] = {}

    def add(self, case: CaseRecord) -> None:
        """Take up another case."""
        for entry in case.get("consistency", ()):
            key = str(entry.get("path")), str(entry.get("configuration"))
            row = self._rows.setdefault(
                key,
                {
                    "path": key[0],
                    "configuration": key[1],
                    "with": entry.get("with"),
                    "how": entry.get("how"),
                    "cases": 0,
                    "pixels": 0,
                    "worst": None,
                    "where": None,
                    "failed": [],
                },
            )
            row["cases"] += 1
            pixels = entry.get("pixels")
            row["pixels"] += pixels if isinstance(pixels, int) else 0
            if entry.get("verdict") == Outcome.FAIL and len(row["failed"]) < NAMED:
                row["failed"].append(case["name"])
            ratio = number(entry.get("worst"))
            if ratio is not None and (row["worst"] is None or ratio > row["worst"]):
                row["worst"], row["where"] = ratio, case["name"]

    @property
    def rows(self) -> list[RouteRow]:
        """Return a row a route and configuration, what differs first: in how many cases and pixels it was compared.

        `worst` is the largest difference over its limit and `where` its case; `failed` names cases in which it differs.
        """
        return sorted(self._rows.values(), key=lambda row: (not row["failed"], row["path"], row["configuration"]))
