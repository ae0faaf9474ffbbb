"""Contenders of one process: what one of them sets for all does not disturb the others."""

import numpy as np
import pytest

from rayproof.cases.benchmark_scenes import chosen
from tests.benchmarks.bench import CONTENDERS

pytestmark = pytest.mark.references


@pytest.mark.parametrize("name", ["mitsuba_minimal", "mitsuba_minimal_frozen", "mitsuba_direct", "ours"])
def test_a_contender_draws_the_same_after_mitsubas_scalar_variant_ran(name: str) -> None:
    scene = chosen(("sphere_and_floor",), quick=True)[0].scene(16, 12)
    prepared = CONTENDERS[name]().prepare(scene)
    prepared.run()
    before = None if prepared.image is None else np.array(prepared.image())

    CONTENDERS["mitsuba_scalar"]().prepare(scene).run()
    if prepared.ready is not None:
        prepared.ready()
    prepared.run()

    if prepared.image is not None:
        assert before is not None
        assert np.array_equal(prepared.image(), before)
