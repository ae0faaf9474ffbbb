"""The scene as float32 receives it: every number rounded once, so that truth and formula start from the same floats."""

from dataclasses import replace
from typing import Any

import numpy as np

from rayproof.cases.scene import Scene, Shape, Sphere, Square


def single(values: Any) -> Any:
    """Return a number, or nested tuples of numbers, rounded to float32."""
    if isinstance(values, tuple):
        return tuple(single(value) for value in values)
    return float(np.float32(values))


def _shape(shape: Shape) -> Shape:
    # A square's sides are told orthogonal or sheared by their float64 values; rounding would make all of them sheared.
    if isinstance(shape, Square):
        return replace(shape, albedo=single(shape.albedo))
    rounded = replace(shape, albedo=single(shape.albedo), to_world=single(shape.to_world))
    if isinstance(rounded, Sphere):
        return replace(rounded, center=single(rounded.center), radius=single(rounded.radius))
    return rounded


def as_received(scene: Scene) -> Scene:
    """Return the scene with its numbers rounded to float32, which every precision then holds exactly.

    Else what a formula is blamed for would include that 0.1 m is no float.
    """
    camera = scene.camera
    fields = {name: single(getattr(camera, name)) for name in ("eye", "target", "up", "fovy", "near", "far")}
    lights = tuple(replace(light, position=single(light.position), flux=single(light.flux)) for light in scene.lights)
    return replace(scene, camera=replace(camera, **fields), shapes=tuple(map(_shape, scene.shapes)), lights=lights)
