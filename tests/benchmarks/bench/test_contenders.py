"""Contenders of one process: what one of them sets for all does not disturb the others."""

import numpy as np
import pytest

from rayproof.cases.benchmark_scenes import chosen
from rayproof.tracer.configuration import Configuration
from tests.benchmarks.bench import CONTENDERS
from tests.benchmarks.bench.contenders import ours
from tests.benchmarks.bench.contenders.mitsuba import loaded
from tests.benchmarks.bench.document import everybody

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


def test_mitsubas_contenders_share_a_scene_and_its_variants_do_not() -> None:
    scene = chosen(("sphere_and_floor",), quick=True)[0].scene(16, 12)

    compiled, interpreted = loaded("llvm_ad_rgb", scene), loaded("scalar_rgb", scene)

    assert loaded("llvm_ad_rgb", scene)[0] is compiled[0]
    assert interpreted[0] is not compiled[0]


def test_the_formulas_that_are_asked_about_are_drawn_with_and_the_defaults_beside(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(ours._Ours, "asked_about", {})
    scene = chosen(("sphere_and_floor",), quick=True)[0].scene(16, 12)

    ours.ask_about(Configuration.parse("float32/sphere=textbook"))

    assert "textbook" in ours.Ours().prepare(scene).does
    assert "textbook" not in ours.OursByDefault().prepare(scene).does
    assert "ours_default" in everybody(quick=True, formulas=True)
    assert "ours_default" not in everybody(quick=True)
