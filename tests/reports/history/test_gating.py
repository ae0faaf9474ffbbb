"""The gate: only what fails as written down passes it, and what is written down and not so is red."""

from datetime import date
from typing import Any

import numpy as np
import pytest
from msgspec.structs import replace

from rayproof.reports.history.expectations import Expectation, KnownCheck, KnownFailures, load_known, save_known
from rayproof.reports.history.gating import Acceptance, GateResult, accepted, figures, gate, pruned
from rayproof.reports.judge.measurement import cells_of
from rayproof.reports.results.case_records import Check
from tests.reports.checks import recorded

NAME = "float32 analytic distance"
CHECK = KnownCheck(verdict="fail", ratio=(2.0, 4.0), wrong=(5, 20), cells="00000000000000ff")
ENTRY = Expectation(
    case="shadows/one", reason="The plane is looked at from far away.", item="HIT-4", checks={NAME: CHECK}
)
TODAY = date(2026, 11, 22)


def check(**more: Any) -> Check:
    """Return a failing check, as a record has it."""
    known = {"configuration": "float32", "reference": "analytic", "stage": "distance", "verdict": "fail"}
    measured = {"ratio": 3.0, "examined": {"wrong": 10}, "end_to_end": {"ours": [1.0]}, "reason": "off"}
    return recorded(**{**known, **measured, **more})


def run(*checks: Check, name: str = "shadows/one", verdict: str = "fail", **more: Any) -> dict[str, Any]:
    """Return a run of one case, as a record has it."""
    case = {"name": name, "verdict": verdict, "item": "HIT-4", "reason": "off", "checks": list(checks)}
    good = {"name": "shadows/two", "verdict": "pass", "item": None, "reason": "", "checks": [check(verdict="pass")]}
    return {"cases": [case, good], "finished": True, "environment": {"backend": "llvm"}, "subject": "tracer", **more}


def held(results: dict[str, Any], *entries: Expectation) -> GateResult:
    """Hold a run against entries."""
    return gate(results, KnownFailures(expected=entries or (ENTRY,)), file="known.json", today=TODAY)


def as_of(**more: Any) -> Expectation:
    """Return the entry with something else about its check."""
    return replace(ENTRY, checks={NAME: replace(CHECK, **more)})


def test_the_mean_error_is_the_first_that_there_is_end_to_end_or_continued():
    def mean(**means: float) -> float:
        return figures(check(**{name: {"ours": [1.0], "mean_wrong": value} for name, value in means.items()}))[2]

    assert mean(end_to_end=0.0, continued=0.3) == 0.3
    assert mean(end_to_end=0.2, continued=0.3) == 0.2
    assert mean(end_to_end=0.0) == 0.0


def test_what_fails_as_written_down_passes_and_is_named():
    found = held(run(check()))

    assert not found.red
    assert found.matched == ["shadows/one: 1 failing check: The plane is looked at from far away."]
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
        run(check(end_to_end={"nan": 1})),
        run(check(verdict="undecided"), verdict="undecided"),
        run(check(verdict="unsupported"), verdict="unsupported"),
        run(check(cells=["0000000000000100", "0000000000000100"])),
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
        "a ratio of NaN", "a pixel of NaN",
        "nothing decided", "nothing answered", "pixels elsewhere",
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
    gone, unplanned = replace(ENTRY, checks={"float32 radiance distance": CHECK}), replace(ENTRY, case="other/*")

    found = held(run(check()), ENTRY, gone, unplanned)

    assert found.stale == ["shadows/one (HIT-4): no check of the run is called float32 radiance distance"]


def test_an_entry_holds_on_its_last_day_and_not_after_it():
    assert not held(run(check()), replace(ENTRY, expires="2026-11-22")).red
    late = held(run(check()), replace(ENTRY, expires="2026-11-21"))

    assert (len(late.expired), len(late.regressions)) == (1, 1)


def test_conditions_and_patterns_decide_whom_an_entry_is_about():
    assert not held(run(check()), replace(ENTRY, case="shadows/*", when={"backend": "llvm", "subject": "trac*"})).red
    assert held(run(check()), replace(ENTRY, when={"backend": "cuda"})).regressions


def test_what_is_accepted_passes_and_what_passes_is_pruned(tmp_path):
    results = run(check(), check(stage="object", ratio=float("inf"), examined={"wrong": 3}, cells=["0" * 15 + "1"] * 2))
    known, new, refused = accepted(results, KnownFailures(), Acceptance(reason="known", issue="#7"))
    save_known(tmp_path / "known.json", known)
    read = load_known(tmp_path / "known.json", patterns=False)

    assert (new, refused, len(read.expected)) == (2, [], 1)
    assert not held(results, *read.expected).red
    better = run(check(ratio=1.5, examined={"wrong": 2}), check(stage="object", verdict="pass"))
    assert len(held(better, *read.expected).tighten) == 2
    left, done = pruned(better, read)
    assert done == ["shadows/one (HIT-4): of 2 checks 1 pass now or are gone, 1 fail less and are narrowed"]
    assert not held(better, *left.expected).red
    assert held(results, *left.expected).regressions


def test_a_number_in_the_file_has_a_tenth_of_room():
    number = KnownCheck(ratio=3.0, wrong=10, error=1.0)

    assert number.ranges == (pytest.approx((3 / 1.1, 3.3)), (9, 11), pytest.approx((1 / 1.1, 1.1)))
    assert KnownCheck(ratio="inf", wrong=(1, 5)).ranges == ((np.inf, np.inf), (1, 5), (0, np.inf))
    # Pruned by two checks it becomes a pair that allows no more.
    both = Expectation(case="shadows/one", reason="known", checks={"float32 * distance": number})
    left, _ = pruned(run(check(ratio=2.0), check(reference="radiance", ratio=9.0)), KnownFailures(expected=[both]))
    assert left.expected[0].checks["float32 * distance"].ratio == (pytest.approx(2 / 1.1, rel=1e-3), pytest.approx(3.3))


def test_further_checks_of_a_case_join_its_entry_and_what_is_not_finite_is_refused():
    first, *_ = accepted(run(check()), KnownFailures(), Acceptance(reason="known"))
    more = run(check(), check(stage="normal"), check(stage="position", end_to_end={"nan": 4}))

    both, new, refused = accepted(more, first, Acceptance(reason="known"))
    other, *_ = accepted(more, first, Acceptance(reason="another"))

    assert (new, [len(entry.checks) for entry in both.expected]) == (1, [2])
    assert refused == [
        "shadows/one: float32 analytic position: 4 pixels without a finite number, of which nothing can be expected"
    ]
    assert [entry.reason for entry in other.expected] == ["known", "another"]


def test_an_infinite_pixel_given_its_own_previous_stages_is_a_regression():
    normal = replace(ENTRY, checks={"float32 analytic normal": CHECK})

    assert not held(run(check(stage="normal")), normal).red
    assert held(run(check(stage="normal", continued={"inf": 2})), normal).regressions


def test_a_missed_hit_is_no_number_that_lacks():
    """A miss has the distance inf: it is wrong where the reference hits, and can be accepted as other failures can."""
    missed = run(check(ratio=float("inf"), end_to_end={"inf": 10}))
    known, new, _ = accepted(missed, KnownFailures(), Acceptance(reason="known"))

    assert new == 1
    assert not held(missed, *known.expected).red


def test_what_is_not_measured_any_more_stays_in_the_file():
    for verdict in ("undecided", "unsupported", "missing", "error"):
        left, done = pruned(run(check(verdict=verdict), verdict=verdict), KnownFailures(expected=[ENTRY]))

        assert ([*left.expected], done) == ([ENTRY], [])


def test_as_many_wrong_pixels_elsewhere_are_red_and_an_outline_that_moves_a_little_is_not():
    def wrong(*places: tuple[int, int]) -> dict[str, Any]:
        image = np.zeros((64, 80), dtype=bool)
        image[tuple(np.transpose(places))] = True
        return run(check(cells=cells_of(image), examined={"wrong": len(places)}))

    before = wrong((7, 9), (7, 8))
    known, *_ = accepted(before, KnownFailures(), Acceptance(reason="known"))

    assert not held(before, *known.expected).red
    assert not held(wrong((8, 10), (7, 9)), *known.expected).red
    (said,) = held(wrong((40, 9), (7, 9)), *known.expected).regressions
    assert said.endswith("pixels are wrong in 1 of 64 parts of the image in which they were right")


def test_an_error_that_doubles_is_red_where_its_limit_is_0():
    def off(mean: float) -> dict[str, Any]:
        return run(check(ratio=float("inf"), end_to_end={"mean_wrong": mean}))

    known, *_ = accepted(off(0.02), KnownFailures(), Acceptance(reason="known"))

    assert not held(off(0.0201), *known.expected).red
    assert "mean error of the wrong pixels" in held(off(0.04), *known.expected).regressions[0]
    assert "mean error of the wrong pixels" in held(off(0.01), *known.expected).tighten[0]


def test_an_entrys_item_may_be_one_of_several_that_are_blamed():
    several = run(check())["cases"][0] | {"item": None, "blamed_items": ["HIT-4", "HIT-5"]}

    assert not held({**run(check()), "cases": [several]}).red


def test_pruning_makes_no_entry_wider():
    worse = run(check(ratio=8.0, examined={"wrong": 40}, cells=["ff" * 8] * 2))

    left, _ = pruned(worse, KnownFailures(expected=[ENTRY]))

    kept = left.expected[0].checks[NAME]
    assert (kept.ratio[1], kept.wrong[1], kept.cells) == (CHECK.ratio[1], CHECK.wrong[1], CHECK.cells)
    assert held(worse, *left.expected).regressions


@pytest.mark.parametrize(
    "entry",
    [
        replace(ENTRY, case="shadows/*"),
        replace(ENTRY, checks={"float32 * distance": CHECK}),
        replace(ENTRY, checks={"* * *": replace(CHECK, ratio=(0, "inf"))}),
        as_of(cells=None),
    ],
)
def test_an_entry_that_opens_more_than_it_names_is_refused_unless_it_is_allowed(tmp_path, entry: Expectation):
    save_known(tmp_path / "known.json", KnownFailures(expected=[entry]))

    with pytest.raises(ValueError, match="--any allows such entries"):
        load_known(tmp_path / "known.json", patterns=False)
    assert [*load_known(tmp_path / "known.json", patterns=True).expected] == [entry]


@pytest.mark.parametrize(
    ("now", "red"),
    [((99, 100), False), ((989, 1000), True), ((65, 511), True), ((0, 0), False), ((200, 200), False)],
)
def test_a_share_of_answers_that_falls_by_more_than_a_hundredth_is_red(now: tuple[int, int], red: bool):
    fuller = run(check(verdict="pass"), verdict="pass", answered={"families": {"shadows": (100, 100)}})
    known, new, _ = accepted(fuller, KnownFailures(), Acceptance(reason=""))

    found = gate(fuller | {"answered": {"families": {"shadows": now, "other": (0, 9)}}}, known, file="known.json")

    assert (new, found.red, len(found.uncovered)) == (0, red, red)
    if now == (65, 511):
        assert found.uncovered == ["shadows: 65 of 511 checks (12.72 %) are answered, 100 % were"]
