"""A run's memory: what was found of the same answers is said again, of any others it is not."""

import json
from pathlib import Path
from typing import Any

import pytest

from rayproof.reference.analytic import Analytic
from rayproof.reports.judge.renderers import Witness
from rayproof.reports.processes.pool import Pool
from rayproof.reports.run import verdict_memory
from rayproof.reports.run.case_run import flawless
from rayproof.reports.run.tasks import kinds
from tests.reports.commands.conftest import Rayproof, rayproof

__all__ = ["rayproof"]
CASE = "inside/sphere"
OURS = "tracer-float32"


@pytest.fixture
def submitted(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Return the kinds of all tasks that a run gives to its workers."""
    kinds: list[str] = []
    submit = Pool.submit

    def counted(self: Pool, kind: str, *rest: Any, **more: Any) -> None:
        kinds.append(kind)
        submit(self, kind, *rest, **more)

    monkeypatch.setattr(Pool, "submit", counted)
    return kinds


def ran(rayproof: Rayproof, folder: Path, *options: object) -> dict[str, Any]:
    """Run the case and return its record."""
    arguments = ["run", CASE, "--out", folder, "--configuration", "float32", *options]
    assert rayproof(*arguments).code == 0
    (record,) = json.loads((folder / "results.json").read_text())["cases"]
    return record


def told(record: dict[str, Any]) -> dict[str, Any]:
    """Return a record without what each run says of itself: times, and where a render came from."""
    ours = {key: value for key, value in record.items() if "seconds" not in key and key != "remembered"}
    ours["renders"] = [
        {key: value for key, value in render.items() if key not in ("seconds", "cached")}
        for render in record["renders"]
    ]
    return ours


@pytest.mark.process
def test_the_same_answers_are_judged_once_and_rendered_every_time(
    rayproof: Rayproof, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, submitted: list[str]
) -> None:
    monkeypatch.setenv("RAYPROOF_CACHE", str(tmp_path / "cache"))
    first = ran(rayproof, tmp_path / "first")
    before = list(submitted)
    submitted.clear()

    second = ran(rayproof, tmp_path / "second")

    assert "judge" in before
    assert submitted == ["tracer"], "no reference and no judge was needed"
    assert told(second) == told(first)
    assert (first["remembered"], second["remembered"]) == (False, True)
    assert (first["judge_seconds"] > 0, second["judge_seconds"]) == (True, 0)
    assert {r["renderer"]: r["cached"] for r in second["renders"]} == {
        r["renderer"]: r["renderer"] != OURS for r in first["renders"]
    }
    for name in (first["scene"], first["pixels"]):
        assert (tmp_path / "second" / name).read_bytes() == (tmp_path / "first" / name).read_bytes()
    assert (tmp_path / "second" / "index.html").is_file()


@pytest.mark.process
def test_other_answers_and_runs_without_memory_are_judged_anew(
    rayproof: Rayproof, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, submitted: list[str]
) -> None:
    monkeypatch.setenv("RAYPROOF_CACHE", str(tmp_path / "cache"))
    ran(rayproof, tmp_path / "first")

    for name, options in {
        "formula": ("--formula", "sphere/textbook"),
        "without": ("--no-cache",),
    }.items():
        submitted.clear()
        ran(rayproof, tmp_path / name, *options)
        assert "judge" in submitted, name
    assert not any(kind == kinds.RECALLING for kind in submitted), "without a cache it is not asked"


def test_a_case_whose_references_or_judge_failed_is_not_kept() -> None:
    abstained = Witness(
        name="embree", precision="float32", independent=True, shadow_epsilon=0.0, answers={}, error="it was killed"
    )

    assert flawless({"verdict": "fail"}, ())
    assert not flawless({"verdict": "error"}, ())
    assert not flawless({"verdict": "pass"}, (abstained,))


def test_a_reference_that_cannot_tell_its_version_ends_no_run_and_is_never_taken_for_the_same(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def broken(self: Analytic) -> str:
        raise RuntimeError("it names no version")

    monkeypatch.setattr(Analytic, "version", broken)

    assert verdict_memory.version("analytic") != verdict_memory.version("analytic")
