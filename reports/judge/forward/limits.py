"""Limits of each stage and pixel: unit roundoff x conditioning x count of roundings; calibrations of references.

Each stage has two limits. `continued` bounds the error of only this stage, given the tracer's own previous stage;
`end_to_end` adds the propagated errors of the previous stages. Each is linear in the unit roundoff, so that the limits
of a float32 reference are added. The counts are counts of operations on the longest path of a straightforward
evaluation; a formula with more roundings loses digits without need. docs/judging.md derives each.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import KW_ONLY, dataclass, field, replace

import numpy as np

from rayproof.cases.rounding import gamma
from rayproof.cases.scene import Scene
from rayproof.cases.stages import Resolution, Stage, StageImages
from rayproof.reports.judge.answers import dot, length
from rayproof.reports.judge.forward.conditioning import Conditioning

RAY = 16  # axes 8 (difference, two normalisations, cross product), combination 4, normalisation 4
AIM = 2  # eye and target, each rounded when it is read, and once more in the renderer's precision
MATRICES = 8  # a 4x4 product each by the inverse projection and the inverse view (CAM-5)
HIT = 16  # ray into object space 7, solve 9
POINT = 4  # product and sum, rounded; origin rounded once
NORMAL = 16  # point into object space 7, inverse transpose 5, normalisation 4
# Corners v that are rounded once are off by at most d = u |v|. That turns a triangle of least height h by no more than
# 2 d / (h - 2 d): its plane tilts by 2 d over a height that is itself shorter by 2 d. This is at most 4 d / h unless h
# is below 4 d; then the limit is above 1 and the normal is arbitrary.
BAKING = 4
CORNERS = 10  # two corners of five roundings each (matrix entry, product, three sums), over the least height
LIGHT = 12  # difference, length 4, two dot products' worth of sums, product of flux, cosine and 1 / (4 pi r^2)

BECAUSE: dict[Stage, str] = {
    Stage.CAMERA: "16 roundings times the condition of the axes and of 1/near - 1/far",
    Stage.RAY: f"{RAY} roundings times the condition of the camera's axes, tan(alpha) and pixel coordinates, which are "
    f"differences with 1, {AIM} times (|eye| + |target|) / |target - eye|; CAM-5 adds |eye| / near",
    Stage.OBJECT: "whole numbers: equal, or what a nearby problem hits",
    Stage.DISTANCE: f"{HIT} roundings of the data along the normal over |n.d| (implicit function theorem), plus "
    "t times the ray's error times tan(incidence) end to end",
    Stage.POSITION: f"{POINT} roundings of |eye| + t, plus the errors of distance and ray end to end",
    Stage.NORMAL: f"{NORMAL} roundings times the model matrix's condition, plus curvature times the position's error",
    Stage.VISIBILITY: "0 or 1: equal, or what a nearby problem sees",
    Stage.IRRADIANCE: f"{LIGHT} roundings, the light's direction (|light| + r)/r, plus the change of "
    "cos/r^2 with position and normal",
    Stage.EXITANCE: "3 roundings of albedo E, plus albedo times the error of E",
    Stage.RADIANCE: "4 roundings of M/pi, plus the error of M over pi",
}


@dataclass(frozen=True, kw_only=True)
class Limits:
    """Largest allowed error of each image stage, shape (height, width) or (height, width, 3)."""

    continued: dict[Stage, np.ndarray]
    end_to_end: dict[Stage, np.ndarray]
    cosine: np.ndarray  # (height, width, lights): error of dot(N, L); for a smaller dot(N, L) the side is undecided
    relative: np.ndarray  # (height, width, lights): relative error of cos / r^2, for a light straight above
    lights: np.ndarray  # (height, width, lights, 3): error of each light's irradiance, if it is visible
    position: np.ndarray  # m, end to end
    aimed: np.ndarray  # m: the part of `position` that is the same in all pixels: eye, target, sample offset
    lifted: np.ndarray  # m: the part of `position` along the normal

    def plus(self, summand: "Limits") -> "Limits":
        """Return the limits of the difference of two answers, the sums of both limits."""
        images = ("cosine", "relative", "lights", "position", "aimed", "lifted")
        return Limits(
            continued={stage: self.continued[stage] + summand.continued[stage] for stage in self.continued},
            end_to_end={stage: self.end_to_end[stage] + summand.end_to_end[stage] for stage in self.end_to_end},
            **{name: getattr(self, name) + getattr(summand, name) for name in images},
        )


@dataclass(frozen=True)
class Roundoff:
    """gamma(count) of one precision, times a constant (1 if derived, more for a calibrated reference)."""

    precision: str
    _: KW_ONLY
    scale: float = 1.0
    origin: str = field(default="derived: float64 with the same counts of roundings", compare=False)
    baked: bool = False  # computes triangles' normals from their float32 corners in world space
    placed: bool = False  # computes squares' and cubes' normals from corners in world space, in its own precision
    local: bool = False  # computes a sphere's position from its hit in object space
    short: bool = False  # solves for this hit in float32, with a direction of any length
    radius: float = 0.0  # px: largest distance of a ray from its image point

    def __call__(self, count: float) -> float:
        """Return the bound on the relative error of `count` roundings."""
        return self.scale * gamma(count, precision=self.precision)


def limits(scene: Scene, truth: StageImages, conditioning: Conditioning, g: Roundoff, *, by_matrices: bool) -> Limits:
    """Return the limits of one precision, for the stages in `truth`.

    `by_matrices`: the ray was computed by CAM-5, whose w is a difference of numbers of size far / near.
    """
    c = conditioning
    # All rays may miss their points on the same side; of the two image directions the larger angle counts.
    aim = g(AIM) * c.aim + g.radius * c.pixel_angle / c.axial
    ray = g(RAY) * c.ray + aim
    if by_matrices:
        # The point on the near plane is at the distance near / cosine of the ray's angle to the axis.
        ray = ray + g(MATRICES) * (1 + float(np.linalg.norm(scene.camera.eye)) / scene.camera.near * c.axial)
    eye = float(np.linalg.norm(scene.camera.eye))
    distance = g(HIT) * c.along_ray
    point = g(POINT) * (eye + c.distance)
    normal = c.rounded(g(NORMAL))
    if g.baked:
        normal = normal + gamma(BAKING, precision="float32") * c.baking
    if g.placed:
        normal = normal + g(CORNERS) * c.placing
    sine = np.sqrt(np.clip(1 - c.cosine**2, 0, 1))
    all_distance = distance + ray * c.swing * sine
    # An object-space hit is on the object-space ray, which rounding has moved off the pixel's ray in any direction.
    carried = (g(HIT) * c.carried + g(POINT) * c.put_back) * g.local + g(HIT) * c.solved / c.cosine * g.short
    all_position = all_distance + ray * c.distance + point + carried
    # A renderer with hits in object space returns their positions; its distance is the length from the eye to them.
    distance, all_distance = distance + carried, all_distance + carried
    all_normal = normal + c.turned(all_position)
    own = {Stage.RAY: ray, Stage.DISTANCE: distance, Stage.POSITION: point, Stage.NORMAL: normal}
    whole = {Stage.RAY: ray, Stage.DISTANCE: all_distance, Stage.POSITION: all_position, Stage.NORMAL: all_normal}
    for errors in (own, whole):
        for stage in (Stage.DISTANCE, Stage.POSITION, Stage.NORMAL):
            errors[stage] = np.where(c.hit, errors[stage], 0.0)
    # A hit's error along the normal is less than along the surface, where the ray's error moves it: such a slide does
    # not turn a flat surface away from a light, and its effect on a curved surface is part of the normal's error.
    lifted = np.where(c.hit, g(HIT) * (c.surface + c.distance * c.cosine) + point, 0.0)
    cosine = relative = np.zeros((*c.hit.shape, len(scene.lights)))
    lights = np.zeros((*c.hit.shape, len(scene.lights), 3))
    if Stage.IRRADIANCE in truth:
        lights, relative = _light(scene, truth, g, all_position, all_normal)
        irradiance = _visible(lights, truth)
        cosine = _turned(scene, truth, g, lifted, all_position, all_normal)
        # A triangle's normal is computed in object space, and its plane from the baked corners: in every renderer, a
        # shadow ray between the horizons of the two that starts along the normal hits the triangle itself.
        baked = (gamma(BAKING, precision="float32") * c.baking)[..., np.newaxis]
        cosine, relative = cosine + baked, relative + baked
        albedo = _albedo(scene, truth)
        per_radiance = albedo if scene.shading == "simplified" else albedo / math.pi
        whole[Stage.IRRADIANCE] = irradiance
        if Stage.EXITANCE in truth:
            whole[Stage.EXITANCE] = albedo * irradiance + g(3) * truth[Stage.EXITANCE]
        if Stage.RADIANCE in truth:
            whole[Stage.RADIANCE] = per_radiance * irradiance + g(7) * truth[Stage.RADIANCE]
    return Limits(
        continued=own,
        end_to_end=whole,
        cosine=cosine,
        relative=relative,
        lights=lights,
        position=np.where(c.hit, all_position, 0.0),
        aimed=np.where(c.hit, aim * (c.swing * sine + c.distance), 0.0),
        lifted=lifted,
    )


def continued_position_limit(scene: Scene, received: StageImages, roundoffs: Sequence[Roundoff]) -> np.ndarray:
    """Return the limit of the position (height, width) continued from a given distance [m]."""
    distance = received[Stage.DISTANCE][..., 0]
    reach = float(np.linalg.norm(scene.camera.eye)) + np.where(np.isfinite(distance), np.abs(distance), 0.0)
    return sum(g(POINT) for g in roundoffs) * reach


def continued_light_limit(
    scene: Scene, stage: Stage, received: StageImages, value: np.ndarray, g: Roundoff
) -> np.ndarray:
    """Return the limit of irradiance, exitance or radiance `value` that the oracle continued from `received` stages."""
    if stage is Stage.IRRADIANCE:
        return _visible(_light(scene, received, g, np.float64(0.0), np.float64(0.0))[0], received)
    return g(3 if stage is Stage.EXITANCE else 4) * np.abs(value)


def _light(
    scene: Scene, answers: StageImages, g: Roundoff, position_error, normal_error
) -> tuple[np.ndarray, np.ndarray]:
    """Return the limits of each visible light's irradiance (height, width, lights, 3) and of its cos / r^2."""
    position = answers[Stage.POSITION]
    lights = np.zeros((*position.shape[:2], len(scene.lights), 3))
    each_relative = np.zeros((*position.shape[:2], len(scene.lights)))
    # cos / r^2 changes three times as fast with position as cos does.
    power = 3 if scene.shading == "inverse_square" else 1
    for index, light in enumerate(scene.lights):
        place = np.asarray(light.position, dtype=np.float64)
        r = length(place - position)
        with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
            relative = g(LIGHT) + g(2) * power * (np.linalg.norm(place) + r) / r
            relative = relative + power * position_error / r + normal_error
            strength = np.asarray(light.flux)
            if scene.shading == "inverse_square":
                strength = strength / (4 * math.pi * r[..., np.newaxis] ** 2)
            each_relative[..., index] = relative
            lights[..., index, :] = np.nan_to_num(strength * relative[..., np.newaxis], nan=0.0, posinf=0.0)
    return lights, each_relative


def _visible(lights: np.ndarray, answers: StageImages) -> np.ndarray:
    """Return the sum (height, width, 3) of the visible lights' limits (height, width, lights, 3)."""
    visible = answers[Stage.VISIBILITY]
    limit = np.zeros((*lights.shape[:2], 3))
    for index in range(lights.shape[2]):
        limit += lights[..., index, :] * visible[..., index : index + 1]
    return limit


def _turned(
    scene: Scene,
    answers: StageImages,
    g: Roundoff,
    lifted: np.ndarray,
    position_error: np.ndarray,
    normal_error: np.ndarray,
) -> np.ndarray:
    """Return the error of each light's cosine (height, width, lights)."""
    position, normal = answers[Stage.POSITION], answers[Stage.NORMAL]
    errors = np.zeros((*position.shape[:2], len(scene.lights)))
    for index, light in enumerate(scene.lights):
        place = np.asarray(light.position, dtype=np.float64)
        r = length(place - position)
        with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
            cosine = np.abs(dot(place - position, normal)) / r
            errors[..., index] = g(LIGHT) + g(2) * (np.linalg.norm(place) + r) / r
            errors[..., index] += (lifted + cosine * position_error) / r + normal_error
    return errors


def _albedo(scene: Scene, truth: StageImages) -> np.ndarray:
    """Return the albedo at each pixel, (height, width, 3), 0 on a miss."""
    table = np.array([shape.albedo for shape in scene.shapes] + [(0.0, 0.0, 0.0)], dtype=np.float64)
    return table[truth[Stage.OBJECT][..., 0].astype(int)]


# Constants for references whose rounding is unknown: calibrated, labelled as such, fixed with their origin.
#
# A reference's limit is the derived limit at its precision times this constant. `analytic` needs no constant, because
# its roundings can be counted in its source. A constant is never widened to make a run pass; it is measured again, and
# `origin` describes the measurement.


# Mitsuba makes a mesh of its cube and two triangles of its rectangle; Radiance gets polygons.
# In the default suite no stage of Mitsuba 3.9.1 exceeds the limits derived for float32: the factor is 1.
# Mitsuba treats an ellipsoid as an instance and projects the hit onto the sphere before it transforms it to the world.
# Its LLVM variant solves for that hit in float32, the scalar variant in float64.
MITSUBA = "calibrated on Mitsuba 3.9.1: factor 1 at float32; normals from world-space corners, hits from object space"
# Its geometry is float64 with no more roundings than are counted; it declares its sums in float32 itself.
RADIANCE = "derived: float64 with the same counts of roundings; normals from world-space corners"
SCALAR = Roundoff("float32", origin=MITSUBA, baked=True, placed=True, local=True)
CALIBRATED: dict[str, Roundoff] = {
    "mitsuba_scalar": SCALAR,
    "mitsuba_llvm": replace(SCALAR, short=True),
    "radiance": Roundoff("float64", origin=RADIANCE, baked=True, placed=True),
}


def calibration(name: str) -> Roundoff:
    """Return a reference's constant and its additional roundings; the constant 1 and none if the limits are derived."""
    return CALIBRATED.get(name, Roundoff("float64"))


def roundoff_of(name: str, precision: str, *, world_normals: bool) -> Roundoff:
    """Return the roundoff of a renderer: derived for the tracer and the oracle, calibrated for other references."""
    roundoff = replace(calibration(name), precision=precision)
    return replace(roundoff, baked=True, placed=True) if world_normals else roundoff


# Coarse outputs: a program whose files resolve less than its arithmetic is judged by the steps of its files.
#
# A step moves a stage's own value, both end to end and continued. Its effect on later stages counts only if the oracle
# continues from this stage: the program itself continued from the number before writing it.


VECTORS = (Stage.RAY, Stage.POSITION, Stage.NORMAL)
# Whole numbers are exact in any format: no step applies to them.
WHOLE = (Stage.OBJECT, Stage.VISIBILITY)
# An output with fewer levels than a byte is no measurement.
COARSEST = 1 / 256


@dataclass(frozen=True, kw_only=True)
class Coarseness:
    """The declared steps of a renderer's output, if any."""

    resolutions: Mapping[Stage, Resolution]

    def step(self, stage: Stage, value: np.ndarray) -> np.ndarray | float:
        """Return the error of `value` (height, width, channels) due to the output's step, in the measure of errors.

        The shape is (height, width) for vectors and distances, (height, width, channels) for light. Values that are not
        finite have no step: a miss is a miss in any format.
        """
        resolution = self.resolutions.get(stage)
        if resolution is None or stage in WHOLE:
            return 0.0
        if stage in VECTORS:
            size, steps = length(np.asarray(value)), math.sqrt(3.0)
        else:
            size, steps = np.abs(value[..., 0] if stage is Stage.DISTANCE else value), 1.0
        finite = np.isfinite(size)
        if resolution.steps is not None and resolution.steps.shape == np.shape(value) and stage not in VECTORS:
            return np.where(finite, resolution.steps if np.ndim(size) == 3 else resolution.steps[..., 0], 0.0)
        return np.where(finite, resolution.relative * np.where(finite, size, 0.0) + steps * resolution.absolute, 0.0)

    def handed_down(self, scene: Scene, stage: Stage, received: StageImages, c: Conditioning) -> np.ndarray | float:
        """Return the error of the oracle's continued value due to the output steps of `received` stages.

        The derivatives are those of the limits: an error of the ray moves the hit, and an error of a point on a curved
        surface turns the normal and changes cos / r^2.
        """
        if not self.resolutions:
            return 0.0

        def moved(before: Stage) -> np.ndarray | float:
            return self.step(before, received[before]) if before in received else 0.0

        if stage is Stage.DISTANCE:
            return moved(Stage.RAY) * c.swing
        if stage is Stage.POSITION:
            return moved(Stage.RAY) * c.distance + moved(Stage.DISTANCE)
        if stage is Stage.NORMAL:
            return c.turned(moved(Stage.POSITION))
        if stage is Stage.IRRADIANCE:
            moved_and_turned = (self.step(before, received[before]) for before in (Stage.POSITION, Stage.NORMAL))
            return irradiance_moved(scene, received, *moved_and_turned)
        if stage is Stage.EXITANCE:
            # The largest albedo of the scene is a bound for the whole image.
            return max((max(shape.albedo) for shape in scene.shapes), default=0.0) * moved(Stage.IRRADIANCE)
        if stage is Stage.RADIANCE:
            return moved(Stage.EXITANCE) * (1.0 if scene.shading == "simplified" else 1 / math.pi)
        return 0.0

    def because(self, stage: Stage, name: str) -> str:
        """Return the part of a limit's derivation that is due to this renderer's output, or ""."""
        step = self.resolutions.get(stage)
        if step is None or stage in WHOLE:
            return ""
        return f"; {name}'s output resolves {step.relative:.3g} of the value plus {step.absolute:.3g}: {step.because}"

    def too_coarse(self, stage: Stage, truth: np.ndarray) -> str | None:
        """Return the reason if an output is too coarse for a stage with the values `truth`, else None."""
        resolution = self.resolutions.get(stage)
        if resolution is None or stage in WHOLE:
            return None
        finite = np.abs(truth[np.isfinite(truth)])
        largest = float(finite.max(initial=0.0))
        # If steps grow with the value, as with a transfer curve, the largest step is over twice the mean step of a
        # byte.
        coarsest = COARSEST if resolution.steps is None else 2 * COARSEST
        if largest > 0 and not resolution.relative + resolution.absolute / largest <= coarsest:
            step = resolution.relative * largest + resolution.absolute
            return f"its output's steps of {step:.3g} ({resolution.because}) tell nothing of values up to {largest:.3g}"
        return None


def irradiance_moved(
    scene: Scene, answers: StageImages, moved: np.ndarray | float, turned: np.ndarray | float
) -> np.ndarray:
    """Return the change of irradiance (height, width, 3) from positions `moved` [m] and normals `turned` [rad]."""
    inverse_square = scene.shading == "inverse_square"
    total = np.zeros((*answers[Stage.POSITION].shape[:2], 3))
    for index, light in enumerate(scene.lights):
        r = length(np.asarray(light.position, dtype=np.float64) - answers[Stage.POSITION])
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            relative = (3 if inverse_square else 1) * moved / r + turned
            scale = relative / (4 * math.pi * r**2) if inverse_square else relative
            arriving = np.asarray(light.flux) * answers[Stage.VISIBILITY][..., index : index + 1]
            moves = arriving * np.asarray(scale)[..., np.newaxis]
        total += np.nan_to_num(moves, nan=0.0, posinf=0.0)
    return total
