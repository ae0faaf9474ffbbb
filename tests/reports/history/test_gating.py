"""The gate: only what fails as written down passes it, and what is written down and not so is red."""

from dataclasses import replace
from datetime import date
from typing import Any

import pytest

from rayproof.reports.history.expectations import Expectation, load_expectations, save_expectations
from rayproof.reports.history.gating import Gate, accepted, gate, pruned

ENTRY = Expectation(
    case="shadows/one",
    configuration="float32",
    reference="analytic",
    stage="distance",
    verdict="fail",
    reason="The plane is looked at from far away.",
    ratio=(2.0, 4.0),
    wrong=(5, 20),
    item="HIT-4",
)
TODAY = date(2026, 11, 22)


def check(**more: Any) -> dict[str, Any]:
    """Return a failing check, as a record has it."""
    known = {"configuration": "float32", "reference": "analytic", "stage": "distance", "verdict": "fail"}
    measured = {"ratio": 3.0, "examined": {"wrong": 10}, "end_to_end": {"ours": [1.0]}, "reason": "off"}
    return {**known, **measured, **more}


def run(*checks: dict[str, Any], name: str = "shadows/one", verdict: str = "fail", **more: Any) -> dict[str, Any]:
    """Return a run of one case, as a record has it."""
    case = {"name": name, "verdict": verdict, "item": "HIT-4", "reason": "off", "checks": list(checks)}
    good = {"name": "shadows/two", "verdict": "pass", "item": None, "reason": "", "checks": [check(verdict="pass")]}
    return {"cases": [case, good], "finished": True, "environment": {"backend": "llvm"}, "subject": "tracer", **more}


def held(results: dict[str, Any], *entries: Expectation) -> Gate:
    """Hold a run against entries."""
    return gate(results, entries or (ENTRY,), file="known.json", today=TODAY)


def test_what_fails_as_written_down_passes_and_is_named():
    found = held(run(check()))

    assert not found.red
    assert found.matched == ["shadows/one float32 analytic distance: The plane is looked at from far away."]
    assert found.cases == ["shadows/one"]


@pytest.mark.parametrize(
    "results",
    [
        run(check(ratio=4.1)),
        run(check(examined={"wrong": 21})),
        run(check(verdict="reference_suspect")),
        run(check(verdict="error")),
        run(check(verdict="missing")),
        run(check(verdict="missing"), verdict="missing"),
        run(check(ratio=float("nan"))),
        run(check(end_to_end={"ours": ["nan"]})),
        run(check(continued={"ours": ["-inf"]})),
        run(check(), check(stage="normal")),
        run(check(), wrong_factors=["radiance is 2e-5 too large"]),
        run(check(), finished=False),
        {**run(check()), "cases": [run(check())["cases"][0] | {"item": "HIT-5"}]},
        {**run(check()), "cases": [run(check())["cases"][0] | {"blamed_items": ["HIT-5", "HIT-6"]}]},
        {**run(check()), "cases": [run(check())["cases"][0] | {"expectations": [{"verdict": "fail"}]}]},
        run(check(), name="shadows/three"),
        {**run(check()), "cases": [*run(check())["cases"], {"name": "x/y", "verdict": "error", "checks": []}]},
    ],
    ids=[
        "a larger error", "more pixels", "another verdict", "a crash", "no answer", "nothing but no answer",
        "a ratio of NaN", "a pixel of NaN", "an infinite pixel given its own previous stages",
        "another stage", "a factor of the run", "cut short", "another item", "other items", "a closed form",
        "another case", "a case without checks",
    ],
)  # fmt: skip
def test_whatever_else_fails_is_a_regression(results: dict[str, Any]):
    found = held(results)

    assert found.red
    assert len(found.regressions) == 1


@pytest.mark.parametrize(
    "results",
    [run(check(ratio=1.9)), run(check(examined={"wrong": 4})), run(check(verdict="pass"), verdict="pass")],
    ids=["a smaller error", "fewer pixels", "it passes"],
)
def test_what_fails_less_is_red_as_well(results: dict[str, Any]):
    found = held(results)

    assert (found.red, len(found.tighten), found.regressions) == (True, 1, [])


def test_entries_that_meet_nothing_are_stale_but_only_of_planned_cases():
    gone, unplanned = replace(ENTRY, reference="embree"), replace(ENTRY, case="other/*")

    found = held(run(check()), ENTRY, gone, unplanned)

    assert found.stale == ["shadows/one float32 embree distance: no check of the run is called so"]


def test_an_entry_holds_on_its_last_day_and_not_after_it():
    assert not held(run(check()), replace(ENTRY, expires="2026-11-22")).red
    late = held(run(check()), replace(ENTRY, expires="2026-11-21"))

    assert (len(late.expired), len(late.regressions)) == (1, 1)


def test_conditions_and_patterns_decide_whom_an_entry_is_about():
    assert not held(run(check()), replace(ENTRY, case="shadows/*", when={"backend": "llvm", "subject": "trac*"})).red
    assert held(run(check()), replace(ENTRY, when={"backend": "cuda"})).regressions


def test_what_is_accepted_passes_and_what_passes_is_pruned(tmp_path):
    results = run(check(), check(stage="object", ratio=float("inf"), examined={"wrong": 3}))
    entries, new = accepted(results, (), reason="known", expires=None, issue="#7", when={})
    save_expectations(tmp_path / "known.json", entries, "rayproof 0")
    read = load_expectations(tmp_path / "known.json")

    assert (new, read) == (2, entries)
    assert not held(results, *read).red
    better = run(check(ratio=1.5, examined={"wrong": 2}), check(stage="object", verdict="pass"))
    assert len(held(better, *read).tighten) == 2
    kept, done = pruned(better, read)
    assert len(done) == 2
    assert not held(better, *kept).red
    assert held(results, *kept).regressions


def test_an_entrys_item_may_be_one_of_several_that_are_blamed():
    several = run(check())["cases"][0] | {"item": None, "blamed_items": ["HIT-4", "HIT-5"]}

    assert not held({**run(check()), "cases": [several]}).red


def test_pruning_makes_no_entry_wider():
    worse = run(check(ratio=8.0, examined={"wrong": 40}))

    (kept,), _ = pruned(worse, (ENTRY,))

    assert (kept.ratio[1], kept.wrong[1]) == (ENTRY.ratio[1], ENTRY.wrong[1])
    assert held(worse, kept).regressions


@pytest.mark.parametrize(
    ("text", "named"),
    [
        ("{", "no JSON"),
        ('{"schema": 2, "expected": []}', "schema 1"),
        ('{"schema": 1, "expected": [{"case": "a"}]}', "entry 0: configuration must be a text"),
        ('{"schema": 1, "expected": [{"cases": "a"}]}', "unknown key 'cases'"),
        ('{"schema": 1, "expected": [7]}', "entry 0: must be an object"),
    ],
)
def test_a_bad_file_is_told_with_the_entry(tmp_path, text, named):
    (tmp_path / "known.json").write_text(text)

    with pytest.raises(ValueError, match=named):
        load_expectations(tmp_path / "known.json")
