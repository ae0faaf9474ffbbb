"""Hostile features of random scenes: each a function that changes a draft in place.

To add one: a function of a `Draft`, in a file of this folder, under `@FEATURES.register("name", step=..., what=...)`.
`step` says when it is its turn; `what` is the sentence that a reader gets; of several of one `group` a scene has one at
most; `bare=True` says that it needs no shape. A scene that is already numbered must stay what it is: a new feature
changes which scenes have which, so that it comes with a new major number of `cases.random.EDITION`.
"""

from collections.abc import Callable
from enum import IntEnum

from rayproof.cases.random.draft import Draft
from rayproof.cases.registry import Registry

FEATURES: Registry[Callable[[Draft], None]] = Registry(
    "feature of random scenes", package="rayproof.cases.random.features"
)


class Step(IntEnum):
    """The order in which features are applied: what is looked at or lit has to be there first."""

    SHAPES = 0
    PLACES = 1
    LIGHTS = 2
    CAMERA = 3
    WHOLE = 4
