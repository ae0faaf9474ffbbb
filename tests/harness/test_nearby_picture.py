"""The picture of two disputed pixels is drawn from the judge's own answers."""

import numpy as np
import pytest

from rayproof.cases.stages import Stage
from tests.harness.nearby_picture import CHANNEL, OUTLINE, PICTURE, VERTEX, disputed


@pytest.mark.parametrize(("name", "column", "row", "objects"), [(*OUTLINE, 2), (*VERTEX, 6)])
def test_the_tracer_has_the_value_of_a_nearby_problem_and_the_mean_is_between_two(name, column, row, objects) -> None:
    pixel = disputed(name, column, row)  # raises unless the judge says so

    radiances = pixel.cloud.rows[Stage.RADIANCE][:, 0, CHANNEL]
    assert len(pixel.objects) == objects
    assert sum(np.count_nonzero(hits) for hits in pixel.objects.values()) == len(radiances) > 1000
    assert abs(pixel.value - pixel.oracle) > pixel.limit
    assert np.abs(radiances - pixel.value).min() <= pixel.limit < np.abs(radiances - pixel.mean).min()
    assert np.all(np.isfinite(pixel.points))


def test_the_picture_is_small() -> None:
    assert 10_000 < PICTURE.stat().st_size < 150_000
