"""Ladders of shadow rays: starts on floors and balls, and lids near them that block."""

from typing import Any

import numpy as np

from rayproof.cases.ladders import Draw, Failure, Gate, Inputs, Ladder, across, directions, rounded
from rayproof.cases.ladders.light import slanted
from rayproof.cases.placement import unit


# Draws. Hit points with a light and a blocker; ways to a light; normals.
def floors(*, scale: float = 1.0, gap: float = 1e-3, offset: float = 0.0, cosine: float = 0.0, swept: str = "") -> Draw:
    """Return a draw of hits on randomly turned planes, seen and lit from random sides; `swept` is the swept argument.

    A unit of length is `scale`; the blocker is `gap` above; everything is moved by `offset`; a `cosine` of 0 means
    random angles of view and of light, 0.2 to 1.
    """

    def draw(value: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
        now = {"scale": scale, "gap": gap, "offset": offset, "cosine": cosine} | ({swept: value} if swept else {})
        normal = rounded(directions(count, generator), precision)
        upright = unit(normal)
        anchor = directions(count, generator)
        # The plane's point is not the hit but an anchor elsewhere in the plane, as in any scene. Its distance
        # determines the error of o + t d.
        hit = anchor + across(upright, generator) * generator.uniform(0, 4, (count, 1))
        slopes = [
            generator.uniform(0.2, 1, count) if now["cosine"] == 0 else np.full(count, now["cosine"]) for _ in "ab"
        ]
        eye = hit + slanted(upright, slopes[0], generator) * generator.uniform(2, 4, (count, 1))
        light = hit + slanted(upright, slopes[1], generator) * generator.uniform(2, 4, (count, 1))
        shift = now["offset"] * directions(1, generator)
        origin = rounded((eye + shift) * now["scale"], precision)
        aimed = (hit + shift) * now["scale"] - origin
        return {
            "o": origin,
            "d": rounded(unit(aimed), precision),
            "point": rounded((anchor + shift) * now["scale"], precision),
            "normal": normal,
            "gap": np.full(count, rounded(np.array(now["gap"] * now["scale"]), precision)),
            "light": rounded((light + shift) * now["scale"], precision),
        }

    return draw


def lids(share: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
    """Return hits on planes, and blockers parallel to them, at `share` of the way's height before or behind the light.

    The blocker's anchor is above the plane's own point, so that a formula has to compute its distance.
    """
    drawn = floors()(0.0, count, generator, precision)
    height = np.sum((drawn["light"] - drawn["point"]) * drawn["normal"], axis=1)
    side = np.where(generator.random(count) < 0.5, -1.0, 1.0)
    above = (height * (1 + side * share))[:, None] * drawn["normal"]
    return drawn | {
        "blocker": rounded(drawn["point"] + above / np.sum(drawn["normal"] ** 2, axis=1)[:, None], precision)
    }


def balls(*, scale: float = 1.0, gap: float = 1e-3, offset: float = 0.0, swept: str = "") -> Draw:
    """Return a draw of hits on spheres of radius `scale`, likewise; the blocker is a plane across the normal."""

    def draw(value: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
        now = {"scale": scale, "gap": gap, "offset": offset} | ({swept: value} if swept else {})
        outward = directions(count, generator)
        center = now["offset"] * directions(1, generator) * np.ones((count, 1))
        hit = center + outward
        slopes = [generator.uniform(0.2, 1, count) for _ in "ab"]
        eye = hit + slanted(outward, slopes[0], generator) * generator.uniform(2, 4, (count, 1))
        light = hit + slanted(outward, slopes[1], generator) * generator.uniform(2, 4, (count, 1))
        origin = rounded(eye * now["scale"], precision)
        aimed = hit * now["scale"] - origin
        return {
            "o": origin,
            "d": rounded(unit(aimed), precision),
            "c": rounded(center * now["scale"], precision),
            "r": np.full(count, rounded(np.array(now["scale"]), precision)),
            "point": rounded(hit * now["scale"], precision),
            "normal": rounded(outward, precision),
            "gap": np.full(count, rounded(np.array(now["gap"] * now["scale"]), precision)),
            "light": rounded(light * now["scale"], precision),
        }

    return draw


# The ladders.
NO_K = "none: lit or not"
BOUNDED = ("normal_offset", "error_bound", "minimum_t", "doubles")

BELOW = Failure(formulas=("none",), because="half of all hits lie below their surface")
FIXED = ("fixed_minimum_t", "fixed_offset")
TOO_LONG = Failure(formulas=FIXED, because="one length for every scale")
TOO_SHORT = Failure(formulas=FIXED, because="one length for every scale", precisions=("float32",))
ABSOLUTE = Failure(
    formulas=("mitsuba", "waechter_binder"),
    because="an offset that is absolute near the origin",
    precisions=("float32",),
)
BY_DISTANCE = Failure(
    formulas=("relative_minimum_t",), because="grows with the distance from the origin, not with size"
)


def _reached(*others: str) -> Failure:
    """Return the failure of the strategies that clear a hit's rounding, and of `others`, if that exceeds the gap."""
    return Failure(
        formulas=("normal_offset", "error_bound", "minimum_t", "mitsuba", "waechter_binder", *others),
        because="the offset, or what rounding does to the hit, reaches the gap",
        precisions=("float32",),
    )


def _shadow_ray(**about: Any) -> Ladder:
    fields: dict[str, Any] = {
        "group": "light and shadow",
        "question": "shadow",
        "slots": ("shadow_ray",),
        "unit": "acne and leaks, rays",
        "condition": NO_K,
        "kind": "count",
        "rays": 20_000,
        "quick_rays": 2_000,
    }
    last = about["values"][-1]
    # The strategies that bound the error may fail in no ray of 20 000, the others in a few.
    gate: Any = Gate(reaches={"float32": last, "float64": last}, misclassified=2e-4, faultless=BOUNDED)
    return Ladder(**({"gate": gate} | fields | about))


LADDERS = (
    _shadow_ray(
        name="SHD-GROW",
        parameter="scale of the scene [m], gap 1e-3 of it",
        values=(1.0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6),
        draw=floors(swept="scale"),
        fails=(BELOW, TOO_SHORT),
        first_to_break="shadow_ray/none, fixed_minimum_t, fixed_offset",
        survivor="shadow_ray/error_bound",
        measured="predicted: 0.005 to 0.4 % acne for waechter_binder; 0.005 % measured with planes anchored up to 4 "
        "scales away, and none with anchors nearer",
    ),
    _shadow_ray(
        name="SHD-SHRINK",
        parameter="scale of the scene [m], gap 1e-3 of it",
        values=(1.0, 1e-1, 1e-2, 1e-3, 1e-4, 1e-6),
        draw=floors(swept="scale"),
        fails=(BELOW, TOO_LONG, ABSOLUTE),
        first_to_break="shadow_ray/none, fixed_minimum_t, fixed_offset, mitsuba, waechter_binder",
        survivor="shadow_ray/error_bound",
    ),
    _shadow_ray(
        name="SHD-FAR",
        parameter="distance of the scene from the world's origin [m], gap 1e-3 m",
        values=(0.0, 1e1, 1e2, 1e3, 1e4),
        draw=floors(swept="offset"),
        fails=(BELOW, _reached(*FIXED), BY_DISTANCE),
        first_to_break="shadow_ray/relative_minimum_t, mitsuba",
        survivor="none where u T reaches the gap: the information is gone",
        measured="predicted: the error bound leaks 4 % at 1e2 and 82 % at 1e3; 0 and 100 % measured, the "
        "clearance being twice as tight at first and never clipped",
    ),
    _shadow_ray(
        name="SHD-GAP",
        parameter="gap [m] at scale 1 m",
        values=(1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6),
        draw=floors(swept="gap"),
        fails=(BELOW, _reached(), Failure(formulas=(*FIXED, "relative_minimum_t"), because="one length for every gap")),
        first_to_break="shadow_ray/fixed_minimum_t, mitsuba",
        survivor="shadow_ray/error_bound down to 1e-4",
    ),
    _shadow_ray(
        name="SHD-GRAZE",
        parameter="cosine of view and of light",
        values=(0.5, 1e-1, 3e-2, 1e-2, 3e-3, 1e-3),
        draw=floors(swept="cosine"),
        fails=(
            Failure(
                formulas=("relative_minimum_t",),
                because="too short where light and view graze: the error along the ray is a height over the cosine",
                precisions=("float32",),
            ),
            BELOW,
            Failure(
                formulas=("error_bound",), because="the box around o + t d grows as 1 / cos", precisions=("float32",)
            ),
        ),
        first_to_break="shadow_ray/none",
        survivor="shadow_ray/normal_offset",
    ),
    _shadow_ray(
        name="SHD-BALL-GROW",
        parameter="radius of a sphere [m], gap 1e-3 of it",
        values=(1.0, 1e2, 1e4, 1e6),
        draw=balls(swept="scale"),
        options={"surface": "sphere"},
        fails=(BELOW, TOO_SHORT),
        first_to_break="shadow_ray/none",
        survivor="shadow_ray/error_bound, normal_offset",
    ),
    _shadow_ray(
        name="SHD-BALL-SHRINK",
        parameter="radius of a sphere [m], gap 1e-3 of it",
        values=(1.0, 1e-2, 1e-4, 1e-6),
        draw=balls(swept="scale"),
        options={"surface": "sphere"},
        fails=(BELOW, TOO_LONG, ABSOLUTE),
        first_to_break="shadow_ray/none",
        survivor="shadow_ray/error_bound, normal_offset",
    ),
    _shadow_ray(
        name="SHD-BALL-FAR",
        parameter="distance of the sphere from the world's origin [r], gap 1e-3 r",
        values=(0.0, 1e1, 1e2, 1e3),
        draw=balls(swept="offset"),
        options={"surface": "sphere"},
        fails=(BELOW, _reached("fixed_minimum_t"), BY_DISTANCE),
        first_to_break="shadow_ray/none",
        survivor="shadow_ray/error_bound",
    ),
    _shadow_ray(
        name="SHD-BALL-REPROJECTED",
        parameter="distance of the sphere from the world's origin [r], gap 1e-3 r, points reprojected",
        values=(0.0, 1e1, 1e2, 1e3),
        draw=balls(swept="offset"),
        options={"surface": "sphere", "reprojected": True},
        fails=(BELOW, _reached("fixed_minimum_t"), BY_DISTANCE),
        first_to_break="shadow_ray/none",
        survivor="shadow_ray/error_bound",
        measured="predicted: reprojection clean up to 1e3; the clearance that a strategy gets does not know of "
        "it, and leaks all the same at 1e3",
    ),
    _shadow_ray(
        name="SHD-SELF",
        parameter="gap [m] between a point and another part of the same shape, which is in the way",
        values=(1e-1, 1e-2, 2e-3),
        draw=floors(swept="gap"),
        options={"self_shadow": True},
        fails=(BELOW, Failure(formulas=("skip_last",), because="the shape that was left casts no shadow on itself")),
        first_to_break="shadow_ray/skip_last: every light shines through",
        survivor="shadow_ray/error_bound, normal_offset",
    ),
    _shadow_ray(
        name="SHD-COPLANAR",
        parameter="scale [m] of two coplanar neighbours that share the point",
        values=(1.0, 1e2, 1e4),
        draw=floors(swept="scale"),
        options={"adjacent": True},
        fails=(
            Failure(
                formulas=("none", "skip_last"),
                because="half of all hits lie below the surface, and the neighbour is not left out",
            ),
            TOO_SHORT,
        ),
        first_to_break="shadow_ray/skip_last: the neighbour is not the shape that was left",
        survivor="shadow_ray/error_bound, normal_offset",
    ),
    _shadow_ray(
        name="SHD-LIGHT-END",
        slots=("shadow_ray", "segment", "obstructed"),
        parameter="height of a blocker below or above the light, over the light's own; half of them stand behind it",
        values=(1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6),
        draw=lids,
        fails=(
            BELOW,
            Failure(formulas=("endless",), because="erratum E10: a blocker behind the light counts"),
            Failure(
                formulas=("mitsuba",),
                because="its last 15 000 epsilons of the way are not tested, 9e-4 of it",
                precisions=("float32",),
            ),
        ),
        first_to_break="segment/endless, then shadow_ray/mitsuba",
        survivor="segment/to_light",
    ),
)
