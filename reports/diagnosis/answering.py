"""`answer`: the stages of a renderer that makes a mistake, with limits; and pixels where rounding decides what is met.

Stages are computed in order: those that a way spoils by its own functions, those after them by the oracle from what is
then there. Limits are those of the judge, for the answers at hand: of light in proportion to how much brighter the
mistake makes it, of a curve that is put over radiance by putting it over the ends of the limit.
"""

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from rayproof.cases.placement import world_triangles
from rayproof.cases.rounding import gamma
from rayproof.cases.scene import Cube, Mesh, Scene, SceneError, Shape, Triangle
from rayproof.cases.stages import IMAGE_STAGES, Stage, StageImages
from rayproof.reference.analytic import Analytic
from rayproof.reports.diagnosis import Answered, Given, Way, Wrong
from rayproof.reports.judge.forward.conditioning import condition
from rayproof.reports.judge.forward.limits import Roundoff, limits
from rayproof.reports.judge.measurement import ratios
from rayproof.reports.judge.oracle import stages_of

if TYPE_CHECKING:
    from rayproof.reference.analytic.surfaces import Surface

LIGHT = (Stage.IRRADIANCE, Stage.EXITANCE, Stage.RADIANCE)
PRECISION = "float32"  # what results keep, whatever a renderer computes in
FLOAT32 = Roundoff(PRECISION)
# Relative: what a renderer in float32 may lose beyond the counted roundings, and what files of other steps lose.
LEAST = 1e-5
ROUNDING = gamma(16, precision=PRECISION)  # relative: of a ray's direction, and of what follows from a few stages
TURNS = ((-1, -1), (-1, 1), (1, -1), (1, 1))
PLAINLY = 4.0  # limits: an answer so far from the right one would not have passed for it


class Unanswerable(Exception):  # noqa: N818  an answer, not a mishap
    """A way that has no answer to a scene: the changed question is no valid scene, or beyond the tracer."""


def right_answer(scene: Scene, oracle: Analytic, rounding: Roundoff = FLOAT32) -> Answered:
    """Return the oracle's own answer, with the limits of a renderer that rounds so."""
    answers = oracle.render(scene, [stage for stage in stages_of(scene) if stage is not Stage.CAMERA])
    return _answered(scene, answers, {}, rounding)


def answer(way: Way, right: Answered, oracle: Analytic, *, ours: StageImages | None = None) -> Answered:
    """Return a way's answer to the scene that `right` answers, in the pixels of the image asked for.

    `ours` are the renderer's own images, of what is written in a way that not all of is foretold.

    Raises:
        Unanswerable: it has none.

    """
    if way.stored is not None:
        return way.stored(right, ours or {})
    scene, answers, plain = _plain_answer(way, right, oracle)
    if answers is right.answers:
        return replace(right, scene=scene)
    found = _answered(scene, answers, plain, right.rounding)
    if scene == right.scene and Stage.VISIBILITY in answers:
        found = replace(found, edge=found.edge | _by_a_light_on_a_surface(scene, answers, right.answers))
    if Stage.RADIANCE in way.stages and Stage.RADIANCE in plain:
        widened = _over_its_limit(scene, found, plain, way)
        return replace(found, limits={**found.limits, **widened})
    return found


def _plain_answer(way: Way, right: Answered, oracle: Analytic) -> tuple[Scene, StageImages, StageImages]:
    """Return the question that a way answers, its answers, and the right light on what it sees, where that is not its.

    Raises:
        Unanswerable: it has none.

    """
    try:
        scene = right.scene if way.asked is None else way.asked(right.scene)
    except (SceneError, ValueError, OverflowError) as wrong:
        raise Unanswerable(str(wrong)) from None
    wanted = [stage for stage in stages_of(scene) if stage is not Stage.CAMERA]
    plain: StageImages = {}
    if way.formulas:
        answers = traced(scene, wanted, way.formulas)
        if Stage.IRRADIANCE in answers:
            plain = _continued(scene, answers, Stage.IRRADIANCE, oracle)
    else:
        answers = right.answers if scene == right.scene else oracle.render(scene, wanted)
    spoilt = [stage for stage in IMAGE_STAGES if stage in way.stages and stage in wanted]
    if spoilt:
        answers, plain = _spoilt(scene, answers, way, spoilt[0], oracle)
    return scene, answers, plain


def unsteady(way: Way, right: Answered, supposed: Answered, oracle: Analytic) -> np.ndarray:
    """Return the pixels (height, width) in which rounding decides what a way, which answers so, meets or lights.

    That is where a turn of the rays by a rounding changes it, and where two shapes are met equally far away. Of what
    the tracer answers it is where its two precisions are farther apart than rounding moves the right formulas.

    Raises:
        Unanswerable: the way has no answer.

    """
    if way.formulas:
        alone = answer(replace(way, stages={}), right, oracle) if way.stages else supposed
        return deviates(alone, traced(alone.scene, list(alone.answers), way.formulas, precision=PRECISION))
    scene, steady, _ = _plain_answer(way, right, oracle)
    found = equally_far(scene, steady[Stage.RAY])
    for aside, along in TURNS:

        def turned(given: Given, aside: int = aside, along: int = along) -> np.ndarray:
            return turned_rays(
                given.right if Stage.RAY not in way.stages else way.stages[Stage.RAY](given), aside, along
            )

        answers = _plain_answer(replace(way, stages={**way.stages, Stage.RAY: turned}), right, oracle)[1]
        found |= _apart(steady, answers)
    return found


def deviates(supposed: Answered, ours: StageImages, *, times: float = 1) -> np.ndarray:
    """Return the pixels (height, width) at which some stage is not the supposed one, within so many limits."""
    found = np.zeros(supposed.edge.shape, dtype=bool)
    for stage, image in ours.items():
        value = np.asarray(supposed.answers[stage], dtype=np.float64)
        with np.errstate(all="ignore"):
            ratio, _ = ratios(stage, np.asarray(image, dtype=np.float64), value, supposed.limits[stage])
        found |= ~(ratio <= times)
    return found


def turned_rays(rays: np.ndarray, aside: int, along: int) -> np.ndarray:
    """Return rays that are turned by a rounding to either side, -1 or 1, in both directions across them."""
    one = np.cross(rays, np.eye(3)[np.argmin(np.abs(rays), axis=-1)])
    other = np.cross(one, rays) / np.linalg.norm(rays, axis=-1, keepdims=True)
    return rays + ROUNDING * (aside * one + along * other)


def beside(own: StageImages, stage: Stage, aside: int, along: int) -> StageImages:
    """Return what is moved before objects or visibility: each ray, or each feeler's start, by a rounding."""
    if stage is Stage.OBJECT:
        return {Stage.RAY: turned_rays(own[Stage.RAY], aside, along)}
    point, normal = own[Stage.POSITION], own[Stage.NORMAL]
    with np.errstate(invalid="ignore"):  # where nothing is met
        shift = np.nan_to_num(turned_rays(normal, aside, along) - normal)
    return {Stage.POSITION: point + shift * (1 + np.linalg.norm(point, axis=-1, keepdims=True))}


def _apart(one: StageImages, other: StageImages) -> np.ndarray:
    """Return the pixels (height, width) in which two answers meet or light different things."""
    stages = [stage for stage in (Stage.OBJECT, Stage.VISIBILITY) if stage in one]
    return np.any(np.concatenate([one[stage] != other[stage] for stage in stages], axis=-1), axis=-1)


# From a shape, the eye, rays (n, 3) and the ends of their clip intervals (n,) to crossings (n,), infinite where missed,
# and faces (n,).
Meeting = Callable[[Shape, np.ndarray, np.ndarray, np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]


def hits_by(meet: Meeting, counts: Callable[[np.ndarray, np.ndarray], np.ndarray] = np.less) -> dict[Stage, Wrong]:
    """Return objects and distances by `meet`; `counts` says which crossings count instead of an earlier shape's."""

    def hits(given: Given) -> tuple[np.ndarray, np.ndarray]:

        height, width, _ = given.answers[Stage.RAY].shape
        rays, eye = given.answers[Stage.RAY].reshape(-1, 3), np.asarray(given.scene.camera.eye, dtype=np.float64)
        ends = Analytic().clip_interval(given.scene, rays)
        distances, objects = np.full(len(rays), np.inf), np.full((len(rays), 2), -1.0)
        for index, shape in enumerate(given.scene.shapes):
            crossing, face = meet(shape, eye, rays, *ends)
            taken = np.isfinite(crossing) & counts(crossing, distances)
            distances = np.where(taken, crossing, distances)
            objects[taken, 0], objects[taken, 1] = index, face[taken]
        return objects.reshape(height, width, 2), distances.reshape(height, width, 1)

    return {Stage.OBJECT: lambda given: hits(given)[0], Stage.DISTANCE: lambda given: hits(given)[1]}


def above(scene: Scene, answers: StageImages) -> np.ndarray:
    """Return which lights are above the horizon, (height, width, lights)."""
    hit, point, normal = answers[Stage.OBJECT][..., 0] >= 0, answers[Stage.POSITION], answers[Stage.NORMAL]
    cosines = [np.sum(normal * (np.asarray(light.position) - point), axis=-1) for light in scene.lights]
    return np.stack([hit & (cosine > 0) for cosine in cosines], axis=-1)


def equally_far(scene: Scene, rays: np.ndarray) -> np.ndarray:
    """Return the pixels (height, width) whose ray meets two faces equally far, or one at the eye, within rounding."""
    from rayproof.reference.analytic.surfaces import surface_of

    flat, eye = rays.reshape(-1, 3), np.asarray(scene.camera.eye, dtype=np.float64)
    low, high = Analytic().clip_interval(scene, flat)
    reach = np.full(len(flat), ROUNDING * (1 + float(np.linalg.norm(eye))))
    tied, nearest = np.zeros(len(flat), dtype=bool), np.full((2, len(flat)), np.inf)
    for surface in map(surface_of, scene.shapes):
        tied |= (low <= reach) & np.isfinite(surface.first(eye, flat, -reach, reach)[0])
        nearest = np.sort([*nearest, *_nearest_two(surface, eye, flat, low, high)], axis=0)[:2]
    with np.errstate(invalid="ignore"):
        tied |= nearest[1] - nearest[0] <= reach + ROUNDING * nearest[0]
    return tied.reshape(rays.shape[:2])


def _nearest_two(
    surface: "Surface", eye: np.ndarray, rays: np.ndarray, low: np.ndarray, high: np.ndarray
) -> np.ndarray:
    """Return the two smallest crossings (2, n) with faces of a surface; of one without faces the first, and inf."""
    from rayproof.reference.analytic.surfaces import Polygons

    nearest = np.full((2, len(rays)), np.inf)
    if not isinstance(surface, Polygons):
        nearest[0] = surface.first(eye, rays, low, high)[0]
        return nearest
    for some, _, crossings in surface.meetings(eye, rays):
        inside = (crossings > low[some, np.newaxis]) & (crossings < high[some, np.newaxis])
        met = np.concatenate([nearest[:, some], np.where(inside, crossings, np.inf).T])
        nearest[:, some] = np.partition(met, 1, axis=0)[:2]
    return nearest


def in_their_planes(scene: Scene, objects: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Return the pixels (height, width) whose point [m] lies within rounding in the plane of a face, of these objects.

    Which of two faces in one plane a ray meets is decided by rounding.
    """
    reach = ROUNDING * (1 + np.linalg.norm(points, axis=-1) + np.linalg.norm(scene.camera.eye))
    within = np.zeros(objects.shape[:2], dtype=bool)
    for index, shape in enumerate(scene.shapes):
        here = objects[..., 0] == index
        if isinstance(shape, Triangle | Mesh) and here.any():
            corners = world_triangles(shape).astype(np.float64)[objects[here][:, 1].astype(int)]
            normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
            height = np.abs(np.sum(normals * (points[here] - corners[:, 0]), axis=-1))
            within[here] = height <= reach[here] * np.linalg.norm(normals, axis=-1)
    return within


def changed(way: Way, right: Answered, oracle: Analytic) -> dict[Stage, np.ndarray]:
    """Return where a way's answer is none that passes for the right one, for each stage that it changes.

    Pixels (height, width) away from the right answer's edges, held to its limits, four of them.

    Raises:
        Unanswerable: the way has no answer.

    """
    answers = _plain_answer(way, right, oracle)[1] if way.stored is None else way.stored(right, {}).answers
    found = {}
    for stage, image in right.answers.items():
        if stage in IMAGE_STAGES and answers[stage] is not image:
            with np.errstate(all="ignore"):
                ratio, _ = ratios(stage, np.asarray(answers[stage], dtype=np.float64), image, right.limits[stage])
            found[stage] = ~(ratio <= PLAINLY) & ~right.edge
    return found


def _spoilt(
    scene: Scene, answers: StageImages, way: Way, first: Stage, oracle: Analytic
) -> tuple[StageImages, StageImages]:
    """Return the answers with a way's wrong stages, and the right light on what is met then."""
    found, plain = dict(answers), {}
    with np.errstate(all="ignore"):
        for stage in IMAGE_STAGES[IMAGE_STAGES.index(first) :]:
            if stage not in answers:
                continue
            before = any(IMAGE_STAGES.index(one) < IMAGE_STAGES.index(stage) for one in way.stages)
            value = follows(way, scene, stage, found, oracle) if before else np.asarray(answers[stage])
            if stage in LIGHT:
                plain[stage] = (
                    oracle.continue_from(scene, stage, found | plain) if stage is not Stage.RADIANCE else value
                )
            if stage in way.stages:
                given = Given(scene=scene, answers=found, right=value, parameter=0.0)
                value = np.asarray(way.stages[stage](given), dtype=np.float64)
            found[stage] = value
        if Stage.IRRADIANCE in found and Stage.RADIANCE not in way.stages:
            plain = _continued(scene, found, Stage.IRRADIANCE, oracle)
    return found, plain


def follows(
    way: Way, scene: Scene, stage: Stage, before: StageImages, oracle: Analytic, *, precision: str = "float64"
) -> np.ndarray:
    """Return a stage as it follows from those before by a way's formulas, else rightly; of what it spoils, the base.

    `precision` is that of the tracer, which the formulas are asked of.

    Raises:
        Unanswerable: the scene is beyond the tracer.

    """
    if not way.formulas:
        return oracle.continue_from(scene, stage, before)
    from rayproof.tracer.configuration import Configuration
    from rayproof.tracer.render import continue_from
    from rayproof.tracer.shapes.bounds import beyond

    if (why := beyond(scene, precision)) is not None:
        raise Unanswerable(why)
    return continue_from(scene, stage, before, Configuration(precision=precision, formulas=way.formulas))


def _continued(scene: Scene, answers: StageImages, first: Stage, oracle: Analytic) -> StageImages:
    """Return the right light from `first` on, on the surfaces and under the lights that the answers see."""
    found = dict(answers)
    with np.errstate(all="ignore"):
        for stage in IMAGE_STAGES[IMAGE_STAGES.index(first) :]:
            found[stage] = oracle.continue_from(scene, stage, found)
    return {stage: found[stage] for stage in LIGHT}


def traced(
    scene: Scene, stages: list[Stage], formulas: Mapping[str, str], *, precision: str = "float64"
) -> StageImages:
    """Return stages as the tracer has them by some formulas; raise Unanswerable where the scene is beyond it."""
    from rayproof.tracer.configuration import Configuration
    from rayproof.tracer.render import render
    from rayproof.tracer.shapes.bounds import beyond

    if (why := beyond(scene, precision)) is not None:
        raise Unanswerable(why)
    return render(scene, stages, Configuration(precision=precision, formulas=formulas))


def _answered(scene: Scene, answers: StageImages, plain: StageImages, rounding: Roundoff) -> Answered:
    with np.errstate(all="ignore"):
        bound = dict(limits(scene, answers, condition(scene, answers), rounding, by_matrices=False).end_to_end)
        bound = {stage: np.abs(limit) for stage, limit in bound.items()}  # behind the eye a distance is negative
        for stage, image in answers.items():
            size = np.abs(image)
            if stage in (Stage.OBJECT, Stage.VISIBILITY):
                bound[stage] = np.zeros(image.shape[:2])
            elif stage in (Stage.RAY, Stage.NORMAL):
                bound[stage] = bound[stage] + LEAST * np.maximum(1.0, np.linalg.norm(image, axis=-1))
            elif stage is Stage.POSITION:
                bound[stage] = bound[stage] + LEAST * (
                    np.linalg.norm(image, axis=-1) + float(np.linalg.norm(scene.camera.eye))
                )
            elif stage is Stage.DISTANCE:
                bound[stage] = bound[stage] + LEAST * np.where(np.isfinite(size[..., 0]), size[..., 0], 0.0)
            else:
                limit = bound[stage] if bound[stage].ndim == 3 else bound[stage][..., np.newaxis]
                if stage in plain:
                    factor = size / np.abs(plain[stage])
                    limit = limit * np.where(np.isfinite(factor), np.maximum(1.0, factor), 1.0)
                bound[stage] = limit + LEAST * np.where(np.isfinite(size), size, 0.0)
        bound = {stage: np.where(np.isnan(limit), 0.0, limit) for stage, limit in bound.items()}
    edge = _edges(answers) | between_faces(scene, answers)
    return Answered(scene=scene, answers=answers, limits=bound, edge=edge, rounding=rounding)


def between_faces(scene: Scene, answers: StageImages) -> np.ndarray:
    """Return the pixels (height, width) that hit a cube so near to an edge that rounding says which face's normal."""
    objects, positions = answers[Stage.OBJECT][..., 0], answers[Stage.POSITION]
    found = np.zeros(objects.shape, dtype=bool)
    for index, shape in enumerate(scene.shapes):
        here = objects == index
        if not isinstance(shape, Cube) or not here.any():
            continue
        matrix = np.asarray(shape.to_world, dtype=np.float64)
        back = np.linalg.inv(matrix[:3, :3])
        points = positions[here]
        lesser, greatest = np.sort(np.abs((points - matrix[:3, 3]) @ back.T), axis=-1)[:, 1:].T
        size = np.linalg.norm(points, axis=-1) + float(np.linalg.norm(scene.camera.eye)) + np.abs(matrix[:3]).sum()
        found[here] = greatest - lesser <= ROUNDING * size * np.linalg.norm(back, ord=2)
    return found


def _by_a_light_on_a_surface(scene: Scene, answers: StageImages, right: StageImages) -> np.ndarray:
    """Return the pixels whose view of a light is not the right one, where that light lies on a surface.

    From the other side than the right one, rounding alone says whether the surface that holds a light blocks it.
    """
    held = [_on_a_surface(scene, np.asarray(light.position, dtype=np.float64)) for light in scene.lights]
    return np.any((answers[Stage.VISIBILITY] != right[Stage.VISIBILITY]) & np.array(held, dtype=bool), axis=-1)


def seen_from_a_surface(scene: Scene, answers: StageImages) -> np.ndarray:
    """Return the pixels (height, width) in which rounding decides what a feeler meets.

    That is where another face is at the same place, and where a light that lies on a surface is above the horizon.
    """
    held = any(_on_a_surface(scene, np.asarray(light.position, dtype=np.float64)) for light in scene.lights)
    return (answers[Stage.OBJECT][..., 0] >= 0) & held | equally_far(scene, answers[Stage.RAY])


def _on_a_surface(scene: Scene, point: np.ndarray) -> bool:
    """Say whether a surface passes a point [m] within the rounding of float32: some axis then crosses it that near."""
    from rayproof.reference.analytic.surfaces import surface_of

    reach = np.full(3, np.sqrt(3) * gamma(16, precision=PRECISION) * (1 + float(np.linalg.norm(point))))
    return any(
        bool(np.isfinite(surface_of(shape).first(point, np.eye(3), -reach, reach)[0]).any()) for shape in scene.shapes
    )


def _over_its_limit(scene: Scene, found: Answered, plain: StageImages, way: Way) -> dict[Stage, np.ndarray]:
    """Return the limit of radiance under a curve: how far its value moves within the limits of what it is made of."""
    wrong = way.stages[Stage.RADIANCE]
    middle, value = plain[Stage.RADIANCE], found.answers[Stage.RADIANCE]
    with np.errstate(all="ignore"):
        room = limits(
            scene, {**found.answers, **plain}, condition(scene, found.answers), found.rounding, by_matrices=False
        ).end_to_end[Stage.RADIANCE]
        room = np.where(np.isfinite(room), room, 0.0) + LEAST * np.abs(middle)
        exitance, about = found.answers[Stage.EXITANCE], found.limits[Stage.EXITANCE]
        ends = [
            wrong(
                Given(
                    scene=scene,
                    answers={**found.answers, Stage.EXITANCE: exitance + sign * about},
                    right=middle + sign * room,
                    parameter=0.0,
                )
            )
            for sign in (-1, 1)
        ]
        moved = np.max([np.abs(end - value) for end in ends], axis=0)
    return {Stage.RADIANCE: np.where(np.isfinite(moved), moved, 0.0) + LEAST * np.abs(value)}


def own_limits(scene: Scene, answers: StageImages, rounding: Roundoff) -> Answered:
    """Return a renderer's own answers with the limits of what follows from them."""
    return _answered(scene, answers, {}, rounding)


def _edges(answers: StageImages) -> np.ndarray:
    """Return the pixels beside which another object, face or light is seen, and those that a way leaves open: NaN."""
    images = [answers[Stage.OBJECT]] + ([answers[Stage.VISIBILITY]] if Stage.VISIBILITY in answers else [])
    state = np.concatenate(images, axis=-1)
    light = [answers[stage] for stage in LIGHT if stage in answers]
    found: np.ndarray = np.any(np.isnan(np.concatenate([*images, *light], axis=-1)), axis=-1)
    for down, right in ((0, 1), (1, 0), (1, 1), (1, -1)):
        height, width = state.shape[:2]
        left = slice(max(0, -right), width - max(0, right))
        moved = slice(max(0, right), width + min(0, right))
        one, other = state[: height - down, left], state[down:, moved]
        differ = np.any((one != other) & ~(np.isnan(one) & np.isnan(other)), axis=-1)
        found[: height - down, left] |= differ
        found[down:, moved] |= differ
    return found
