"""The noise of a program that draws random numbers: the mean of its renders, what that may be off by, a pooled test.

The limit of a pixel is its standard error over renders with different seeds, by Student's distribution. In a program
that picks one of several lights most samples of a pixel that a single light reaches are black, so that the variance of
few renders says too little: it is at least what such a pick makes of the brightest light, scaled to the noise of the
whole image. Pixels with much noise say little each; the mean over all smooth pixels is tested besides. Its error
is that of the renders' own means, so that a program may use the same random numbers in every pixel.

Where a sample may lie anywhere in its pixel, the expected value is the mean over the pixel, which the oracle takes from
4 x 4 points. Its error belongs to the limit: half a jump in parts of a pixel that an edge may cross, and elsewhere the
error of the midpoint rule, h^2 f'' / 24 in either direction (Davis and Rabinowitz, Methods of Numerical Integration,
1984, 2.1).
"""

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from rayproof.cases.scene import Scene
from rayproof.cases.stages import Resolution, Stage
from rayproof.reference.analytic import Analytic
from rayproof.reports.judge.box_filter import box_mean, finer
from rayproof.reports.judge.oracle import stages_of
from rayproof.reports.judge.scene_truth import scene_truth

CHANCE = 1e-9  # that a right pixel is over its limit by noise
POINTS = 4  # a side of a pixel, for its mean
UNEVEN = (
    4  # times the variance of the image on average, beside that of a pick: pixels differ in how many lights they see
)


def averaged(
    renders: Iterable[np.ndarray], scene: Scene, *, within_pixel: bool
) -> tuple[np.ndarray, Resolution, np.ndarray | None]:
    """Return the mean of renders (height, width, 3), what noise makes it off by, and the `pooled_error` of `Answers`.

    If samples may lie anywhere `within_pixel`, the image is the mean as it would be at the pixels' centres: less the
    difference that the oracle finds between a pixel's mean and its centre.
    """
    from scipy.special import stdtrit

    centre = Analytic().render(scene, [Stage.RADIANCE])[Stage.RADIANCE]
    expected, off, smooth = _over_pixels(scene, centre) if within_pixel else _at_centres(scene, centre)
    count, mean, squares, means = 0, np.zeros_like(centre), np.zeros_like(centre), []
    with np.errstate(invalid="ignore", over="ignore"):  # of infinite renders, which are judged as they are
        for render in renders:
            count += 1
            step = render - mean
            mean = mean + step / count
            squares = squares + step * (render - mean)
            means.append(render[smooth].mean(axis=0) if smooth.any() else np.zeros(3))
        quantile = -float(stdtrit(count - 1, CHANCE / 2))
        variance = np.nan_to_num(squares / (count - 1), nan=0.0, posinf=0.0)
        variance = np.maximum(variance, _floor(scene, variance))
        noise = quantile * np.sqrt(variance / count)
        image = mean - expected + centre
    resolution = Resolution(
        relative=0.0,
        absolute=0.0,
        because=f"each pixel's standard error over {count} renders, times {quantile:.3g}",
        steps=noise + off,
    )
    if not smooth.any():
        return image, resolution, None
    error = quantile * np.std(means, axis=0, ddof=1) / np.sqrt(count) + off[smooth].mean(axis=0)
    return image, resolution, np.where(smooth[..., np.newaxis], error, np.nan)


def _at_centres(scene: Scene, centre: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the expected image, what it is off by, and the pixels beside no edge."""
    beside = scene_truth(scene, stages_of(scene), Analytic()).beside_changes
    return centre, np.zeros_like(centre), ~beside & np.isfinite(centre).all(axis=-1)


def _over_pixels(scene: Scene, centre: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the mean over each pixel, what it is off by, and the pixels that no edge is near."""
    fine = finer(scene, POINTS)
    base = scene_truth(fine, stages_of(fine), Analytic())
    values, beside = base.truth[Stage.RADIANCE], base.beside_changes
    jumps, bends = np.zeros_like(values), np.zeros_like(values)
    with np.errstate(invalid="ignore"):
        for axis in (0, 1):
            before, after = _neighbours(values, axis)
            jumps = np.maximum(jumps, np.maximum(np.abs(values - before), np.abs(values - after)))
            bends = bends + np.abs(before - 2 * values + after)
    off = np.nan_to_num(np.where(beside[..., np.newaxis], jumps / 2, bends / 24), nan=0.0)
    smooth = ~(box_mean(beside[..., np.newaxis].astype(float), POINTS)[..., 0] > 0)
    expected = box_mean(values, POINTS)
    finite = np.isfinite(expected) & np.isfinite(centre)
    return np.where(finite, expected, centre), box_mean(off, POINTS), smooth & finite.all(axis=-1)


def _neighbours(image: np.ndarray, axis: int) -> tuple[np.ndarray, np.ndarray]:
    """Return each pixel's neighbours along an axis; at the border of the image the pixel itself."""
    places = np.arange(image.shape[axis])
    before, after = np.maximum(places - 1, 0), np.minimum(places + 1, places[-1])
    return np.take(image, before, axis=axis), np.take(image, after, axis=axis)


def _floor(scene: Scene, variance: np.ndarray) -> np.ndarray:
    """Return the least variance (height, width, 3) of a render, from the brightest light of each pixel.

    One of n lights that is picked at random and counted n times has the variance (n - 1) L^2 in a single sample.
    """
    count = len(scene.lights)
    if count < 2:
        return np.zeros_like(variance)
    brightest = np.zeros_like(variance)
    for light in scene.lights:
        under_it = Analytic().render(replace(scene, lights=(light,)), [Stage.RADIANCE])
        brightest = np.maximum(brightest, under_it[Stage.RADIANCE])
    picked = (count - 1) * np.nan_to_num(brightest, posinf=0.0) ** 2
    whole = float(picked.sum())
    share = min(1.0, UNEVEN * float(variance.sum()) / whole) if whole > 0 else 0.0
    return share * picked
