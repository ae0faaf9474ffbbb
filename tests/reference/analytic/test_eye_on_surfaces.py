"""An eye on a sphere's surface sees its inside, whose inverse depth must not be followed by a division by nothing."""

import numpy as np
import pytest

from rayproof.cases.families import select
from rayproof.cases.stages import Stage
from rayproof.reference.analytic import Analytic
from rayproof.reference.analytic.edges.hits import hits_of
from rayproof.reference.analytic.surfaces import Ellipsoid, surface_of


@pytest.mark.parametrize("name", ["random/1/110", "random/1/347", "random/1/366"])
def test_edges_are_told_from_pixels_far_away_where_the_eye_is_on_an_ellipsoid(name):
    (case,) = select([name])

    assert np.min(Analytic().edges(case.scene).silhouette) > 1e-3


@pytest.mark.parametrize(("name", "shape"), [("random/1/110", 0), ("random/1/347", 0), ("random/1/45", 2)])
def test_an_ellipsoid_seen_from_its_inside_is_as_deep_as_its_sheet_says(name, shape):
    (case,) = select([name])
    hits, generator = hits_of(case.scene), np.random.default_rng(7)
    surface = surface_of(case.scene.shapes[shape])
    assert isinstance(surface, Ellipsoid)
    rays = hits.of(shape)
    assert len(rays) > 100
    sheet, steps = hits.sheet[rays], np.stack([hits.view.across, hits.view.down])

    aside = generator.normal(size=(len(rays), 2))
    aside *= (sheet.radius * generator.uniform(0, 1, len(rays)) / np.linalg.norm(aside, axis=1))[:, np.newaxis]
    roots = surface.crossings(hits.view.eye, hits.directions[rays] + aside @ steps)
    depths = roots.max(axis=1)
    expected = sheet.value + (sheet.gradient * aside).sum(axis=1)

    error = sheet.bend * (aside**2).sum(axis=1) / 2
    assert np.all(np.abs(1 / depths - expected) <= error + 1e-9 * np.abs(sheet.value))
    assert np.all(hits.rows[Stage.OBJECT][rays, 0] == shape)
