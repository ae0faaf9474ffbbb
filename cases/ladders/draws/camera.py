"""Cameras in random orientations: with an axis-aligned up some errors do not show at all."""

import numpy as np

from rayproof.cases.ladders.draws import across, directions, rounded
from rayproof.cases.ladders.ladder import Draw, Inputs

ASPECT = 1.75  # exact in both precisions


def cameras(
    *,
    eye: float = 6.0,
    near: float = 0.125,
    far: float = 128.0,
    fovy: float = 60.0,
    aspect: float = ASPECT,
    lean: float = 1.0,
    swept: str = "",
) -> Draw:
    """Return a draw of cameras `eye` m from the origin; the value replaces the quantity called `swept`.

    Quantities: eye, near, ratio (far / near), fovy, aspect, lean (between F and up [rad]), flare (180 - fovy).
    """

    def draw(value: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
        now = {"eye": eye, "near": near, "far": far, "fovy": fovy, "aspect": aspect, "lean": lean}
        if swept == "ratio":
            now["far"] = near * value
        elif swept == "flare":
            now["fovy"] = 180 - value
        elif swept:
            now[swept] = value
        position = rounded(directions(count, generator) * now["eye"], precision)
        forward = directions(count, generator)
        target = rounded(position + forward * 6.0, precision)
        up = np.cos(now["lean"]) * forward + np.sin(now["lean"]) * across(forward, generator)
        single = {name: rounded(np.full(count, now[name]), precision) for name in ("near", "far", "aspect")}
        return {
            "eye": position,
            "target": target,
            "up": rounded(up, precision),
            "sx": rounded(generator.uniform(-1, 1, count), precision),
            "sy": rounded(generator.uniform(-1, 1, count), precision),
            "fovy": np.full(count, now["fovy"]),
            **single,
        }

    return draw
