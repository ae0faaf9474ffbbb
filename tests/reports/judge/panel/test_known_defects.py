"""Findings name scenes and commands that are there, and the scenes show what the findings say."""

import json
import shlex
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rayproof.cases.scene_json import load_scene
from rayproof.cases.stages import Stage
from rayproof.reference import REFERENCES
from rayproof.reference.analytic import Analytic
from rayproof.reports.judge import known_defects
from rayproof.reports.judge.known_defects import KnownFinding, explained, known_findings
from rayproof.reports.judge.oracle import stages_of
from rayproof.reports.results.outcomes import Outcome
from rayproof.reports.run import totals
from rayproof.reports.subjects.image_files import read_pfm
from tests.reports.judge.scenes import SCENE, rounded, truth, verdict, witness

ROOT = Path(__file__).parents[4]
FINDING = KnownFinding(
    name="bright",
    reference="second",
    version="",
    stage=Stage.RADIANCE,
    where="center_over_hit",
    at_least=0.1,
    smallest_scene="none.json",
    command="rayproof run none.json",
    third_witness="analytic",
    what="It is too bright.",
)


ON_THE_BALL = np.where(truth()[Stage.OBJECT][..., :1] == 0, 1.01, 1.0)
ABOUT_PLAIN_MITSUBA = [one for one in known_findings() if "exec:" in one.command]
(ABOUT_MITSUBA_LLVM,) = [one for one in known_findings() if one.where == "light_nearness"]
ABOUT_LARGE_SPHERES = [one for one in known_findings() if one.where == "center_over_hit"]
ABOUT_SHARED_EDGES = [one for one in known_findings() if one.where == "edge_nearness"]


@pytest.mark.process
@pytest.mark.parametrize("one", ABOUT_PLAIN_MITSUBA, ids=lambda one: one.name)
def test_a_finding_is_shown_by_its_smallest_scene(one, tmp_path):
    scene = load_scene(ROOT / one.smallest_scene)
    program = ROOT / "examples/findings/plain_mitsuba.py"
    words = shlex.split(one.command)
    assert words[:3] == ["rayproof", "run", one.smallest_scene]
    assert program.relative_to(ROOT).as_posix() in words[-1]
    image = tmp_path / "image.pfm"

    subprocess.run([sys.executable, program, ROOT / one.smallest_scene, image], check=True, capture_output=True)

    ours = read_pfm(image.read_bytes(), width=scene.camera.width, height=scene.camera.height)
    theirs = Analytic().render(scene, [Stage.RADIANCE])[Stage.RADIANCE]
    off = np.abs(ours - theirs).max(axis=-1) > 0.01 * theirs.max()
    assert np.count_nonzero(off) > 50


@pytest.mark.references
def test_mitsuba_has_no_number_where_a_light_lies_on_what_is_seen():
    place = ABOUT_MITSUBA_LLVM.smallest_scene
    assert ABOUT_MITSUBA_LLVM.command == f"rayproof run {place} --subject mitsuba_llvm"
    scene = load_scene(ROOT / place)

    compiled, plain = (
        REFERENCES[name]().render(scene, [Stage.RADIANCE])[Stage.RADIANCE]
        for name in ("mitsuba_llvm", "mitsuba_scalar")
    )

    assert np.isnan(compiled).any()
    assert np.isfinite(plain).all()


@pytest.mark.references
@pytest.mark.parametrize("name", ["mitsuba_llvm", "mitsuba_scalar"])
def test_a_large_sphere_blocks_its_own_light_near_the_origin(name):
    findings = [finding for finding in ABOUT_LARGE_SPHERES if finding.reference == name]
    ((place, command),) = {(finding.smallest_scene, finding.command) for finding in findings}
    assert command == f"rayproof run {place} --subject {name}"
    scene = load_scene(ROOT / place)

    lit, seen = (
        REFERENCES[other]().render(scene, [Stage.VISIBILITY])[Stage.VISIBILITY] for other in (name, "radiance")
    )

    truth = Analytic().render(scene, stages_of(scene))
    assert np.all(truth[Stage.VISIBILITY] == 1)
    assert np.all(seen == 1)
    assert np.count_nonzero(lit == 0) >= 5
    assert {finding.stage for finding in findings} == {
        finding.stage for finding in findings if finding.covers(scene, truth, lit[..., 0] == 0)
    }


@pytest.mark.references
def test_radiance_misses_a_mesh_where_rays_go_through_its_vertices():
    ((place, command, name),) = {
        (finding.smallest_scene, finding.command, finding.reference) for finding in ABOUT_SHARED_EDGES
    }
    assert command == f"rayproof run {place} --subject {name}"
    scene = load_scene(ROOT / place)
    truth = Analytic().render(scene, stages_of(scene))

    seen = {
        other: REFERENCES[other]().render(scene, [Stage.OBJECT])[Stage.OBJECT][..., 0]
        for other in (name, "mitsuba_scalar")
    }

    holes = (seen[name] != truth[Stage.OBJECT][..., 0]) & (truth[Stage.OBJECT][..., 0] == 0)
    assert np.count_nonzero(holes) >= 2
    assert np.array_equal(seen["mitsuba_scalar"], truth[Stage.OBJECT][..., 0])
    assert all(finding.covers(scene, truth, holes) for finding in ABOUT_SHARED_EDGES)
    assert {finding.stage for finding in ABOUT_SHARED_EDGES} == {*Stage} - {Stage.CAMERA, Stage.RAY}


def test_a_finding_explains_its_version_stage_and_circumstances_only(monkeypatch):
    monkeypatch.setattr(known_defects, "known_findings", lambda: (replace(FINDING, version="1"),))
    ball = truth()[Stage.OBJECT][..., 0] == 0

    def found(reference: str, version: str, stage: Stage, pixels: np.ndarray) -> bool:
        return explained(reference, version, stage, SCENE, truth(), pixels) is not None

    assert found("second", "1", Stage.RADIANCE, ball)
    assert not found("second", "2", Stage.RADIANCE, ball)
    assert not found("second", "1", Stage.NORMAL, ball)
    assert not found("third", "1", Stage.RADIANCE, ball)
    assert not found("second", "1", Stage.RADIANCE, ball | (truth()[Stage.OBJECT][..., 0] == 1)), "the floor is no ball"
    assert not found("second", "1", Stage.RADIANCE, ~ball & False), "nothing differs"
    monkeypatch.setattr(known_defects, "known_findings", lambda: (replace(FINDING, version="1", at_least=100.0),))
    assert not found("second", "1", Stage.RADIANCE, ball)


def test_a_suspect_that_a_finding_explains_is_a_warning_and_counted_as_met(monkeypatch):
    monkeypatch.setattr(known_defects, "known_findings", lambda: (FINDING,))
    monkeypatch.setattr(totals, "known_findings", lambda: (FINDING,))
    bright = truth() | {Stage.RADIANCE: truth()[Stage.RADIANCE] * ON_THE_BALL}

    judged = verdict(rounded(truth()), witness(bright, name="second"))

    assert judged.outcome is Outcome.WARN
    checks = [check.recorded() for check in judged.checks]
    about = {"name": "test/ball", "family": "test", "verdict": "warn", "covers": [], "ran": {}, "planned": len(checks)}
    (entry,) = totals.of([about | {"checks": checks}]).findings
    assert entry["met"] == ["test/ball float32 second radiance"]
    assert json.dumps(entry)
