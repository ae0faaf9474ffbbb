"""What conditioning allows a right computation, held against the lecture's formulas in the precision judged."""

import math

import numpy as np
import pytest

from rayproof.cases.families import select
from rayproof.cases.scene import Camera, Plane, Scene
from rayproof.cases.stages import Stage
from rayproof.reference import REFERENCES
from rayproof.reports.judge.forward.conditioning import condition
from rayproof.reports.judge.forward.limits import Roundoff, limits
from rayproof.reports.judge.measurement import error
from rayproof.reports.judge.oracle import ORACLE, stages_of


def lecture_rays(camera: Camera, number: type) -> np.ndarray:
    """Return CAM-3 and CAM-4 as printed, each operation rounded to `number`: the view's axes are exact here."""
    columns, rows = np.meshgrid(np.arange(camera.width), np.arange(camera.height))
    px, py = columns.astype(number) + number(0.5), rows.astype(number) + number(0.5)
    sx, sy = number(2) * px / number(camera.width) - 1, 1 - number(2) * py / number(camera.height)
    vertical = np.tan(number(math.radians(camera.fovy)) / number(2))
    horizontal = vertical * (number(camera.width) / number(camera.height))
    rays = np.stack([sx * horizontal, sy * vertical, np.full(px.shape, number(-1))], axis=-1)
    return rays / np.sqrt(np.sum(rays * rays, axis=-1, keepdims=True))


@pytest.mark.parametrize("precision", ["float32", "float64"])
@pytest.mark.parametrize(
    ("width", "height", "fovy"), [(200, 1, 45.0), (3001, 3, 90.0), (1, 200, 170.0), (401, 7, 175.0), (48, 36, 30.0)]
)
def test_the_pixels_coordinates_are_off_by_roundings_of_one_however_near_the_axis(width, height, fovy, precision):
    eye, target, up = (0.0, 0.0, 1.0), (0.0, 0.0, 0.0), (0.0, 1.0, 0.0)
    camera = Camera(eye=eye, target=target, up=up, fovy=fovy, width=width, height=height, near=0.1, far=9.0)
    scene = Scene(camera=camera, shapes=(Plane(albedo=(1.0, 1.0, 1.0)),), lights=())
    stages = (Stage.RAY, Stage.OBJECT, Stage.DISTANCE, Stage.POSITION, Stage.NORMAL)
    truth = REFERENCES[ORACLE]().render(scene, stages)

    exact = lecture_rays(camera, np.longdouble)
    ours = lecture_rays(camera, np.dtype(precision).type)
    limit = limits(scene, truth, condition(scene, truth), Roundoff(precision), by_matrices=False)

    off = error(Stage.RAY, np.asarray(ours, np.longdouble), exact) / limit.end_to_end[Stage.RAY]
    assert off.max() <= 1


@pytest.mark.parametrize(
    ("name", "pixel", "measured", "how"),
    [
        ("random/42011/179", (3, 2), 26.5e-6, "local"),
        ("random/84007/166", (26, 44), 185e-6, "local"),
        ("random/73001/78", (31, 7), 689e-6, "short"),
    ],
    ids=["off-its-ray", "put-back-along-a-flat-side", "solved-for-from-afar"],
)
def test_a_hit_taken_from_the_object_space_of_an_ellipsoid_is_off_by_the_errors_of_that_space(
    name, pixel, measured, how
):
    # So far off was Mitsuba in that pixel: across the ray, along the surface, and along the ray, in LLVM alone.
    (case,) = select([name])
    oracle, (column, row) = REFERENCES[ORACLE](), pixel
    truth = oracle.render(case.scene, stages_of(case.scene))
    amplified = condition(case.scene, truth)

    def limit(**ways: bool) -> float:
        found = limits(case.scene, truth, amplified, Roundoff("float32", **ways), by_matrices=False)
        return float(found.end_to_end[Stage.POSITION][row, column])

    assert limit() < measured < limit(**{how: True}) < 20 * measured
