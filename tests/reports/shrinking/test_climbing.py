"""A climb raises what is wrong, keeps to the right scenes of a right renderer, and is the same for the same seed."""

import json
from pathlib import Path

import pytest

from rayproof.cases.scene_json import scene_to_json
from rayproof.reports.shrinking.climbing import ScenesClimb
from tests.reports.commands.conftest import Rayproof
from tests.reports.shrinking.test_search import tracer


def climbed(tries: int, formula: str = "", seed: int = 3) -> ScenesClimb:
    search = ScenesClimb(tracer(formula), seed=seed, tries=tries, seconds=None)
    search.run(lambda now: None)
    return search


def test_a_climb_goes_up_and_stays_within_the_limits_of_a_right_tracer() -> None:
    search = climbed(50, seed=1)

    assert any(climb.first < climb.height.ratio for climb in search.climbs)
    assert all(climb.height.ratio <= 1 for climb in search.climbs)
    assert sum(climb.tries for climb in search.climbs) == search.tries < 56  # the last climb ends with the tries


def test_the_same_seed_and_number_of_tries_give_the_same_scenes() -> None:
    one, other = climbed(14), climbed(14)

    assert [(climb.start, climb.height.ratio, scene_to_json(climb.height.scene)) for climb in one.climbs] == [
        (climb.start, climb.height.ratio, scene_to_json(climb.height.scene)) for climb in other.climbs
    ]


def test_an_error_of_less_than_its_limit_in_the_first_scenes_is_driven_beyond_it() -> None:
    # The textbook's discriminant is right in random/3/0 to 5: their spheres are near.
    assert not climbed(6, "sphere=textbook").climbs[0].height.ratio > 1

    worst = climbed(60, "sphere=textbook").worst

    assert worst is not None
    assert worst.height.ratio > 1


@pytest.mark.references
def test_the_worst_scene_of_a_wrong_formula_is_written_and_all_references_blame_it(
    rayproof: Rayproof, tmp_path: Path
) -> None:
    out, file = tmp_path / "out", tmp_path / "out" / "worst.json"
    words = ("run", "random", "--worst", "--formula", "exitance=fault_albedo_squared", "--count", "8", "--seed", "2")
    ended = rayproof(*words, "--out", out, "--json", file)

    assert ended.code == 1, ended.error
    assert f"smaller: rayproof shrink {out / 'scene.json'}" in ended.out.replace("./rayproof", "rayproof")
    assert "All references together: fail at exitance" in ended.out
    record = json.loads(file.read_text())
    assert record["tries"] == 8
    assert record["climbs"][0]["ratio"] > 1
    assert record["climbs"][0]["stage"] == "exitance"


def test_worst_refuses_what_it_does_not_take(rayproof: Rayproof) -> None:
    for words, complaint in (
        (["primitives/sphere", "--worst"], "--worst climbs over random scenes"),
        (["random", "--worst", "--laws"], "--worst climbs over random scenes"),
        (["random", "--worst", "--seconds", "-1"], "--seconds must be positive, got -1.0"),
        (["random", "--worst", "--count", "0"], "--count must be from 1 to 10000 scenes, got 0"),
        (["random", "--seconds", "5"], "--seconds needs --worst"),
    ):
        ended = rayproof("run", *words)
        assert ended.code == 2
        assert complaint in ended.error
