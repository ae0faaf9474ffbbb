"""The noise of a program that draws random numbers: the mean of its renders, the limit of its error, a pooled test.

The limit of a pixel is a multiple of its standard error over renders with different seeds, by Student's distribution.
If a program samples a single random light at a time, most samples of a pixel that only one light reaches are black, and
the variance of a few renders is no reliable estimate. So the variance is at least that of such a choice of the
brightest light, scaled to the noise of the whole image. The limits of noisy pixels are wide, so that the mean over all
smooth pixels is tested as well. Its limit is a multiple of the standard error of the renders' own means, so that a
program may use the same random numbers in every pixel.

If samples may be anywhere in a pixel, the expected value is the mean over the pixel, which the oracle computes from
4 x 4 points. The error of this mean is added to the limit: half a jump in parts of a pixel that an edge may cross, and
elsewhere the error of the midpoint rule, h^2 f'' / 24 in each direction (Davis and Rabinowitz, Methods of Numerical
Integration, 1984, 2.1).
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

CHANCE = 1e-9  # probability that noise moves a right pixel beyond its limit
POINTS = 4  # per side of a pixel, for its mean
# Factor of the image's mean variance in the scale of `_floor`: the number of visible lights varies over pixels.
UNEVEN = 4


def averaged(
    renders: Iterable[np.ndarray], scene: Scene, *, within_pixel: bool
) -> tuple[np.ndarray, Resolution, np.ndarray | None]:
    """Return the mean of renders (height, width, 3), the limits of its error by noise, and `Answers.pooled_error`.

    If samples may be anywhere `within_pixel`, the mean is converted to values at the pixels' centres: the oracle's
    difference between a pixel's mean and its centre is subtracted.
    """
    from scipy.special import stdtrit

    centre = Analytic().render(scene, [Stage.RADIANCE])[Stage.RADIANCE]
    expected, off, smooth = _over_pixels(scene, centre) if within_pixel else _at_centres(scene, centre)
    count, mean, squares, means = 0, np.zeros_like(centre), np.zeros_like(centre), []
    with np.errstate(invalid="ignore", over="ignore"):  # by infinite values, which are kept and judged
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
    """Return the expected image, a bound of its error, and the mask of pixels that are not next to an edge."""
    beside = scene_truth(scene, stages_of(scene), Analytic()).beside_changes
    return centre, np.zeros_like(centre), ~beside & np.isfinite(centre).all(axis=-1)


def _over_pixels(scene: Scene, centre: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the mean over each pixel, a bound of its error, and the mask of pixels that are not near an edge."""
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
    """Return each pixel's two neighbours along an axis; at the border of the image, the pixel itself."""
    places = np.arange(image.shape[axis])
    before, after = np.maximum(places - 1, 0), np.minimum(places + 1, places[-1])
    return np.take(image, before, axis=axis), np.take(image, after, axis=axis)


def _floor(scene: Scene, variance: np.ndarray) -> np.ndarray:
    """Return the least variance (height, width, 3) of a render, from the brightest light of each pixel.

    If a random light of n is sampled and counted n times, the variance of a sample is (n - 1) L^2.
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
