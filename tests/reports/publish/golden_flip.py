"""A pair of images with their HDR-FLIP by its authors' program, kept beside this file, and what made it.

`python -m tests.reports.publish.golden_flip` makes it anew where flip-evaluator is installed; version 1.7 did.
Exposures are passed: its own are log2(x / 0) where more than half of the reference is black (NVlabs/flip issue 42).
"""

from pathlib import Path

import numpy as np

PATH = Path(__file__).with_suffix(".npz")
WIDTH, HEIGHT = 40, 30  # px


def pair() -> tuple[np.ndarray, np.ndarray]:
    """Return a lit ball before nothing, and it with noise, a brighter patch, a hole and a row out of place; float32."""
    random = np.random.default_rng(8)
    y, x = np.mgrid[:HEIGHT, :WIDTH]
    light = 0.02 + 3 * np.clip(1 - ((x - 14) ** 2 + (y - 9) ** 2) / 200, 0, 1)
    ball = ((x - 20) ** 2 + (y - 14) ** 2 < 130) * light
    theirs = (ball[..., None] * [0.7, 0.5, 0.3]).astype(np.float32)
    ours = (theirs * np.maximum(0, 1 + 0.05 * random.normal(size=theirs.shape))).astype(np.float32)
    ours[18:22, 22:27] *= 1.5
    ours[5:7, 12:14] = 0
    ours[14] = np.roll(ours[14], 1, axis=0)
    return ours, theirs


def evaluated(ours: np.ndarray, theirs: np.ndarray, exposures: tuple[float, float]) -> np.ndarray:
    """Return HDR-FLIP (height, width) by flip_evaluator, from the first to the last exposure, in stops."""
    import flip_evaluator  # type: ignore[import-not-found]

    asked = {"startExposure": exposures[0], "stopExposure": exposures[1]}
    found, *_ = flip_evaluator.evaluate(theirs, ours, "HDR", applyMagma=False, parameters=asked)
    return np.asarray(found)[..., 0]


def main() -> None:
    """Write the images, their FLIP and the exposures that it was asked over."""
    ours, theirs = pair()
    exposures = (0.40991969, 4.5)  # five exposures, the first as the article has it for this reference
    np.savez_compressed(PATH, ours=ours, theirs=theirs, exposures=exposures, flip=evaluated(ours, theirs, exposures))


if __name__ == "__main__":
    main()
