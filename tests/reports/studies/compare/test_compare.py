"""Known differences come out as they should, nothing comes out of nothing, and JSON has the promised keys."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rayproof.cases.families import select
from rayproof.cases.scene_json import save_scene
from rayproof.cases.stages import Stage
from rayproof.cases.stresses import STRESSES
from rayproof.reports.commands.lookup import scene_files
from rayproof.reports.studies.compare.contenders import contender, seen, stages_at_stake
from rayproof.reports.studies.compare.findings import (
    MIXED,
    NOTHING,
    FamilyDifference,
    Signs,
    accuracy,
    finding,
    outcome,
)
from rayproof.reports.studies.compare.paired_errors import PairedStage, paired
from rayproof.reports.studies.compare.records import as_received
from rayproof.reports.studies.tradeoff.diagrams import tasks
from rayproof.tracer.formulas import FORMULAS
from tests.reports.commands.conftest import Rayproof

SCENE = next(iter(STRESSES["far_sphere_1e3"]()))[1]


def compared(base: str, candidate: str, *, precision: str = "float32", stage: Stage = Stage.OBJECT) -> PairedStage:
    """Return the comparison of two formulas on one far sphere."""
    first, second = (contender(name, precision=precision) for name in (base, candidate))
    (found,) = paired(SCENE, (stage,), first, [second], slots=("sphere",), seed=1)
    return found[stage]


def one_finding(pair: PairedStage) -> FamilyDifference:
    return finding("far", True, [{Stage.OBJECT: pair}], level=0.95, seed=1)


@pytest.mark.parametrize("precision", ["float32", "float64"])
def test_haines_keeps_three_digits_that_the_textbook_loses_a_thousand_radii_away(precision: str) -> None:
    pair = compared("sphere/textbook", "sphere/haines", precision=precision)

    assert pair.same_inputs
    assert 2.7 < pair.digits < 3.4
    assert np.nanquantile(pair.candidate.scaled, 0.99) <= 4  # K u: backward stable
    assert accuracy(one_finding(pair), alpha=0.05).all == {1}


def test_the_way_back_loses_what_the_way_there_gained() -> None:
    there, back = compared("sphere/textbook", "sphere/haines"), compared("sphere/haines", "sphere/textbook")

    assert back.digits == -there.digits
    assert back.only_candidate == there.only_base > 0


def test_a_formula_against_itself_shows_nothing() -> None:
    pair = compared("sphere/haines", "sphere/haines")

    assert (pair.digits, pair.only_base, pair.only_candidate) == (0, 0, 0)
    assert one_finding(pair).digits_interval == (0, 0)
    assert outcome([accuracy(one_finding(pair), alpha=0.05)], 0) == NOTHING


def test_a_formula_that_misses_what_is_there_is_worse_whatever_its_digits() -> None:
    pair = compared("sphere/haines", "sphere/fault_far_root")
    missing = compared("sphere/haines", "sphere/fault_center_ignored")

    assert accuracy(one_finding(pair), alpha=0.05).all == {-1}
    assert missing.pixels > 0


def test_both_precisions_receive_the_same_floats() -> None:
    scene = as_received(SCENE)

    assert as_received(scene) == scene
    assert np.array_equal(np.asarray(scene.camera.eye, dtype=np.float32), scene.camera.eye)


@pytest.fixture
def result(rayproof: Rayproof, tmp_path: Path) -> dict[str, Any]:
    arguments = ["far_sphere_1e3", "primitives", "--repetitions", 9, "--json", tmp_path / "c.json", "--out", tmp_path]
    ended = rayproof("compare", "sphere/textbook", "sphere/haines", *arguments)
    assert ended.code == 0
    assert ended.error == ""
    assert (tmp_path / "comparison.md").is_file()
    assert (tmp_path / "comparison.json").read_text() == (tmp_path / "c.json").read_text()
    found = json.loads((tmp_path / "c.json").read_text())
    assert ended.out.startswith(found["verdict"])
    return found


def test_the_record_has_the_promised_keys_and_its_control_beside_it(result: dict[str, Any]) -> None:
    assert "errs less" in result["verdict"]
    families = {one["family"]: one for one in result["families"]}
    assert families["far_sphere_1e3"]["digits_gained"] > 2.5
    for side in (result, result["control"]):
        low, high = side["digits_interval"]
        assert low <= side["digits_gained"] <= high
        assert side["time_interval"][0] <= side["time_ratio"] <= side["time_interval"][1]
        assert [one["family"] for one in side["families"]] == ["primitives", "far_sphere_1e3"]
    assert result["control"]["digits_gained"] == 0


@pytest.mark.references
def test_a_scene_file_is_compared_and_priced_as_run_takes_it(rayproof: Rayproof, tmp_path: Path) -> None:
    file, record = str(tmp_path / "mine.json"), tmp_path / "c.json"
    save_scene(SCENE, file)

    ended = rayproof("compare", "sphere/textbook", "sphere/haines", file, "--repetitions", 9, "--json", record)

    assert ended.code == 0
    (family,) = json.loads(record.read_text())["families"]
    assert family["family"] == "file/mine"
    assert family["digits_gained"] > 2.5
    formulas, _, _ = tasks((), files=scene_files([file])[1])
    assert [task.diagram for task in formulas] == ["sphere/file-mine"]
    broken = rayproof("tradeoff", tmp_path / "absent.json", "--out", tmp_path / "out")
    assert (broken.code, broken.error.count("\n")) == (2, 1)


CAMERA_SLOTS = ("basis", "half_extent", "ndc", "sample", "view", "inverse")


@pytest.mark.parametrize("slot", CAMERA_SLOTS)
def test_a_wrong_camera_formula_is_worse_in_the_rays(slot: str) -> None:
    default = FORMULAS.slots[slot]
    wrong = next(one for one in FORMULAS.variants(slot) if one.kind != "right")
    base, candidate = seen(*(contender(f"{slot}/{name}", precision="float32") for name in (default, wrong.variant)))
    scene = select(["primitives/sphere"])[0].scene

    stages = stages_at_stake(base.configuration, candidate.configuration)
    (found,) = paired(scene, stages, base, [candidate], slots=(slot,), seed=1)

    assert stages == (Stage.RAY,)
    assert found[Stage.RAY].digits < -2


@pytest.mark.parametrize(
    ("base", "candidate", "case", "stage"),
    [
        ("shadow_ray/normal_offset", "shadow_ray/none", "acne/contact", Stage.VISIBILITY),
        ("falloff/inverse_square", "falloff/none", "inverse_square", Stage.IRRADIANCE),
        ("world_normal/inverse_transpose", "world_normal/model_matrix", "normals", Stage.NORMAL),
        ("ray/reference_point", "ray/half_depth", "primitives/cube", Stage.RAY),
    ],
    ids=lambda value: str(value).replace("/", "-"),
)
def test_a_control_is_worse_at_its_own_stage(base: str, candidate: str, case: str, stage: Stage) -> None:
    first, second = (contender(name, precision="float32") for name in (base, candidate))
    scene = select([case])[0].scene

    (found,) = paired(scene, (stage,), first, [second], slots=(base.split("/")[0],), seed=1)

    pair = found[stage]
    if stage is Stage.VISIBILITY:
        assert pair.only_candidate > 10 * max(1, pair.only_base)
    else:
        assert pair.digits < -1


@pytest.mark.parametrize(
    ("signs", "word"),
    [
        (Signs(decisions=1, typical=-1, tail=0), MIXED),  # fewer wrong pixels, and 0.7 digits lost at a typical one
        (Signs(decisions=1, typical=0, tail=-1), MIXED),
        (Signs(decisions=1, typical=1, tail=0), "better"),
        (Signs(decisions=0, typical=0, tail=-1), "worse"),
        (Signs(decisions=0, typical=0, tail=0), NOTHING),
    ],
)
def test_the_verdict_follows_from_decisions_typical_pixel_and_tail(signs: Signs, word: str) -> None:
    assert outcome([signs], 0) == word


def test_on_a_shared_edge_the_default_decides_no_pixel_wrongly_and_a_leak_is_still_one() -> None:
    wrong = {}
    for name in (FORMULAS.variants("triangle")[0].name, "triangle/moeller_trumbore"):
        one = contender(name, precision="float32")
        wrong[name] = 0
        for case in select(["watertight/fans", "watertight/vertices"]):
            (found,) = paired(case.scene, (Stage.OBJECT,), one, [one], slots=("triangle",), seed=1)
            wrong[name] += found[Stage.OBJECT].both_wrong

    default, leaking = wrong.values()
    assert default == 0
    assert leaking > 20
