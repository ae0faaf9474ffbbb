"""Mistakes of cameras and pixels: CAM-1 to CAM-5."""

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from rayproof.cases.answers import Answers
from rayproof.cases.scene import Camera, Scene
from rayproof.cases.stages import IMAGE_STAGES, Stage
from rayproof.reports.diagnosis import MISTAKES, Given, Laid, Mistake, Way


def _flipped(axis: int) -> Laid:
    def laid(ours: Answers, _: Answers) -> Answers:
        return {stage: np.flip(image, axis) for stage, image in ours.items() if stage in IMAGE_STAGES}

    return laid


def _placed(down: int, right: int) -> Laid:
    """Return the function that lays an image whose centres are another's corners into that larger one."""

    def laid(ours: Answers, whole: Answers) -> Answers:
        found: Answers = {}
        for stage, image in ours.items():
            if stage in IMAGE_STAGES and stage in whole:
                height, width = np.shape(image)[:2]
                found[stage] = np.full(np.shape(whole[stage])[:2] + np.shape(image)[2:], np.nan)
                found[stage][down : down + height, right : right + width] = image
        return found

    return laid


def _larger(scene: Scene) -> Scene:
    camera = scene.camera
    fovy = math.degrees(2 * math.atan(math.tan(camera.alpha) * (camera.height + 1) / camera.height))
    return replace(scene, camera=replace(camera, width=camera.width + 1, height=camera.height + 1, fovy=fovy))


def _camera(**changes: Callable[[Camera], object]) -> Callable[[Scene], Scene]:
    def asked(scene: Scene) -> Scene:
        values = {name: change(scene.camera) for name, change in changes.items()}
        return replace(scene, camera=replace(scene.camera, **values))  # type: ignore[arg-type]

    return asked


def _rays(
    *,
    tangent: Callable[[Camera], float] = lambda camera: math.tan(camera.alpha),
    aspect: Callable[[Camera], float] = lambda camera: camera.aspect,
    up_as_given: bool = False,
    unit: bool = True,
) -> dict[Stage, Callable[[Given], np.ndarray]]:
    """Return the rays of a pinhole camera, F + sx aspect tan R + sy tan U, with one part of it wrong."""

    def rays(given: Given) -> np.ndarray:
        camera = given.scene.camera
        forward = np.subtract(camera.target, camera.eye)
        forward = forward / np.linalg.norm(forward)
        right = np.cross(forward, camera.up)
        right = right / np.linalg.norm(right)
        up = np.asarray(camera.up) / np.linalg.norm(camera.up) if up_as_given else np.cross(right, forward)
        sx = (2 * (np.arange(camera.width) + 0.5) / camera.width - 1)[np.newaxis, :, np.newaxis]
        sy = (1 - 2 * (np.arange(camera.height) + 0.5) / camera.height)[:, np.newaxis, np.newaxis]
        high = tangent(camera)
        found = forward + sx * (aspect(camera) * high) * right + sy * high * up
        return found / np.linalg.norm(found, axis=-1, keepdims=True) if unit else found

    return {Stage.RAY: rays}


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


for _name, _says, _items, _way in (
    ("left_handed", "builds a left-handed camera, so that its image is mirrored", ("CAM-1",), Way(laid=_flipped(1))),
    ("image_mirrored", "writes each row of its image from right to left", ("CAM-3",), Way(laid=_flipped(1))),
    ("upside_down", "writes its image upside down, the bottom row first", ("CAM-3",), Way(laid=_flipped(0))),
    (
        "turned_half",
        "turns its image by 180 degrees",
        ("CAM-3",),
        Way(laid=lambda a, b: _flipped(0)(_flipped(1)(a, b), b)),
    ),
    ("pixel_corner", "samples each pixel at its top left corner", ("CAM-3",), Way(asked=_larger, laid=_placed(0, 0))),
    (
        "pixel_corner_right",
        "samples each pixel at its top right corner",
        ("CAM-3",),
        Way(asked=_larger, laid=_placed(0, 1)),
    ),
    (
        "pixel_corner_below",
        "samples each pixel at its bottom left corner",
        ("CAM-3",),
        Way(asked=_larger, laid=_placed(1, 0)),
    ),
    (
        "pixel_far_corner",
        "samples each pixel at its bottom right corner",
        ("CAM-3",),
        Way(asked=_larger, laid=_placed(1, 1)),
    ),
    (
        "fovx_for_fovy",
        "takes fovy for the horizontal angle",
        ("CAM-2", "CAM-4", "CAM-5"),
        Way(stages=_rays(tangent=lambda camera: math.tan(camera.alpha) / camera.aspect)),
    ),
    (
        "whole_angle",
        "takes the tangent of the whole angle fovy instead of half of it",
        ("CAM-2", "CAM-4", "CAM-5"),
        Way(stages=_rays(tangent=lambda camera: math.tan(2 * camera.alpha))),
    ),
    (
        "half_angle_twice",
        "halves the angle fovy twice",
        ("CAM-2", "CAM-4", "CAM-5"),
        Way(stages=_rays(tangent=lambda camera: math.tan(camera.alpha / 2))),
    ),
    (
        "degrees_for_radians",
        "hands degrees to a tangent that expects radians",
        ("CAM-2", "CAM-4", "CAM-5"),
        Way(stages=_rays(tangent=lambda camera: math.tan(camera.fovy / 2))),
    ),
    ("no_aspect", "leaves the aspect ratio out", ("CAM-2", "CAM-4", "CAM-5"), Way(stages=_rays(aspect=lambda _: 1.0))),
    (
        "aspect_inverted",
        "takes height over width for the aspect ratio",
        ("CAM-2", "CAM-4", "CAM-5"),
        Way(stages=_rays(aspect=lambda camera: 1 / camera.aspect)),
    ),
    (
        "up_as_given",
        "takes the given up vector as it is, without making it orthogonal to the view",
        ("CAM-1",),
        Way(stages=_rays(up_as_given=True)),
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
    ("not_normalised", "does not normalise its rays", ("CAM-4", "CAM-5"), Way(stages=_rays(unit=False))),
    (
        "depth_for_distance",
        "writes the depth along the viewing direction as distance",
        ("HIT-9", "CAM-4"),
        Way(stages={Stage.DISTANCE: _depths, Stage.POSITION: _right_positions}),
    ),
):
    MISTAKES.register(_name)(Mistake(says=_says, items=_items, ways=(_way,)))
