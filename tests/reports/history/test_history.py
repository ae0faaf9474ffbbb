"""The results database: runs go in whole, series come out, and a worse run says so."""

import sqlite3
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest
from msgspec.structs import replace

from rayproof.reports.history.database import LAST, HistoryError, Series, append, opened, read_series, worse
from tests.reports.checks import recorded


def results(
    ratio: float | str = 0.2, seconds: float = 0.1, verdict: str = "pass", wrong: tuple[int, ...] = (0,)
) -> dict[str, Any]:
    """Return a run of one case as results.json has it, with a check for each number of wrong pixels."""
    measurement = {"worst_error": 1e-7, "worst_ratio": ratio}
    checks = [
        recorded(
            configuration="float32", reference="analytic", stage="normal", verdict=verdict, ratio=ratio,
            end_to_end=measurement, examined={"wrong": count},
        )
        for count in wrong
    ]  # fmt: skip
    renders = [
        {"renderer": "tracer-float32", "configuration": "float32", "seconds": seconds},
        {"renderer": "analytic", "configuration": None, "seconds": 9.0},
        {"renderer": "radiance", "configuration": None, "seconds": 9.0},  # which no check is against
    ]
    case = {"name": "shadows/one", "verdict": verdict, "seconds": 10.0, "renders": renders, "checks": checks}
    return {
        "started": "2026-01-01T00:00:00+00:00", "command": "rayproof run", "verdict": verdict, "finished": True,
        "seconds": 12.0, "environment": {"python": "3.11"}, "cases": [case],
    }  # fmt: skip


def kept(path: Path, runs: list[dict[str, Any]]) -> Series:
    for number, run in enumerate(runs):
        append(path, run, f"commit{number}")
    with opened(path) as connection:
        return read_series(connection, "tracer")


def test_a_run_comes_back_as_it_went_in(tmp_path: Path) -> None:
    ((name, (point,)),) = kept(tmp_path / "h.sqlite", [results(0.25, 0.5, wrong=(3, 8, 5))]).items()

    assert (name, point.ratio, point.stage, point.place) == ("shadows/one", 0.25, "normal", "float32 analytic")
    assert (point.seconds, point.revision, point.verdict, point.wrong) == (0.5, "commit0", "pass", 8)


def test_of_a_stages_checks_the_worst_is_kept_with_its_place(tmp_path: Path) -> None:
    run = results(0.2)
    (check,) = run["cases"][0]["checks"]
    run["cases"][0]["checks"] += [replace(check, ratio=0.7, reference="radiance"), replace(check, ratio=0.1)]

    (points,) = kept(tmp_path / "h.sqlite", [run]).values()

    assert [(point.ratio, point.place) for point in points] == [(0.7, "float32 radiance")]


def test_the_error_of_a_check_is_the_one_that_decides_it(tmp_path: Path) -> None:
    run = results(0.2)
    (check,) = run["cases"][0]["checks"]
    small, large = ({"worst_error": 1e-7, "worst_ratio": ratio} for ratio in (0.2, 0.7))
    run["cases"][0]["checks"] = [
        recorded(
            configuration="float32", reference="analytic", stage="normal", verdict="pass", ratio=0.7,
            end_to_end=small, continued=large, examined={"wrong": 0},
        ),
        replace(check, ratio=0.5),
    ]  # fmt: skip

    (points,) = kept(tmp_path / "h.sqlite", [run]).values()

    assert [point.ratio for point in points] == [0.7]


def test_each_subject_has_a_history_of_its_own(tmp_path: Path) -> None:
    path = tmp_path / "h.sqlite"
    append(path, {**results(0.9), "subject": "radiance"}, "")

    (points,) = kept(path, [results(0.2)]).values()

    assert [point.ratio for point in points] == [0.2]


def test_runs_that_measured_nothing_are_left_out_of_the_comparison(tmp_path: Path) -> None:
    empty = results()
    empty["cases"][0]["checks"] = []

    series = kept(tmp_path / "h.sqlite", [empty, results(0.2), *[empty] * LAST, results(0.5)])

    assert [record["what"] for record in worse(series, LAST + 3)] == ["error"]


def test_infinite_errors_are_kept_and_are_no_worse_than_each_other(tmp_path: Path) -> None:
    series = kept(tmp_path / "h.sqlite", [results("inf"), results("nan")])

    assert [point.ratio for point in series["shadows/one"]] == [float("inf")] * 2
    assert worse(series, 2) == []


def test_a_case_without_measurement_has_no_ratio(tmp_path: Path) -> None:
    empty = results()
    empty["cases"][0]["checks"] = []

    series = kept(tmp_path / "h.sqlite", [results(), empty])

    assert series["shadows/one"][-1].ratio is None
    assert worse(series, 2) == []


@pytest.mark.parametrize(
    ("runs", "what"),
    [
        ([results(0.2), results(0.2)], []),
        ([results(0.2), results(0.1)], []),
        ([results(0.2), results(0.3)], ["error"]),
        ([results(0.001), results(0.003)], []),  # nothing, and three times nothing
        ([results(0.2), results(1.3, verdict="fail")], ["verdict", "error"]),
        ([results(1.3, verdict="fail"), results(0.2)], []),
        # An error that a run of the last ten had is inside their spread; the verdict is compared with the run before.
        ([results(1.3, verdict="fail"), results(0.2), results(1.3, verdict="fail")], ["verdict"]),
        ([results(ratio) for ratio in (0.2, 0.3, 0.25, 0.32)], []),
        ([results(ratio) for ratio in (0.2, 0.3, 0.25, 0.34)], ["error"]),
        ([results(ratio) for ratio in (0.3, *[0.2] * LAST, 0.3)], ["error"]),
        ([results(wrong=(pixels,)) for pixels in (400, 300, 440)], []),
        ([results(wrong=(pixels,)) for pixels in (400, 300, 441)], ["pixels"]),
        ([results(wrong=(0,)), results(wrong=(400,))], []),  # which the verdict says
        ([results(seconds=s) for s in (0.1, 0.1, 0.101, 0.099, 0.1, 0.2)], ["time"]),
        ([results(seconds=s) for s in (0.1, 0.1, 0.101, 0.099, 0.1, 0.11)], []),
        ([results(seconds=s) for s in (0.3, 0.301, 0.299, 0.3, *[0.1] * LAST, 0.15)], ["time"]),  # the last ten count
        ([results(seconds=s) for s in (0.1, 0.2)], []),  # too few to know the noise
        ([results(seconds=s) for s in (0.1, 0.3, 0.06, 0.2, 0.1, 0.25)], []),  # noise, and known
    ],
)
def test_a_worse_run_says_so(runs: list[dict[str, Any]], what: list[str], tmp_path: Path) -> None:
    series = kept(tmp_path / "h.sqlite", runs)

    found = worse(series, len(runs))

    assert [entry["what"] for entry in found] == what
    assert all(entry["sentence"].startswith("shadows/one: ") for entry in found)


def test_a_slow_time_is_not_in_its_own_baseline(tmp_path: Path) -> None:
    usual = [results(seconds=seconds) for seconds in (0.1, 0.102, 0.099, 0.101, 0.1)]
    path = tmp_path / "h.sqlite"

    (once,) = worse(kept(path, [*usual, results(seconds=0.3)]), 6)
    (again,) = worse(kept(path, [results(seconds=0.3)]), 7)

    assert (once["what"], once["factor"]) == ("time", pytest.approx(3))
    assert once["sentence"] == "shadows/one: 0.3 s, median of 5 runs before 0.1 s"
    # One slow run among six moves neither their median nor their spread.
    assert (again["what"], again["factor"]) == ("time", pytest.approx(3, rel=0.02))


def test_a_time_that_lasts_becomes_the_usual_one(tmp_path: Path) -> None:
    series = kept(tmp_path / "h.sqlite", [results(seconds=s) for s in (*[0.1] * LAST, *[0.3] * 6, 0.3)])

    assert worse(series, LAST + 7) == []


def test_an_error_after_none_at_all_is_infinitely_worse(tmp_path: Path) -> None:
    (record,) = worse(kept(tmp_path / "h.sqlite", [results(0.0), results(0.5)]), 2)

    assert (record["what"], record["factor"]) == ("error", float("inf"))


def test_the_check_with_most_wrong_pixels_counts(tmp_path: Path) -> None:
    series = kept(tmp_path / "h.sqlite", [results(wrong=(7, 400)), results(wrong=(90, 20)), results(wrong=(5, 450))])

    assert [point.wrong for point in series["shadows/one"]] == [400, 90, 450]
    (record,) = worse(series, 3)
    assert record["sentence"] == "shadows/one: 450 wrong pixels, at most 400 in the runs before"
    assert record["factor"] == pytest.approx(450 / 400)


def test_what_became_worse_by_most_comes_first(tmp_path: Path) -> None:
    runs = [results(0.2, wrong=(100,)), results(0.3, wrong=(500,))]

    assert [record["what"] for record in worse(kept(tmp_path / "h.sqlite", runs), 2)] == ["pixels", "error"]


def test_times_of_another_machine_do_not_count(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "h.sqlite"
    monkeypatch.setattr("rayproof.reports.history.database.this_machine", lambda: "a fast one")
    kept(path, [results(seconds=0.1)] * 6)
    monkeypatch.setattr("rayproof.reports.history.database.this_machine", lambda: "a slow one")

    series = kept(path, [results(seconds=0.9)])

    assert worse(series, 7) == []


def test_what_is_no_history_is_refused_and_left_alone(tmp_path: Path) -> None:
    text, foreign, newer = tmp_path / "text", tmp_path / "foreign.sqlite", tmp_path / "newer.sqlite"
    text.write_text("not a database, but a text that is long enough to look like one" * 20)
    with sqlite3.connect(foreign) as connection:
        connection.execute("CREATE TABLE theirs (x)")
    append(newer, results(), "")
    with sqlite3.connect(newer) as connection:
        connection.execute("PRAGMA user_version = 99")
    before = [file.read_bytes() for file in (text, foreign, newer)]

    for file in (text, foreign, newer):
        with pytest.raises(HistoryError, match=file.name):
            append(file, results(), "")

    assert [file.read_bytes() for file in (text, foreign, newer)] == before


def test_a_history_is_made_whole_or_not_at_all(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """As another run sees it that begins at the same moment, and the next one after a run that was killed."""
    path = tmp_path / "h.sqlite"
    seen: set[int] = set()
    connect = sqlite3.connect

    def tables() -> int:
        with closing(connect(path)) as other:
            return int(other.execute("SELECT count(*) FROM sqlite_master WHERE type = 'table'").fetchone()[0])

    class Watched(sqlite3.Connection):
        def execute(self, statement: str, *values: Any) -> sqlite3.Cursor:
            seen.add(tables())
            return super().execute(statement, *values)

    monkeypatch.setattr(
        "rayproof.reports.history.database.sqlite3.connect",
        lambda *given, **named: connect(*given, factory=Watched, **named),
    )

    with opened(path, create=True):
        pass

    assert seen == {0}
    assert tables() == 2


def test_a_run_that_cannot_be_kept_whole_is_not_kept(tmp_path: Path) -> None:
    path = tmp_path / "h.sqlite"
    broken = results()
    broken["cases"] *= 2  # the same case twice

    with pytest.raises(HistoryError):
        append(path, broken, "")

    append(path, results(), "")
    with opened(path) as connection:
        assert connection.execute("SELECT count(*) FROM runs").fetchone() == (1,)
