"""A scene in Tachyon's model format: the camera, and the surfaces in the colours of the question."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from rayproof.cases.scene import Camera, Scene, Shape
from rayproof.reference.tachyon.surfaces import Ball, Level, Surface, surface_of


@dataclass(frozen=True, kw_only=True)
class Look:
    """What a facet looks like."""

    color: tuple[float, ...]  # per channel
    shines: bool  # by itself, whatever the light; else it is an albedo


# (shape, its surface, its index in the scene) -> a look per facet, or the one of a sphere or plane
Paint = Callable[[Shape, Surface, int], list[Look]]


def model(scene: Scene, paint: Paint, lights: str = "") -> str:
    """Return the whole model."""
    parts = ["BEGIN_SCENE", "RESOLUTION 8 8", _camera(scene.camera), "BACKGROUND 0 0 0", lights]
    for index, shape in enumerate(scene.shapes):
        surface = surface_of(shape)
        parts += _objects(surface, [_texture(look) for look in paint(shape, surface, index)])
    return "\n".join([*parts, "END_SCENE", ""])


def numbers(values: object) -> str:
    """Return numbers with every digit of float64, of which Tachyon's reader keeps float32's."""
    return " ".join(f"{value:.17g}" for value in np.ravel(np.asarray(values, dtype=np.float64)).tolist())


def _camera(camera: Camera) -> str:
    forward = np.subtract(camera.target, camera.eye, dtype=np.float64)
    # Tachyon's image is one unit high at `zoom` from the eye.
    return f"""CAMERA
  ZOOM {0.5 / np.tan(camera.alpha):.17g}
  ASPECTRATIO 1
  ANTIALIASING 0
  RAYDEPTH 1
  CENTER {numbers(camera.eye)}
  VIEWDIR {numbers(forward / np.linalg.norm(forward))}
  UPDIR {numbers(camera.up)}
END_CAMERA"""


def _texture(look: Look) -> str:
    ambient, diffuse = (1, 0) if look.shines else (0, 1)
    return f"TEXTURE AMBIENT {ambient} DIFFUSE {diffuse} SPECULAR 0 OPACITY 1 COLOR {numbers(look.color)} TEXFUNC 0"


def _objects(surface: Surface, textures: list[str]) -> list[str]:
    if isinstance(surface, Ball):
        return [f"SPHERE CENTER {numbers(surface.center)} RAD {surface.radius:.17g} {textures[0]}"]
    if isinstance(surface, Level):
        return [f"PLANE CENTER {numbers(surface.point)} NORMAL {numbers(surface.normal)} {textures[0]}"]
    corners = surface.corners.reshape(-1, 9).tolist()
    form = "TRI V0 %.17g %.17g %.17g V1 %.17g %.17g %.17g V2 %.17g %.17g %.17g "
    return [form % tuple(row) + texture for row, texture in zip(corners, textures, strict=True)]
