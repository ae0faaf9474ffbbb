"""What users name on the command line becomes a case, scene, configuration, sweep, stage or subject."""

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
Repeated = Annotated[tuple[str, ...], Parameter(negative="", show_default=False)]  # an option given once a value


def one_case(name: str) -> "Case":
    """Return the case called `name`.

    Raises:
        UsageError: none or several are called so; the message lists near matches.

    """
    from rayproof.cases.families import select

    with told_in_one_line():
        found = select([name])
    if len(found) != 1:
        some = ", ".join(case.name for case in found[:5])
        raise UsageError(f"{name!r} names {len(found)} cases, one is needed: {some}{', ...' if len(found) > 5 else ''}")
    return found[0]


def scene_named(name: str) -> "Scene":
    """Return the scene of a case, or of a scene file if `name` ends in .json.

    Raises:
        UsageError: there is none, or the file is not a valid scene.

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
    """Return the selectors that name no scene file, and a case for each scene file that the others name.

    Raises:
        UsageError: a file is not a valid scene, or this machine has not enough memory for its image.

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
    """Return the formulas without planted faults that selectors name, and the selectors that name something else.

    A selector names formulas if its first part is a slot, and not a family of cases as well: nearest is the family, and
    nearest/smaller the formula.

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
            variants = [one for one in FORMULAS.variants(slot) if one.kind != "fault"]
            matches = [one for one in variants if selector == slot or fnmatchcase(one.name, selector)]
            if not matches:
                known = ", ".join(one.name for one in variants)
                raise LookupError(f"no formula is called {selector!r}; known: {known}")
        else:
            others.append(selector)
            continue
        formulas |= {one.name: one for one in matches}
    return [*formulas.values()], tuple(others)


SWEEP = re.compile(r"(?P<name>\w+)=(?P<first>[^:]+?)\.\.(?P<last>[^:]+?):(?P<number>\d+)")
MOST_VALUES = 100  # of a sweep, each of which is measured as a formula is, for seconds


def sweep_of(text: str) -> tuple[str, list[float]]:
    """Return the parameter and its values, in equal ratios, of a sweep such as eps=1e-6..1e-2:9.

    Raises:
        UsageError: it is not written so.

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
    """Return the tracer configurations that `--configuration` and `--formula` ask for; none if neither does.

    Formulas are added to every configuration, or to the default one in float32.

    Raises:
        UsageError: a name is not known; the message lists what is.

    """
    from rayproof.tracer.configuration import Configuration
    from rayproof.tracer.formulas.own_file import forget, is_own
    from rayproof.tracer.kernel.compiler import choose_packaged_llvm

    if not names and not formulas:
        return ()
    # `rayproof list formulas` writes slot/variant, a configuration slot=variant; either is understood.
    parts = [formula if "=" in formula else formula.replace("/", "=", 1) for formula in formulas]
    with told_in_one_line():
        found = tuple(Configuration.parse("/".join([name, *parts])) for name in names or ("float32",))
        if any(is_own(one.name) for one in found):
            choose_packaged_llvm()
            forget()
            _ = [one.own for one in found]  # loaded now: a mistake in it is told before anything is computed
        return found


def stages_named(names: str) -> tuple["Stage", ...]:
    """Return the image stages of a comma-separated list, in the specification's order.

    Raises:
        UsageError: one is not known, or is not an image.

    """
    from rayproof.cases.stages import IMAGE_STAGES

    wanted = {name.strip() for name in names.split(",")}
    known = {stage.value for stage in IMAGE_STAGES}
    if unknown := sorted(wanted - known):
        raise UsageError(f"--stages: no image stage is called {unknown[0]!r}; known: {', '.join(IMAGE_STAGES)}")
    return tuple(stage for stage in IMAGE_STAGES if stage.value in wanted)


def references_named(required: Sequence[str]) -> tuple[str, ...]:
    """Return the names of the usual references and the `required` ones, which may answer on request only.

    Raises:
        UsageError: a required one is not known; the message lists what is.

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
    """Return the subject that is named so; raise ValueError, LookupError or OSError if it cannot be put under test.

    The file `declare` says of a program what it does not say itself. One that stays alive is started in the `pool` that
    will ask it, if there is one.
    """
    from rayproof.reports.run.workers import ask
    from rayproof.reports.subjects import THE_TRACER
    from rayproof.reports.subjects.choosing import KNOWN, chosen

    if subject == TRACER:
        if variables or declare is not None:
            option = "--env" if variables else "--declare"
            raise ValueError(f"{option} is for a program under test: --subject {KNOWN}")
        return THE_TRACER
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
    """Return the subject that is named so, with the usual limits; one line says why it cannot be put under test."""
    with told_in_one_line():
        about = {"variables": env, "declare": declare, "before_oracle": False}
        return under_test(subject, seconds=seconds, memory=8.0, **about)
