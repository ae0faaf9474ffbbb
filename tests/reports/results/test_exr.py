"""EXR files carry every stage, bit for bit, under the specification's names."""

import numpy as np
import OpenEXR
import pytest

from rayproof.cases.stages import IMAGE_STAGES, Stage, exr_channels
from rayproof.reports.results.images import read_answers, write_answers
from tests.reports.publish.sample import answers


def test_what_is_read_is_what_was_written_rounded_once(tmp_path):
    written = answers()
    written[Stage.RADIANCE][0, 0] = (np.nan, np.inf, -0.0)

    found = read_answers(write_answers(tmp_path / "a.exr", written, 2))

    assert set(found) == set(IMAGE_STAGES)
    for stage, image in found.items():
        assert image.dtype == np.float32
        assert image.tobytes() == written[stage].astype(np.float32).tobytes()


def test_channels_have_the_names_of_the_specification(tmp_path):
    path = write_answers(tmp_path / "a.exr", answers(), 2)

    with OpenEXR.File(str(path), separate_channels=True) as file:
        names = set(file.channels())

    assert names == {name for stage in IMAGE_STAGES for name in exr_channels(stage, lights=2)}
    assert {"R", "G", "B", "visibility.1", "face.V", "normal.Z"} <= names


def test_the_camera_stage_and_visibility_without_lights_are_left_out(tmp_path):
    written = answers()
    written[Stage.VISIBILITY] = written[Stage.VISIBILITY][..., :0]

    found = read_answers(write_answers(tmp_path / "a.exr", {Stage.CAMERA: {}, **written}, 0))

    assert set(found) == set(IMAGE_STAGES) - {Stage.VISIBILITY}


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        pytest.param({Stage.NORMAL: np.zeros((2, 3, 2))}, "normal must have shape", id="channels"),
        pytest.param({Stage.NORMAL: np.zeros((2, 3, 3)), Stage.DISTANCE: np.zeros((3, 3, 1))}, "one size", id="sizes"),
        pytest.param({}, "got none", id="nothing"),
    ],
)
def test_answers_that_are_no_image_are_refused_and_leave_no_file(tmp_path, wrong, message):
    with pytest.raises(ValueError, match=message):
        write_answers(tmp_path / "a.exr", wrong, 0)

    assert not list(tmp_path.iterdir())
