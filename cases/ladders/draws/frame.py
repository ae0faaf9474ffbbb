"""Numbers that a camera is made of: places in an image, axes, half-sizes, matrices, and rays at its clip planes."""

import math

import numpy as np

from rayproof.cases.ladders.draws import across, directions, rounded
from rayproof.cases.ladders.ladder import Draw, Inputs

NEAR, FAR, FOVY, ASPECT = 0.125, 8.0, 60.0, 1.75
PER_SIDE = 3  # no power of two: a division that rounds


def _full(count: int, value: float, precision: str) -> np.ndarray:
    return rounded(np.full(count, value), precision)


def samples(width: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
    """Return samples of an image of so many columns and rows of them, PER_SIDE a pixel."""
    places = generator.integers(0, int(width), (2, count)).astype(np.float64)
    return {"column": places[0], "row": places[1], "per_side": np.full(count, float(PER_SIDE))}


def _size(width: float, count: int) -> Inputs:
    """Return a landscape image: one that is square would not tell its sides apart."""
    return {"width": np.full(count, width), "height": np.full(count, np.floor(0.7 * width))}


def pixels(width: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
    """Return centres of pixels of an image `width` pixels wide."""
    size = _size(width, count)
    px, py = (rounded(np.floor(generator.uniform(0, size[side])) + 0.5, precision) for side in ("width", "height"))
    return {"px": px, "py": py} | size


def places(width: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
    """Return normalised device coordinates, and an image `width` pixels wide."""
    ndc = rounded(generator.uniform(-1, 1, (2, count)), precision)
    return {"sx": ndc[0], "sy": ndc[1]} | _size(width, count)


def frames(*, eye: float = 6.0, fovy: float = FOVY, near: float = NEAR, far: float = FAR, swept: str = "") -> Draw:
    """Return a draw of cameras by their own numbers: eye, axes in random orientation, half-sizes, near and far.

    The value replaces the quantity called `swept`: eye (distance from the origin [m]), fovy [degrees], ratio
    (far / near) or depth (far / near - 1).
    """

    def draw(value: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
        now = {"eye": eye, "fovy": fovy, "far": far} | ({swept: value} if swept in ("eye", "fovy") else {})
        if swept in ("ratio", "depth"):
            now["far"] = near * (value if swept == "ratio" else 1 + value)
        forward = directions(count, generator)
        right = across(forward, generator)
        # Sizes differ from camera to camera, so that no quotient is an exact one.
        vertical = math.tan(math.radians(now["fovy"]) / 2) * generator.uniform(0.7, 1.4, count)
        scale = generator.uniform(0.7, 1.4, count)
        return {
            "eye": rounded(directions(count, generator) * now["eye"], precision),
            "right": rounded(right, precision),
            "up": rounded(np.cross(right, forward), precision),
            "forward": rounded(forward, precision),
            "horizontal": rounded(vertical * ASPECT, precision),
            "vertical": rounded(vertical, precision),
            "near": rounded(near * scale, precision),
            "far": rounded(now["far"] * scale, precision),
        }

    return draw


def matrices(kind: str, frames: Draw) -> Draw:
    """Return a draw of the matrices "view" or "projection" of the cameras of `frames`, entry by entry."""

    def draw(value: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
        x = frames(value, count, generator, precision)
        m = np.zeros((count, 4, 4))
        if kind == "view":
            for row, axis in enumerate(("right", "up", "forward")):
                m[:, row, :3] = x[axis]
                m[:, row, 3] = -np.sum(x[axis] * x["eye"], axis=1)
            m[:, 3, 3] = 1
        else:
            stretch = x["far"] / (x["far"] - x["near"])
            m[:, 0, 0], m[:, 1, 1] = 1 / x["horizontal"], 1 / x["vertical"]
            m[:, 2, 2], m[:, 2, 3], m[:, 3, 2] = stretch, -x["near"] * stretch, 1
        m = rounded(m, precision)
        return {f"m{i}{j}": m[:, i, j].copy() for i in range(4) for j in range(4)}

    return draw


def slanted(cosine: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
    """Return unit directions at this cosine to the viewing direction, and near and far."""
    forward = directions(count, generator)
    direction = cosine * forward + math.sqrt(1 - cosine**2) * across(forward, generator)
    return {
        "direction": rounded(direction, precision),
        "forward": rounded(forward, precision),
        "near": rounded(generator.uniform(0.1, 0.2, count), precision),
        "far": rounded(generator.uniform(5, 10, count), precision),
    }


def at_planes(*, shell: bool) -> Draw:
    """Return a draw of hits about `value` roundings before or behind the near or the far plane, or `shell`."""

    def draw(value: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
        u = 2.0**-24 if precision == "float32" else 2.0**-53
        x = slanted(float(generator.uniform(0.3, 0.9)), count, generator, precision)
        depth = np.where(generator.random(count) < 0.5, x["near"], x["far"])
        off = 1 + value * u * np.where(generator.random(count) < 0.5, -1, 1) * generator.uniform(1, 2, count)
        cosine = 1.0 if shell else np.sum(x["direction"] * x["forward"], axis=1)
        return x | {"t": rounded(depth / cosine * off, precision)}

    return draw


def anywhere(distance: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
    """Return hits about `distance` m before or behind the eye."""
    side = np.where(generator.random(count) < 0.5, -1.0, 1.0)
    x = slanted(0.7, count, generator, precision)
    return x | {"t": rounded(side * distance * generator.uniform(0.5, 1, count), precision)}
