"""Mistakes of the camera: its angles, its axes, and the positions of samples in pixels."""

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from rayproof.cases.scene import Camera, Scene, SceneError
from rayproof.cases.stages import Stage
from rayproof.reference.analytic.camera import view_of
from rayproof.reference.analytic.vectors import length
from rayproof.reports.mistakes import Family, Mistake, family, known

ANGLE = ("CAM-2", "CAM-4", "CAM-5")
FLIPPED = ("CAM-3", "IMG-1")  # a reversed sign of pixel coordinates and a reversed order of rows give the same image


class Pinhole(Mistake):
    """A pinhole camera with wrong half angles, axes or positions of samples."""

    def tangents(self, camera: Camera) -> tuple[float, float]:
        """Return half the image's width and half its height at depth 1."""
        return math.tan(camera.alpha) * camera.aspect, math.tan(camera.alpha)

    def axes(self, camera: Camera) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the axes right, up and forward."""
        view = view_of(camera)
        return view.right, view.up, view.forward

    def on_image(self, camera: Camera, points: np.ndarray) -> np.ndarray:
        """Return (sx, sy) of image points (N, 2) [px], from -1 to 1."""
        return (2 * points / (camera.width, camera.height) - 1) * (1, -1)

    def rays(self, scene: Scene, points: np.ndarray) -> np.ndarray:
        """Return unit directions (N, 3) from these tangents, axes and positions."""
        camera = scene.camera
        right, up, forward = self.axes(camera)
        x, y = (self.on_image(camera, points) * self.tangents(camera)).T[..., np.newaxis]
        directions = forward + x * right + y * up
        return directions / length(directions)[:, np.newaxis]


Angles = Callable[[Camera], tuple[float, float]]


def _angle(name: str, sentence: str, tangents: Angles) -> None:
    known(name, sentence, *ANGLE)(type(name, (Pinhole,), {"tangents": lambda _, camera: tangents(camera)}))


def _vertical(name: str, sentence: str, tangent: Callable[[Camera], float]) -> None:
    _angle(name, sentence, lambda camera: (tangent(camera) * camera.aspect, tangent(camera)))


_vertical(
    "whole_angle", "takes the tangent of the whole angle fovy instead of half of it", lambda c: math.tan(2 * c.alpha)
)
_vertical("half_angle_twice", "halves the angle fovy twice", lambda c: math.tan(c.alpha / 2))
_vertical("degrees_for_radians", "hands degrees to a tangent that expects radians", lambda c: math.tan(c.fovy / 2))
_vertical("linear_fov", "takes half of the angle fovy itself instead of its tangent", lambda c: c.alpha)
_vertical("sine_fov", "takes the sine of half of fovy instead of its tangent", lambda c: math.sin(c.alpha))
_vertical("fovx_for_fovy", "takes fovy for the horizontal angle", lambda c: math.tan(c.alpha) / c.aspect)
_vertical(
    "diagonal_fov",
    "takes fovy for the angle of the image's diagonal",
    lambda c: math.tan(c.alpha) / math.hypot(1, c.aspect),
)
_vertical(
    "smaller_side_fov",
    "takes fovy for the angle of the image's shorter side",
    lambda c: math.tan(c.alpha) / min(1.0, c.aspect),
)
_angle("no_aspect", "leaves the aspect ratio out", lambda c: (math.tan(c.alpha), math.tan(c.alpha)))
_angle(
    "aspect_inverted",
    "takes height over width for the aspect ratio",
    lambda c: (math.tan(c.alpha) / c.aspect, math.tan(c.alpha)),
)
_angle(
    "integer_aspect",
    "divides width by height as whole numbers",
    lambda c: (math.tan(c.alpha) * (c.width // c.height), math.tan(c.alpha)),
)
_angle(
    "aspect_twice",
    "multiplies by the aspect ratio twice",
    lambda c: (math.tan(c.alpha) * c.aspect**2, math.tan(c.alpha)),
)


@family(
    "fixed_fov",
    "sees {0} times tan(fovy / 2) in each case, a field of view of its own",
    *ANGLE,
    starts=[(0.25, 0.5, 0.8, 1.25, 2.0, 4.0)],
)
class AnotherAngle(Family, Pinhole):
    """The image's width and height at depth 1 are multiples of the right ones."""

    def tangents(self, camera: Camera) -> tuple[float, float]:
        """Return both tangents times the parameter."""
        width, height = super().tangents(camera)
        return width * self.numbers[0], height * self.numbers[0]


@family(
    "one_fov",
    "sees {0} degrees from bottom to top, whatever the scene says",
    *ANGLE,
    starts=[(10.0, 25.0, 40.0, 55.0, 75.0, 100.0, 130.0)],
)
class OneAngle(Family, Pinhole):
    """The vertical angle is the same number of degrees in every case."""

    def tangents(self, camera: Camera) -> tuple[float, float]:
        """Return both tangents for the vertical angle [degrees] of the parameter."""
        height = math.tan(math.radians(min(max(self.numbers[0], 1e-3), 179.0)) / 2)
        return height * camera.aspect, height


@family("tilted", "looks {0} degrees too high", "CAM-1", starts=[(-5.0, -1.0, 1.0, 5.0)])
class Tilted(Family, Pinhole):
    """The view is rotated about the right axis."""

    def axes(self, camera: Camera) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the axes, rotated upwards."""
        right, up, forward = super().axes(camera)
        angle = math.radians(self.numbers[0])
        turned = math.cos(angle) * forward + math.sin(angle) * up
        return right, np.cross(right, turned), turned


@known("left_handed", "builds a left-handed camera, so that its image is mirrored", "CAM-1")
class LeftHanded(Pinhole):
    """The right axis is up x forward, which is reversed."""

    def axes(self, camera: Camera) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the axes with a reversed right axis."""
        right, up, forward = super().axes(camera)
        return -right, up, forward


@known("up_as_given", "takes the given up vector as it is, without making it orthogonal to the view", "CAM-1")
class UpAsGiven(Pinhole):
    """The up axis is the scene's up vector, normalised."""

    def axes(self, camera: Camera) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the axes with the scene's up vector."""
        right, _, forward = super().axes(camera)
        return right, np.asarray(camera.up) / np.linalg.norm(camera.up), forward


@known("right_not_normalised", "does not normalise the camera's right vector", "CAM-1")
class RightNotNormalised(Pinhole):
    """The right axis is forward x up, not normalised, and so is the up axis that is computed from it."""

    def axes(self, camera: Camera) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the axes; right and up are too short."""
        _, _, forward = super().axes(camera)
        right = np.cross(forward, camera.up)
        return right, np.cross(right, forward), forward


@known("right_too_short", "does not normalise the camera's right vector, but its up vector", "CAM-1")
class RightTooShort(Pinhole):
    """The right axis is forward x up, not normalised."""

    def axes(self, camera: Camera) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the axes; right is too short."""
        _, up, forward = super().axes(camera)
        return np.cross(forward, np.asarray(camera.up) / np.linalg.norm(camera.up)), up, forward


@known("width_minus_one", "divides pixels by w - 1 and h - 1", "CAM-3")
class WidthMinusOne(Pinhole):
    """The samples of the first and the last pixel are on the image's border."""

    def on_image(self, camera: Camera, points: np.ndarray) -> np.ndarray:
        """Return (sx, sy) with the first pixel's centre at -1 and the last one's at 1."""
        return (2 * (points - 0.5) / np.maximum((camera.width - 1, camera.height - 1), 1) - 1) * (1, -1)


@known("swapped_sizes", "swaps width and height where it turns pixels into image coordinates", "CAM-3")
class SwappedSizes(Pinhole):
    """Pixel coordinates are divided by the length of the wrong side."""

    def on_image(self, camera: Camera, points: np.ndarray) -> np.ndarray:
        """Return (sx, sy), divided by the length of the wrong side."""
        return (2 * points / (camera.height, camera.width) - 1) * (1, -1)


@known("not_normalised", "does not normalise its rays", "CAM-4", "CAM-5")
class NotNormalised(Mistake):
    """Directions have depth 1."""

    def rays(self, scene: Scene, points: np.ndarray) -> np.ndarray:
        """Return directions of depth 1."""
        return view_of(scene.camera).directions(points)


@known("one_metre_rays", "builds rays that are right only for a target 1 m away", "CAM-4")
class OneMetre(Pinhole):
    """The forward axis is as long as the distance of the target."""

    def axes(self, camera: Camera) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the axes, with forward from the eye to the target."""
        right, up, _ = super().axes(camera)
        return right, up, np.subtract(camera.target, camera.eye)


class AnotherView(Mistake):
    """A wrong eye, target or up vector; the right camera if these make no valid camera."""

    def changed(self, camera: Camera) -> Camera:
        """Return the wrong camera."""
        raise NotImplementedError

    def scene(self, scene: Scene) -> Scene:
        """Return the scene with the wrong camera."""
        try:
            return replace(scene, camera=self.changed(scene.camera))
        except (SceneError, OverflowError):
            return scene


def _view(name: str, sentence: str, changed: Callable[[Camera], Camera]) -> None:
    known(name, sentence, "CAM-1")(type(name, (AnotherView,), {"changed": lambda _, camera: changed(camera)}))


_view("up_is_y", "takes y for up, whatever the scene says", lambda c: replace(c, up=(0.0, 1.0, 0.0)))
_view("up_is_z", "takes z for up, whatever the scene says", lambda c: replace(c, up=(0.0, 0.0, 1.0)))
_view("up_is_x", "takes x for up, whatever the scene says", lambda c: replace(c, up=(1.0, 0.0, 0.0)))
_view("up_downwards", "turns the up vector round", lambda c: replace(c, up=tuple(-x for x in c.up)))
_view(
    "target_is_direction",
    "takes the target point for the viewing direction",
    lambda c: replace(c, target=tuple(map(float, np.add(c.eye, c.target)))),
)
_view(
    "eye_at_origin",
    "leaves the eye's place out, and looks from the origin in the right direction",
    lambda c: replace(c, eye=(0.0, 0.0, 0.0), target=tuple(map(float, np.subtract(c.target, c.eye)))),
)


def _another_up_when_steep(camera: Camera) -> Camera:
    forward = np.subtract(camera.target, camera.eye)
    along = abs(forward @ np.asarray(camera.up)) / np.linalg.norm(forward) / np.linalg.norm(camera.up)
    axis = (0.0, 1.0, 0.0) if abs(forward[2]) > 0.9 * np.linalg.norm(forward) else (0.0, 0.0, 1.0)
    return replace(camera, up=axis) if along > 0.99 else camera


_view(
    "another_up_when_steep", "takes another up vector in views that are within 8 degrees of it", _another_up_when_steep
)


def _placed(name: str, sentence: str, items: tuple[str, ...], move: Callable[[Camera, np.ndarray], np.ndarray]) -> None:
    known(name, sentence, *items)(
        type(name, (Mistake,), {"image_points": lambda _, scene, points: move(scene.camera, points)})
    )


for _name, _where, _off in (
    ("pixel_corner", "at its top left corner", (-0.5, -0.5)),
    ("pixel_corner_right", "at its top right corner", (0.5, -0.5)),
    ("pixel_corner_below", "at its bottom left corner", (-0.5, 0.5)),
    ("pixel_far_corner", "at its bottom right corner", (0.5, 0.5)),
    ("one_pixel_right", "one pixel too far to the right", (1.0, 0.0)),
    ("one_pixel_left", "one pixel too far to the left", (-1.0, 0.0)),
    ("one_pixel_down", "one pixel too far down", (0.0, 1.0)),
    ("one_pixel_up", "one pixel too far up", (0.0, -1.0)),
):
    _placed(_name, f"samples each pixel {_where}", ("CAM-3",), lambda _, points, off=_off: points + off)
_placed(
    "image_mirrored",
    "writes each row of its image from right to left",
    FLIPPED,
    lambda c, p: p * (-1, 1) + (c.width, 0),
)
_placed(
    "upside_down",
    "writes its image upside down, the bottom row first",
    FLIPPED,
    lambda c, p: p * (1, -1) + (0, c.height),
)
_placed("turned_half", "turns its image by 180 degrees", FLIPPED, lambda c, p: (c.width, c.height) - p)


@family(
    "sample_position",
    "takes its samples ({0}, {1}) px off the pixel's centre",
    "CAM-3",
    starts=[(-0.25, 0.0, 0.25), (-0.25, 0.0, 0.25)],
)
class SamplePosition(Family):
    """Samples are to the right of the pixel's centre and below it, by the two parameters [px]."""

    def image_points(self, scene: Scene, points: np.ndarray) -> np.ndarray:
        """Return the moved points."""
        return points + self.numbers


@known("depth_for_distance", "writes the depth along the viewing direction as distance", "HIT-9", "CAM-4")
class DepthForDistance(Mistake):
    """Only the written image is wrong, not the distances in the later stages."""

    def image(self, scene: Scene, stage: Stage, values: np.ndarray, points: np.ndarray) -> np.ndarray:
        """Return depths instead of distances."""
        if stage is not Stage.DISTANCE:
            return super().image(scene, stage, values, points)
        directions = self.rays(scene, self.image_points(scene, points))
        with np.errstate(invalid="ignore"):
            return values * (directions @ view_of(scene.camera).forward)[:, np.newaxis]
