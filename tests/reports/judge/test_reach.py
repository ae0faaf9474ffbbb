"""How far rounding reaches: not so far that what it cannot change is left undecided."""

import math
from dataclasses import replace

import numpy as np
import pytest

from rayproof.cases.families import select
from rayproof.reports.judge.channels import any_of
from rayproof.reports.judge.conditioning import basis_condition, ray_condition
from rayproof.reports.judge.ground import ground
from rayproof.reports.judge.oracle import stages_of
from rayproof.reports.judge.terms import Terms
from tests.reports.judge.scenes import CAMERA, ORACLE, candidate, witness


def test_a_light_near_a_cubes_planes_leaves_most_of_it_decided():
    # A hit slides along its side by 4e-5 of the light's distance, and is off it by far less.
    (case,) = select(["random/1/109"])
    base = ground(case.scene, stages_of(case.scene), ORACLE, known={})
    ours = replace(candidate(base.truth), shadow_epsilon=0.0)

    terms = Terms(ground=base, candidate=ours, witness=witness(base.truth))

    assert np.mean(any_of(terms.classes.light)) < 0.5


@pytest.mark.parametrize("fovy", [120.0, 170.0, 179.0])
def test_the_axes_error_turns_no_ray_of_a_wide_view_much_farther_than_themselves(fovy):
    camera = replace(CAMERA, eye=(300.0, 400.0, 500.0), target=(300.1, 400.1, 500.0), fovy=fovy)
    generator, worst = np.random.default_rng(1), 0.0
    for _ in range(1000):
        a, b = math.tan(camera.alpha) * generator.uniform(-1, 1, 2) * (camera.aspect, 1)
        axes = np.eye(3) + 1e-7 * generator.uniform(-1, 1, (3, 3))
        exact, off = np.array([a, b, 1.0]), axes @ [a, b, 1.0]
        turned = np.linalg.norm(np.cross(exact, off)) / np.linalg.norm(exact) / np.linalg.norm(off)
        worst = max(worst, turned / 1e-7 / math.sqrt(3))  # an axis is off by sqrt(3) 1e-7 at most

    assert worst <= 2
    assert ray_condition(camera) <= 2.1 * basis_condition(camera)


def test_where_clipping_cuts_a_surface_near_the_eye_its_outline_is_an_edge():
    # The eye is 4e-8 m off a triangle, which clipping hides up to 1e-3 m: Mitsuba's float32 sees it a pixel on.
    (case,) = select(["random/2/18"])
    base = ground(case.scene, stages_of(case.scene), ORACLE, known={})

    terms = Terms(ground=base, candidate=candidate(base.truth), witness=witness(base.truth))

    assert terms.classes.outline[9, 28]
    assert np.mean(terms.classes.outline) < 0.05
