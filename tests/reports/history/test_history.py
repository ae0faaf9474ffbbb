"""The results database: runs go in whole, series come out, and a worse run says so."""

import json
import sqlite3
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest
from msgspec.structs import replace

from rayproof.reports.cli import main
from rayproof.reports.history.database import HistoryError, append, opened, read_series, worse
from tests.reports.checks import recorded


def results(ratio: float | str = 0.2, seconds: float = 0.1, verdict: str = "pass") -> dict[str, Any]:
    """Return a run of one case as results.json has it."""
    measurement = {"worst_error": 1e-7, "worst_ratio": ratio}
    check = recorded(
        configuration="float32", reference="analytic", stage="normal", verdict=verdict, ratio=ratio,
        end_to_end=measurement,
    )  # fmt: skip
    renders = [
        {"renderer": "tracer-float32", "configuration": "float32", "seconds": seconds},
        {"renderer": "analytic", "configuration": None, "seconds": 9.0},
        {"renderer": "radiance", "configuration": None, "seconds": 9.0},  # which no check is against
    ]
    case = {"name": "shadows/one", "verdict": verdict, "seconds": 10.0, "renders": renders, "checks": [check]}
    return {
        "started": "2026-01-01T00:00:00+00:00", "command": "rayproof run", "verdict": verdict, "finished": True,
        "seconds": 12.0, "environment": {"python": "3.11"}, "cases": [case],
    }  # fmt: skip


def kept(path: Path, runs: list[dict[str, Any]]):
    for number, run in enumerate(runs):
        append(path, run, f"commit{number}")
    with opened(path) as connection:
        return read_series(connection, "tracer")


def test_a_run_comes_back_as_it_went_in(tmp_path: Path) -> None:
    (series,) = kept(tmp_path / "h.sqlite", [results(0.25, 0.5)])

    (point,) = series.points
    assert (series.name, point.ratio, point.stage, point.place) == ("shadows/one", 0.25, "normal", "float32 analytic")
    assert (point.seconds, point.revision, point.verdict) == (0.5, "commit0", "pass")


def test_of_a_stages_checks_the_worst_is_kept_with_its_place(tmp_path: Path) -> None:
    run = results(0.2)
    (check,) = run["cases"][0]["checks"]
    run["cases"][0]["checks"] += [replace(check, ratio=0.7, reference="radiance"), replace(check, ratio=0.1)]

    (series,) = kept(tmp_path / "h.sqlite", [run])

    assert [(point.ratio, point.place) for point in series.points] == [(0.7, "float32 radiance")]


def test_each_subject_has_a_history_of_its_own(tmp_path: Path) -> None:
    path = tmp_path / "h.sqlite"
    append(path, {**results(0.9), "subject": "radiance"}, "")

    (series,) = kept(path, [results(0.2)])

    assert [point.ratio for point in series.points] == [0.2]


def test_a_step_stands_at_its_run_where_others_measured_nothing(tmp_path: Path) -> None:
    empty = results()
    empty["cases"][0]["checks"] = []

    (series,) = kept(tmp_path / "h.sqlite", [empty, results(0.2), empty, results(0.5)])

    assert [series.points[step.at].run for step in series.error_steps] == [4]


def test_infinite_errors_are_kept(tmp_path: Path) -> None:
    (series,) = kept(tmp_path / "h.sqlite", [results("inf"), results("nan")])

    assert [point.ratio for point in series.points] == [float("inf")] * 2


def test_a_case_without_measurement_has_no_ratio(tmp_path: Path) -> None:
    empty = results()
    empty["cases"][0]["checks"] = []

    (series,) = kept(tmp_path / "h.sqlite", [results(), empty])

    assert series.points[-1].ratio is None
    assert worse([series], 2) == []


@pytest.mark.parametrize(
    ("runs", "what"),
    [
        ([results(0.2), results(0.2)], []),
        ([results(0.2), results(0.1)], []),
        ([results(0.2), results(0.3)], ["error"]),
        ([results(0.001), results(0.003)], []),  # nothing, and three times nothing
        ([results(0.2), results(1.3, verdict="fail")], ["verdict", "error"]),
        ([results(1.3, verdict="fail"), results(0.2)], []),
        ([results(1.3, verdict="fail"), results(0.2), results(1.3, verdict="fail")], ["verdict", "error"]),
        ([results(seconds=s) for s in (0.1, 0.1, 0.101, 0.099, 0.1, 0.2)], ["time"]),
        ([results(seconds=s) for s in (0.1, 0.1, 0.101, 0.099, 0.1, 0.11)], []),
        # Since the step to a tenth of a second that is the level.
        ([results(seconds=s) for s in (0.3, 0.301, 0.299, 0.3, 0.301, 0.3, 0.1, 0.1, 0.101, 0.1, 0.15)], ["time"]),
        ([results(seconds=s) for s in (0.1, 0.2)], []),  # too few to know the noise
        ([results(seconds=s) for s in (0.1, 0.3, 0.06, 0.2, 0.1, 0.25)], []),  # noise, and known
    ],
)
def test_a_worse_run_says_so(runs: list[dict[str, Any]], what: list[str], tmp_path: Path) -> None:
    series = kept(tmp_path / "h.sqlite", runs)

    found = worse(series, len(runs))

    assert [entry["what"] for entry in found] == what
    assert all(entry["sentence"].startswith("shadows/one: ") for entry in found)


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


def test_a_name_that_is_no_text_is_kept_as_reports_write_it(tmp_path: Path) -> None:
    odd = results()
    odd["command"] = odd["subject"] = odd["cases"][0]["name"] = "file/caf\udce9"

    for _ in range(2):
        append(tmp_path / "h.sqlite", odd, "")
    with opened(tmp_path / "h.sqlite") as connection:
        (series,) = read_series(connection, odd["subject"])

    assert (series.name, len(series.points)) == ("file/caf?", 2)


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
    assert tables() == 3


def test_a_run_that_cannot_be_kept_whole_is_not_kept(tmp_path: Path) -> None:
    path = tmp_path / "h.sqlite"
    broken = results()
    broken["cases"] *= 2  # the same case twice

    with pytest.raises(HistoryError):
        append(path, broken, "")

    append(path, results(), "")
    with opened(path) as connection:
        assert connection.execute("SELECT count(*) FROM runs").fetchone() == (1,)


def test_the_command_shows_and_writes_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path, file = tmp_path / "h.sqlite", tmp_path / "h.json"
    kept(path, [results(0.2), results(0.2), results(0.5)])

    assert main(["report", "history", "shadows", "--history", str(path), "--json", str(file)]) == 0

    told = capsys.readouterr().out
    assert "worse than its history: shadows/one: worst error / limit 0.5" in " ".join(told.split())
    document = json.loads(file.read_text())
    assert [point["ratio"] for point in document["cases"][0]["points"]] == [0.2, 0.2, 0.5]
    assert [step["run"] for step in document["cases"][0]["error_steps"]] == [3]
    assert document["worse"][0]["what"] == "error"


@pytest.mark.parametrize("arguments", [["--history", "nowhere.sqlite"], ["none/such"], ["--subject", "stranger"]])
def test_what_is_not_there_is_one_line_and_2(
    arguments: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("RAYPROOF_HISTORY", str(tmp_path / "h.sqlite"))
    append(tmp_path / "h.sqlite", results(), "")

    assert main(["report", "history", *arguments]) == 2

    assert capsys.readouterr().err.count("\n") == 1
