"""Other routes are compared where they can be, agree, and a route that differs fails its case."""

from collections import Counter

import numpy as np
import pytest

from rayproof.cases.families import all_cases, select
from rayproof.cases.stages import IMAGE_STAGES, Stage
from rayproof.reports.paths.choice import CHOICE, NAMES, SHORT, asked, routes_of
from rayproof.reports.paths.routes import ROUTES, compare, suiting
from rayproof.reports.paths.verdict import held_together
from rayproof.tracer.configuration import Configuration
from rayproof.tracer.frames import Frames
from rayproof.tracer.render import render


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
    assert routes_of("primitives/sphere", everything=True) == NAMES
    assert routes_of("primitives/sphere", everything=False) == ()
    assert asked(NAMES, "float64") == NAMES
    assert asked(("frames", "tiles of 4 x 4"), "float64") == ("frames",)
    assert asked(NAMES, "float32/feeler=doubles") == ()
    assert set(SHORT) < set(NAMES)


@pytest.mark.parametrize("route", NAMES[:4])
def test_routes_of_one_scene_agree(route: str, precision: str) -> None:
    (case,) = select(["antialiased/sphere"])
    configuration = Configuration(precision=precision)

    entry = compare(route, case.scene, configuration, render(case.scene, IMAGE_STAGES, configuration))

    assert (entry["verdict"], entry["stage"], entry["differ"]) == ("pass", None, 0)
    assert 0 <= entry["worst"] <= 1
    assert entry["pixels"] == case.scene.camera.width * case.scene.camera.height


def test_a_frame_that_is_a_little_too_bright_fails_the_case(monkeypatch: pytest.MonkeyPatch) -> None:
    (case,) = select(["antialiased/sphere"])
    right, answers = Frames.pixels, render(case.scene, IMAGE_STAGES, Configuration())
    monkeypatch.setattr(Frames, "pixels", lambda frames: right(frames) * np.float32(1 + 2.0**-17))

    entry = compare("frames", case.scene, Configuration(), answers)
    record = {"verdict": "pass", "stage": None, "item": None, "reason": ""}
    held_together(record, [entry])

    assert entry["verdict"] == "fail"
    assert entry["worst"] > 1
    assert (record["verdict"], record["stage"]) == ("fail", Stage.RADIANCE)
    assert "float32 by frames: radiance differs" in record["reason"]


def test_a_failure_that_references_found_keeps_its_reason() -> None:
    record = {"verdict": "reference_suspect", "stage": "ray", "item": None, "reason": "analytic is off"}
    entry = {"verdict": "fail", "stage": "radiance"}

    held_together(record, [entry])

    assert record == {
        "verdict": "reference_suspect",
        "stage": "ray",
        "item": None,
        "reason": "analytic is off",
        "consistency": [entry],
    }
