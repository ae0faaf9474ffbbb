"""From random scenes to one in which a renderer is farthest off its limits (`run random --worst`).

A climb raises the error of one stage; climbs take the stages in turn. Each begins with the worst of a few random
scenes. It changes numbers by a few roundings, by powers of two or to their neighbours' values, adds features of random
scenes, takes shapes and lights away, and moves the camera. It keeps what raises the error over its limit, at any stage
once a check fails. It ends where many changes in a row raise nothing, or the ratio is infinite. The oracle alone
judges. The same seed and number of tries give the same scenes on every machine that rounds alike.
"""

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from rayproof.cases.placement import vector
from rayproof.cases.random_scenes import EDITION, random_case
from rayproof.cases.random_scenes.draft import Draft, Draws
from rayproof.cases.random_scenes.features import FEATURES, Step
from rayproof.cases.scene import Scene, SceneError
from rayproof.cases.scene_json import scene_to_json
from rayproof.cases.stages import Stage
from rayproof.reports.results.case_records import Check
from rayproof.reports.results.outcomes import Outcome
from rayproof.reports.shrinking.failure import Renderer, judged
from rayproof.reports.shrinking.numbers import groups
from rayproof.reports.shrinking.search import aimed

STREAM = 2  # of a climb's changes, beside those of a random scene and of its wide fields
FIRST = 6  # random scenes, the worst of which a climb begins with
PATIENCE = 30  # changes in a row that raise nothing
# Whose error each climb raises in turn; wrong objects and shadows have no size, and end a climb wherever they appear.
AIMS = (
    Stage.RADIANCE, Stage.RAY, Stage.DISTANCE, Stage.POSITION, Stage.NORMAL, Stage.IRRADIANCE, Stage.CAMERA,
    Stage.EXITANCE,
)  # fmt: skip
BARE = ("empty", "no_light")  # features that leave little to be wrong
ULPS = (1, 2, 3, 8, 64)
ZOOM = 4


@dataclass(frozen=True, kw_only=True)
class Height:
    """How far off a renderer is in a scene at a stage: the largest error over its limit; above 1 if a check fails."""

    scene: Scene
    ratio: float
    stage: Stage
    pixel: tuple[int, int] | None  # column, row
    rays: np.ndarray  # right ones, (height, width, 3)


@dataclass(frozen=True, kw_only=True)
class Climb:
    """One climb: the random scene that it began with, and the highest that it came to."""

    start: str
    first: float  # the ratio of that scene
    height: Height
    tries: int  # renders


class ScenesClimb:
    """Climbs over random scenes until the tries or the time are over."""

    def __init__(self, render: Renderer, *, seed: int, tries: int | None, seconds: float | None) -> None:
        self.tries, self.interrupted = 0, False
        self.climbs: list[Climb] = []
        self._render, self._seed, self._most = render, seed, tries
        self._end = None if seconds is None else time.monotonic() + seconds

    @property
    def spent(self) -> bool:
        """Say whether the tries or the time are over."""
        return (self._most is not None and self.tries >= self._most) or (
            self._end is not None and time.monotonic() >= self._end
        )

    @property
    def worst(self) -> Climb | None:
        """Return the climb that came highest; the first of equal ones."""
        return max(self.climbs, key=lambda climb: climb.height.ratio, default=None)

    def run(self, tell: Callable[["ScenesClimb"], None]) -> None:
        """Climb again and again, at least once. Ctrl-C ends the search with what it has."""
        try:
            while not self.climbs or not self.spent:
                self._climb(len(self.climbs), tell)
        except KeyboardInterrupt:
            self.interrupted = True

    def _climb(self, number: int, tell: Callable[["ScenesClimb"], None]) -> None:
        before, draws = self.tries, Draws(EDITION, self._seed, number, STREAM)
        aim = AIMS[number % len(AIMS)]
        starts = [random_case(self._seed, FIRST * number + place) for place in range(FIRST)]
        heights = [(case.name, height) for case in starts if (height := self._height(case.scene, aim)) is not None]
        if not heights:
            return
        start, highest = max(heights, key=lambda pair: pair[1].ratio)
        first, futile, tried = highest.ratio, 0, {repr(scene_to_json(highest.scene))}
        self.climbs.append(Climb(start=start, first=first, height=highest, tries=self.tries - before))
        while futile < PATIENCE and math.isfinite(highest.ratio) and not self.spent:
            futile += 1
            scene = _changed(highest, draws)
            if scene is None or (text := repr(scene_to_json(scene))) in tried:
                continue
            tried.add(text)
            height = self._height(scene, aim)
            if height is not None and height.ratio > highest.ratio:
                highest, futile = height, 0
            self.climbs[-1] = Climb(start=start, first=first, height=highest, tries=self.tries - before)
            tell(self)

    def _height(self, scene: Scene, aim: Stage) -> Height | None:
        """Return how far off the renderer is at a stage, or where a check fails; None where something has no answer."""
        self.tries += 1
        answered = judged(scene, self._render)
        if answered is None:
            return None
        verdict, _, truth = answered
        failed = [check for check in verdict.checks if check.outcome is Outcome.FAIL]
        passed = [check for check in verdict.checks if check.outcome is Outcome.PASS and check.stage is aim]
        worst = max(failed or passed, key=_ratio, default=None)
        if worst is None:
            return None
        parts = [part for part in (worst.continued, worst.end_to_end) if part is not None]
        part = max(parts, key=lambda part: part.worst_ratio, default=None)
        pixel = None if part is None else part.pixel
        return Height(scene=scene, ratio=_ratio(worst), stage=worst.stage, pixel=pixel, rays=truth[Stage.RAY])


def _ratio(check: Check) -> float:
    """Return a check's largest error over its limit; a check that passes has none above 1."""
    ratio = 0.0 if math.isnan(check.ratio) else check.ratio
    return max(ratio, math.nextafter(1.0, 2.0)) if check.outcome is Outcome.FAIL else min(ratio, 1.0)


def _changed(highest: Height, draws: Draws) -> Scene | None:
    """Return the scene with one to three changes; None where no such scene can be."""
    scene = highest.scene
    try:
        with np.errstate(all="ignore"):
            for _ in range(draws.choice((1, 1, 2, 3))):
                change = draws.choice((_number, _number, _number, _number, _feature, _fewer, _moved_eye))
                scene = change(scene, draws)
            return _zoomed(replace(highest, scene=scene), draws) if draws.chance(0.1) else scene
    except (SceneError, OverflowError, ZeroDivisionError, np.linalg.LinAlgError):
        return None


def _number(scene: Scene, draws: Draws) -> Scene:
    """Change one number of a scene."""
    group = draws.choice(groups(scene))
    values = group.values.copy()
    if not values.size:
        return scene
    place = draws.whole(0, values.size - 1)
    value, kind = float(values.flat[place]), draws.whole(0, 5)
    if kind == 0:
        single = np.float32(value)
        for _ in range(draws.choice(ULPS)):
            single = np.nextafter(single, np.float32(np.inf if draws.chance(0.5) else -np.inf))
        value = float(single)
    elif kind == 1:
        value *= 2.0 ** draws.whole(-10, 10)
    elif kind == 2:
        value += (value or 1.0) * draws.choice((-1, 1)) * draws.logarithmic(1e-7, 1.0)
    elif kind == 3:
        value = float(values.flat[draws.whole(0, values.size - 1)])
    elif kind == 4:
        value = draws.choice((0.0, 1.0, -1.0, -value))
    else:
        value = float(f"{value:.1g}")
    values.flat[place] = value
    return group.put(scene, values)


def _feature(scene: Scene, draws: Draws) -> Scene:
    """Add a feature of random scenes, to a scene that has a shape."""
    if not scene.shapes:
        return scene
    camera = scene.camera
    draft = Draft(
        draws=draws,
        shapes=[*scene.shapes],
        lights=[*scene.lights],
        shading=scene.shading,
        clip=scene.clip,
        **{name: getattr(camera, name) for name in ("eye", "target", "up", "fovy", "width", "height", "near", "far")},
    )
    lit = bool(scene.lights)
    usable = [name for name in FEATURES if name not in BARE and (lit or FEATURES.about(name)["step"] != Step.LIGHTS)]
    FEATURES[draws.choice(usable)](draft)
    return draft.scene()


def _fewer(scene: Scene, draws: Draws) -> Scene:
    """Leave out a shape or a light, the last ones excepted."""
    kind = draws.choice(("shapes", "lights"))
    parts = list(getattr(scene, kind))
    if len(parts) > 1:
        parts.pop(draws.whole(0, len(parts) - 1))
    return replace(scene, **{kind: tuple(parts)})


def _moved_eye(scene: Scene, draws: Draws) -> Scene:
    """Move the eye towards the target, or away, by a power of two of their distance."""
    camera = scene.camera
    away = np.subtract(camera.eye, camera.target) * 2.0 ** draws.whole(-6, 6)
    return replace(scene, camera=replace(camera, eye=vector(np.asarray(camera.target) + away)))


def _zoomed(highest: Height, draws: Draws) -> Scene:
    """Aim the camera at the worst pixel and narrow its view."""
    scene, camera = highest.scene, highest.scene.camera
    if highest.pixel is None or camera.height < ZOOM:
        return scene
    near = aimed(scene, highest.rays, highest.pixel, camera.height // ZOOM)
    return replace(near, camera=replace(near.camera, width=camera.width, height=camera.height))
