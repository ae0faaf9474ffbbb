"""Errata E15 and its kin: rays in the very plane of a face, where either of hit and miss is right."""

import pytest

from rayproof.cases.case import Case
from rayproof.cases.scene import IDENTITY, Camera, Cube, Scene
from rayproof.reports.audit.case_task import work
from rayproof.reports.audit.orders import CaseOrder
from rayproof.reports.audit.planted import planted

pytestmark = pytest.mark.references


MIRROR = ((-1.0, 0.0, 0.0, 0.0), *IDENTITY[1:])


@pytest.mark.parametrize("to_world", [IDENTITY, MIRROR], ids=["upright", "mirrored"])
def test_whatever_the_slab_test_makes_of_zero_by_zero_is_a_side_of_the_outline(to_world) -> None:
    camera = Camera(
        eye=(0.5, 0.1, 4.0), target=(0.5, 0.1, 0.0), up=(0.0, -1.0, 0.0), fovy=20.0, width=9, height=7, near=0.1, far=9
    )
    case = Case(
        name="test/in_a_face",
        scene=Scene(camera=camera, shapes=(Cube(albedo=(0.5, 0.5, 0.5), to_world=to_world),)),
        stresses="The middle column's rays run in the plane of a face.",
        covers=("HIT-3",),
        least_interior=10,
        most_edge=0.5,
    )
    faults = tuple(fault for fault in planted("cube/*") if fault.equivalent)

    report = work(CaseOrder(case=case, faults=faults, healthy=("float32", "float64")))

    assert {fault.erratum for fault in faults} == {"E15", None}
    assert {str(one.outcome) for one in (*report.sightings, *report.healthy)} == {"pass"}
