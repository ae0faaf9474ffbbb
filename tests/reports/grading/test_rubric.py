"""A rubric is checked as a whole, and each error names what is wrong; hidden cases have names that nobody knows."""

from pathlib import Path

import pytest

from rayproof.reports.grading.rubric import GRADED, Rubric, load_rubric, starter
from rayproof.reports.subjects.protocol import Capabilities

SMALL = """
title = "A course"
points = {HIT-1 = 2, RAD-1 = 1}
[program]
run = "./tracer {scene} {output}"
[cases]
visible = ["primitives/sphere"]
"""


def loaded(tmp_path: Path, text: str) -> Rubric:
    (tmp_path / "rubric.toml").write_text(text)
    return load_rubric(tmp_path / "rubric.toml")


def test_the_starter_gives_points_for_all_items_in_at_most_60_cases(tmp_path: Path) -> None:
    rubric = loaded(tmp_path, starter(5))
    assert tuple(rubric.points) == GRADED
    assert len(rubric.cases) <= 60
    assert f"{len(rubric.cases)} of them" in starter(5)
    assert {case.name for case in rubric.cases if case.name.startswith("hidden-")} == rubric.hidden


def test_hidden_cases_have_fresh_names_and_an_order_of_their_own(tmp_path: Path) -> None:
    first, again, second = (loaded(tmp_path, starter(seed)) for seed in (5, 5, 6))
    assert [case.name for case in first.cases] == [case.name for case in again.cases]
    assert not first.hidden & second.hidden
    assert [case.name for case in first.cases] != sorted(case.name for case in first.cases)
    assert not any("combined/1" in name or "random" in name for name in (case.name for case in first.cases))


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("title = 3", "title"),
        (SMALL.replace("HIT-1", "HIT-99"), "HIT-99"),
        (SMALL.replace("HIT-1", "HIT-6"), "give points to HIT-5"),
        (SMALL.replace("HIT-1 = 2", "HIT-1 = -2"), "from 0 to 1000, got -2"),
        (SMALL.replace("HIT-1 = 2, RAD-1 = 1", "HIT-1 = 0"), "no item has points"),
        (SMALL.replace("HIT-1", "HIT-3"), "no case asks for it"),
        (SMALL.replace("{output}", ""), "{output}"),
        (SMALL.replace("primitives/sphere", "primitives/shere"), "did you mean primitives/sphere"),
        (SMALL.replace("primitives/sphere", "random/1/2"), "cases.random"),
        (SMALL + "more = 1", "more"),
        (SMALL + "[limits]\nseconds = 0.0", "limits.seconds"),
        (SMALL + "[readable]\nfolders = ['nowhere']", "'nowhere' is no absolute path"),
        (SMALL + "[declared]\nallowed = ['everything']", "'everything' is not known"),
        ("title = ", "rubric.toml"),
    ],
)
def test_what_is_wrong_is_named(tmp_path: Path, text: str, said: str) -> None:
    with pytest.raises((ValueError, LookupError)) as raised:
        loaded(tmp_path, text)
    assert said in str(raised.value)


def test_a_declaration_counts_only_as_far_as_it_is_allowed(tmp_path: Path) -> None:
    rubric = loaded(tmp_path, SMALL + "[declared]\nallowed = ['chained']\nepsilon = 1e-4")
    declared = Capabilities(chained=True, deterministic=False, shapes=("sphere",), shadow_epsilon=0.5, ray_epsilon=1e-5)
    assert rubric.believed(declared) == Capabilities(chained=True, shadow_epsilon=1e-4, ray_epsilon=1e-5)
