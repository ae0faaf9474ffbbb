"""A sample of wrong renderers, each with a case that it fails: how small the scene becomes, in how many renders."""

import json
import os
import random
import shutil
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from fnmatch import fnmatch
from itertools import islice
from pathlib import Path

import msgspec
import numpy as np

from rayproof.cases.case import Case
from rayproof.cases.families import all_cases
from rayproof.cases.scene import Mesh, Scene
from rayproof.cases.scene_json import scene_to_json
from rayproof.cases.stages import IMAGE_STAGES, Stage
from rayproof.reports.judge.answers import Answers
from rayproof.reports.results.files import write_text
from rayproof.reports.shrinking.attempts import SearchLimits
from rayproof.reports.shrinking.failure import Renderer, failure, renderer
from rayproof.reports.shrinking.search import shrink
from rayproof.reports.subjects import PROGRAM, THE_TRACER, Subject
from rayproof.reports.subjects.program import ask_capabilities
from rayproof.tracer.configuration import Configuration
from rayproof.tracer.kernel.compiler import choose_packaged_llvm
from tests.harness.audit.diagnosing import built, listed, usable_cases
from tests.harness.audit.planted import candidates, tracer_faults

STAGED, ALONE = "all stages", "only radiance"
TRACER, PROGRAMS = "planted fault of the tracer", "switch of the C++ example"
LOOKED_AT = 40  # cases among which one is sought that a renderer fails
LONGEST = 30.0  # s, for one render of the C++ example
# What is promised: at the median and at the 90th percentile shapes, lights, pixels; seconds; the share of blame.
MEDIAN, NINE_TENTHS = (2, 1, 1), (3, 2, 64)
MOST_TRIES = 200
SECONDS = {TRACER: 20.0, PROGRAMS: 60.0}
BLAMED_ALIKE = 0.97


@dataclass(frozen=True, kw_only=True)
class Wrong:
    """A renderer that is wrong on purpose."""

    name: str
    kind: str  # TRACER or PROGRAMS
    written: str  # STAGED or ALONE
    items: tuple[str, ...] = ()  # of the specification, in which it is wrong, where that is known


@dataclass(frozen=True, kw_only=True)
class Shrunk:
    """What became of one renderer; without a case it fails none of those that were looked at."""

    name: str
    kind: str
    written: str
    case: str = ""
    before: tuple[int, int, int] = (0, 0, 0)  # shapes, lights, pixels
    after: tuple[int, int, int] = (0, 0, 0)
    faces: int = 0
    tries: int = 0
    seconds: float = 0.0  # by the clock
    processor: float = 0.0  # s, of this process and the programs that it called
    stage: str = ""
    way: str = ""
    items_before: tuple[str, ...] = ()
    items_after: tuple[str, ...] = ()
    own_kept: bool = (
        True  # the items in which it is wrong are blamed by the small scene where the large one blames them
    )
    right_passes: bool = True  # whether the same renderer without its fault passes the small scene
    scene: str = ""  # the small one, as JSON


@dataclass(frozen=True, kw_only=True)
class Campaign:
    """What is asked."""

    out: Path
    count: int
    seed: int
    tries: int
    only: str


@dataclass(frozen=True)
class Found:
    """What became of all renderers."""

    each: tuple[Shrunk, ...]

    def table(self) -> Iterator[str]:
        """Yield the table of docs/failures.md, line by line."""
        yield (
            "| renderers | written | shrunk | shapes, median and 90 % | lights | pixels | renders | s, by the clock | "
            "processor s | same blame |"
        )
        yield "|---" * 10 + "|"
        for kind, written in ((TRACER, STAGED), (TRACER, ALONE), (PROGRAMS, STAGED), (PROGRAMS, ALONE), ("all", "")):
            rows = [one for one in self.each if one.case and (one.kind, one.written) in ((kind, written),)]
            rows = rows if kind != "all" else [one for one in self.each if one.case]
            if rows:
                parts = [*(_of(rows, lambda one, part=part: one.after[part]) for part in range(3))]
                parts += [_of(rows, lambda one: one.tries), _of(rows, lambda one: one.seconds)]
                parts += [_of(rows, lambda one: one.processor), f"{_alike(rows):.0%}"]
                yield f"| {kind} | {written} | {len(rows)} | {' | '.join(parts)} |"

    def problems(self) -> list[str]:
        """Return what is not as promised."""
        rows = [one for one in self.each if one.case]
        if not rows:
            return ["nothing was shrunk"]
        found = []
        for share, most in ((50, MEDIAN), (90, NINE_TENTHS)):
            for part, (name, allowed) in enumerate(zip(("shapes", "lights", "pixels"), most, strict=True)):
                value = _percentile([one.after[part] for one in rows], share)
                if value > allowed:
                    found.append(f"{value:g} {name} at {share} %, promised are {allowed}")
        found += [f"{one.name} took {one.tries} renders" for one in rows if one.tries > MOST_TRIES]
        slow = [one for one in rows if one.processor > SECONDS[one.kind]]
        found += [f"{one.name} ({one.written}) took {one.processor:.0f} s of processor time" for one in slow]
        found += [f"{one.name}: without its fault it fails the small scene too" for one in rows if not one.right_passes]
        if _alike(rows) < BLAMED_ALIKE:
            found.append(f"{_alike(rows):.0%} of the small scenes blame what the large ones blame")
        return found


def _percentile(values: Sequence[float], share: int) -> float:
    return float(np.percentile(values, share, method="inverted_cdf"))


def _of(rows: Sequence[Shrunk], number: Callable[[Shrunk], float]) -> str:
    values = [number(one) for one in rows]
    return f"{_percentile(values, 50):.3g}, {_percentile(values, 90):.3g}"


def _alike(rows: Sequence[Shrunk]) -> float:
    """Return the share whose small scene blames nothing new, and still what is wrong."""
    return sum(
        bool(one.items_after) and {*one.items_after} <= {*one.items_before} and one.own_kept for one in rows
    ) / len(rows)


def run(campaign: Campaign) -> Found:
    """Shrink what the sample holds and is not in OUT yet; return all of the sample.

    Raises:
        FileNotFoundError: there is no C++ compiler, or no source.
        LookupError: no renderer matches `only`.

    """
    choose_packaged_llvm()
    place = campaign.out / "shrunk.jsonl"
    known = [json.loads(line) for line in place.read_text().splitlines()] if place.exists() else []
    done = {(one["name"], one["written"]): msgspec.convert(one, Shrunk) for one in known}
    with tempfile.TemporaryDirectory() as made:
        program = built(Path(made))
        every = [one for one in renderers(program) if fnmatch(one.name, campaign.only)]
        if not every:
            raise LookupError(f"no wrong renderer is called {campaign.only!r}")
        count = min(campaign.count or len(every), len(every))
        sample = random.Random(campaign.seed).sample(every, count)
        for number, wrong in enumerate(sample):
            if (wrong.name, wrong.written) in done:
                continue
            found = shrunk(wrong, program, campaign)
            done[wrong.name, wrong.written] = found
            with place.open("a") as file:
                file.write(json.dumps(asdict(found)) + "\n")
            sys.stderr.write(f"{number + 1} of {count}: {wrong.name}, {wrong.written}: {found.case or 'not seen'}, ")
            sys.stderr.write(f"{found.before} -> {found.after} in {found.tries}, {found.seconds:.1f} s\n")
    result = Found(tuple(done[one.name, one.written] for one in sample))
    write_text(campaign.out / "table.md", "\n".join(result.table()) + "\n")
    return result


def renderers(program: Path) -> list[Wrong]:
    """Return all wrong renderers: the tracer with a planted fault, the program with a switch."""
    ones = [Wrong(name=one.name, kind=TRACER, written=STAGED, items=one.covers) for one in tracer_faults()]
    ones += [Wrong(name=name, kind=PROGRAMS, written=STAGED) for name, _ in listed(program)]
    return [replace(one, written=written) for one in ones for written in (STAGED, ALONE)]


def shrunk(wrong: Wrong, program: Path, campaign: Campaign) -> Shrunk:
    """Return what becomes of a renderer's first case that fails, of cases in an order that the seed draws."""
    blank = Shrunk(name=wrong.name, kind=wrong.kind, written=wrong.written)
    render, right = answering(wrong, program), answering(replace(wrong, name=""), program)
    draws = random.Random(f"{campaign.seed} {wrong.name} {wrong.written}")
    for case in islice(_cases(wrong, draws), LOOKED_AT):
        first = failure(case.scene, render)
        if first is None or failure(case.scene, right) is not None:
            continue  # the example's epsilon is too large for some cases, whatever it is told to do wrongly
        start, used = time.perf_counter(), _processor()
        search = shrink(case.scene, render, limits=SearchLimits(tries=campaign.tries))
        items = {*wrong.items} & first.items
        return replace(
            blank,
            case=case.name,
            before=_parts(case.scene),
            after=_parts(search.scene),
            faces=sum(len(one.faces) for one in search.scene.shapes if isinstance(one, Mesh)),
            tries=search.tries,
            seconds=round(time.perf_counter() - start, 2),
            processor=round(_processor() - used, 2),
            stage=first.stage.value,
            way=first.way.value,
            items_before=tuple(sorted(first.items)),
            items_after=tuple(sorted(search.failure.items)),
            own_kept=not items or bool(items & search.failure.items),
            right_passes=failure(search.scene, right) is None,
            scene=json.dumps(scene_to_json(search.scene)),
        )
    return blank


def _processor() -> float:
    times = os.times()
    return times.user + times.system + times.children_user + times.children_system


def _parts(scene: Scene) -> tuple[int, int, int]:
    return len(scene.shapes), len(scene.lights), scene.camera.width * scene.camera.height


def _cases(wrong: Wrong, draws: random.Random) -> Iterator[Case]:
    """Return the cases that may show it: what a fault names and covers, any that a program may be asked about."""
    if wrong.kind == PROGRAMS:
        cases = usable_cases()
    else:
        fault = next(one for one in tracer_faults() if one.name == wrong.name)
        cases = [case for case in candidates(fault, all_cases()) if case.samples == 1]
    yield from draws.sample(cases, len(cases))


def answering(wrong: Wrong, program: Path) -> Renderer:
    """Return how a wrong renderer is asked; without a name, the one without its fault."""
    if wrong.kind == TRACER:
        planted = {one.name: str(one.configuration) for one in tracer_faults()}
        render = renderer(THE_TRACER, Configuration.parse(planted.get(wrong.name, "float32")))
        return render if wrong.written == STAGED else lambda scene: by_radiance(render(scene))
    words = (
        *(("--mistake", wrong.name) if wrong.name else ()),
        *(("--only", "radiance") if wrong.written == ALONE else ()),
    )
    command = (str(program), *words, "{scene}", "{output}")
    subject = Subject(
        name=PROGRAM,
        transport=PROGRAM,
        title=f"{PROGRAM}:{shutil.which(str(program))}",
        command=command,
        seconds=LONGEST,
    )
    able = ask_capabilities(subject, seconds=LONGEST)
    return renderer(replace(subject, capabilities=able), Configuration())


def by_radiance(candidate: Answers) -> Answers:
    """Return a renderer that has written its radiance and nothing else."""
    if candidate.error is not None:
        return candidate
    left = {stage: image for stage, image in candidate.answers.items() if stage is Stage.RADIANCE}
    unsaid = {stage: "It is not written." for stage in (Stage.CAMERA, *IMAGE_STAGES) if stage is not Stage.RADIANCE}
    return replace(candidate, answers=left, unsupported=unsaid)
