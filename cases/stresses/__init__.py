"""Stressing scenes: ordinary scenes rank no two formulas; these do. Not judged by `rayproof run`.

Formulas that are right in mathematics may fail here in floating point, so these scenes have no limits to keep. They
are asked when two formulas are compared or priced. To add a family: a function without parameters that yields
(name, scene), in a new file, under `@STRESSES.register("family", slots=(...))`; `slots` are the tracer's slots whose
formulas it tells apart. Scenes of one family are replicates: the same difficulty, seen from elsewhere.
"""

from collections.abc import Callable, Iterator

from rayproof.cases.registry import Registry
from rayproof.cases.scene import Scene

STRESSES: Registry[Callable[[], Iterator[tuple[str, Scene]]]] = Registry("stress", package="rayproof.cases.stresses")

WIDTH, HEIGHT = 64, 48  # px
VIEWS = ((20.0, 30.0), (115.0, -25.0), (200.0, 55.0), (290.0, 5.0), (335.0, -50.0))  # degrees: azimuth, elevation


def stressing(slot: str) -> tuple[str, ...]:
    """Return the stress families that tell formulas of `slot` apart."""
    return tuple(name for name in STRESSES if slot in STRESSES.about(name)["slots"])
