"""What routes that differ mean for a case: it fails, at the first stage that differs."""

from collections.abc import Iterable, Mapping, Sequence

from rayproof.reports.results.outcomes import Outcome
from rayproof.reports.results.records import CaseRecord, ConsistencyRecord, TakenRecord

# A failure, an error and a suspicion stand: they were found by those who know what is right.
STANDS = (Outcome.FAIL, Outcome.ERROR, Outcome.REFERENCE_SUSPECT)


def held_together(record: CaseRecord, consistency: Sequence[ConsistencyRecord]) -> None:
    """Put into a case's record how its routes compare; one that differs fails the case."""
    record["consistency"] = list(consistency)
    failed = [entry for entry in consistency if entry["verdict"] == Outcome.FAIL]
    if failed and Outcome(record["verdict"]) not in STANDS:
        first = failed[0]
        record.update({"verdict": Outcome.FAIL.value, "stage": first["stage"], "item": None, "reason": sentence(first)})


def sentence(entry: ConsistencyRecord) -> str:
    """Return in words where a route differs."""
    column, row = entry["pixel"] or (0, 0)
    return (
        f"{entry['configuration']} by {entry['path']}: {entry['stage']} differs from {entry['with']} in "
        f"{entry['differ']} pixels, most in ({column}, {row}); {entry['how']}"
    )


def together(paths: Iterable[Mapping[str, Sequence[str]]]) -> dict[str, list[str]]:
    """Return path -> routes of all configurations together; the judged route is called ''."""
    found: dict[str, set[str]] = {}
    for one in paths:
        for name, routes in one.items():
            found.setdefault(name, set()).update(routes)
    return {name: sorted(routes) for name, routes in sorted(found.items())}


def count_paths(found: dict[str, TakenRecord], record: CaseRecord) -> None:
    """Add to path -> how many cases of a run took it, and in how many its answer was compared with another."""
    compared = {entry["path"] for entry in record.get("consistency", ())} | ({""} if record["checks"] else set())
    for name, routes in record.get("paths", {}).items():
        counts = found.setdefault(name, {"executed": 0, "compared": 0})
        counts["executed"] += 1
        counts["compared"] += bool(compared & set(routes))
