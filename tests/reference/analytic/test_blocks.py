"""A mesh that is looked at block by block, as large ones are, has the answers and edges of one looked at whole."""

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
    whole, edges = Analytic().render(scene, stages_of(scene)), Analytic().edges(scene)

    monkeypatch.setattr(surfaces, "BLOCK", 7)
    parts, some = Analytic().render(scene, stages_of(scene)), Analytic().edges(scene)

    for stage in whole:
        if stage is not Stage.CAMERA:
            np.testing.assert_array_equal(parts[stage], whole[stage])
    for kind in ("silhouette", "shadow", "terminator", "gap", "behind"):
        # Bounds are products of matrices, which round by how many rows they have.
        np.testing.assert_allclose(getattr(some, kind), getattr(edges, kind), rtol=1e-12, atol=1e-12)
