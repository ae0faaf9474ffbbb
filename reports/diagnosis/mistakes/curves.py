"""Light off by a curve of one variable (distance, cosine, flux, albedo): RAD-1, RAD-2, RAD-4, RAD-5.

The variable is the distance to the light, the cosine, the flux, the albedo or the number of lights. A curve has a
formula: a sum of powers, a power, an exponential, the sRGB curve. Where the ratio depends on the distance or the cosine
alone and no formula fits, the curve is a table, and what lies beyond the table is not judged.
"""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import cast

import numpy as np

from rayproof.cases.scene import Rgb, Scene, Shape
from rayproof.cases.stages import Stage
from rayproof.reports.diagnosis import MISTAKES, Given, Mistake, Way, Wrong
from rayproof.reports.diagnosis.fits import CLOSE, LEAST_SAMPLES, MOST_OUTSIDE, Fitting, one_value, spelled, sum_of
from rayproof.reports.diagnosis.mistakes.light import Lights, Share, Strength, lit_by_one, srgb
from rayproof.reports.diagnosis.mistakes.shadows import no_horizon

MOST_GAP = 0.005  # relative: between two entries of a table so far apart a smooth curve is straight within CLOSE
Curve = Callable[[np.ndarray], np.ndarray]


@dataclass(frozen=True, kw_only=True)
class Samples:
    """Pixels of several cases, with one entry a channel or one a pixel."""

    ratio: np.ndarray  # of the renderer's light to the right one
    variable: np.ndarray


def _stage(case: Fitting, *stages: Stage) -> Stage | None:
    """Return the stage of light at which a ratio is taken: one of those given, of radiance alone that."""
    if case.staged:
        return next((stage for stage in stages if stage in case.ours), None)
    return Stage.RADIANCE if Stage.RADIANCE in case.ours else None


def _ratios(case: Fitting, stage: Stage) -> np.ndarray:
    """Return the ratio to the right light, (height, width, 3); NaN where there is none or an edge is near."""
    ours, right = case.ours[stage], case.right[stage]
    found = np.where((right > 0) & (ours > 0), ours / np.where(right > 0, right, 1.0), np.nan)
    found[~case.plain] = np.nan
    return found


def _of_one_light(cases: Sequence[Fitting], variable: str, *, physical: bool) -> Samples:
    """Return samples of pixels that one light lights, by its distance [m], its cosine or its flux [W] a channel."""
    ratios, variables = [np.zeros(0)], [np.zeros(0)]
    for case in cases:
        stage = _stage(case, Stage.IRRADIANCE)
        if stage is None or not case.scene.lights or (physical and case.scene.shading == "simplified"):
            continue
        alone, distance, cosine = lit_by_one(case.scene, case.right)
        found = _ratios(case, stage)
        if variable == "flux":
            which = np.argmax(case.right[Stage.VISIBILITY] > 0, axis=-1)
            values = np.array([light.flux for light in case.scene.lights], dtype=np.float64)[which]
        else:
            # Each pixel by the channel that is brightest, whose rounding is least.
            best = np.argmax(case.right[stage], axis=-1)[..., np.newaxis]
            found = np.take_along_axis(found, best, axis=-1)
            values = {"distance": distance, "cosine": cosine}[variable][..., np.newaxis]
        ratios.append(found[alone].ravel())
        variables.append(values[alone].ravel())
    return _usable(ratios, variables)


def _usable(ratios: Sequence[np.ndarray], variables: Sequence[np.ndarray]) -> Samples:
    ratio, variable = np.concatenate(ratios), np.concatenate(variables)
    good = np.isfinite(ratio) & np.isfinite(variable) & (variable > 0)
    return Samples(ratio=ratio[good], variable=variable[good])


def _says_nothing(samples: Samples) -> bool:
    """Say whether there are few samples, or all but a few have the right light."""
    differ = np.count_nonzero(np.abs(samples.ratio - 1) > 5 * CLOSE)
    return len(samples.ratio) < LEAST_SAMPLES or bool(differ < LEAST_SAMPLES)


def _in_light(share: Share, says: str, *, everywhere: bool = False) -> Way:
    stages: dict[Stage, Wrong] = {Stage.IRRADIANCE: Lights((share,))}
    return Way(stages=stages | ({Stage.VISIBILITY: no_horizon} if everywhere else {}), says=says)


def _of_distance(cases: Sequence[Fitting]) -> Iterator[Way]:
    samples = _of_one_light(cases, "distance", physical=True)
    if _says_nothing(samples):
        return
    r, fall = samples.variable, samples.ratio / samples.variable**2
    powers = sum_of(fall[:, np.newaxis] * np.stack([np.ones_like(r), r, r**2], axis=-1))
    said = "has light that depends on the distance r alone, as {0} instead of 1/r^2"
    found = False
    if powers is not None:
        one, two, three = (float(value) for value in powers)
        square = math.isclose(two * two, 4 * one * three, rel_tol=10 * CLOSE) and min(one, three) > 0
        words = spelled({"": one, "r": two, "r^2": three})
        if square:
            words = f"({spelled({'': math.sqrt(one), 'r': math.copysign(math.sqrt(three), two)})})^2"
        else:
            words = f"({words})"
        yield _by_distance(lambda r: r**2 / (one + two * r + three * r**2), said.format(f"1/{words}"))
        found = True
    # Nearer than some distance the light no longer grows.
    near = samples.ratio < 1 - 5 * CLOSE
    least = one_value(samples.variable[near] / np.sqrt(samples.ratio[near]))
    if least is not None and np.all(np.abs(samples.ratio[r > least * (1 + CLOSE)] - 1) <= 5 * CLOSE):
        yield _by_distance(lambda r: np.minimum(1.0, (r / least) ** 2), said.format(f"1/max(r, {least:.4g})^2"))
        found = True
    rate = one_value(-np.log(samples.ratio) / r)
    if rate is not None:
        yield _by_distance(lambda r: np.exp(-rate * r), said.format(f"exp(-{rate:.4g} r)/r^2"))
        found = True
    curve = None if found or _is_power(samples) else _table(samples)
    if curve is not None:
        yield _by_distance(
            curve, f"has light whose ratio to the right one depends on the distance alone: {_some(samples)}"
        )


def _by_distance(curve: Curve, says: str) -> Way:
    return _in_light(Share(physical=lambda squared, cosine, _: curve(np.sqrt(squared))), says)


def _of_cosine(cases: Sequence[Fitting]) -> Iterator[Way]:
    for physical in (False, True):
        samples = _of_one_light(cases, "cosine", physical=physical)
        if _says_nothing(samples):
            continue
        c = samples.variable
        powers = sum_of(np.stack([c**power for power in range(4)], axis=-1) / (samples.ratio * c)[:, np.newaxis])
        if powers is not None:
            words = spelled({name: float(value) for name, value in zip(("", "c", "c^2", "c^3"), powers, strict=True)})
            says = f"has light that depends on the cosine c alone, as {words} instead of c"
            polynomial = np.polynomial.Polynomial(powers)
            yield _by_cosine(lambda c, curve=polynomial: curve(c) / c, says, physical=physical)
            if not physical:  # the light may go on below the horizon
                yield _in_light(Share(cosine=polynomial), f"{says}, below the horizon, too", everywhere=True)
        elif not _is_power(samples) and (curve := _table(samples)) is not None:
            says = f"has light whose ratio to the right one depends on the cosine alone: {_some(samples)}"
            yield _by_cosine(curve, says, physical=physical)


def _by_cosine(curve: Curve, says: str, *, physical: bool) -> Way:
    def strength(squared: np.ndarray, cosine: np.ndarray, _: float) -> np.ndarray:
        return curve(cosine)

    plain: Strength | None = None if physical else strength
    return _in_light(Share(physical=strength, simplified=plain), says)


def _is_power(samples: Samples) -> bool:
    """Say whether the ratio is a factor times a power, which known mistakes are, alone or two at a time."""
    terms = np.stack([np.ones_like(samples.ratio), np.log(samples.variable)], axis=-1)
    log = np.log(samples.ratio)
    off = np.abs(terms @ np.linalg.lstsq(terms, log, rcond=None)[0] - log)
    return bool(np.median(off) <= CLOSE)


def _table(samples: Samples) -> Curve | None:
    """Return the curve through samples where their ratio depends on nothing else: NaN where they leave a gap."""
    order = np.argsort(samples.variable)
    x, y = np.log(samples.variable[order]), samples.ratio[order]
    cells = np.unique(np.floor(x / (MOST_GAP / 8)), return_index=True)[1]
    where = np.append(cells, len(x))
    knots = np.array([(np.mean(x[one:two]), np.median(y[one:two])) for one, two in pairwise(where)])
    if len(knots) < LEAST_SAMPLES:
        return None
    off = np.abs(np.interp(x, knots[:, 0], knots[:, 1]) / y - 1)
    if np.count_nonzero(off > 2 * CLOSE) > MOST_OUTSIDE * len(off):
        return None

    def curve(values: np.ndarray) -> np.ndarray:
        logs = np.log(values)
        after = np.clip(np.searchsorted(knots[:, 0], logs), 1, len(knots) - 1)
        gap = knots[after, 0] - knots[after - 1, 0]
        found = np.interp(logs, knots[:, 0], knots[:, 1], left=np.nan, right=np.nan)
        return np.where(gap <= MOST_GAP, found, np.nan)

    return curve


def _some(samples: Samples) -> str:
    """Return three places of a curve in words."""
    order = np.argsort(samples.variable)
    places = order[[int(share * (len(order) - 1)) for share in (0.1, 0.5, 0.9)]]
    return ", ".join(f"{samples.ratio[place]:.3g} at {samples.variable[place]:.3g}" for place in places)


# Curves of albedo and flux that have no parameter.
CURVES: Mapping[str, Curve] = {
    "made linear as if it were sRGB": lambda value: np.where(
        value <= 0.04045, value / 12.92, ((np.maximum(value, 0) + 0.055) / 1.055) ** 2.4
    ),
    "put through the sRGB curve": srgb,
    "rounded to 8 bits": lambda value: np.floor(255 * np.clip(value, 0, 1) + 0.5) / 255,
    "taken off 1": lambda value: 1 - value,
}


def _curves(samples: Samples, what: str) -> Iterator[tuple[Curve, str]]:
    """Yield curves that a quantity may have been put through, with words."""
    value, ratio = samples.variable, samples.ratio
    for words, curve in CURVES.items():
        if np.count_nonzero(np.abs(curve(value) / value / ratio - 1) > 5 * CLOSE) <= MOST_OUTSIDE * len(ratio):
            yield curve, f"takes {what} {words}"
    powers = 1 + np.log(ratio) / np.log(value)
    power = one_value(powers[np.abs(np.log(value)) > 0.1])
    if power is not None:
        yield lambda value: np.power(value, power), f"takes {what} to the power of {power:.4g}"


def _of_albedo(cases: Sequence[Fitting]) -> Iterator[Way]:
    ratios, variables = [np.zeros(0)], [np.zeros(0)]
    for case in cases:
        stage = _stage(case, Stage.EXITANCE)
        if stage is not None and case.scene.lights:
            ratios.append(_ratios(case, stage).ravel())
            variables.append(_albedo(case.scene.shapes, case.right[Stage.OBJECT]).ravel())
    samples = _usable(ratios, variables)
    if _says_nothing(samples):
        return
    for curve, says in _curves(samples, "albedo"):

        def wrong(given: Given, curve: Curve = curve) -> np.ndarray:
            return curve(_albedo(given.scene.shapes, given.answers[Stage.OBJECT])) * given.answers[Stage.IRRADIANCE]

        yield Way(stages={Stage.EXITANCE: wrong}, says=says)


def _albedo(shapes: Sequence[Shape], objects: np.ndarray) -> np.ndarray:
    table = np.array([*(shape.albedo for shape in shapes), (0.0, 0.0, 0.0)], dtype=np.float64)
    return table[objects[..., 0].astype(int)]


def _of_flux(cases: Sequence[Fitting]) -> Iterator[Way]:
    samples = _of_one_light(cases, "flux", physical=False)
    if _says_nothing(samples):
        return
    for curve, says in _curves(samples, "the flux of a light"):

        def asked(scene: Scene, curve: Curve = curve) -> Scene:
            lights = tuple(
                replace(light, flux=cast("Rgb", tuple(curve(np.array(light.flux)).tolist()))) for light in scene.lights
            )
            return replace(scene, lights=lights)

        yield Way(asked=asked, says=says)


def _of_number(cases: Sequence[Fitting]) -> Iterator[Way]:
    """Yield a power of the number of lights."""
    ratios, variables = [np.zeros(0)], [np.zeros(0)]
    for case in cases:
        stage, count = _stage(case, Stage.IRRADIANCE), len(case.scene.lights)
        if stage is not None and count > 1:
            ratios.append(_ratios(case, stage).ravel())
            variables.append(np.full(ratios[-1].shape, float(count)))
    samples = _usable(ratios, variables)
    power = one_value(np.log(samples.ratio) / np.log(samples.variable)) if len(samples.ratio) else None
    if power:
        share = Share(of=lambda _, count: count**power)
        yield _in_light(share, f"multiplies the sum of n lights by n^{power:.4g}")


def _register(
    name: str, says: str, item: str, example: Way, fitted: Callable[[Sequence[Fitting]], Iterator[Way]]
) -> None:
    MISTAKES.register(name)(Mistake(says=says, items=(item,), ways=(example,), fitted=fitted))


_register(
    "curve_of_distance",
    "has light that falls off with the distance by another law than 1/r^2",
    "RAD-1",
    _by_distance(lambda r: r**2 / (1 + r) ** 2, "falls off with 1/(1 + r)^2"),
    _of_distance,
)
_register(
    "curve_of_cosine",
    "has light that depends on the cosine by another law than Lambert's",
    "RAD-2",
    _by_cosine(lambda c: c * (3 - 2 * c), "takes the smooth step of the cosine", physical=False),
    _of_cosine,
)
_register(
    "curve_of_albedo",
    "takes another albedo, a curve of the one that is given",
    "RAD-4",
    Way(
        stages={
            Stage.EXITANCE: lambda given: (
                _albedo(given.scene.shapes, given.answers[Stage.OBJECT]) ** 2.2 * given.answers[Stage.IRRADIANCE]
            )
        }
    ),
    _of_albedo,
)
_register(
    "curve_of_flux",
    "takes another flux, a curve of the one that is given",
    "RAD-1",
    _in_light(Share(of=lambda _, count: 0.5), "halves the flux"),
    _of_flux,
)
_register(
    "curve_of_number",
    "multiplies the sum of the lights by a power of their number",
    "RAD-5",
    _in_light(Share(of=lambda _, count: count**-0.5), "divides by the square root of the number of lights"),
    _of_number,
)
