"""What references say in many cases is said once, counted; findings come from the run, else from the checkout."""

from rayproof.reports.publish.page.front import Said


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
