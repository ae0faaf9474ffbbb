"""The mask shown to people is the classes that judging goes by."""

from types import SimpleNamespace
from typing import Any

import numpy as np

from rayproof.reports.judge.pixel_classes import FLAGGED, SHADOW, SILHOUETTE, TERMINATOR, mask


def test_each_kind_has_its_bit_and_an_undecided_light_goes_to_the_nearer_edge():
    none = np.zeros((1, 4), bool)
    outline, flagged = none.copy(), none.copy()
    outline[0, 0] = flagged[0, 3] = True
    light = np.array([[[True], [True], [False], [False]]])
    edges: Any = SimpleNamespace(
        silhouette=np.ones((1, 4)), shadow=np.array([[[0.1], [9.0], [0.0], [0.0]]]), terminator=np.ones((1, 4, 1))
    )
    classes: Any = SimpleNamespace(outline=outline, light=light, reach=np.ones((1, 4)), flagged=flagged)

    assert mask(classes, edges).tolist() == [[SILHOUETTE | SHADOW, TERMINATOR, 0, FLAGGED]]


def test_a_scene_without_lights_has_silhouettes_alone():
    dark = np.zeros((2, 2, 0))
    classes: Any = SimpleNamespace(
        outline=np.ones((2, 2), bool), light=dark > 0, reach=np.ones((2, 2)), flagged=np.zeros((2, 2), bool)
    )

    edges: Any = SimpleNamespace(silhouette=np.ones((2, 2)), shadow=dark, terminator=dark)

    found = mask(classes, edges)

    assert found.tolist() == [[SILHOUETTE] * 2] * 2
