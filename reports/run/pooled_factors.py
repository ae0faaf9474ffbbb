"""Factors that a whole run shares (pi, 4, every flux): pooled over cases, found below one case's limits.

Each case contributes the median of its groups' factors. For a correct renderer it deviates by constants, which all
cases may share and `allowance` bounds, and by roundings of the case's own camera, lights and shapes. Cases with the
same camera and lights share roundings too, so that they have one vote together. For votes of different cameras or
lights both signs of the deviation are equally likely, and the sign test of `reports/judge/forward/common_factors.py` is
applied to them.
"""

import hashlib
from array import array
from collections.abc import Iterable, Mapping, Sequence
from statistics import median

from msgspec.structs import astuple

from rayproof.cases.scene import Scene
from rayproof.cases.stages import Stage
from rayproof.reports.results.case_records import LEAST_DISTINCT, CaseRecord, Leaning, least_share
from rayproof.reports.results.files import at_worst
from rayproof.reports.results.outcomes import Outcome
from rayproof.reports.results.records import CommonFactorRecord, WideLimitsRecord


def camera_and_lights(scene: Scene) -> str:
    """Return a digest of the positions of camera and lights: cases that share it share the roundings of both."""
    places = (scene.camera.eye, scene.camera.target, *(light.position for light in scene.lights))
    return hashlib.blake2b(repr(places).encode(), digest_size=6).hexdigest()


class PooledFactors:
    """The votes of all cases on the factors that the whole run shares: two numbers per configuration and stage."""

    def __init__(self) -> None:
        self._voices: dict[str, int] = {}  # numbers of the votes, by the digest of camera and lights
        self._words: dict[tuple[str, str], tuple[array[int], array[float], array[float]]] = {}
        # Per camera and lights only the case with the most pixels: other cases may show the same pixels.
        self._wide: dict[tuple[str, str], dict[str, Leaning]] = {}

    def add(self, record: CaseRecord) -> None:
        """Add the record of a case."""
        for check in record["checks"]:
            bias, digest = check.bias, record.get("camera_and_lights", record["name"])
            if bias is not None and (wide := bias.wide) is not None:
                cases = self._wide.setdefault((check.configuration, check.stage), {})
                cases[digest] = max(cases.get(digest, wide), wide, key=lambda leaning: leaning.pixels)
            if bias is not None and bias.common is not None:
                vote = self._voices.setdefault(digest, len(self._voices))
                key = check.configuration, check.stage
                votes = self._words.setdefault(key, (array("l"), array("d"), array("d")))
                votes[0].append(vote)
                votes[1].append(at_worst(bias.common))
                votes[2].append(at_worst(bias.allowance))

    @property
    def pooled(self) -> list[CommonFactorRecord]:
        """Return the common factor of all cases for each configuration and stage of light."""
        order = list(Stage)
        factors = []
        for (configuration, stage), votes in sorted(
            self._words.items(), key=lambda entry: (entry[0][0], order.index(Stage(entry[0][1])))
        ):
            groups: dict[int, list[tuple[float, float]]] = {}
            for vote, off, allowed in zip(*votes, strict=True):
                groups.setdefault(vote, []).append((off, allowed))
            factors.append(_pooled(configuration, stage, groups))
        return factors

    @property
    def wide(self) -> list[WideLimitsRecord]:
        """Return the common sign of the errors of pixels with wide limits, for each configuration and stage of light.

        For a correct renderer an error exceeds the part that pixels can share, to a chosen side, with a probability of
        at most 1/2.
        """
        leanings: list[WideLimitsRecord] = []
        for (configuration, stage), cases in sorted(
            self._wide.items(), key=lambda entry: (entry[0][0], list(Stage).index(Stage(entry[0][1])))
        ):
            pixels, above, below = map(sum, zip(*map(astuple, cases.values()), strict=True))
            verdict = Outcome.PASS if max(above, below) <= (1 - least_share(pixels)) * pixels else Outcome.FAIL
            verdict = Outcome.UNDECIDED if pixels < LEAST_DISTINCT else verdict
            leanings.append(
                {
                    "configuration": configuration,
                    "stage": stage,
                    "pixels": pixels,
                    "above": above,
                    "below": below,
                    "verdict": verdict.value,
                }
            )
        return leanings


def common_factors(records: Iterable[CaseRecord]) -> list[CommonFactorRecord]:
    """Return the common factor of all cases for each configuration and stage of light, as plain JSON data."""
    factors = PooledFactors()
    for record in records:
        factors.add(record)
    return factors.pooled


def _pooled(configuration: str, stage: str, groups: Mapping[int, Sequence[tuple[float, float]]]) -> CommonFactorRecord:
    """Return one configuration's factor at one stage; with too few votes it is undecided."""
    votes = [(median(off for off, _ in group), max(allowed for _, allowed in group)) for group in groups.values()]
    off = float(f"{median(value for value, _ in votes):.4g}")
    sign = 1 if off >= 0 else -1
    sees, verdict = None, Outcome.UNDECIDED
    if len(votes) >= LEAST_DISTINCT:
        beyond = sorted(sign * value - allowed for value, allowed in votes)
        sees = float(f"{abs(off) - beyond[int(len(votes) * least_share(len(votes)))]:.4g}")
        verdict = Outcome.PASS if abs(off) <= sees else Outcome.FAIL
    return {
        "configuration": configuration,
        "stage": stage,
        "cases": sum(len(group) for group in groups.values()),
        "voices": len(votes),
        "off": off,
        "sees": sees,
        "verdict": verdict.value,
    }


def wrong(pooled: Sequence[CommonFactorRecord], wide: Sequence[WideLimitsRecord]) -> list[str]:
    """Return a sentence for each configuration that has a wrong factor in the whole run, at its first such stage.

    A sentence on the pixels with wide limits is only returned if the configuration has no other one.
    """
    first: dict[str, str] = {}
    for entry in pooled:
        if entry["verdict"] == Outcome.FAIL:
            first.setdefault(entry["configuration"], _sentence(entry))
    for leaning in wide:
        if leaning["verdict"] == Outcome.FAIL:
            first.setdefault(leaning["configuration"], _leaning(leaning))
    return list(first.values())


def _leaning(entry: WideLimitsRecord) -> str:
    most, way = max((entry["above"], "too large"), (entry["below"], "too small"))
    return (
        f"{entry['stage']} of {entry['configuration']} is {way} in {most} of the {entry['pixels']} pixels of the whole "
        "run whose limits are over 1 % of the value, by more than rounding can make them share"
    )


def _sentence(entry: CommonFactorRecord) -> str:
    off, limit = (at_worst(entry[name] or 0.0) for name in ("off", "sees"))
    return (
        f"{entry['stage']} of {entry['configuration']} is {1 + off:.9g} times what it should be in the whole "
        f"run ({entry['cases']} cases of {entry['voices']} different cameras and lights; limit {limit:.3g})"
    )
