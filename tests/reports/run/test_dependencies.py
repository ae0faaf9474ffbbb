"""A run with --changed does what changed, all of it, and nothing else."""

import json
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from rayproof.cases.families import select
from rayproof.reports.cache import digests
from rayproof.reports.cache.closure import ROOT
from rayproof.reports.processes.pool import Pool
from rayproof.reports.results.document import save_results
from rayproof.reports.run import dependencies
from rayproof.reports.run.demands import Demands
from rayproof.reports.run.dependencies import Dependencies, Earlier
from rayproof.reports.run.kept_images import EVERY_CASE
from rayproof.reports.run.plan import PlannedCase, plan
from rayproof.reports.subjects import PROGRAM, THE_TRACER, Subject
from tests.reports.commands.conftest import Rayproof, rayproof
from tests.reports.publish.sample import results_of

__all__ = ["rayproof"]  # a fixture

CASES = ("primitives/sphere", "primitives/triangle")
DEMANDS = Demands(subject="tracer", identity=(), references=(), require=(), images=EVERY_CASE, certified=False, own=())
HAINES, WOOP = "tracer/intersections/sphere_haines.py", "tracer/intersections/triangle_woop_kahan.py"
SCRIPT = Path(__file__).resolve().parents[3] / ".ci" / "changed_is_sound"


@pytest.fixture
def edit(monkeypatch: pytest.MonkeyPatch) -> Iterator[Any]:
    """Return what lets a file's content seem to be another."""
    right, edited = digests.content_digest, set()

    def content(file: Path) -> str:
        return "0" * 64 if file in edited else right(file)

    def forget() -> None:
        for each in (digests._content, digests.code):
            each.cache_clear()

    def changed(name: str) -> None:
        edited.add(ROOT / name)
        forget()

    monkeypatch.setattr(digests, "content_digest", content)
    monkeypatch.setattr(dependencies, "content_digest", content)
    yield changed
    edited.clear()
    forget()


def ran(rayproof: Rayproof, folder: Path, *options: str) -> tuple[dict[str, Any], str]:
    """Run the cases; return results.json and what was said."""
    done = rayproof("run", *CASES, "--out", folder, "--configuration", "float32", *options)
    assert done.code == 0, done.out
    return json.loads((folder / "results.json").read_text()), done.out


@pytest.mark.process
def test_only_the_cases_that_ask_for_a_changed_formula_are_rendered_again(
    rayproof: Rayproof,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    edit: Any,
) -> None:
    monkeypatch.setenv("RAYPROOF_CACHE", str(tmp_path / "cache"))
    rendered: list[str] = []
    submit = Pool.submit

    def counted(self: Pool, kind: str, task: Any, *rest: Any, **more: Any) -> None:
        rendered.extend([kind] if kind == "tracer" else [])
        submit(self, kind, task, *rest, **more)

    monkeypatch.setattr(Pool, "submit", counted)
    first, _ = ran(rayproof, tmp_path / "report")
    assert [case["rendered"] for case in first["cases"]] == [True, True]
    rendered.clear()

    same, text = ran(rayproof, tmp_path / "report", "--changed")
    assert rendered == []
    assert same["changed"] == {"taken_up": 2, "rendered": 0, "because": {}}
    assert [case["rendered"] for case in same["cases"]] == [False, False]
    assert [case["checks"] for case in same["cases"]] == [case["checks"] for case in first["cases"]]
    assert "2 cases were not rendered" in text

    edit(HAINES)
    again, text = ran(rayproof, tmp_path / "report", "--changed")
    assert rendered == ["tracer"] * 2, "the one case that is rendered twice"
    assert {case["name"]: case["rendered"] for case in again["cases"]} == dict(zip(CASES, (True, False), strict=True))
    assert again["changed"] == {"taken_up": 1, "rendered": 1, "because": {HAINES: 1}}
    assert f"1 for {HAINES}" in text


def depends(name: str, **change: Any) -> dict[str, str]:
    """Return what a case depends on."""
    (planned,) = plan(select((name,)), ("float32",))
    about = {"case": planned.case, "configurations": planned.configurations} | change
    return Dependencies(DEMANDS, THE_TRACER).of(PlannedCase(**about))


def test_each_kind_of_change_is_known(edit: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    sphere, triangle = (depends(name) for name in CASES)

    def differ(name: str, **change: Any) -> set[str]:
        now, before = depends(name, **change), {CASES[0]: sphere, CASES[1]: triangle}[name]
        return {part for part in before if now[part] != before[part]}

    assert differ(CASES[0]) == differ(CASES[1]) == set()
    assert differ(CASES[0], configurations=("float64",)) == {"demands"}
    assert differ(CASES[0], configurations=("float32/sphere=kahan",)) == {"demands", "formulas", "code"}
    (other,) = select(("primitives/cube",))
    assert differ(CASES[0], case=other) >= {"case", "code"}
    with monkeypatch.context() as elsewhere:
        elsewhere.setattr(dependencies, "machine", lambda: ("another",))
        assert differ(CASES[1]) == {"machine"}
    edit(WOOP)
    assert (differ(CASES[0]), differ(CASES[1])) == (set(), {"code"})
    # What all formulas, all cases or all verdicts share is everybody's.
    for file in ("tracer/device/arrays.py", "cases/scene.py", "reports/judge/tolerance/limits.py"):
        edit(file)
        assert differ(CASES[0]) == {"code"}, file


def test_a_program_and_what_is_not_known_are_done_again(tmp_path: Path) -> None:
    (planned,) = plan(select((CASES[0],)), ("float32",))
    program = Subject(name=PROGRAM, title="exec:true", command=("true",))

    for subject in (program, THE_TRACER):
        earlier = Earlier(tmp_path, Dependencies(DEMANDS, subject), ())
        assert earlier.unchanged(planned, lambda _: {"name": "never asked"}) is None
    assert earlier.record(planned=1) == {
        "taken_up": 0, "rendered": 1, "because": {"it was not done before, or ended in an error": 1}
    }  # fmt: skip


def test_a_case_that_ended_in_an_error_is_done_again_and_counted_so(tmp_path: Path) -> None:
    (planned,) = plan(select((CASES[0],)), ("float32",))
    needs = Dependencies(DEMANDS, THE_TRACER)
    case = {"name": CASES[0], "family": "primitives", "verdict": "error", "covers": [], "checks": [], "item": None}
    case |= {"key": "0", "depends": needs.of(planned)}
    save_results(tmp_path, results_of([case]))
    earlier = Earlier(tmp_path, needs, ())

    assert earlier.unchanged(planned, lambda _: None) is None
    assert earlier.record(planned=1) == {"taken_up": 0, "rendered": 1, "because": {dependencies.NOT_KEPT: 1}}
    assert earlier.unchanged(planned, lambda key: {**case, "key": key}) is not None
    assert earlier.record(planned=1)["taken_up"] == 1


@pytest.mark.process
def test_whatever_a_changed_formula_file_changes_is_done_again() -> None:
    cases = ("primitives/*", "simplified/*", "shadows/*", "transforms/*")
    done = subprocess.run([sys.executable, SCRIPT, "--files", "8", *cases], capture_output=True, text=True, check=False)

    assert done.returncode == 0, done.stdout + done.stderr
    assert "NOT DONE AGAIN" not in done.stdout
    assert done.stdout.splitlines()[-1].startswith("8 files: ")
