"""Planted faults of the feeler formulas, for the audit; never in use unless named."""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.feelers import FEELERS
from rayproof.tracer.rays import Hit, Start


@FEELERS.register(
    "feeler/fault_bare",
    covers=("LIT-5",),
    kind="fault",
    stage=Stage.VISIBILITY,
    doubles=False,
    epsilon=lambda clearance: clearance,
)
def fault_bare(hit: Hit, cosine: Any, reach: Any) -> Start:
    """Return the hit point as it is.

    No strategy against shadow acne.
    """
    return Start(origin=hit.position)


@FEELERS.register(
    "feeler/fault_inward",
    covers=("LIT-5",),
    kind="fault",
    says="starts its shadow rays below the surface",
    stage=Stage.VISIBILITY,
    doubles=False,
    epsilon=lambda clearance: clearance,
)
def fault_inward(hit: Hit, cosine: Any, reach: Any) -> Start:
    """Return a start below the surface.

    The offset to the wrong side of the surface.
    """
    return Start(origin=dr.fma(hit.normal, -hit.clearance, hit.position))


@FEELERS.register(
    "feeler/fault_wide_offset",
    covers=("LIT-5",),
    kind="fault",
    stage=Stage.VISIBILITY,
    doubles=False,
    epsilon=lambda clearance: clearance,
)
def fault_wide_offset(hit: Hit, cosine: Any, reach: Any) -> Start:
    """Return a start 1 cm above the surface.

    An offset of a centimetre, whatever the scene: contact shadows are lost.
    """
    return Start(origin=dr.fma(hit.normal, 0.01, hit.position))


@FEELERS.register(
    "horizon/fault_never",
    covers=("LIT-1",),
    kind="fault",
    says="does not ask whether a light is above the horizon of the surface",
    stage=Stage.VISIBILITY,
)
def fault_never(cosine: Any) -> Any:
    """Return False everywhere.

    Lights below the horizon counted as seen.
    """
    return (cosine < 0) & (cosine > 0)


@FEELERS.register(
    "horizon/fault_reversed",
    covers=("LIT-1",),
    kind="fault",
    says="asks the wrong way round whether a light is above the horizon",
    stage=Stage.VISIBILITY,
)
def fault_reversed(cosine: Any) -> Any:
    """Return where the light is above the horizon.

    The horizon's sign turned round.
    """
    return cosine > 0


@FEELERS.register(
    "obstructed/fault_nearer_than_light",
    covers=("LIT-1",),
    kind="fault",
    says="lets only the nearer half of the way to a light be blocked",
    stage=Stage.VISIBILITY,
)
def fault_nearer_than_light(distance: Any) -> Any:
    """Return where something is met before the middle of the feeler.

    A hit counted only in the first half of the way to the light.
    """
    return distance < 0.5


@FEELERS.register("obstructed/fault_never", covers=("LIT-1",), kind="fault", stage=Stage.VISIBILITY)
def fault_obstructed_never(distance: Any) -> Any:
    """Return False everywhere.

    The feeler missing: every light above the horizon is seen.
    """
    return (distance < 0) & (distance > 0)


@FEELERS.register(
    "segment/fault_long",
    covers=("LIT-1",),
    kind="fault",
    says="lets its shadow rays run 15 % farther than the light",
    stage=Stage.VISIBILITY,
    bounded=True,
    cases=("along_the_way/behind_the_light",),
)
def fault_long(origin: Any, light: Any) -> tuple[Any, Any]:
    """Return the direction light - origin, and an end of 1.15 where the light stands at 1.

    Feelers that end behind the light, at 1.15 of the way.
    """
    return light - origin, 1.15


@FEELERS.register(
    "segment/fault_short",
    covers=("LIT-1",),
    kind="fault",
    says="lets its shadow rays end 10 % before the light",
    stage=Stage.VISIBILITY,
    bounded=True,
    cases=("along_the_way/before_the_light",),
)
def fault_short(origin: Any, light: Any) -> tuple[Any, Any]:
    """Return the direction light - origin, and an end of 0.9 where the light stands at 1.

    Feelers that end before the light, at 0.9 of the way.
    """
    return light - origin, 0.9
