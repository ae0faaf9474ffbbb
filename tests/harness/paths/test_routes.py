"""Other routes are compared where they can be, agree, and a route that differs fails its case."""

from collections import Counter

import numpy as np
import pytest

from rayproof.cases.families import all_cases, select
from rayproof.cases.stages import IMAGE_STAGES, Stage
from rayproof.tracer.configuration import Configuration
from rayproof.tracer.frames import Frames
from rayproof.tracer.render import render
from tests.harness.paths.ledger import comparisons, sentence
from tests.harness.paths.routes import CHOICE, NAMES, ROUTES, SHORT, asked, compare, suiting


def test_the_names_are_those_of_the_routes() -> None:
    assert tuple(ROUTES) == NAMES


def test_every_route_is_taken_by_two_cases_of_the_suite_that_suit_it() -> None:
    cases = {case.name: case for case in all_cases()}
    met = Counter(
        route for name, routes in CHOICE.items() for route in suiting(routes, cases[name].scene, Configuration())
    )

    assert set(CHOICE) <= set(cases)
    assert {route: met[route] for route in NAMES if met[route] < 2} == {}
    # Whoever is chosen can take what it was chosen for.
    assert sum(met.values()) == sum(len(routes) for routes in CHOICE.values())


def test_everything_is_every_route_in_both_precisions() -> None:
    assert asked(NAMES, "float64") == NAMES
    assert asked(("frames", "tiles of 4 x 4"), "float64") == ("frames",)
    assert asked(NAMES, "float32/shadow_ray=doubles") == ()
    assert set(SHORT) < set(NAMES)


@pytest.mark.parametrize("route", NAMES[:4])
def test_routes_of_one_scene_agree(route: str, precision: str) -> None:
    (case,) = select(["antialiased/sphere"])
    configuration = Configuration(precision=precision)

    entry = compare(route, case.scene, configuration, render(case.scene, IMAGE_STAGES, configuration))

    assert (entry["verdict"], entry["stage"], entry["differ"]) == ("pass", None, 0)
    assert 0 <= entry["worst"] <= 1
    assert entry["pixels"] == case.scene.camera.width * case.scene.camera.height


def test_a_frame_that_is_a_little_too_bright_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    (case,) = select(["antialiased/sphere"])
    right, answers = Frames.pixels, render(case.scene, IMAGE_STAGES, Configuration())
    monkeypatch.setattr(Frames, "pixels", lambda frames: right(frames) * np.float32(1 + 2.0**-17))

    entry = compare("frames", case.scene, Configuration(), answers)

    assert entry["verdict"] == "fail"
    assert entry["worst"] > 1
    assert entry["stage"] == Stage.RADIANCE
    assert "float32 by frames: radiance differs" in sentence(entry)


def test_a_case_is_compared_by_the_routes_that_were_chosen_for_it() -> None:
    compared = [*comparisons(select(["parallel_rays/flat", "primitives/sphere"]))]

    assert [(one["case"], one["path"], one["configuration"], one["verdict"]) for one in compared] == [
        ("parallel_rays/flat", "frames", precision, "pass") for precision in ("float32", "float64")
    ]
