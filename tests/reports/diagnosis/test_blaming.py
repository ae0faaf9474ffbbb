"""What is blamed is the set that the evidence leaves: the right item is in it, and what is out is out by a check."""

from pathlib import Path
from typing import Any

import pytest

from rayproof.cases.case import Case
from rayproof.cases.families import select
from rayproof.cases.stages import Stage
from rayproof.reference.analytic import Analytic
from rayproof.reports.diagnosis.blaming import Blamed, by_stages, narrowed, put
from rayproof.reports.diagnosis.diagnosing import causes_of, entries, narrow
from rayproof.reports.diagnosis.evidence import Evidence
from rayproof.reports.judge.answers import Answers
from rayproof.reports.judge.case import judge_case
from rayproof.reports.judge.oracle import stages_of
from rayproof.reports.judge.verdict import of_what_is_supported
from rayproof.reports.mistakes import MISTAKES
from rayproof.reports.subjects import PROGRAM, Subject
from rayproof.reports.subjects.program import ask_program
from tests.harness.audit import diagnosing
from tests.reports.checks import recorded

ORACLE = Analytic()
needs_compiler = pytest.mark.skipif(diagnosing.compiler() is None, reason="there is no C++ compiler")


@pytest.fixture(scope="module")
def program(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return diagnosing.built(tmp_path_factory.mktemp("mistaken"))


def shown(
    program: Path, mistake: str, names: list[str], *more: str
) -> tuple[list[dict[str, Any]], dict[str, Evidence]]:
    """Return the records of a program with a mistake, judged before the oracle alone, and its evidence."""
    command = (str(program), "--mistake", mistake, *more, "{scene}", "{output}")
    subject = Subject(name=PROGRAM, transport=PROGRAM, title="exec:mistaken", command=command)
    records, evidence = [], {}
    for case in select(names):
        given = ask_program(subject, case.scene, samples=1)
        answers = ORACLE.render(case.scene, stages_of(case.scene))
        truth = Answers(name="analytic", precision="float64", independent=True, answers=answers)
        found = of_what_is_supported(judge_case(case, [given], [truth], ORACLE, {}), [given])
        record = {
            "name": case.name,
            "verdict": found.outcome.value,
            "stage": None if found.stage is None else found.stage.value,
            "shapes": [type(shape).__name__ for shape in case.scene.shapes],
            "checks": [check.recorded() for check in found.checks],
        }
        if (blamed := by_stages(record, ran=False)) is not None:
            put(record, blamed)
        records.append(record)
        evidence[case.name] = Evidence(
            case=case.name,
            scene=case.scene,
            load=lambda answers=given.answers: dict(answers or {}),
            failed=found.outcome.value == "fail",
            shadow_epsilon=diagnosing.EPSILON,
        )
    return records, evidence


@pytest.mark.process
@needs_compiler
@pytest.mark.parametrize(
    ("mistake", "more", "names", "items"),
    [
        ("no_falloff", ["--only", "radiance"], ["primitives/sphere", "primitives/cube"], ["RAD-1"]),
        ("clips_nothing", [], ["clipping/sphere_depth", "clipping/sphere_shell", "primitives/sphere"], ["HIT-2"]),
        ("pixel_corner", [], ["primitives/sphere", "primitives/cube"], ["CAM-3"]),
    ],
)
def test_what_a_named_mistake_concerns_is_blamed_and_nothing_else(
    program: Path, mistake: str, more: list[str], names: list[str], items: list[str]
) -> None:
    records, evidence = shown(program, mistake, names, *more)
    failing = [one for one in evidence.values() if one.failed]
    causes = entries(*causes_of(list(evidence.values())), of=len(failing))

    narrow({"cases": records}, evidence, PROGRAM, causes)

    failed = [record for record in records if record["verdict"] == "fail"]
    assert failed
    for record in failed:
        assert record["blamed_items"] == items, record
        assert record["item"] == (items[0] if len(items) == 1 else None)


def test_a_named_mistake_and_what_has_the_same_pixels_are_blamed_in_the_cases_that_it_explains() -> None:
    records = [failing("ray") | {"name": name} for name in ("a/explained", "a/another")]
    for record in records:
        put(record, Blamed(items=("CAM-1", "CAM-3", "CAM-4")))
    case = select(["primitives/sphere"])[0]
    known = Evidence(case=case.name, scene=case.scene, load=dict, failed=True)
    evidence: dict[str, Evidence] = dict.fromkeys(("a/explained", "a/another"), known)
    other = {"items": ["CAM-3"]}
    cause = {"mistake": "left_handed", "cases": ["a/explained"], "items": ["CAM-1"], "alternatives": [other]}

    narrow({"cases": records[:1]}, evidence, PROGRAM, [cause])

    assert records[0]["blamed_items"] == ["CAM-1", "CAM-3"]


@pytest.mark.process
@needs_compiler
def test_of_an_unknown_mistake_items_are_out_only_by_a_check_that_passes(program: Path) -> None:
    records, evidence = shown(program, "softened_falloff", ["primitives/cube", "several_lights/simplified"])
    (failing,), (passing,) = ([one for one in records if one["verdict"] == kind] for kind in ("fail", "pass"))

    blamed = by_stages(failing, ran=False)
    assert blamed is not None

    found = narrowed(
        [(failing, evidence[failing["name"]], blamed)],
        [(passing, evidence[passing["name"]])],
        PROGRAM,
    )[failing["name"]]

    assert "RAD-1" in found.items
    assert not {"NRM-2", "CAM-4", "RAD-4"} & set(found.items), "these stages pass in the case itself"


def test_a_passing_case_excludes_an_item_for_its_own_kinds_of_shapes_alone() -> None:
    wrong, spheres, cubes = (select([name])[0] for name in ("primitives/sphere", "inside/sphere", "primitives/cube"))
    images = MISTAKES["no_pi"]().render(wrong.scene, [Stage.RADIANCE])
    broken = Evidence(case=wrong.name, scene=wrong.scene, load=lambda: images, failed=True)
    record = failing("radiance") | {"name": wrong.name}

    def left(case: Case) -> set[str]:
        right = ORACLE.render(case.scene, [Stage.RADIANCE])
        passed = Evidence(case=case.name, scene=case.scene, load=lambda: right, failed=False)
        checks = [recorded(configuration=PROGRAM, stage="radiance")]
        other = {"verdict": "pass", "checks": checks, "name": case.name}
        blamed = Blamed(items=("HIT-1", "RAD-1"))
        return set(narrowed([(record, broken, blamed)], [(other, passed)], PROGRAM)[wrong.name].items)

    assert left(cubes) == {"HIT-1", "RAD-1"}
    assert left(spheres) <= {"HIT-1", "RAD-1"}


def failing(stage: str, *passing: str) -> dict[str, Any]:
    """Return the record of a case of spheres that fails at a stage and passes at others."""
    checks = [recorded(configuration=PROGRAM, stage=one) for one in passing]
    checks.append(recorded(configuration=PROGRAM, stage=stage, verdict="fail"))
    return {"verdict": "fail", "stage": stage, "checks": checks, "shapes": ["Sphere"]}


def test_a_marchers_distances_are_no_fault_of_its_camera_whose_rays_pass() -> None:
    blamed = by_stages(failing("distance", "ray", "object"), ran=False)

    assert blamed is not None
    assert "HIT-1" in blamed.items
    assert not any(item.startswith("CAM") for item in blamed.items)


def test_radiance_alone_leaves_every_item_that_its_shapes_ask_for() -> None:
    blamed = by_stages(failing("radiance"), ran=False)

    assert blamed is not None
    assert {"CAM-3", "XF-1", "HIT-1", "HIT-2", "NRM-1", "NRM-3", "LIT-5", "RAD-1", "RAD-4", "RAD-5"} <= set(
        blamed.items
    )
    assert not {"HIT-3", "NRM-2", "HIT-7"} & set(blamed.items)
