"""One sentence a cause, the same wherever it is shown; where nothing fits that is said."""

from typing import Any

from rayproof.cases.families import select
from rayproof.reports.diagnosis.diagnosing import _changing, entries, of_images_that_change
from rayproof.reports.diagnosis.evidence import Evidence
from rayproof.reports.diagnosis.search import Cause, Searched
from rayproof.reports.mistakes import MISTAKES
from rayproof.reports.results.headline import cause_of, causes, headline


def searched(*names: str) -> Searched:
    """Return that the first of some mistakes explains a case, and that the others have the same pixels."""
    if not names:
        return Searched(tried=150)
    case = select(["primitives/sphere"])[0]
    evidence = Evidence(case="a/b", scene=case.scene, load=dict, failed=True)
    first, *others = (MISTAKES[name] for name in names)
    return Searched(causes=[Cause(mistake=first, cases=(evidence,), alternatives=tuple(others))], tried=150)


def results(diagnosis: list[dict[str, Any]]) -> dict[str, Any]:
    from rayproof.cases.stages import Stage
    from rayproof.reports.results.outcomes import Outcome

    ledger = dict.fromkeys(("planned", *(outcome.value for outcome in Outcome)), 0) | {"planned": 1, "fail": 1}
    case = {"name": "a/b", "family": "a", "verdict": "fail", "stage": Stage.RADIANCE.value, "item": "RAD-4"}
    return {"summary": ledger, "checks": ledger, "cases": [case], "diagnosis": diagnosis}


def test_where_nothing_fits_that_is_said_and_the_stage_stays_blamed() -> None:
    (entry,) = entries([], searched(), of=12)

    said = results([entry])

    assert entry["mistake"] is None
    assert entry["sentence"] == "None of 150 known mistakes explains the 12 failing cases."
    assert "radiance RAD-4 (radiant exitance and radiance) in 1 case" in headline(said)
    assert causes(said) == [entry["sentence"]]


def test_a_mistake_is_said_with_its_item_and_with_what_has_the_same_pixels() -> None:
    (entry,) = entries([], searched("left_handed", "image_mirrored"), of=3)

    assert "[CAM-1 view basis and view matrix]" in entry["sentence"]
    assert [one["mistake"] for one in entry["alternatives"]] == ["image_mirrored"]
    assert "writes each row of its image from right to left" in entry["sentence"]


def test_a_case_tells_the_causes_that_explain_it_alone() -> None:
    (entry,) = entries([], searched("left_handed"), of=3)
    entry["cases"] = ["a/b"]
    told = results([entry])

    assert cause_of(told, {"name": "a/b"}) == entry["sentence"]
    assert cause_of(told, {"name": "a/c"}) == ""


def test_images_that_change_beyond_the_limits_are_one_finding() -> None:
    told = {"configuration": "exec", "stage": "radiance", "differing": 9, "verdict": "fail", "beyond": "inf"}
    cases = [{"name": "a/b", "verdict": "fail", "checks": []}, {"name": "a/c", "checks": [], "repeated": [told]}]

    found = _changing({"cases": cases}, "exec")
    within = _changing({"cases": [{**cases[1], "repeated": [told | {"beyond": 0.5}]}]}, "exec")
    assert found is not None
    cause = of_images_that_change(*found, ["a/b"], of=2)

    assert (cause["items"], cause["cases"]) == (["IMG-1"], ["a/b"])
    assert "in a/c two differ in 9 pixels of radiance" in cause["sentence"]
    assert "Its first images are diagnosed" in cause["sentence"]
    assert within is None, "what differs by roundings explains no failure"
    assert _changing({"cases": cases}, "float32") is None
