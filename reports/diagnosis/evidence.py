"""`Evidence`: a renderer's images of one case, compared with the oracle, right or with a mistake."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cache, cached_property

import numpy as np

from rayproof.cases.rounding import gamma
from rayproof.cases.scene import Mesh, Scene
from rayproof.cases.stages import IMAGE_STAGES, Resolution, Stage, StageImages
from rayproof.reference.analytic import Analytic
from rayproof.reference.analytic.camera import pixel_centers
from rayproof.reports.judge.against_oracle import AgainstOracle
from rayproof.reports.judge.answers import Answers, well_shaped
from rayproof.reports.judge.forward.conditioning import condition
from rayproof.reports.judge.forward.limits import Limits, Roundoff, limits
from rayproof.reports.judge.measurement import error, ratios
from rayproof.reports.judge.nearby.clouds import LIGHT
from rayproof.reports.judge.oracle import stages_of
from rayproof.reports.judge.scene_truth import SceneTruth, scene_truth
from rayproof.reports.mistakes import Family, Mistake, lights_only

PRECISION = "float32"  # of stored results, whatever the precision of the renderer's arithmetic
MOST_OVER = 0.05  # share of the pixels: rounding does not explain more pixels over their limits
LEFT = 0.1  # largest share of the wrong pixels that a mistake may leave unexplained
MOST_LEFT = 0.002  # the same, as a share of the image
TELLS = 0.5  # limits of the right oracle: an oracle with a smaller difference from it explains nothing
SHOWS = 0.01  # share of the image: a mistake that changes more pixels is visible
LOOKED_AT = 400  # pixels: with 98 % probability, a change of 1 % of the image changes one of these
MORE = gamma(16, precision=PRECISION)  # relative: roundings that a mistake adds to the counted roundings
WIDEST = 0.01  # relative: the largest limit to which a mistake may widen a limit
# The sample of pixels: the number drawn from the wrong pixels, and from all; the shares of these that may be off.
DRAWN, OFF_OF_WRONG, OFF_OF_ALL = 80, 0.15, 0.1
# Coarse tolerances, relative to the value's size: rounding explains no larger difference.
COARSE = {Stage.RAY: 1e-4, Stage.DISTANCE: 1e-3, Stage.POSITION: 1e-3, Stage.NORMAL: 5e-3}
COARSE_LIGHT = 3e-3
RIGHT = Analytic()


@dataclass(frozen=True, kw_only=True, eq=False)
class SupposedTruth(SceneTruth):
    """The images of an oracle with a mistake; where the mistake makes light brighter, its limits grow in proportion."""

    basis: StageImages  # the images before the mistakes of writing; the limits are computed from them

    @cached_property
    def limits(self) -> Callable[..., Limits]:
        """Return a function of a roundoff and `by_matrices` that returns the limits for such rounding."""
        return cache(self._limits)

    def _limits(self, g: Roundoff, *, by_matrices: bool) -> Limits:
        plain_limits = limits(self.scene, self.basis, self.conditioning, g, by_matrices=by_matrices)
        plain, whole = dict(self.basis), dict(plain_limits.end_to_end)
        for stage in LIGHT:
            if stage not in whole:
                continue
            size = self.scene.camera.height, self.scene.camera.width
            rows = {
                image_stage: image.reshape(size[0] * size[1], -1)
                for image_stage, image in plain.items()
                if image_stage in IMAGE_STAGES
            }
            plain[stage] = RIGHT.continued(self.scene, stage, rows).reshape(*size, 3)
            value, limit = np.abs(self.truth[stage]), whole[stage]
            brighter = np.nan_to_num(value / np.abs(plain[stage]), nan=1.0, posinf=1.0)
            changed = ~np.isclose(brighter, 1.0, rtol=1e-9, atol=0)
            widened = limit * np.maximum(brighter, 1.0) + MORE * value * changed
            whole[stage] = np.nan_to_num(np.maximum(limit, np.minimum(widened, WIDEST * value)))
        return replace(plain_limits, end_to_end=whole)


def supposed(scene: Scene, stages: tuple[Stage, ...], oracle: Analytic) -> SceneTruth:
    """Return the images of an oracle with a mistake, with their limits."""
    truth = basis = oracle.render(scene, stages)
    if type(oracle).image is not Analytic.image:
        basis = type("Unwritten", (type(oracle),), {"image": Analytic.image})().render(scene, stages)
    return SupposedTruth(scene=scene, truth=truth, conditioning=condition(scene, basis), oracle=oracle, basis=basis)


@dataclass(eq=False, kw_only=True)
class Evidence:
    """A case of a run with the renderer's images."""

    case: str
    scene: Scene
    load: Callable[[], StageImages]
    failed: bool
    name: str = "renderer"  # the name that selects its model of rounding
    shadow_epsilon: float = 0.0  # m: as the renderer declares it
    world_normals: bool = False
    resolutions: dict[Stage, Resolution] = field(default_factory=dict)  # steps of coarse output, from the images
    kept: dict[type, dict[Stage, np.ndarray]] = field(default_factory=dict)  # samples of mistakes without parameters
    kept_hits: dict[tuple[type, ...], dict[Stage, np.ndarray]] = field(default_factory=dict)  # samples before light
    explains_known: dict[object, bool] = field(default_factory=dict)

    @cached_property
    def images(self) -> StageImages:
        """Return the renderer's image stages of the scene's size, as float64."""
        with np.errstate(invalid="ignore"):  # the conversion changes signalling NaNs
            loaded = {stage: np.asarray(image, dtype=np.float64) for stage, image in self.load().items()}
        used = {stage: image for stage, image in loaded.items() if stage in stages_of(self.scene)}
        renderer = Answers(name="renderer", precision=PRECISION, answers=used)
        return dict(well_shaped(self.scene, renderer).answers)

    @cached_property
    def stages(self) -> tuple[Stage, ...]:
        """Return the renderer's image stages, in order."""
        return tuple(stage for stage in IMAGE_STAGES if stage in self.images)

    @cached_property
    def kinds(self) -> tuple[type, ...]:
        """Return the kinds of shapes in the scene."""
        return tuple(dict.fromkeys(type(shape) for shape in self.scene.shapes))

    @property
    def work(self) -> int:
        """Return an estimate of the scene's render time in arbitrary units; mistakes are tried on cheap cases first."""
        faces = sum(len(shape.faces) if isinstance(shape, Mesh) else 1 for shape in self.scene.shapes)
        return self.scene.camera.width * self.scene.camera.height * (faces + 4) * (2 + len(self.scene.lights))

    def judge_by(self, resolutions: Mapping[Stage, Resolution]) -> None:
        """Judge the images anew by their steps of storage."""
        self.resolutions = dict(resolutions)
        self._judge_anew()

    def judge_instead(self, images: StageImages) -> None:
        """Judge other images in place of the renderer's, such as its images in another encoding."""
        self.load = lambda: images
        self._judge_anew()

    def _judge_anew(self) -> None:
        for memo in (self.explains_known, self.kept, self.kept_hits):
            memo.clear()
        for name in ("images", "stages", "right", "wrong", "drawn", "own", "looked_at", "blank"):
            vars(self).pop(name, None)

    def held(self, oracle: Analytic) -> AgainstOracle:
        """Return the comparison of the renderer's images with an oracle."""
        stages = tuple(stage for stage in stages_of(self.scene) if stage is not Stage.CAMERA)
        with np.errstate(all="ignore"):
            right = oracle is RIGHT
            base = scene_truth(self.scene, stages, RIGHT) if right else supposed(self.scene, stages, oracle)
        renderer = Answers(
            name=self.name, precision=PRECISION, answers=self.images, resolutions=self.resolutions,
            world_normals=self.world_normals, shadow_epsilon=self.shadow_epsilon,
        )  # fmt: skip
        return AgainstOracle(base=base, renderer=renderer)

    @cached_property
    def right(self) -> AgainstOracle:
        """Return the comparison of the images with the right oracle."""
        return self.held(RIGHT)

    @cached_property
    def wrong(self) -> np.ndarray:
        """Return the pixels (height, width) that are wrong by the right oracle, at any stage."""
        over = over_of(self.right)
        return wrong_of(self.right) if over.mean() < MOST_OVER else over

    def explains(self, mistake: type[Mistake]) -> bool:
        """Return whether an oracle with a mistake explains this case."""
        if mistake not in self.explains_known:
            with np.errstate(all="ignore"):
                self.explains_known[mistake] = self._explains(mistake)
        return self.explains_known[mistake]

    def _explains(self, mistake: type[Mistake]) -> bool:
        oracle = mistake()
        if not self.agrees(oracle):
            return False
        against, allowed = self.held(oracle), min(LEFT * np.count_nonzero(self.wrong), MOST_LEFT * self.wrong.size)
        over = over_of(against)
        few = np.count_nonzero(over) <= allowed
        if not few and (over.mean() > MOST_OVER or np.count_nonzero(wrong_of(against)) > allowed):
            return False
        return self._tells(against)

    def _tells(self, against: AgainstOracle) -> bool:
        """Return whether an oracle differs from the right one by over `TELLS` limits in half of the wrong pixels."""
        differs, right = np.zeros_like(self.wrong), self.right.base.truth
        for stage in self.stages:
            limit = self.right.limits.end_to_end.get(stage, self.right.base.no_limit)
            differs |= ~(ratios(stage, against.base.truth[stage], right[stage], limit)[0] <= TELLS)
        return bool(2 * np.count_nonzero(differs & self.wrong) >= np.count_nonzero(self.wrong))

    @cached_property
    def drawn(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the numbers (n,) of a sample of pixels, and the mask (n,) of wrong ones by the right oracle."""
        draw, wrong = np.random.default_rng(0), np.flatnonzero(self.wrong.ravel())
        wrong_pixels = draw.permutation(wrong)[:DRAWN]
        any_pixels = draw.permutation(self.wrong.size)[:DRAWN]
        pixels = np.concatenate([wrong_pixels, any_pixels])
        return pixels, self.wrong.ravel()[pixels]

    @cached_property
    def own(self) -> dict[Stage, np.ndarray]:
        """Return the renderer's values (n, channels) at the sample."""
        pixels, _ = self.drawn
        return {stage: image.reshape(len(self.wrong.ravel()), -1)[pixels] for stage, image in self.images.items()}

    def sampled(self, oracle: Analytic) -> dict[Stage, np.ndarray]:
        """Return an oracle's values (n, channels) at the sample."""
        kind = type(oracle)
        if kind in self.kept:
            return self.kept[kind]
        with np.errstate(all="ignore"):
            rows = self._lit(oracle) if self.stages[-1] in LIGHT else self._asked(oracle)
        if isinstance(oracle, Mistake) and not oracle.parts and not oracle.parameters:  # needed again in later rounds
            self.kept[kind] = rows
        return rows

    def _asked(self, oracle: Analytic, last: Stage | None = None) -> dict[Stage, np.ndarray]:
        points = pixel_centers(self.scene.camera)[self.drawn[0]]
        return oracle.samples(self.scene, points, last or self.stages[-1]).rows

    def _lit(self, oracle: Analytic) -> dict[Stage, np.ndarray]:
        """Return the sample; mistakes of light that agree in all earlier stages share these from `kept_hits`."""
        kinds = oracle.parts if isinstance(oracle, Mistake) and oracle.parts else (type(oracle),)
        before = tuple(kind for kind in kinds if not lights_only(kind))
        if before == kinds or any(issubclass(kind, Family) for kind in before):
            return self._asked(oracle)
        if before not in self.kept_hits:
            made = type("Hits", (*before, Analytic), {"image": Analytic.image})
            self.kept_hits[before] = self._asked(made(), Stage.VISIBILITY)
        rows, scene = dict(self.kept_hits[before]), oracle.scene(self.scene)
        for stage in LIGHT[: LIGHT.index(self.stages[-1]) + 1]:
            rows[stage] = oracle.continued(scene, stage, rows)
        points = pixel_centers(self.scene.camera)[self.drawn[0]]
        return {stage: oracle.image(scene, stage, values, points) for stage, values in rows.items()}

    def off(self, values: Mapping[Stage, np.ndarray], stages: tuple[Stage, ...] | None = None) -> np.ndarray:
        """Return the mask (n,) of the sample's pixels whose errors at any stage are larger than rounding explains."""
        is_off = np.zeros(len(self.drawn[0]), dtype=bool)
        for stage in self.stages if stages is None else stages:
            if stage in values:
                is_off |= off(stage, self.own[stage], values[stage], self.resolutions.get(stage))
        return is_off

    def off_each_other(self, first: Analytic, second: Analytic) -> np.ndarray:
        """Return the mask (n,) of the sample's pixels whose values by two oracles differ by more than rounding."""
        first_values, second_values = self.sampled(first), self.sampled(second)
        differs = np.zeros(len(self.drawn[0]), dtype=bool)
        for stage in self.stages:
            differs |= off(stage, first_values[stage], second_values[stage])
        return differs

    def agrees(self, oracle: Analytic) -> bool:
        """Return whether an oracle may explain this case: its sample agrees within coarse tolerances."""
        wrong, is_off = self.drawn[1], self.off(self.sampled(oracle))
        if not wrong.any():
            return False
        return bool(is_off[wrong].mean() <= OFF_OF_WRONG and is_off.mean() <= OFF_OF_ALL)

    def shows(self, mistake: type[Mistake]) -> bool:
        """Return whether a mistake changes more than 1 % of a sample of pixels, at the renderer's stages."""
        if not self.stages:
            return False
        points, last = pixel_centers(self.scene.camera)[self.looked_at], self.stages[-1]
        with np.errstate(all="ignore"):
            values = mistake().samples(self.scene, points, last).rows
            changed = np.zeros(len(points), dtype=bool)
            for stage in self.stages:
                right = self.right.base.truth[stage].reshape(self.wrong.size, -1)[self.looked_at]
                changed |= off(stage, values[stage], right)
        return bool(changed.mean() > SHOWS)

    @cached_property
    def looked_at(self) -> np.ndarray:
        """Return the numbers (n,) of a sample of all pixels, wrong or not."""
        return np.random.default_rng(1).permutation(self.wrong.size)[:LOOKED_AT]

    @cached_property
    def blank(self) -> bool:
        """Return whether each image has a single value, so that many mistakes explain it equally well."""
        return all(np.all(image == image[:1, :1]) for image in self.images.values())


def off(stage: Stage, values: np.ndarray, expected: np.ndarray, step: Resolution | None = None) -> np.ndarray:
    """Return the mask (...) of the pixels whose values differ by more than rounding explains."""
    with np.errstate(all="ignore"):
        wrong = error(stage, values, expected)
        wrong = wrong.max(axis=-1) if wrong.ndim == values.ndim else wrong
        if stage in (Stage.OBJECT, Stage.VISIBILITY):
            return np.asarray(~(wrong == 0))
        size = np.linalg.norm(np.where(np.isfinite(expected), expected, 0.0), axis=-1)
        if stage in LIGHT:
            largest = np.abs(expected[np.isfinite(expected)]).max(initial=0.0)
            limit = COARSE_LIGHT * size + 1e-5 * largest
        else:
            limit = COARSE[stage] * np.maximum(size, 1.0 if stage in (Stage.RAY, Stage.NORMAL) else 1e-3)
        if step is not None:
            limit = limit + 2 * (step.relative * size + step.absolute)
        return np.asarray(~(wrong <= limit))


def over_of(against: AgainstOracle) -> np.ndarray:
    """Return the pixels (height, width) over the forward limit of any stage."""
    over = np.zeros(against.base.conditioning.hit.shape, dtype=bool)
    with np.errstate(all="ignore"):
        for stage in IMAGE_STAGES:
            if against.answers(stage):
                over |= against.over(stage)
    return over


def wrong_of(against: AgainstOracle) -> np.ndarray:
    """Return the pixels (height, width) that no nearby problem explains, at any stage."""
    wrong = np.zeros(against.base.conditioning.hit.shape, dtype=bool)
    with np.errstate(all="ignore"):
        for pixels in against.end_to_end.values():
            wrong |= pixels.wrong
    return wrong
