"""Faults of the tracer and of references before a judge who also hears the others: killed, and blamed right."""

import pytest

from rayproof.cases.case import Case
from rayproof.cases.families import select
from rayproof.cases.scene import IDENTITY, Camera, Cube, Scene
from tests.harness.audit import findings
from tests.harness.audit.orders import CaseOrder, GradedOrder
from tests.harness.audit.planted import planted
from tests.harness.audit.tasks import QUANTITIES
from tests.harness.audit.tasks import grade as grade
from tests.harness.audit.tasks import judge_faults as work

pytestmark = pytest.mark.references


# Fault, case: one of each stage, and of each side.
TRACER = (
    ("sample/corner", "primitives/square"),
    ("cube/fault_parallel_ignored", "parallel_rays/cubes"),
    ("sphere/fault_far_root", "primitives/sphere"),
    ("world_normal/fault_model_matrix", "transforms/sphere_stretched"),
    ("shadow_ray/fault_inward", "shadows/square_at_0.6m"),
    ("radiance/fault_srgb", "primitives/square"),
)
REFERENCE = (
    ("reference/mitsuba_flux_factor", "primitives/square"),
    ("reference/mitsuba_fovy", "primitives/square"),
    ("reference/analytic_normal_mirrored", "primitives/sphere"),
)


@pytest.mark.parametrize(("name", "case"), TRACER, ids=[name for name, _ in TRACER])
def test_a_fault_of_the_tracer_is_killed_by_each_reference_alone_and_blamed_on_its_stage(name: str, case: str) -> None:
    (fault,), (question,) = planted(name), select([case])

    report = work(CaseOrder(case=question, faults=(fault,), healthy=("float32",)))
    entry = findings.by_cases(fault, report.sightings)

    assert [str(one.outcome) for one in report.healthy] == ["pass"]
    assert entry["killed"]
    assert entry["blamed_right"]
    assert entry["blamed_stage"] == fault.stage
    assert report.sightings[0].items
    # A program without a camera does not see every stage; a reference that sees the stage must kill.
    seeing = [one for one in entry["references"].values() if one["sees"]]
    assert len(seeing) >= 3
    assert all(one["killed"] for one in seeing)


@pytest.mark.parametrize(("name", "case"), REFERENCE, ids=[name for name, _ in REFERENCE])
def test_a_fault_of_a_reference_is_never_blamed_on_the_tracer(name: str, case: str) -> None:
    (fault,), (question,) = planted(name), select([case])

    report = work(CaseOrder(case=question, faults=(fault,), healthy=()))
    entry = findings.by_cases(fault, report.sightings)

    assert entry["killed"]
    assert entry["blamed_right"]
    assert "tracer" not in entry["blamed"]


# Small errors: what is found grows with the error and with the precision.


(CASE,) = select(["primitives/sphere"])
AMOUNTS = (1e-2, 1e-4, 1e-6)


@pytest.mark.parametrize("quantity", QUANTITIES)
def test_every_quantity_is_noticed_and_in_float64_sooner(quantity: str) -> None:
    single, double = (
        grade(GradedOrder(case=CASE, quantity=quantity, precision=precision, amounts=AMOUNTS)).smallest
        for precision in ("float32", "float64")
    )

    assert single
    assert set(single) <= set(double)
    assert all(double[stage] <= amount for stage, amount in single.items())
    assert min(double.values()) == AMOUNTS[-1]


# Errata E15 and its kin: rays in the very plane of a face, where either of hit and miss is right.


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
        most_explained=0.5,
    )
    faults = tuple(fault for fault in planted("cube/*") if fault.equivalent)

    report = work(CaseOrder(case=case, faults=faults, healthy=("float32", "float64")))

    assert {fault.erratum for fault in faults} == {"E15", None}
    assert {str(one.outcome) for one in (*report.sightings, *report.healthy)} == {"pass"}
