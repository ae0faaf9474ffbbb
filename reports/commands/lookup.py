"""Looks up the cases, scenes, configurations, sweeps, stages and subjects that users name on the command line."""

import re
from collections.abc import Sequence
from fnmatch import fnmatchcase
from functools import partial
from math import inf
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from rayproof.reports.commands.usage import UsageError, told_in_one_line

if TYPE_CHECKING:
    from rayproof.cases.case import Case
    from rayproof.cases.scene import Scene
    from rayproof.cases.stages import Stage
    from rayproof.reports.processes.pool import Pool
    from rayproof.reports.subjects import Subject
    from rayproof.tracer.configuration import Configuration
    from rayproof.tracer.formulas import Formula

TRACER = "tracer"
USUAL_LIMIT = 120.0  # s, for one render or one judgement
Repeated = Annotated[tuple[str, ...], Parameter(negative="", show_default=False)]  # repeat the option for each value


def one_case(name: str) -> "Case":
    """Return the case called `name`.

    Raises:
        UsageError: `name` matches no case or several; the message lists near matches.

    """
    from rayproof.cases.families import select

    with told_in_one_line():
        cases = select([name])
    if len(cases) != 1:
        names = ", ".join(case.name for case in cases[:5])
        raise UsageError(
            f"{name!r} names {len(cases)} cases, one is needed: {names}{', ...' if len(cases) > 5 else ''}"
        )
    return cases[0]


def scene_named(name: str) -> "Scene":
    """Return the scene of a case, or of a scene file if `name` ends in .json.

    Raises:
        UsageError: there is no such case or file, or the file is not a valid scene.

    """
    if not name.endswith(".json"):
        return one_case(name).scene
    from rayproof.cases.scene_json import load_scene
    from rayproof.reports.run.scenes import refuse_too_large, scene_path

    with told_in_one_line():
        scene = load_scene(scene_path(name))
        refuse_too_large(scene, name)
    return scene


def scene_files(selectors: Sequence[str]) -> tuple[tuple[str, ...], "tuple[Case, ...]"]:
    """Return the selectors that name no scene file, and a case for each scene file.

    Raises:
        UsageError: a file is not a valid scene, or this machine has too little memory for its image.

    """
    files = [name for name in selectors if name.endswith(".json")]
    if not files:
        return tuple(selectors), ()
    from rayproof.reports.run.scenes import cases_of_files, refuse_too_large, scene_path

    with told_in_one_line():
        cases = cases_of_files([*map(scene_path, files)])
        for case in cases:
            refuse_too_large(case.scene, case.name)
    return tuple(name for name in selectors if not name.endswith(".json")), cases


def formulas_among(selectors: Sequence[str]) -> "tuple[list[Formula], tuple[str, ...]]":
    """Return the formulas that selectors name, without planted faults, and the selectors that name no formula.

    A selector names formulas if its first part is a slot and no family of cases; a formula's full name always does.
    So nearest is the family of cases, and nearest/smaller the formula.

    Raises:
        LookupError: a selector names no formula of its slot.

    """
    from rayproof.cases.families import CASE_FAMILIES
    from rayproof.tracer.formulas import FORMULAS
    from rayproof.tracer.formulas.own_file import is_own

    formulas: dict[str, Formula] = {}
    others = []
    for selector in selectors:
        slot = selector.partition("/")[0]
        if is_own(selector) or selector in FORMULAS:
            matches = [FORMULAS.named(selector)]
        elif slot in FORMULAS.slots and slot not in CASE_FAMILIES:
            variants = [formula for formula in FORMULAS.variants(slot) if formula.kind != "fault"]
            matches = [formula for formula in variants if selector == slot or fnmatchcase(formula.name, selector)]
            if not matches:
                names = ", ".join(formula.name for formula in variants)
                raise LookupError(f"no formula is called {selector!r}; known: {names}")
        else:
            others.append(selector)
            continue
        formulas |= {formula.name: formula for formula in matches}
    return [*formulas.values()], tuple(others)


SWEEP = re.compile(r"(?P<name>\w+)=(?P<first>[^:]+?)\.\.(?P<last>[^:]+?):(?P<number>\d+)")
MOST_VALUES = 100  # in a sweep; measuring each takes seconds, as for a formula


def sweep_of(text: str) -> tuple[str, list[float]]:
    """Return a sweep's parameter and its values in equal ratios; `text` is a sweep such as eps=1e-6..1e-2:9.

    Raises:
        UsageError: the text does not have this form, or a number is out of range.

    """
    match = SWEEP.fullmatch(text)
    try:
        first, last = (float(match[part]) for part in ("first", "last")) if match else (0.0, 0.0)
    except ValueError:
        first = last = 0.0
    number = int(match["number"]) if match else 0
    if match is None or not (0 < first < inf and 0 < last < inf and first != last and 2 <= number <= MOST_VALUES):
        raise UsageError(
            f"--sweep must read eps=1e-6..1e-2:9, two positive bounds and 2 to {MOST_VALUES} values, got {text}"
        )
    ratios = (first * (last / first) ** (place / (number - 1)) for place in range(number - 1))
    values = [float(f"{value:.12g}") for value in ratios]  # 1e-4, not 9.999999999999999e-05
    return match["name"], [*values, last]


def configurations(names: Sequence[str], formulas: Sequence[str]) -> tuple["Configuration", ...]:
    """Return the tracer configurations of `--configuration` and `--formula`; none if both are empty.

    Formulas are added to every configuration, or to the default one in float32.

    Raises:
        UsageError: a name is unknown; the message lists the known names.

    """
    from rayproof.tracer.configuration import Configuration
    from rayproof.tracer.formulas.own_file import forget, is_own
    from rayproof.tracer.kernel.compiler import choose_packaged_llvm

    if not names and not formulas:
        return ()
    # Accept slot/variant, as `rayproof list formulas` prints it, and slot=variant, as configurations write it.
    parts = [formula if "=" in formula else formula.replace("/", "=", 1) for formula in formulas]
    with told_in_one_line():
        parsed = tuple(Configuration.parse("/".join([name, *parts])) for name in names or ("float32",))
        if any(is_own(configuration.name) for configuration in parsed):
            choose_packaged_llvm()
            forget()
            # Load the formulas now, so that an error in them is reported before anything is computed.
            _ = [configuration.own for configuration in parsed]
        return parsed


def stages_named(names: str) -> tuple["Stage", ...]:
    """Return the image stages of a comma-separated list, in the specification's order.

    Raises:
        UsageError: a name is unknown, or the stage is not an image.

    """
    from rayproof.cases.stages import IMAGE_STAGES

    wanted = {name.strip() for name in names.split(",")}
    names_of_stages = {stage.value for stage in IMAGE_STAGES}
    if unknown := sorted(wanted - names_of_stages):
        raise UsageError(f"--stages: no image stage is called {unknown[0]!r}; known: {', '.join(IMAGE_STAGES)}")
    return tuple(stage for stage in IMAGE_STAGES if stage.value in wanted)


def references_named(required: Sequence[str]) -> tuple[str, ...]:
    """Return the names of the references that always render and of the `required` ones, which may render on request.

    Raises:
        UsageError: a required reference is unknown; the message lists the known ones.

    """
    from rayproof.reference import REFERENCES

    with told_in_one_line():
        for name in required:
            REFERENCES.about(name)
    return tuple(name for name in REFERENCES if name in required or not REFERENCES.about(name).get("on_request", False))


def under_test(
    subject: str,
    *,
    seconds: float,
    memory: float,
    variables: tuple[str, ...] = (),
    before_oracle: bool = True,
    pool: "Pool | None" = None,
    declare: Path | None = None,
) -> "Subject":
    """Return the subject called `subject`; raise ValueError, LookupError or OSError if it cannot be put under test.

    The JSON file `declare` declares properties of a program that the program does not declare itself. A program that
    stays alive is started in the `pool` that will send it scenes, if there is one. `seconds` and `memory` [GiB] are the
    limits of a render.
    """
    from rayproof.reports.run.workers import ask
    from rayproof.reports.subjects import THE_TRACER

    if subject == TRACER and not variables and declare is None:
        return THE_TRACER
    from rayproof.reports.subjects.choosing import KNOWN, chosen

    if subject == TRACER:
        option = "--env" if variables else "--declare"
        raise ValueError(f"{option} is for a program under test: --subject {KNOWN}")
    return chosen(
        subject,
        seconds=seconds,
        memory=int(memory * 2**30),
        ask=partial(ask, pool=pool),
        variables=variables,
        before_oracle=before_oracle,
        declare=declare,
    )


def subject_named(
    subject: str, env: tuple[str, ...] = (), declare: Path | None = None, *, seconds: float = USUAL_LIMIT
) -> "Subject":
    """Return the subject called `subject`, with the usual limits; raise UsageError if it cannot be put under test."""
    with told_in_one_line():
        about = {"variables": env, "declare": declare, "before_oracle": False}
        return under_test(subject, seconds=seconds, memory=8.0, **about)
