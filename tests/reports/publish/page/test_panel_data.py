"""What references say in many cases is said once, counted; findings come from the run, else from the checkout."""

from rayproof.reports.publish.page.front import Said, findings


def panel(cases):
    said = Said()
    for case in cases:
        said.add(case)
    return said.panel


def test_notes_refusals_and_settings_are_gathered_over_cases() -> None:
    case = {
        "notes": [{"reference": "a", "note": "a disc for a plane"}],
        "unsupported": [{"reference": "b", "stage": "ray", "why": "no such"}] * 2,
        "settings": {"a": {"shadow epsilon": "1 m"}},
    }

    found = panel([case, case | {"settings": {"a": {"shadow epsilon": "2 m"}}}])

    assert found == {
        "a": {"settings": {"shadow epsilon": ["1 m", "2 m"]}, "notes": [("a disc for a plane", 2)], "unsupported": []},
        "b": {"settings": {}, "notes": [], "unsupported": [("no such", 4)]},
    }


def test_values_that_differ_from_case_to_case_are_counted_not_listed() -> None:
    cases = [{"settings": {"a": {"epsilon": f"{index} m"}}} for index in range(30)]

    assert panel(cases)["a"]["settings"]["epsilon"] == ["0 m", "1 m", "2 m", "27 more, by case"]


def test_sentences_that_differ_in_numbers_alone_are_one() -> None:
    cases = [{"notes": [{"reference": "a", "note": f"a disc of radius {radius} m"}]} for radius in ("1.5", "2e-3")]

    assert panel(cases)["a"]["notes"] == [("a disc of radius 1.5 m", 2)]


def test_what_is_malformed_is_passed_over() -> None:
    assert panel([{"notes": "x", "unsupported": [1], "settings": [2]}, {"settings": {"a": 1}}]) == {}


def test_findings_of_the_run_go_before_those_checked_in() -> None:
    assert findings({"findings": [{"reference": "a", "what": "w"}, 3]}) == [{"reference": "a", "what": "w"}]
    assert all(entry["reference"] for entry in findings({}))
