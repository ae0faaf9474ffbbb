"""A mesh that is looked at block by block, as large ones are, has the answers of one looked at whole."""

from dataclasses import replace

import numpy as np
import pytest

from rayproof.cases.families import select
from rayproof.cases.stages import Stage
from rayproof.reference.analytic import Analytic, surfaces
from rayproof.reports.judge.oracle import stages_of


@pytest.mark.parametrize("name", ["meshes/divided_box", "meshes/torus"])
def test_blocks_change_nothing(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    scene = select([name])[0].scene
    scene = replace(scene, lights=scene.lights[:1])
    whole = Analytic().render(scene, stages_of(scene))

    monkeypatch.setattr(surfaces, "BLOCK", 7)
    parts = Analytic().render(scene, stages_of(scene))

    for stage in whole:
        if stage is not Stage.CAMERA:
            np.testing.assert_array_equal(parts[stage], whole[stage])
