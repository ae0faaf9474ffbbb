"""Mistakes of cameras, pixels and view rays: CAM-1 to CAM-5."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from rayproof.cases.scene import Camera, Scene
from rayproof.cases.stages import Stage
from rayproof.reports.diagnosis import MISTAKES, Given, Mistake, Way, Wrong


@dataclass(frozen=True, kw_only=True)
class Pinhole:
    """A camera's axes, half its extent and where its image is sampled; a mistake changes one of them."""

    camera: Camera
    forward: np.ndarray
    right: np.ndarray
    up: np.ndarray
    tangent: float  # of half the angle of the image's height
    aspect: float
    columns: np.ndarray  # px, where each column of pixels is sampled
    rows: np.ndarray
    unit: bool = True  # whether rays are normalised

    def rays(self) -> np.ndarray:
        """Return F + sx aspect tan R + sy tan U, (height, width, 3)."""
        sx = (2 * self.columns / self.camera.width - 1)[np.newaxis, :, np.newaxis]
        sy = (1 - 2 * self.rows / self.camera.height)[:, np.newaxis, np.newaxis]
        found = self.forward + sx * (self.aspect * self.tangent) * self.right + sy * self.tangent * self.up
        return found / np.linalg.norm(found, axis=-1, keepdims=True) if self.unit else found


def pinhole_of(camera: Camera) -> Pinhole:
    """Return the right camera."""
    forward = np.subtract(camera.target, camera.eye)
    forward = forward / np.linalg.norm(forward)
    right = np.cross(forward, camera.up)
    right = right / np.linalg.norm(right)
    return Pinhole(
        camera=camera,
        forward=forward,
        right=right,
        up=np.cross(right, forward),
        tangent=math.tan(camera.alpha),
        aspect=camera.aspect,
        columns=np.arange(camera.width) + 0.5,
        rows=np.arange(camera.height) + 0.5,
    )


Change = Callable[[Pinhole], Pinhole]


@dataclass(frozen=True)
class Rays:
    """The rays of a pinhole camera with some changes, one after the other."""

    changes: tuple[Change, ...]

    def __call__(self, given: Given) -> np.ndarray:
        """Return the rays, (height, width, 3)."""
        found = pinhole_of(given.scene.camera)
        for change in self.changes:
            found = change(found)
        return found.rays()

    def followed_by(self, other: Wrong) -> Wrong | None:
        """Return both mistakes at once, the other's after these; None where it is of another kind."""
        return Rays((*self.changes, *other.changes)) if isinstance(other, Rays) else None


def _rays(*changes: Change) -> Way:
    return Way(stages={Stage.RAY: Rays(changes)})


def _mirrored(pinhole: Pinhole) -> Pinhole:
    return replace(pinhole, columns=pinhole.camera.width - pinhole.columns)


def _upside_down(pinhole: Pinhole) -> Pinhole:
    return replace(pinhole, rows=pinhole.camera.height - pinhole.rows)


def _shifted(across: float, down: float) -> Change:
    return lambda pinhole: replace(pinhole, columns=pinhole.columns + across, rows=pinhole.rows + down)


def _angle(tangent: Callable[[Camera], float]) -> Change:
    return lambda pinhole: replace(pinhole, tangent=tangent(pinhole.camera))


def _camera(**changes: Callable[[Camera], object]) -> Callable[[Scene], Scene]:
    def asked(scene: Scene) -> Scene:
        values = {name: change(scene.camera) for name, change in changes.items()}
        return replace(scene, camera=replace(scene.camera, **values))  # type: ignore[arg-type]

    return asked


def _depths(given: Given) -> np.ndarray:
    forward = np.subtract(given.scene.camera.target, given.scene.camera.eye)
    along = given.answers[Stage.RAY] @ (forward / np.linalg.norm(forward))
    return np.where(np.isfinite(given.right), given.right * along[..., np.newaxis], given.right)


def _right_positions(given: Given) -> np.ndarray:
    """Return the positions of the hits themselves: what is written as distance is used nowhere."""
    camera = given.scene.camera
    forward = np.subtract(camera.target, camera.eye)
    along = given.answers[Stage.RAY] @ (forward / np.linalg.norm(forward))
    distance = given.answers[Stage.DISTANCE] / along[..., np.newaxis]
    hit = np.isfinite(distance)
    return np.where(hit, np.asarray(camera.eye) + np.where(hit, distance, 0) * given.answers[Stage.RAY], 0.0)


# A pixel's sign turned round and rows stored from the other end are one image, in every stage.
FLIPPED = ("CAM-3", "IMG-1")

for _name, _says, _items, _way in (
    (
        "left_handed",
        "builds a left-handed camera, so that its image is mirrored",
        ("CAM-1",),
        _rays(lambda pinhole: replace(pinhole, right=-pinhole.right)),
    ),
    ("image_mirrored", "writes each row of its image from right to left", FLIPPED, _rays(_mirrored)),
    ("upside_down", "writes its image upside down, the bottom row first", FLIPPED, _rays(_upside_down)),
    ("turned_half", "turns its image by 180 degrees", FLIPPED, _rays(_mirrored, _upside_down)),
    ("one_pixel_right", "samples each pixel one pixel too far to the right", ("CAM-3",), _rays(_shifted(1, 0))),
    ("one_pixel_left", "samples each pixel one pixel too far to the left", ("CAM-3",), _rays(_shifted(-1, 0))),
    ("one_pixel_down", "samples each pixel one pixel too far down", ("CAM-3",), _rays(_shifted(0, 1))),
    ("one_pixel_up", "samples each pixel one pixel too far up", ("CAM-3",), _rays(_shifted(0, -1))),
    ("pixel_corner", "samples each pixel at its top left corner", ("CAM-3",), _rays(_shifted(-0.5, -0.5))),
    ("pixel_corner_right", "samples each pixel at its top right corner", ("CAM-3",), _rays(_shifted(0.5, -0.5))),
    ("pixel_corner_below", "samples each pixel at its bottom left corner", ("CAM-3",), _rays(_shifted(-0.5, 0.5))),
    ("pixel_far_corner", "samples each pixel at its bottom right corner", ("CAM-3",), _rays(_shifted(0.5, 0.5))),
    (
        "fovx_for_fovy",
        "takes fovy for the horizontal angle",
        ("CAM-2", "CAM-4", "CAM-5"),
        _rays(lambda pinhole: replace(pinhole, tangent=pinhole.tangent / pinhole.camera.aspect)),
    ),
    (
        "whole_angle",
        "takes the tangent of the whole angle fovy instead of half of it",
        ("CAM-2", "CAM-4", "CAM-5"),
        _rays(_angle(lambda camera: math.tan(2 * camera.alpha))),
    ),
    (
        "half_angle_twice",
        "halves the angle fovy twice",
        ("CAM-2", "CAM-4", "CAM-5"),
        _rays(_angle(lambda camera: math.tan(camera.alpha / 2))),
    ),
    (
        "degrees_for_radians",
        "hands degrees to a tangent that expects radians",
        ("CAM-2", "CAM-4", "CAM-5"),
        _rays(_angle(lambda camera: math.tan(camera.fovy / 2))),
    ),
    (
        "no_aspect",
        "leaves the aspect ratio out",
        ("CAM-2", "CAM-4", "CAM-5"),
        _rays(lambda pinhole: replace(pinhole, aspect=1.0)),
    ),
    (
        "aspect_inverted",
        "takes height over width for the aspect ratio",
        ("CAM-2", "CAM-4", "CAM-5"),
        _rays(lambda pinhole: replace(pinhole, aspect=1 / pinhole.aspect)),
    ),
    (
        "up_as_given",
        "takes the given up vector as it is, without making it orthogonal to the view",
        ("CAM-1",),
        _rays(
            lambda pinhole: replace(
                pinhole, up=np.asarray(pinhole.camera.up) / float(np.linalg.norm(pinhole.camera.up))
            )
        ),
    ),
    (
        "up_is_y",
        "takes y for up, whatever the scene says",
        ("CAM-1",),
        Way(asked=_camera(up=lambda _: (0.0, 1.0, 0.0))),
    ),
    (
        "up_is_z",
        "takes z for up, whatever the scene says",
        ("CAM-1",),
        Way(asked=_camera(up=lambda _: (0.0, 0.0, 1.0))),
    ),
    ("up_downwards", "turns the up vector round", ("CAM-1",), Way(asked=_camera(up=lambda c: tuple(-x for x in c.up)))),
    (
        "target_is_direction",
        "takes the target point for the viewing direction",
        ("CAM-1",),
        Way(asked=_camera(target=lambda c: tuple(float(x) for x in np.add(c.eye, c.target)))),
    ),
    (
        "not_normalised",
        "does not normalise its rays",
        ("CAM-4", "CAM-5"),
        _rays(lambda pinhole: replace(pinhole, unit=False)),
    ),
    (
        "depth_for_distance",
        "writes the depth along the viewing direction as distance",
        ("HIT-9", "CAM-4"),
        Way(stages={Stage.DISTANCE: _depths, Stage.POSITION: _right_positions}),
    ),
):
    MISTAKES.register(_name)(Mistake(says=_says, items=_items, ways=(_way,)))
