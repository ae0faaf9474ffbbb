"""One file holds every renderer's floats of a case, bit for bit, in an eighth of what EXR files take."""

import numpy as np
import pytest

from rayproof.cases.stages import Stage
from rayproof.reports.results.images import kept_images, read_pixels, write_pixels
from tests.reports.publish.sample import SCENE, answers


@pytest.fixture
def renders():
    """Return three renderers' answers, one with a stage less, one with special values."""
    odd = answers(rounding=1e-7)
    odd[Stage.RADIANCE][0, :4, 0] = (np.nan, np.inf, -0.0, 1e300)
    odd[Stage.OBJECT][3, 3] = np.nan
    less = answers(rounding=3e-7, seed=4)
    del less[Stage.IRRADIANCE]
    return {"tracer-float32": odd, "analytic": answers(), "</script>": less}


def test_every_bit_of_every_stage_comes_back(tmp_path, renders):
    back = read_pixels(write_pixels(tmp_path / "a.js", "a.js", renders, SCENE))

    assert list(back) == list(renders)
    for name, stages in renders.items():
        assert set(back[name]) == set(stages)
        with np.errstate(over="ignore"):
            for stage, image in stages.items():
                assert back[name][stage].tobytes() == image.astype(np.float32).tobytes(), (name, stage)


def test_one_renderer_is_read_as_it_is_among_all(tmp_path, renders):
    write_pixels(tmp_path / "a.js", "a.js", renders, SCENE)

    images, _ = kept_images(tmp_path, {"pixels": "a.js"}, only=("tracer-float32", "nobody", None))

    assert list(images) == ["tracer-float32"]
    everything, _ = kept_images(tmp_path, {"pixels": "a.js"})
    for stage, image in everything["tracer-float32"].items():
        assert images["tracer-float32"][stage].tobytes() == image.tobytes()


def test_a_renderer_a_few_roundings_away_adds_little(tmp_path):
    one = {"analytic": answers(width=80, height=60)}
    two = one | {"tracer-float32": answers(width=80, height=60, rounding=6e-8)}

    alone, both = (write_pixels(tmp_path / "a.js", "a", renders, SCENE).stat().st_size for renders in (one, two))

    assert both < 1.8 * alone
    assert both < 0.35 * 2 * 22 * 4 * 80 * 60


def test_a_case_that_keeps_one_file_is_read_like_one_that_keeps_many(tmp_path, renders):
    write_pixels(tmp_path / "a.js", "a.js", renders, SCENE)

    images, notes = kept_images(tmp_path, {"pixels": "a.js", "renders": [{"renderer": "analytic", "image": None}]})

    assert (set(images), notes) == (set(renders), [])
    assert kept_images(tmp_path, {"pixels": "../a.js"}) == ({}, ["../a.js is not in the results folder"])
