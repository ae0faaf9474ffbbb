"""Planted faults before the laws: who is killed by what, and what is said of the others."""

from dataclasses import replace

import pytest

from rayproof.cases.case import Case
from rayproof.cases.families import select
from tests.harness.audit.faults_against_laws import FaultOrder, FaultReport, before_the_laws, meet, summed_up, told
from tests.harness.audit.planted import PlantedFault, planted

(LIGHTS,) = select(["several_lights/inverse_square"])
PAIRS = (("albedo_linear", LIGHTS), ("lights_add", LIGHTS))


def met(name: str, *cases: Case) -> FaultReport:
    """Return what becomes of one fault."""
    (fault,) = planted(name)
    return meet(FaultOrder(fault=fault, pairs=PAIRS, cases=cases))


def test_the_first_law_that_the_image_breaks_is_named() -> None:
    report = met("sum_lights/fault_mean")

    assert report.image == report.staged == report.changes == "lights_add, several_lights/inverse_square"


@pytest.mark.parametrize(
    ("name", "changes"), [("falloff/none", "several_lights/inverse_square"), ("corners/fault_far_by_near", None)]
)
def test_a_survivor_is_held_beside_the_right_tracer(name: str, changes: str | None) -> None:
    report = met(name, LIGHTS)

    assert (report.image, report.staged, report.changes) == (None, None, changes)


def test_the_score_counts_equivalent_faults_apart_and_gives_a_reason_for_each_survivor() -> None:
    def fault(name: str, proof: str | None = None) -> PlantedFault:
        return PlantedFault(name=name, where="tracer", stage=None, equivalent=proof)

    killed = FaultReport(fault=fault("a/killed"), image="split, x/y", staged="split, x/y", changes="split, x/y")
    reports = (
        killed,
        replace(killed, fault=fault("a/staged"), image=None, changes=None),
        replace(killed, fault=fault("a/alive"), image=None, staged=None, changes="x/y"),
        replace(killed, fault=fault("a/same", "it is the same"), image=None, staged=None, changes=None),
        replace(killed, fault=fault("a/lost"), image=None, staged=None, changes=None, error="the worker died"),
    )

    score = summed_up(reports)

    assert (score["killed_image"], score["of_image"], score["killed_staged"], score["of"]) == (1, 2, 2, 4)
    assert score["equivalent_killed"] == []
    assert score["survivors"] == {
        "a/staged": "changes no image that was looked at; its stages break split, x/y",
        "a/alive": "changes the image of x/y and breaks no law there",
        "a/same": "equivalent: it is the same",
        "a/lost": "could not be asked: the worker died",
    }
    assert told(score)[-1].startswith("Laws, no reference asked: 1 of 2 faults that change an image killed")


def test_where_nothing_of_the_tracer_is_planted_nothing_is_asked() -> None:
    assert before_the_laws(planted("loader"), jobs=1, timeout=1.0, say=print) is None
    assert told(None) == []
