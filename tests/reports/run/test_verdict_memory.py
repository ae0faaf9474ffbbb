"""A run's memory: what was found of the same answers is said again, of any others it is not."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import pytest

from rayproof.reports.cli import main
from rayproof.reports.judge.answers import Answers
from rayproof.reports.processes.pool import Future, Pool
from rayproof.reports.processes.worker import Reply
from rayproof.reports.run import worker_tasks
from rayproof.reports.run.case_pipeline import flawless

CASE = "inside/sphere"
OURS = "tracer-float32"


class Kinds(list[str]):
    """The kinds of all tasks that runs give to their workers while a patch is in force."""

    def __init__(self, patch: pytest.MonkeyPatch) -> None:
        super().__init__()
        submit = Pool.submit

        def counted(pool: Pool, kind: str, *rest: Any, **more: Any) -> Future[Reply]:
            self.append(kind)
            return submit(pool, kind, *rest, **more)

        patch.setattr(Pool, "submit", counted)


def ran(folder: Path, *options: object) -> dict[str, Any]:
    """Run the case and return its record."""
    assert main(["run", CASE, "--out", str(folder), "--configuration", "float32", *map(str, options)]) == 0
    (record,) = json.loads((folder / "results.json").read_text())["cases"]
    return record


def told(record: dict[str, Any]) -> dict[str, Any]:
    """Return a record without what each run says of itself: times, and where a render came from."""
    ours = {key: value for key, value in record.items() if "seconds" not in key and key != "remembered"}
    ours["renders"] = [
        {key: value for key, value in render.items() if key not in ("seconds", "cached", "kernels", "launches")}
        for render in record["renders"]
    ]
    return ours


class First(NamedTuple):
    """The first run with a cache: its folder, its record and the kinds of its tasks."""

    folder: Path
    record: dict[str, Any]
    kinds: list[str]


@pytest.fixture(scope="module")
def first(tmp_path_factory: pytest.TempPathFactory) -> Iterator[First]:
    """Run the case with a cache of its own, which stays in force for the runs that come after."""
    folder = tmp_path_factory.mktemp("memory")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("RAYPROOF_CACHE", str(folder / "cache"))
        with pytest.MonkeyPatch.context() as counting:
            kinds = Kinds(counting)
            record = ran(folder / "first")
        yield First(folder / "first", record, kinds)


@pytest.mark.process
def test_the_same_answers_are_judged_once_and_rendered_every_time(
    first: First, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    submitted = Kinds(monkeypatch)

    second = ran(tmp_path / "second")

    assert "judge" in first.kinds
    assert submitted == ["tracer"] * 2, "the one case is rendered twice, and no reference and no judge was needed"
    assert told(second) == told(first.record)
    assert (first.record["remembered"], second["remembered"]) == (False, True)
    assert (first.record["judge_seconds"] > 0, second["judge_seconds"]) == (True, 0)
    assert {r["renderer"]: r.get("cached", False) for r in second["renders"]} == {
        r["renderer"]: r["renderer"] != OURS for r in first.record["renders"]
    }
    for name in (second["scene"], second["pixels"]):
        assert (tmp_path / "second" / name).read_bytes() == (first.folder / name).read_bytes()
    assert (tmp_path / "second" / "index.html").is_file()


@pytest.mark.process
@pytest.mark.parametrize(
    "options", [pytest.param(("--formula", "sphere/textbook"), id="formula"), pytest.param(("--no-cache",), id="cache")]
)
@pytest.mark.usefixtures("first")
def test_other_answers_and_runs_without_memory_are_judged_anew(
    options: tuple[str, ...], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    submitted = Kinds(monkeypatch)

    ran(tmp_path / "other", *options)

    assert "judge" in submitted
    assert (worker_tasks.CACHE in submitted) == ("--no-cache" not in options), "without a cache it is not asked"


def test_a_case_whose_references_or_judge_failed_is_not_kept() -> None:
    abstained = Answers(name="radiance", precision="float32", independent=True, error="it was killed")

    assert flawless({"verdict": "fail"}, ())
    assert not flawless({"verdict": "error"}, ())
    assert not flawless({"verdict": "pass"}, (abstained,))
