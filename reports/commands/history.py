"""`rayproof report history`: error and time of each case over the stored runs, and the cases that became worse."""

import os
from collections.abc import Sequence
from pathlib import Path

from rayproof.reports.commands.output import say, show_table, write_json
from rayproof.reports.commands.usage import UsageError, told_in_one_line

USUAL = "rayproof-history.sqlite"
VARIABLE = "RAYPROOF_HISTORY"
RUN = ("run", "started", "revision", "verdict", "seconds")


def history(*selectors: str, history: Path | None = None, subject: str | None = None, json: Path | None = None) -> int:
    """Show the error and time of each case in the last run and in the ten runs before, and the cases that became worse.

    `rayproof run --history FILE` stores the runs.

    Parameters
    ----------
    selectors
        Families, family/case names or patterns. Default: every case in the history.
    history
        The history file. Default: $RAYPROOF_HISTORY, or rayproof-history.sqlite in the current folder.
    subject
        The renderer whose history is shown: tracer, or the value of --subject. Default: the file's renderer, if it has
        only one.
    json
        Also write every point of every case to this file.

    """
    from fnmatch import fnmatchcase

    from msgspec.structs import asdict

    from rayproof.reports.history.database import errors, opened, read_series, storable, timed, worse

    path = history or Path(os.environ.get(VARIABLE, USUAL))
    with told_in_one_line(), opened(path) as connection:
        subjects = [str(row[0]) for row in connection.execute("SELECT DISTINCT subject FROM runs ORDER BY subject")]
        if subject is None and len(subjects) > 1:
            raise UsageError(f"{path} has runs of {', '.join(subjects)}: choose one with --subject")
        (shown,) = storable(subject or next(iter(subjects), "any subject"))
        if shown not in subjects:
            raise UsageError(f"{path} has no run of {shown}{', only of ' if subjects else ''}{', '.join(subjects)}")
        query = "SELECT id, started, revision, verdict, seconds FROM runs WHERE subject = ? ORDER BY id"
        runs = [dict(zip(RUN, row, strict=True)) for row in connection.execute(query, (shown,))]
        series = read_series(connection, shown)
    chosen = {
        name: points
        for name, points in series.items()
        if not selectors or any(fnmatchcase(name, s) or name.split("/")[0] == s for s in selectors)
    }
    if not chosen:
        raise UsageError(f"{path} has no case{' called ' if selectors else ''}{' or '.join(selectors)}")
    records = worse(chosen, runs[-1]["run"])
    cases = [{"name": name, "points": [asdict(point) for point in points]} for name, points in chosen.items()]
    write_json(json, {"runs": runs, "cases": cases, "worse": records})
    rows = []
    for name, (*before, now) in sorted(chosen.items(), key=lambda case: -(case[1][-1].ratio or 0.0)):
        seconds = [point.seconds for point in timed(before, now.machine)]
        figures = (spanned(errors([now])), spanned(errors(before)), spanned([now.seconds]), spanned(seconds))
        rows.append([name, str(1 + len(before)), now.verdict.value, *figures])
    show_table(
        f"{len(chosen)} cases over {len(runs)} runs of {shown}",
        ["case", "runs", "verdict", "error / limit", "ten runs before", "time [s]", "ten runs before"],
        rows,
    )
    for record in records:
        say(f"worse than its history: {record['sentence']}")
    return 0


def spanned(values: Sequence[float]) -> str:
    """Return the range of values as text, such as "0.1 to 0.3", a single number if all are equal, "-" without any."""
    if not values:
        return "-"
    low, high = f"{min(values):.3g}", f"{max(values):.3g}"
    return low if low == high else f"{low} to {high}"
