"""Factors that a whole run shares (pi, 4, every flux): pooled over cases, found below one case's limits.

Each case's word is the middle one of its groups' factors. Of a correct renderer it is off by constants, which all cases
may share and `allowance` bounds, and by roundings of the case's own camera, lights and shapes. Cases that share a
camera and lights share roundings too, so that they have one word together; of words of different cameras or lights the
sign is as likely one as the other, and the sign test of `reports/judge/forward/common_factors.py` is asked of them
in turn.
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
    """Return a digest of where a scene is seen and lit from: cases that share it share the roundings of both."""
    places = (scene.camera.eye, scene.camera.target, *(light.position for light in scene.lights))
    return hashlib.blake2b(repr(places).encode(), digest_size=6).hexdigest()


class CommonFactors:
    """What cases say of the factors that the whole run shares: two numbers a configuration and stage."""

    def __init__(self) -> None:
        self._voices: dict[str, int] = {}  # who shares a camera and lights, by number
        self._words: dict[tuple[str, str], tuple[array[int], array[float], array[float]]] = {}
        # Of who shares a camera and lights the case with the most pixels: others may show the same ones.
        self._wide: dict[tuple[str, str], dict[str, Leaning]] = {}

    def add(self, record: CaseRecord) -> None:
        """Take up another case."""
        for check in record["checks"]:
            bias, told = check.bias, record.get("camera_and_lights", record["name"])
            if bias is not None and (wide := bias.wide) is not None:
                cases = self._wide.setdefault((check.configuration, check.stage), {})
                cases[told] = max(cases.get(told, wide), wide, key=lambda one: one.pixels)
            if bias is not None and bias.common is not None:
                voice = self._voices.setdefault(told, len(self._voices))
                key = check.configuration, check.stage
                words = self._words.setdefault(key, (array("l"), array("d"), array("d")))
                words[0].append(voice)
                words[1].append(at_worst(bias.common))
                words[2].append(at_worst(bias.allowance))

    @property
    def pooled(self) -> list[CommonFactorRecord]:
        """Return for each configuration and stage of light what all cases' factors have in common."""
        order = list(Stage)
        found = []
        for (configuration, stage), words in sorted(
            self._words.items(), key=lambda entry: (entry[0][0], order.index(Stage(entry[0][1])))
        ):
            voices: dict[int, list[tuple[float, float]]] = {}
            for voice, off, allowed in zip(*words, strict=True):
                voices.setdefault(voice, []).append((off, allowed))
            found.append(_pooled(configuration, stage, voices))
        return found

    @property
    def wide(self) -> list[WideLimitsRecord]:
        """Return for each configuration and stage of light which way its pixels with wide limits are off together.

        Of a correct renderer each is off to a chosen side by more than pixels share with probability 1/2 at most.
        """
        found: list[WideLimitsRecord] = []
        for (configuration, stage), cases in sorted(
            self._wide.items(), key=lambda entry: (entry[0][0], list(Stage).index(Stage(entry[0][1])))
        ):
            pixels, above, below = map(sum, zip(*map(astuple, cases.values()), strict=True))
            verdict = Outcome.PASS if max(above, below) <= (1 - least_share(pixels)) * pixels else Outcome.FAIL
            verdict = Outcome.UNDECIDED if pixels < LEAST_DISTINCT else verdict
            found.append(
                {
                    "configuration": configuration,
                    "stage": stage,
                    "pixels": pixels,
                    "above": above,
                    "below": below,
                    "verdict": verdict.value,
                }
            )
        return found


def common_factors(records: Iterable[CaseRecord]) -> list[CommonFactorRecord]:
    """Return for each configuration and stage of light what all cases' factors have in common, as plain JSON data."""
    factors = CommonFactors()
    for record in records:
        factors.add(record)
    return factors.pooled


def _pooled(configuration: str, stage: str, voices: Mapping[int, Sequence[tuple[float, float]]]) -> CommonFactorRecord:
    """Return one configuration's factor at one stage; too few voices decide nothing."""
    said = [(median(off for off, _ in each), max(allowed for _, allowed in each)) for each in voices.values()]
    off = float(f"{median(value for value, _ in said):.4g}")
    sign = 1 if off >= 0 else -1
    sees, verdict = None, Outcome.UNDECIDED
    if len(said) >= LEAST_DISTINCT:
        beyond = sorted(sign * value - allowed for value, allowed in said)
        sees = float(f"{abs(off) - beyond[int(len(said) * least_share(len(said)))]:.4g}")
        verdict = Outcome.PASS if abs(off) <= sees else Outcome.FAIL
    return {
        "configuration": configuration,
        "stage": stage,
        "cases": sum(len(each) for each in voices.values()),
        "voices": len(said),
        "off": off,
        "sees": sees,
        "verdict": verdict.value,
    }


def wrong(pooled: Sequence[CommonFactorRecord], wide: Sequence[WideLimitsRecord]) -> list[str]:
    """Return in sentences which configurations multiply all of a run by a wrong factor, from their first stage on.

    A factor of the pixels with wide limits alone is told where there is no other.
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
