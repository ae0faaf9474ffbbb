"""Mutants: wrong renderers that are made by rules from the scene vocabulary, and measure what the suite can see.

A mutant of a field is the oracle, at one place of use or everywhere, on a scene whose field was changed by a rule of
`operations`: `fields` walks the fields, `frames` the camera's axes and pixels, and what is in the wrong space. A
mutant of a tolerance is an intersection or shadow ray with one number put where none belongs (`tolerances`). Equivalent
mutants and known survivors have their reasons below. `trials` judges one, `campaign` all of them.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from rayproof.cases.scene import Scene
from rayproof.cases.stages import Stage
from rayproof.reference.analytic import Analytic

PREFIX = "mutant/"
ORACLE = Analytic()
Rows = Mapping[Stage, np.ndarray]  # stage -> (pixels, channels)
# A wrong stage, from the scene and the rows before it. The object's step returns shape, face and distance, for they are
# one search; one of the distance finds in its own row what that search said.
Step = Callable[[Scene, Rows], np.ndarray]


@dataclass(frozen=True, kw_only=True)
class Mutant:
    """One wrong renderer. `steps` returns what it computes otherwise in a scene; nothing where it is right there."""

    name: str  # "mutant/FIELD/RULE", and "/PLACE" where the rule holds at one place of use alone
    field: str  # such as "light.position", or the formula of a tolerance
    what: str  # what it does, in words that complete "a renderer that ..."
    steps: Callable[[Scene], Mapping[Stage, Step]]

    def answer(self, scene: Scene, right: Rows) -> dict[Stage, np.ndarray] | None:
        """Return the rows of every stage in `right`, the oracle's own; None where the mutant changes nothing."""
        steps = self.steps(scene)
        order = list(right)
        places = [order.index(stage) for stage in steps if stage in right]
        if not places:
            return None
        rows = {stage: right[stage] for stage in order[: min(places)]}
        distances = right.get(Stage.DISTANCE)
        for stage in order[min(places) :]:
            if stage is Stage.OBJECT:
                found = steps.get(stage, hits)(scene, rows)
                rows[stage], distances = found[:, :2], found[:, 2:]
            elif stage is Stage.DISTANCE:
                assert distances is not None
                rows[stage] = distances
                if stage in steps:
                    rows[stage] = steps[stage](scene, rows)
            else:
                step = steps.get(stage)
                rows[stage] = ORACLE.continued(scene, stage, rows) if step is None else step(scene, rows)
        return rows


def hits(scene: Scene, rows: Rows) -> np.ndarray:
    """Return shape, face and distance of the rays in `rows`, shape (pixels, 3)."""
    found = ORACLE.nearest(scene, rows[Stage.RAY])
    return np.column_stack([found.objects, found.distances])


# Why a mutant is a right renderer after all, and why one that is wrong survives: by patterns of names.
#
# The first pattern that a name matches counts. What is said to be equivalent must stay within a right renderer's limits
# on all cases and random scenes; a survivor that is killed, and one without a reason, is a problem of the audit.
# u = 2^-24 is the unit roundoff of float32; gamma(16) = 9.5e-7 is the share of the coordinates by which docs/judging.md
# lets hits and outlines move at least.


_LENGTH = "R = F x U is made a unit vector afterwards, and the length of U only scales F x U"
_CORNERS = "a face is the same from whichever corner it begins, and (b - a) x (c - a) = (c - b) x (a - b)"
_GRAZING = (
    "such a ray leaves the surface by less than 1e-6 rad; rays may be off by 1.07e-6 rad in the narrowest view, and "
    "both ends of a shadow ray are within 1e-6 of its length of the surface's plane, as much as gamma(16) of "
    "coordinates"
)
_ROUNDING = "1e-8 is less than u: one rounding to float32 of either of the numbers that are compared changes as much"
EQUIVALENT: dict[str, str] = {
    "mutant/camera.frame/up_normalised_first": _LENGTH,
    "mutant/camera.up/normalised": _LENGTH,
    "mutant/camera.frame/up_perpendicular_first": "F x (U - F (U.F) / (F.F)) = F x U, for F x F = 0",
    "mutant/sphere.radius/negated": "the radius enters a hit as its square, and a normal twice, with (-1)(-1) = 1",
    "mutant/sphere.radius/*/normals": (
        "the normal has the direction of the point less the centre, and is made a unit vector after it was scaled"
    ),
    "mutant/triangle.vertices/rolled_corners": _CORNERS,
    "mutant/mesh.faces/rolled_corners": _CORNERS,
    "mutant/*.vertices/negated/normals": "(-a) x (-b) = a x b",
    "mutant/nearest.*/relative_1e-6": "either distance may be off by gamma(16) t, both together by 1.9e-6 t: a tie",
    "mutant/mesh.box_parallel/relative_1e-6": (
        "such a ray starts outside of the box and hits inside of it, so that the hit lies within 1e-6 t of the box's "
        "border, and so of the mesh's outline, which gamma(16) of t and of the eye's coordinates may move as far"
    ),
    "mutant/*.parallel/relative_1e-6": _GRAZING,
    "mutant/shadow_ray.horizon/1e-6": "the normal may be off by gamma(16), the direction to the light by 3 gamma(2)",
    "mutant/shadow_ray.offset/relative_1e-6": (
        "1e-6 of the coordinates is 17 u, and LIT-5 itself moves the start by gamma(16) of the same coordinates"
    ),
    "mutant/sphere.discriminant/relative_1e-6": "the outline moves by 5e-7 of the radius, and may by gamma(16) of it",
    "mutant/clip.*/relative_1e-8": _ROUNDING,
    "mutant/nearest.*/relative_1e-8": _ROUNDING,
    "mutant/shadow_ray.end_*/relative_1e-8": _ROUNDING,
    "mutant/shadow_ray.offset/relative_1e-8": _ROUNDING,
    "mutant/shadow_ray.horizon/1e-8": _ROUNDING,
    "mutant/square.edges_*/relative_1e-8": _ROUNDING,
    "mutant/cube.edges_*/relative_1e-8": _ROUNDING,
    "mutant/*.parallel/relative_1e-8": _ROUNDING,
    "mutant/mesh.box_parallel/relative_1e-8": _ROUNDING,
    "mutant/sphere.discriminant/relative_1e-8": _ROUNDING,
}

_SIXTEEN = "rounding to 16 bits moves a value by 7.6e-6 at most, and what is seen by no more than limits of light allow"
_EDGE = "an edge that moves by so little changes edge pixels alone, where radiance may have the value of either side"
SURVIVES: dict[str, str] = {
    "mutant/camera.up/16_bits": _SIXTEEN,
    "mutant/shadow_ray.end_b*/relative_1e-6": (
        "no case has a blocker within 1e-6 of a shadow ray's length from a light: a shadow ray from the point meets it "
        "at 1 - 1e-6, and gamma(16) is as much"
    ),
    "mutant/mesh.box_parallel/absolute_1e-8": (
        "no case has a mesh beside a shadow ray of 1e-8 m; for the camera's rays it equals the relative one"
    ),
    "mutant/triangle.area/relative_1e-8": "no case shows the small face of a mesh whose faces differ so much in area",
    "mutant/cube.edges_*/relative_1e-6": _EDGE,
    "mutant/square.edges_*/relative_1e-6": _EDGE,
    "mutant/triangle.edges_outside/relative_1e-6": _EDGE,
    "mutant/triangle.edges_outside/relative_1e-8": _EDGE,
}
