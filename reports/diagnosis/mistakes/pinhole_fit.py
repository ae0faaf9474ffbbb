"""A free pinhole camera fitted to a renderer's rays or image: scales, shifts, axes, and laws of them: CAM-1 to CAM-5.

A renderer that writes its rays gives all seven numbers of each case. Of radiance alone one number at a time is sought
in the image. What is common to the cases is a law: a scale by a power of one variable of the camera, a shift in pixels,
an angle.
"""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import product

import numpy as np

from rayproof.cases.scene import Camera
from rayproof.cases.stages import Stage
from rayproof.reports.diagnosis import MISTAKES, Mistake, Way
from rayproof.reports.diagnosis.fits import CLOSE, EXPONENTS, Fitting, Sampled, rounded
from rayproof.reports.diagnosis.mistakes.camera import Pinhole, Rays, pinhole_of
from rayproof.reports.diagnosis.trials import work

ACROSS, DOWN = 0, 1  # the image's two directions
Variable = Callable[[Camera, int], float]
# What a scale may be a power of, as the code of a wrong renderer would have it.
VARIABLES: Mapping[str, Variable] = {
    "tan(fovy/2) / (fovy/2)": lambda camera, _: math.tan(camera.alpha) / camera.alpha,
    "cos(fovy/2)": lambda camera, _: math.cos(camera.alpha),
    "tan(fovy/2)": lambda camera, _: math.tan(camera.alpha),
    "the aspect ratio": lambda camera, _: camera.aspect,
    "the diagonal over the height": lambda camera, _: math.hypot(1, camera.aspect),
    "the length of forward x up": lambda camera, _: float(np.linalg.norm(np.cross(_forward(camera), camera.up))),
    "the length of up": lambda camera, _: float(np.linalg.norm(camera.up)),
    "the distance from eye to target": lambda camera, _: float(np.linalg.norm(np.subtract(camera.target, camera.eye))),
    "n/(n - 1) of n pixels": lambda camera, axis: _count(camera, axis) / max(_count(camera, axis) - 1, 1),
    "n/(n + 1) of n pixels": lambda camera, axis: _count(camera, axis) / (_count(camera, axis) + 1),
}
NARROW = 1e-6  # of a direction: how far the rays of a pinhole may be off, some roundings of float32
MOST_LAWS = 3  # of one number
MOST_RAYS = 400  # that a camera is fitted through
SIMPLE = 3  # cases in whose images a number is sought
STEPS = 33  # of a coarse search
SECTIONS = 30  # of the golden section after it
BETTER = 0.7  # of the error of the right camera: what a coarse search leaves if there is something to find


@dataclass(frozen=True, kw_only=True)
class Law:
    """One number of a camera: factor times a power of a variable."""

    factor: float = 1.0
    variable: str | None = None
    exponent: float = 0.0

    def at(self, camera: Camera, axis: int) -> float:
        """Return the number."""
        return self.factor * (VARIABLES[self.variable](camera, axis) ** self.exponent if self.variable else 1.0)

    @property
    def phrase(self) -> str:
        """Return it in words."""
        if not self.variable:
            return f"{self.factor:.4g}"
        power = f"({self.variable})^{self.exponent:.4g}"
        words = {1.0: self.variable, -1.0: f"1 / ({self.variable})"}.get(self.exponent, power)
        return words if self.factor == 1 else f"{self.factor:.4g} times {words}"


ONE, ZERO = Law(), Law(factor=0.0)


@dataclass(frozen=True, kw_only=True)
class Free:
    """A camera: what its image is scaled and shifted by [px], and how its axes are turned [rad]."""

    scales: tuple[Law, Law] = (ONE, ONE)
    shifts: tuple[float, float] = (0.0, 0.0)  # px to the right and down, of where an image is sampled
    anchored: bool = False  # whether it is scaled from the first pixel's corner instead of the middle
    turns: tuple[float, float, float] = (0.0, 0.0, 0.0)  # about the right, up and forward axes
    example: str = field(default="", compare=False)

    def change(self, pinhole: Pinhole) -> Pinhole:
        """Return the camera in the place of the right one."""
        camera = pinhole.camera
        across, down = (law.at(camera, axis) for axis, law in enumerate(self.scales))
        right, up, forward = _rotation(self.turns).T @ np.stack([pinhole.right, pinhole.up, pinhole.forward])
        columns, rows = pinhole.columns + self.shifts[ACROSS], pinhole.rows + self.shifts[DOWN]
        if self.anchored:  # sx + 1 is what is scaled
            columns = columns + camera.width / 2 * (1 - 1 / across)
            rows = rows + camera.height / 2 * (1 - 1 / down)
        return replace(
            pinhole,
            right=right,
            up=up,
            forward=forward,
            tangent=pinhole.tangent * down,
            aspect=pinhole.aspect * across / down,
            columns=columns,
            rows=rows,
        )

    @property
    def way(self) -> Way:
        """Return the way of a renderer with this camera."""
        return Way(stages={Stage.RAY: Rays((self.change,))}, says=self.phrase)

    @property
    def phrase(self) -> str:
        """Return what a renderer with it does, as a verb phrase."""
        across, down = self.scales
        found = []
        if across == down != ONE:
            found.append(f"is {across.phrase} times as wide and as high")
        else:
            found += [f"is {across.phrase} times as wide"] * (across != ONE) + [f"is {down.phrase} times as high"] * (
                down != ONE
            )
        if any(self.shifts):
            found.append(f"is shifted by {self.shifts[ACROSS]:.4g} px to the right and {self.shifts[DOWN]:.4g} px down")
        for angle, axis in zip(self.turns, ("right", "up", "forward"), strict=True):
            found += [f"is turned by {math.degrees(angle):.4g} degrees about the {axis} axis"] * bool(angle)
        anchored = ", scaled from the first pixel's corner," if self.anchored else ""
        return f"traces the rays of a camera whose image{anchored} {' and '.join(found)}{self.example}"


def _forward(camera: Camera) -> np.ndarray:
    forward = np.subtract(camera.target, camera.eye)
    return forward / np.linalg.norm(forward)


def _count(camera: Camera, axis: int) -> int:
    return camera.width if axis == ACROSS else camera.height


def _rotation(turns: tuple[float, float, float]) -> np.ndarray:
    """Return the rotation by a vector of angles [rad] about right, up and forward (Rodrigues)."""
    angle = float(np.linalg.norm(turns))
    if angle == 0:
        return np.eye(3)
    x, y, z = np.array(turns) / angle
    turned = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + math.sin(angle) * turned + (1 - math.cos(angle)) * turned @ turned


def _angles(rotation: np.ndarray) -> tuple[float, float, float]:
    """Return the vector of angles [rad] of a rotation, away from half a turn."""
    halves = (rotation - rotation.T) / 2
    vector = np.array([halves[2, 1], halves[0, 2], halves[1, 0]])
    size = float(np.linalg.norm(vector))
    angle = math.atan2(size, (float(np.trace(rotation)) - 1) / 2)
    x, y, z = vector * (angle / size if size > 0 else 1.0)
    return float(x), float(y), float(z)


@dataclass(frozen=True, kw_only=True)
class Fitted:
    """The seven numbers of one case's camera."""

    camera: Camera
    scales: tuple[float, float]
    shifts: tuple[float, float]  # px
    turns: tuple[float, float, float]


def through(camera: Camera, rays: np.ndarray) -> Fitted | None:
    """Return the pinhole camera through rays (height, width, 3) of unit length; None where there is none."""
    pinhole = pinhole_of(camera)
    axes = np.stack([pinhole.right, pinhole.up, pinhole.forward])
    height, width = rays.shape[:2]
    some = np.unique(np.linspace(0, height * width - 1, MOST_RAYS).astype(int))
    ours = rays.reshape(-1, 3)[some] @ axes.T
    x = (2 * (some % width + 0.5) / width - 1) * pinhole.aspect * pinhole.tangent
    y = (1 - 2 * (some // width + 0.5) / height) * pinhole.tangent
    if not np.all(np.abs(np.linalg.norm(ours, axis=-1) - 1) <= 10 * NARROW) or min(height, width) < 3:
        return None
    found = _unturned(ours, x, y)
    if found is None:
        found = _turned(ours, x, y)
    if found is None:
        return None
    inner, rotation = found
    half = pinhole.aspect * pinhole.tangent, pinhole.tangent
    # px: the sample of a pixel is moved by so much before the image is scaled.
    shifts = (
        inner[0, 2] / inner[0, 0] / half[0] * width / 2,
        -inner[1, 2] / inner[1, 1] / half[1] * height / 2,
    )
    return Fitted(camera=camera, scales=(inner[0, 0], inner[1, 1]), shifts=shifts, turns=_angles(rotation))


def _unturned(ours: np.ndarray, x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
    """Return scales and shifts, and no turn, where these alone make the rays."""
    if not np.all(ours[:, 2] > 0):
        return None
    inner = np.eye(3)
    for axis, values in enumerate((x, y)):
        terms = np.stack([values, np.ones_like(values)], axis=-1)
        inner[axis, axis], inner[axis, 2] = np.linalg.lstsq(terms, ours[:, axis] / ours[:, 2], rcond=None)[0]
    return (inner, np.eye(3)) if _makes(inner, ours, x, y) else None


def _turned(ours: np.ndarray, x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
    """Return scales and shifts, and the turn of the axes: by the homography from the image to the rays."""
    points = np.stack([x, y, np.ones_like(x)], axis=-1)
    size = np.array([max(np.abs(x).max(), 1e-12), max(np.abs(y).max(), 1e-12), 1.0])
    even = points / size
    a, b, c = (ours[:, [axis]] * even for axis in range(3))
    none = np.zeros_like(even)
    # ours x (H p) = 0, of which each row is linear in the nine numbers of H.
    rows = [np.concatenate(row, axis=1) for row in ((none, -c, b), (c, none, -a), (-b, a, none))]
    homography = np.linalg.svd(np.concatenate(rows))[2][-1].reshape(3, 3) / size
    homography = homography * np.sign(np.sum(ours * (points @ homography.T)))
    try:
        inner = np.linalg.cholesky(homography.T @ homography).T
    except np.linalg.LinAlgError:
        return None
    rotation, inner = homography @ np.linalg.inv(inner), inner / inner[2, 2]
    if np.linalg.det(rotation) < 0 or abs(inner[0, 1]) > 10 * NARROW * inner[0, 0]:
        return None
    return (inner, rotation) if _makes(rotation @ inner, ours, x, y) else None


def _makes(matrix: np.ndarray, ours: np.ndarray, x: np.ndarray, y: np.ndarray) -> bool:
    rays = np.stack([x, y, np.ones_like(x)], axis=-1) @ matrix.T
    rays /= np.linalg.norm(rays, axis=-1, keepdims=True)
    return bool(np.all(np.linalg.norm(rays - ours, axis=-1) <= NARROW))


def laws_of(values: Sequence[float], cameras: Sequence[Camera], axis: int) -> list[Law]:
    """Return the laws that scales of several cameras follow, those without an estimated factor first."""
    numbers = np.array(values)
    if np.all(np.abs(numbers - 1) <= CLOSE):
        return [ONE]
    plain, factors = [], []
    middle = float(np.median(numbers))
    if np.all(np.abs(numbers / middle - 1) <= CLOSE):
        factors.append(Law(factor=rounded(middle)))
    for name, variable in VARIABLES.items():
        bases = np.array([variable(camera, axis) for camera in cameras])
        for exponent in EXPONENTS:
            ratios = numbers / bases**exponent
            middle = float(np.median(ratios))
            if np.all(np.abs(ratios - 1) <= CLOSE):
                plain.append(Law(variable=name, exponent=exponent))
            elif np.all(np.abs(ratios / middle - 1) <= CLOSE) and not factors:
                factors.append(Law(factor=rounded(middle), variable=name, exponent=exponent))
    return [*plain[:MOST_LAWS], *factors[:MOST_LAWS]]


def _by_rays(cases: Sequence[Fitting]) -> Iterator[Free]:
    shown = [case for case in cases if not np.array_equal(case.ours[Stage.RAY], case.right[Stage.RAY])]
    found = [through(case.scene.camera, case.ours[Stage.RAY]) for case in shown]
    cameras = [one for one in found if one is not None]
    # A camera through which no pinhole goes is none of these.
    if not cameras or len(cameras) < len(found):
        return
    asked = [one.camera for one in cameras]
    across, down = (laws_of([one.scales[axis] for one in cameras], asked, axis) for axis in (ACROSS, DOWN))
    turns = np.array([one.turns for one in cameras])
    turn = np.median(turns, axis=0)
    if not np.all(np.abs(turns - turn) <= CLOSE):
        return
    degrees = [rounded(math.degrees(angle)) if abs(angle) > 10 * NARROW else 0.0 for angle in turn]
    about_right, about_up, about_forward = map(math.radians, degrees)
    of_turns = about_right, about_up, about_forward
    shifts = np.array([one.shifts for one in cameras])
    shift = np.median(shifts, axis=0)
    still = np.all(np.abs(shifts - shift) <= 0.01)
    first = next((one for one in cameras if abs(one.scales[DOWN] - 1) > CLOSE), None)
    both = [(one, two) for one, two in product(across, down) if one == two] or list(product(across, down))
    for one, two in both[:MOST_LAWS]:
        example = _example(first.camera, first.scales[DOWN]) if first is not None and one == two else ""
        if still:
            of_shifts = tuple(rounded(float(value)) if abs(value) > 10 * CLOSE else 0.0 for value in shift)
            yield Free(scales=(one, two), shifts=(of_shifts[0], of_shifts[1]), turns=of_turns, example=example)
        else:
            yield Free(scales=(one, two), anchored=True, turns=of_turns, example=example)


def _example(camera: Camera, scale: float) -> str:
    seen = math.degrees(2 * math.atan(math.tan(camera.alpha) * scale))
    return f", such as that of fovy {seen:.4g} for {camera.fovy:.4g}"


def _by_images(cases: Sequence[Fitting]) -> Iterator[Free]:
    lit = [case for case in cases if case.scene.lights and Stage.RADIANCE in case.ours]
    look = [Sampled(evidence=case.evidence) for case in sorted(lit, key=lambda case: work(case.scene))[: 2 * SIMPLE]]
    if not look:
        return
    for free in (*_by_laws(), *_by_search(look[:SIMPLE])):
        way = free.way
        if all(case.agrees(way) is not False for case in look) and any(case.agrees(way) for case in look):
            law = free.scales[DOWN]
            scale = law.at(look[0].evidence.scene.camera, DOWN)
            equal = free.scales[ACROSS] == law != ONE
            yield replace(free, example=_example(look[0].evidence.scene.camera, scale)) if equal else free


def _by_laws() -> Iterator[Free]:
    """Yield cameras scaled by a law without an estimated factor, in both directions or in one."""
    for name, exponent in product(VARIABLES, EXPONENTS):
        law = Law(variable=name, exponent=exponent)
        yield Free(scales=(law, law))
        yield Free(scales=(law, ONE))
        yield Free(scales=(ONE, law))
        if name.startswith("n/"):
            yield Free(scales=(law, law), anchored=True)


# One number of a camera that is sought in an image: the camera of the number, and the numbers that are tried first.
Family = tuple[Callable[[float], Free], np.ndarray]
SCALES, PIXELS = np.geomspace(0.3, 3.2, STEPS), np.linspace(-4, 4, STEPS)
_ONE_WAY = np.geomspace(0.004, 0.5, STEPS // 2)  # rad: turns by less move an image by less than a pixel
ANGLES = np.concatenate([-_ONE_WAY[::-1], [0.0], _ONE_WAY])
TANGENTS = np.tan(np.radians(np.linspace(4, 60, STEPS)))
FAMILIES: tuple[Family, ...] = (
    (lambda value: _scaled(value, value), SCALES),
    (lambda value: _scaled(value, 1.0), SCALES),
    (lambda value: _scaled(1.0, value), SCALES),
    (lambda value: _of_half_height(value), TANGENTS),
    (lambda value: Free(shifts=(value, value)), PIXELS),
    (lambda value: Free(shifts=(value, 0.0)), PIXELS),
    (lambda value: Free(shifts=(0.0, value)), PIXELS),
    (lambda value: Free(turns=(value, 0.0, 0.0)), ANGLES),
    (lambda value: Free(turns=(0.0, value, 0.0)), ANGLES),
    (lambda value: Free(turns=(0.0, 0.0, value)), ANGLES),
)


def _of_half_height(tangent: float) -> Free:
    law = Law(factor=tangent, variable="tan(fovy/2)", exponent=-1.0)
    return Free(scales=(law, law))


def _scaled(across: float, down: float) -> Free:
    return Free(scales=(Law(factor=across), Law(factor=down)))


def _by_search(look: Sequence[Sampled]) -> Iterator[Free]:
    """Yield cameras of which one number is sought in the image of the simplest case."""
    case = look[0]
    before = _off(case, Free())
    for made, grid in FAMILIES:
        errors = [_off(case, made(value)) for value in grid]
        best = int(np.argmin(errors))
        if errors[best] > BETTER * before:
            continue
        low, high = float(grid[max(best - 1, 0)]), float(grid[min(best + 1, len(grid) - 1)])
        value = _golden(lambda value, made=made: _off(case, made(value)), low, high)
        angle = grid is ANGLES
        yield made(math.radians(rounded(math.degrees(value))) if angle else rounded(value))


def _off(case: Sampled, free: Free) -> float:
    """Return by how much the image of a camera is off in some pixels, relatively, each by 1 at most."""
    answers = case.answers(free.way)
    if answers is None:
        return np.inf
    value, ours = answers[Stage.RADIANCE], case.ours
    with np.errstate(all="ignore"):
        off = np.abs(value - ours) / (np.abs(value) + np.abs(ours))
    return float(np.sum(np.where(np.isfinite(off), off, value != ours)))


def _golden(off: Callable[[float], float], low: float, high: float) -> float:
    """Return where a function is least between two numbers, by the golden section."""
    ratio = (math.sqrt(5) - 1) / 2
    one, two = high - ratio * (high - low), low + ratio * (high - low)
    at_one, at_two = off(one), off(two)
    for _ in range(SECTIONS):
        if at_one <= at_two:
            high, two, at_two = two, one, at_one
            one = high - ratio * (high - low)
            at_one = off(one)
        else:
            low, one, at_one = one, two, at_two
            two = low + ratio * (high - low)
            at_two = off(two)
    return (low + high) / 2


def _fitted(cases: Sequence[Fitting]) -> Iterator[Way]:
    if not cases:
        return
    staged = all(case.staged for case in cases)
    seen: list[Free] = []
    for free in _by_rays(cases) if staged else _by_images(cases):
        if free not in seen and free != Free():
            seen.append(free)
            yield free.way


MISTAKES.register("another_camera")(
    Mistake(
        says="traces the rays of another pinhole camera",
        items=("CAM-1", "CAM-2", "CAM-3", "CAM-4", "CAM-5"),
        ways=(_scaled(1.25, 1.25).way,),
        fitted=_fitted,
    )
)
__all__ = ["Free", "Law", "laws_of", "through"]
