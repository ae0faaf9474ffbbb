"""Which pixels are near an edge, as one small image for people: the classes that judging goes by, kind by kind."""

from typing import TYPE_CHECKING

import numpy as np

from rayproof.reports.judge.tolerance.channels import any_of

if TYPE_CHECKING:
    from rayproof.reports.judge.tolerance.edges import Edges
    from rayproof.reports.judge.tolerance.pixel_classes import Classes

# Bits of a mask; a pixel may be several things.
SILHOUETTE, SHADOW, TERMINATOR, FLAGGED = 1, 2, 4, 8
NAMES = {SILHOUETTE: "silhouette", SHADOW: "shadow edge", TERMINATOR: "terminator", FLAGGED: "light on the surface"}


def mask(classes: "Classes", edges: "Edges") -> np.ndarray:
    """Return uint8 (height, width): the bits of each pixel that may differ; 0 for what is judged strictly.

    A pixel that a light leaves undecided is a shadow edge or a terminator by which of the two is nearer.
    """
    found = np.zeros(classes.outline.shape, np.uint8)
    found[classes.outline] |= SILHOUETTE
    found[classes.flagged] |= FLAGGED
    if classes.light.shape[-1]:
        shadow = edges.shadow < edges.terminator
        found[any_of(classes.light & shadow)] |= SHADOW
        found[any_of(classes.light & ~shadow)] |= TERMINATOR
    return found
