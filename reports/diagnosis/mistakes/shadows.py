"""Mistakes of feelers and visibility, LIT-1 to LIT-5: offsets, no horizon, blockers behind, shadow acne.

Roundings decide which points of a surface shadow themselves, so acne predicts no pixel. It is recognised by its look:
of the points that one light lights, some are dark for no other reason, scattered among right ones. A wrong shadow of
another kind darkens whole regions, whose pixels have few right neighbours; a wrong factor or colour leaves some light.
"""

from collections.abc import Callable

import numpy as np

from rayproof.cases.placement import placed
from rayproof.cases.scene import Scene, Sphere
from rayproof.cases.stages import IMAGE_STAGES, Stage, StageImages
from rayproof.reference.analytic import Analytic
from rayproof.reports.diagnosis import MISTAKES, Fit, Given, Mistake, Way
from rayproof.reports.diagnosis.answering import above, deviates
from rayproof.reports.diagnosis.mistakes.light import Lights, Share
from rayproof.reports.diagnosis.trials import Evidence
from rayproof.reports.judge.answers import dot

ORACLE = Analytic()
NOBODY = 1e6  # the number of a shape that is none: a feeler that starts in the air is on no surface
OWN = 1e-6  # of a point's coordinates: so far off its surface it may be in float32, with some roundings and a slant


def _never_blocked(given: Given) -> np.ndarray:
    return above(given.scene, given.answers).astype(np.float64)


def _beyond(given: Given) -> np.ndarray:
    """Return visibility where shapes behind the light cast shadows, too.

    What lies behind the light as a point sees it lies on the segment to a light ever so much farther in that direction,
    which is another light for each pixel: so the feeler is asked as a ray from the point, with the analytic surfaces.
    """
    from rayproof.reference.analytic.surfaces import surface_of

    found = np.array(given.right, dtype=np.float64)
    positions = given.answers[Stage.POSITION]
    for column, light in enumerate(given.scene.lights):
        source = np.asarray(light.position, dtype=np.float64)
        rows, columns = np.nonzero(found[..., column] > 0)
        offsets = source - positions[rows, columns]
        for shape in given.scene.shapes:
            left = found[rows, columns, column] > 0
            crossing, *_ = surface_of(shape).first(
                source, offsets[left], np.zeros(np.count_nonzero(left)), np.full(np.count_nonzero(left), np.inf)
            )
            found[rows[left], columns[left], column] = np.where(np.isfinite(crossing), 0.0, 1.0)
    return found


def _behind_the_point(given: Given, *, flat: bool) -> np.ndarray:
    """Return visibility where shapes on the other side of the point block, too; all of them or none but spheres."""
    found = np.array(given.right, dtype=np.float64)
    for column in range(found.shape[-1]):
        blocked = _met(given, column, lambda own, far: (1 + own / far, np.full_like(far, np.inf)), flat=flat)
        found[..., column][blocked] = 0.0
    return found


def _within_a_metre(given: Given) -> np.ndarray:
    """Return visibility where blockers within 1 m of the point count alone, behind the light as well."""
    found = _never_blocked(given)
    for column in range(found.shape[-1]):
        found[..., column][_met(given, column, lambda own, far: (1 - 1 / far, 1 - own / far))] = 0.0
    return found


# From how near the point's own surface is [m] and the light's distance [m] to two places on the line from the light,
# where 1 is the point.
Reach = Callable[[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]


def _met(given: Given, column: int, reach: Reach, *, flat: bool = False) -> np.ndarray:
    """Return the pixels (height, width) of which the line from a light meets a shape between two places."""
    from rayproof.reference.analytic.surfaces import surface_of

    source = np.asarray(given.scene.lights[column].position, dtype=np.float64)
    found = np.zeros(given.answers[Stage.OBJECT].shape[:2], dtype=bool)
    hit = given.answers[Stage.OBJECT][..., 0] >= 0
    lines = given.answers[Stage.POSITION][hit] - source
    far = np.sqrt(dot(lines, lines))
    points = given.answers[Stage.POSITION][hit]
    off = OWN * np.maximum(1.0, np.sqrt(dot(points, points)))
    slope = np.maximum(OWN, np.abs(dot(given.answers[Stage.NORMAL][hit], lines)) / far)
    for index, shape in enumerate(given.scene.shapes):
        curved = isinstance(shape, Sphere)
        if not (flat and curved):
            # Of a line that grazes the point's own sphere a chord of that height is near, of one that grazes its own
            # face the way up to it.
            size = shape.radius * np.linalg.norm(placed(shape)[0], ord=2) if curved else 0.0
            grazing = np.sqrt(2 * size * off) if curved else off / slope
            own = np.where(given.answers[Stage.OBJECT][hit][:, 0] == index, grazing, off)
            found[hit] |= np.isfinite(surface_of(shape).first(source, lines, *reach(own, far))[0])
    return found


def lifted(scene: Scene, answers: StageImages, offset: float) -> np.ndarray:
    """Return visibility from points an offset [m] above the surface, along the normal."""
    objects = answers[Stage.OBJECT]
    start = {
        Stage.OBJECT: np.where(objects >= 0, NOBODY, objects),
        Stage.POSITION: answers[Stage.POSITION] + offset * answers[Stage.NORMAL],
        Stage.NORMAL: answers[Stage.NORMAL],
    }
    # The light's side is asked at the surface, its blockers from the point above it.
    return np.where(above(scene, answers), _from_the_lights_side(scene, start), 0.0)


def no_horizon(given: Given) -> np.ndarray:
    """Return visibility of lights on either side of a surface."""
    return _from_the_lights_side(given.scene, given.answers)


def _from_the_lights_side(scene: Scene, answers: StageImages) -> np.ndarray:
    """Return visibility by feelers that start on each light's side of the surface, (height, width, lights)."""
    columns = []
    for column, light in enumerate(scene.lights):
        ahead = dot(answers[Stage.NORMAL], np.asarray(light.position) - answers[Stage.POSITION]) >= 0
        facing = {**answers, Stage.NORMAL: answers[Stage.NORMAL] * np.where(ahead, 1.0, -1.0)[..., np.newaxis]}
        columns.append(ORACLE.continue_from(scene, Stage.VISIBILITY, facing)[..., column])
    return np.stack(columns, axis=-1)


MISTAKES.register("no_shadows")(
    Mistake(says="casts no shadows", items=("LIT-1",), ways=(Way(stages={Stage.VISIBILITY: _never_blocked}),))
)
MISTAKES.register("beyond_the_light")(
    Mistake(
        says="lets shapes behind a light cast shadows",
        items=("LIT-1",),
        ways=(Way(stages={Stage.VISIBILITY: _beyond}),),
    )
)
MISTAKES.register("blockers_behind")(
    Mistake(
        says="counts blockers behind the point from which a shadow ray starts, too",
        items=("LIT-1",),
        ways=tuple(
            Way(stages={Stage.VISIBILITY: lambda given, flat=flat: _behind_the_point(given, flat=flat)})
            for flat in (False, True)
        ),
    )
)
MISTAKES.register("unit_feelers")(
    Mistake(
        says="gives shadow rays length 1 but compares their t with 1, so that blockers farther than 1 m are missed",
        items=("LIT-1",),
        ways=(Way(stages={Stage.VISIBILITY: _within_a_metre}),),
    )
)
MISTAKES.register("feeler_offset")(
    Mistake(
        says="starts its shadow rays {0} m above the surface, so that nearer blockers are missed",
        items=("LIT-5", "LIT-3"),
        ways=(Way(stages={Stage.VISIBILITY: lambda given: lifted(given.scene, given.answers, given.parameter)}),),
        fit=Fit(
            samples=lambda scene, right, ours: np.zeros(0),
            nothing=0.0,
            grid=(1e-3, 2e-3, 5e-3, 0.01, 0.02, 0.03, 0.05, 0.07, 0.1, 0.15, 0.2, 0.3),
        ),
    )
)
MISTAKES.register("cosine_not_clamped")(
    Mistake(
        says="neither clamps the cosine to zero nor asks whether the light is above the horizon",
        items=("RAD-2", "LIT-1"),
        ways=(
            Way(
                stages={
                    Stage.VISIBILITY: no_horizon,
                    Stage.IRRADIANCE: Lights((Share(cosine=lambda cosine: cosine),)),
                }
            ),
            Way(formulas={"lambert": "fault_unclamped", "horizon": "fault_never", "simplified": "fault_unclamped"}),
        ),
    )
)
MISTAKES.register("cosine_absolute")(
    Mistake(
        says="takes the absolute value of the cosine, so that surfaces are lit from behind",
        items=("RAD-2", "LIT-1"),
        ways=(
            Way(
                stages={
                    Stage.VISIBILITY: no_horizon,
                    Stage.IRRADIANCE: Lights((Share(cosine=np.abs),)),
                }
            ),
        ),
    )
)


DARKENED = 0.98  # of the wrong pixels so many have no light left
FEW = 0.005  # of a case's pixels: so many may be wrong otherwise, since the same roundings move hits at grazing angles
SCATTERED = 0.8  # of these so many have a right pixel of the same shape beside them: of a region its rim alone has
LEAST = 30  # pixels of a case: of a smaller region nearly all is rim


def scattered(evidence: Evidence) -> bool | None:
    """Say whether a case's wrong pixels are dark ones scattered over lit surfaces; None where it says nothing.

    Cases of several lights say nothing, and roundings of a pattern, such as on a wall that the rays meet evenly.
    """
    stage = Stage.VISIBILITY if Stage.VISIBILITY in evidence.stages else Stage.RADIANCE
    if len(evidence.scene.lights) != 1 or stage not in evidence.stages:
        return None
    geometry = IMAGE_STAGES[: IMAGE_STAGES.index(Stage.VISIBILITY)]
    before = {one: evidence.ours[one] for one in evidence.stages if one in geometry}
    few = FEW * evidence.wrong.size
    if np.count_nonzero(deviates(evidence.right, before) & ~evidence.right.edge) > few:
        return False
    lit = np.any(evidence.right.answers[stage] > 0, axis=-1) & ~evidence.right.edge
    dark = evidence.wrong & lit & np.all(evidence.ours[stage] == 0, axis=-1)
    others = np.count_nonzero(evidence.wrong) - np.count_nonzero(dark)
    if others > max(few, (1 - DARKENED) * np.count_nonzero(evidence.wrong)):
        return False
    if np.count_nonzero(dark) < LEAST:
        return None
    beside = dark & _beside(lit & ~evidence.wrong, evidence.right.answers[Stage.OBJECT][..., 0])
    return bool(np.count_nonzero(beside) >= SCATTERED * np.count_nonzero(dark)) or None


def _beside(good: np.ndarray, objects: np.ndarray) -> np.ndarray:
    """Return the pixels (height, width) with a good one of the same shape above, below, to the left or to the right."""
    found = np.zeros_like(good)
    for one, other in ((np.s_[1:], np.s_[:-1]), (np.s_[:, 1:], np.s_[:, :-1])):
        same = objects[one] == objects[other]
        found[one] |= same & good[other]
        found[other] |= same & good[one]
    return found


MISTAKES.register("acne")(
    Mistake(
        says="lets surfaces shadow themselves, so that scattered points of them are dark (shadow acne)",
        items=("LIT-2", "LIT-3", "LIT-4", "LIT-5"),
        ways=(Way(formulas={"feeler": "fault_bare"}),),
        seen=scattered,
    )
)
