"""What a law of light says of two or more images of one renderer, as plain data: nobody else's image is asked for.

A law asks a renderer for the image of a scene and of scenes that it changes in a known way, and yields relations: what
each stage of the changed scene must be (`expected`, made from the first image) and what it is (`measured`). Both come
from the one under test, so that the law holds for any renderer, and only rounding may keep the two apart.
Source: Chen, Cheung and Yiu, Metamorphic Testing: A New Approach for Generating Next Test Cases (1998).
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from rayproof.cases.scene import Scene
from rayproof.cases.stages import IMAGE_STAGES, Stage, StageImages

LIGHT = (Stage.IRRADIANCE, Stage.EXITANCE, Stage.RADIANCE)
GEOMETRY = (Stage.RAY, Stage.OBJECT, Stage.DISTANCE, Stage.POSITION, Stage.NORMAL)
Map = Callable[[np.ndarray], np.ndarray]
Maps = Mapping[Stage, Map]


class Ask(Protocol):
    """The renderer that a law is put to."""

    def __call__(self, scene: Scene) -> StageImages:
        """Return every stage that it answers of `scene` and that is to be looked at; radiance alone, it may be."""
        ...


@dataclass(frozen=True, kw_only=True)
class Conditions:
    """What a law knows of its own conditioning, in multiples of what the scenes themselves explain."""

    factor: float = 1.0  # times which the law magnifies rounding
    truncation: float = 0.0  # relative: what a finite sum leaves out
    rebaked: bool = False  # it moves or divides triangles, whose corners are then rounded to float32 anew
    exact: bool = False  # only powers of two were touched, or nothing at all: equal to the last bit


@dataclass(frozen=True, kw_only=True, eq=False)
class Relation:
    """One stage of a changed scene: what a law expects, from the same renderer's other images, and what was measured.

    Images (height, width, channels) in the stage's unit; those of `Stage.CAMERA` are lists of numbers in that shape.
    """

    stage: Stage
    expected: np.ndarray
    measured: np.ndarray
    scene: Scene  # the one whose image `expected` was made from
    changed: Scene  # the one that `measured` is an image of
    what: str  # the change, in words
    terms: np.ndarray | None = None  # sum of the sizes of what `expected` was added up from, where that is larger
    examined: np.ndarray | None = None  # (height, width) bool: pixels that the law speaks of; None: all
    conditions: Conditions = field(default_factory=Conditions)


def related(
    ask: Ask,
    scene: Scene,
    changed: Scene,
    *,
    what: str,
    before: Maps | None = None,
    after: Maps | None = None,
    stages: tuple[Stage, ...] = IMAGE_STAGES,
    conditions: Conditions | None = None,
    examined: np.ndarray | None = None,
) -> Iterator[Relation]:
    """Yield, for each of `stages` that the renderer answers, the relation of two scenes' images.

    `before` maps the images of `scene` to what the law expects, `after` those of `changed` to what is comparable with
    it; a stage that neither names is compared as it is.
    """
    one, other = ask(scene), ask(changed)
    for stage in stages:
        if stage in one and stage in other:
            expected = (before or {}).get(stage, _itself)(one[stage])
            measured = (after or {}).get(stage, _itself)(other[stage])
            yield Relation(
                stage=stage,
                expected=expected,
                measured=measured,
                scene=scene,
                changed=changed,
                what=what,
                examined=examined,
                conditions=conditions or Conditions(),
            )


def _itself(image: np.ndarray) -> np.ndarray:
    return image


def added(
    ask: Ask, parts: tuple[Scene, ...], whole: Scene, *, what: str, weights: tuple[float, ...] = ()
) -> Iterator[Relation]:
    """Yield for each stage of light that the image of `whole` is the (weighted) sum of the images of `parts`."""
    several, together = [ask(part) for part in parts], ask(whole)
    shares = weights or (1.0,) * len(parts)
    for stage in LIGHT:
        if stage in together and all(stage in one for one in several):
            terms = [share * one[stage] for share, one in zip(shares, several, strict=True)]
            yield Relation(
                stage=stage,
                expected=np.sum(terms, axis=0),
                measured=together[stage],
                scene=parts[0],
                changed=whole,
                what=what,
                terms=np.sum(np.abs(terms), axis=0),
            )


def everywhere(turn: Map) -> dict[Stage, Map]:
    """Return maps that do the same to every image stage."""
    return dict.fromkeys(IMAGE_STAGES, turn)


def faces(change: Map) -> dict[Stage, Map]:
    """Return the map of the object stage that changes its face indices."""

    def renumbered(image: np.ndarray) -> np.ndarray:
        return np.stack([image[..., 0], change(image[..., 1])], axis=-1)

    return {Stage.OBJECT: renumbered}
