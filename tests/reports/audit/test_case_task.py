"""Faults of the tracer and of references before a judge who also hears the others: killed, and blamed right."""

import pytest

from rayproof.cases.families import select
from rayproof.reports.audit import findings
from rayproof.reports.audit.case_task import work
from rayproof.reports.audit.orders import CaseOrder
from rayproof.reports.audit.planted import planted

pytestmark = pytest.mark.references


# Fault, case: one of each stage, and of each side.
TRACER = (
    ("sample/corner", "primitives/square"),
    ("half_extent/fault_whole_angle", "primitives/square"),
    ("ray/fault_depends_on_t", "primitives/square"),
    ("cube/fault_parallel_ignored", "parallel_rays/cubes"),
    ("sphere/fault_far_root", "primitives/sphere"),
    ("position/fault_left_in_object_space", "transforms/square_translated"),
    ("world_normal/fault_model_matrix", "transforms/sphere_stretched"),
    ("feeler/fault_inward", "shadows/square_at_0.6m"),
    ("lambert/fault_squared", "primitives/square"),
    ("exitance/fault_albedo_squared", "primitives/square"),
    ("radiance/fault_srgb", "primitives/square"),
)
REFERENCE = (
    ("reference/mitsuba_flux_factor", "primitives/square"),
    ("reference/mitsuba_fovy", "primitives/square"),
    ("reference/analytic_normal_mirrored", "primitives/sphere"),
    ("judge/mitsuba_copies_light", "primitives/square"),
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
    assert report.sightings[0].item is not None
    # Embree sees no sphere, and neither it nor a camera-less program every stage; who sees must kill.
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


def test_a_formula_that_is_proven_equivalent_passes() -> None:
    faults = tuple(fault for fault in planted("cube/*") if fault.equivalent)
    (question,) = select(["parallel_rays/cubes"])

    report = work(CaseOrder(case=question, faults=faults, healthy=()))

    assert faults
    assert {str(one.outcome) for one in report.sightings} == {"pass"}
