"""Many laws on many cases: orders to workers, reports back, and what all of them say of each law."""

import platform
import sys
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from fnmatch import fnmatchcase
from importlib.metadata import version
from pathlib import Path
from typing import TypedDict

from rayproof.cases.case import Case
from rayproof.cases.families import select
from rayproof.cases.laws import LAWS
from rayproof.cases.stages import Stage
from rayproof.reports.laws.judging import Judged, K
from rayproof.reports.laws.law_task import LawOrder, LawReport, serve_laws
from rayproof.reports.processes.pool import Pool
from rayproof.reports.processes.worker import Reply
from rayproof.reports.publish import publish_all
from rayproof.reports.results.case_records import CaseRecord, CheckRecord, MeasurementRecord, RenderRecord
from rayproof.reports.results.document import save_results
from rayproof.reports.results.files import as_json, write_text
from rayproof.reports.results.images import write_answers
from rayproof.reports.results.outcomes import Outcome
from rayproof.reports.run import totals
from rayproof.reports.run.case_record import write_scene
from rayproof.reports.subjects import Subject

PASS, FAIL, ERROR, UNSUPPORTED, SILENT = "pass", "fail", "error", "unsupported", "inapplicable"
WORST_LAST = (SILENT, UNSUPPORTED, PASS, ERROR, FAIL)
KIND = "laws"


class LawAlarm(TypedDict):
    """A relation that is broken on a case; expected and measured are values of its stage at the worst pixel."""

    case: str
    configuration: str
    stage: str
    what: str
    pixel: list[int] | None  # column and row
    expected: list[float]
    measured: list[float]
    outside: int  # pixels
    excused: int  # pixels
    examined: int  # pixels
    worst_over_Ku: float


class LawFinding(TypedDict):
    """What the relations of one law came to, over all cases."""

    law: str
    stage: str
    anchor: bool
    implicates: list[str]  # the specification's items
    cases: list[str]
    relations: int
    ill_conditioned: int  # relations
    pixels: int
    excused: int
    worst_over_Ku: float
    verdict: str
    alarms: list[LawAlarm]
    problems: list[str]
    unsupported: list[str]  # the subject's reasons


class LawsRecord(TypedDict):
    """What `rayproof laws --json` writes."""

    schema: int
    finished: bool
    subject: str
    configurations: list[str]
    stages: list[str]
    pairs: int  # of a law and a case
    laws: list[LawFinding]
    relations: int
    alarms: int
    errors: int
    scenes: int  # rendered
    seconds: float


@dataclass(frozen=True, kw_only=True)
class Pair:
    """One law on one case."""

    law: str
    case: Case


@dataclass(frozen=True, kw_only=True)
class LawsRequest:
    """What is asked of `rayproof laws`."""

    subject: Subject
    configurations: tuple[str, ...]
    pairs: tuple[Pair, ...]
    stages: tuple[Stage, ...]
    jobs: int
    timeout: float  # s, of one law on one case
    keep: bool = False


def run(request: LawsRequest, done: Callable[[LawReport, float], None]) -> None:
    """Put every pair to the subject; `done` hears each report and its seconds as it comes."""
    pool = Pool(jobs=request.jobs, timeout=request.timeout, copies={KIND: request.jobs}, target=serve_laws)
    try:
        for configuration in request.configurations:
            for pair in request.pairs:
                order = LawOrder(
                    law=pair.law,
                    case=pair.case.name,
                    scene=pair.case.scene,
                    subject=request.subject,
                    configuration=configuration,
                    stages=request.stages,
                    keep=request.keep,
                )

                def heard(reply: Reply, order: LawOrder = order) -> None:
                    report = reply.value or LawReport(
                        law=order.law, case=order.case, configuration=order.configuration, error=reply.error
                    )
                    done(report, reply.seconds)

                pool.submit(KIND, order, heard)
        while not pool.idle:
            pool.step()
    finally:
        pool.close()


def verdict(report: LawReport) -> str:
    """Return what one report comes to."""
    if report.error is not None:
        return ERROR
    if report.unsupported is not None:
        return UNSUPPORTED
    if report.alarms:
        return FAIL
    return PASS if any(one.examined for one in report.judged) else SILENT


def summary(reports: Iterable[LawReport]) -> list[LawFinding]:
    """Return a row for each law, in alphabetical order: what its relations came to."""
    by_law: dict[str, list[LawReport]] = {}
    for report in reports:
        by_law.setdefault(report.law, []).append(report)
    return [_row(law, some) for law, some in sorted(by_law.items())]


def _row(law: str, reports: Sequence[LawReport]) -> LawFinding:
    judged = [one for report in reports for one in report.judged]
    verdicts = [verdict(report) for report in reports]
    about = LAWS.about(law)
    return {
        "law": law,
        "stage": str(about["stage"]),
        "anchor": bool(about.get("anchor", False)),
        "implicates": list(about["implicates"]),
        "cases": sorted({report.case for report in reports}),
        "relations": sum(one.examined > 0 for one in judged),
        "ill_conditioned": sum(one.ill_conditioned for one in judged),
        "pixels": sum(one.examined for one in judged),
        "excused": sum(one.excused for one in judged),
        "worst_over_Ku": max((one.worst for one in judged), default=0.0),
        "verdict": max(verdicts, key=WORST_LAST.index),
        "alarms": [_alarm(report, one) for report in reports for one in report.alarms],
        "problems": sorted({f"{one.case}: {one.error}" for one in reports if one.error is not None}),
        "unsupported": sorted({one.unsupported for one in reports if one.unsupported is not None}),
    }


def _alarm(report: LawReport, one: Judged) -> LawAlarm:
    return {
        "case": report.case,
        "configuration": report.configuration,
        "stage": str(one.stage),
        "what": one.what,
        "pixel": list(one.pixel) if one.pixel else None,
        "expected": list(one.expected),
        "measured": list(one.measured),
        "outside": one.outside,
        "excused": one.excused,
        "examined": one.examined,
        "worst_over_Ku": one.worst,
    }


def document(
    request: LawsRequest, reports: Sequence[LawReport], seconds: float, *, finished: bool = True
) -> LawsRecord:
    """Return what `--json` writes."""
    rows = summary(reports)
    return {
        "schema": 1,
        "finished": finished,
        "subject": request.subject.title,
        "configurations": list(request.configurations),
        "stages": [str(stage) for stage in request.stages],
        "pairs": len(request.pairs),
        "laws": rows,
        "relations": sum(row["relations"] for row in rows),
        "alarms": sum(len(row["alarms"]) for row in rows),
        "errors": sum(report.error is not None for report in reports),
        "scenes": sum(report.scenes for report in reports),
        "seconds": round(seconds, 1),
    }


def exit_code(content: LawsRecord) -> int:
    """Return 1 if a law is broken, 3 if one could not be asked or nothing was measured, else 0."""
    if content["alarms"]:
        return 1
    return 3 if content["errors"] or not content["relations"] else 0


# Which law is put to which case: by default a covering choice, or the whole matrix.


# Law and case; docs/laws.md says how they were chosen.
DEFAULT: tuple[tuple[str, str], ...] = (
    ("rigid", "random_scenes/seed_2"),
    ("rigid", "parallel_rays/cubes"),
    ("mirror", "random_scenes/seed_2"),
    ("roll", "cameras/panorama"),
    ("crop", "cameras/ordinary"),
    ("resolution", "cameras/portrait"),
    ("up_slid", "cameras/slanted_up"),
    ("target_slid", "cameras/banked"),
    ("clip_join", "clipping/sphere_depth"),
    ("clip_beyond", "primitives/cube"),
    ("clip_measured", "clipping/faces_shell"),
    ("unseen", "behind/sphere"),
    ("unseen", "clipping/sphere_none"),
    ("scale", "transforms/sphere_sheared"),
    ("scale", "shadows/every_blocker"),
    ("sphere_placed", "normals/offset_sphere"),
    ("cube_squares", "inside/cube"),
    ("symmetry", "transforms/cube_sheared"),
    ("square_triangles", "transforms/square_sheared"),
    ("plane_square", "primitives/plane"),
    ("split", "meshes/torus"),
    ("baked", "transforms/mesh_mirrored"),
    ("winding", "sidedness/triangle_lit_from_the_viewer"),
    ("sides_add", "sidedness/square_lit_from_behind"),
    ("sides_add", "sidedness/plane_from_below_two_sided"),
    ("shapes_commute", "nearest/interpenetrating"),
    ("lights_add", "several_lights/inverse_square"),
    ("lights_add", "simplified/lights_at_1.5m"),
    ("light_split", "several_lights/inverse_square"),
    ("light_harmonic", "transforms/sphere_rotated"),
    ("light_hidden", "shadows/every_blocker"),
    ("light_caged", "shadows/every_blocker"),
    ("light_backed", "shadows/every_blocker"),
    ("not_negative", "several_lights/simplified"),
    ("not_negative", "acne/terminator"),
    ("albedo_linear", "several_lights/inverse_square"),
    ("channels", "several_lights/inverse_square"),
    ("flux_power", "several_lights/inverse_square"),
    ("unit_vectors", "normals/turned_to_the_viewer"),
    ("point_on_ray", "transforms/cube_translated"),
    ("light_in_stages", "several_lights/inverse_square"),
    ("light_in_stages", "inverse_square/angle_95"),
    ("light_sees", "shadows/every_blocker"),
    ("camera_inverses", "cameras/ordinary"),
    ("camera_rays", "cameras/ordinary"),
    ("anchor_sphere", "primitives/sphere"),
    ("anchor_floor", "primitives/sphere"),
    ("anchor_sizes", "primitives/sphere"),
    ("anchor_clip", "primitives/sphere"),
)


def chosen(selectors: Sequence[str], *, everything: bool) -> tuple[Pair, ...]:
    """Return the pairs that selectors name: laws, cases, families or globs of either; none: the default choice.

    A case without a law gets every law, or with none named those that the default choice puts to anything.

    Raises:
        LookupError: a selector names neither a law nor a case.

    """
    laws = [law for law in LAWS if any(fnmatchcase(law, selector) for selector in selectors)]
    wanted = [one for one in selectors if not any(fnmatchcase(law, one) for law in LAWS)]
    cases = select(wanted) if wanted else ()
    if not everything and not cases:
        return tuple(pair for pair in default() if not laws or pair.law in laws)
    every_case = cases or select(["*"])
    pairs = [(law, case) for case in every_case for law in (laws or LAWS)]
    own = {law for law in LAWS if LAWS.about(law).get("own", False)}
    return tuple(Pair(law=law, case=case) for law, case in pairs if law not in own or case is every_case[0])


def default() -> tuple[Pair, ...]:
    """Return the covering choice, in its order."""
    cases: dict[str, Case] = {case.name: case for case in select(sorted({name for _, name in DEFAULT}))}
    return tuple(Pair(law=law, case=cases[name]) for law, name in DEFAULT)


# What laws found as a results folder: each law on each case is a case of its own, so that all publishers know it.
#
# The law is the reference, and what it says of the changed scene is its image; the scene file is the changed scene.


NAME = "laws.json"
REFERENCE = "law"
BECAUSE = f"{K} u times the scene's condition times (the value's size + pixels per radian x the neighbours' range)"
OUTCOMES = {"pass": Outcome.PASS, "fail": Outcome.FAIL, "error": Outcome.ERROR}


def publish(folder: Path, content: LawsRecord, reports: Sequence[LawReport], request: LawsRequest) -> None:
    """Write laws.json, results.json with images and scenes, and every publication of them."""
    write_text(folder / NAME, as_json(content, indent=1) + "\n")
    by_pair: dict[tuple[str, str], list[LawReport]] = {}
    for report in reports:
        by_pair.setdefault((report.law, report.case), []).append(report)
    done = [pair for pair in request.pairs if (pair.law, pair.case.name) in by_pair]
    records = [_record(folder, pair, by_pair[pair.law, pair.case.name], request) for pair in done]
    found = totals.of(records)
    detail = found.coverage
    faults = sorted({fault for name in content["configurations"] for fault in _faults(name, request)})
    save_results(
        folder,
        {
            "schema": 1,
            "rayproof": version("rayproof"),
            "command": " ".join(["rayproof", *sys.argv[1:]]),
            "started": datetime.now(UTC).isoformat(timespec="seconds"),
            "seconds": content["seconds"],
            "finished": content["finished"],
            "verdict": found.verdict(planned=len(request.pairs), tracer=False).value,
            "subject": request.subject.title,
            "faults": faults,
            "environment": {"python": sys.version.split()[0], "system": platform.platform(), "kind": "laws"},
            "configurations": content["configurations"],
            "references": {REFERENCE: {"version": version("rayproof"), "precision": "float64", "independent": False}},
            "absent": {},
            "summary": found.case_ledger(planned=len(request.pairs)),
            "checks": found.check_ledger(),
            "coverage": {item: entry["cases"] for item, entry in detail.items()},
            "coverage_detail": detail,
            "review": [],
            "findings": [],
            "cases": records,
        },
    )
    publish_all(folder)


def _faults(configuration: str, request: LawsRequest) -> tuple[str, ...]:
    if not request.subject.is_tracer:
        return ()
    from rayproof.tracer.configuration import Configuration

    return Configuration.parse(configuration).faults


def _record(folder: Path, pair: Pair, reports: Sequence[LawReport], request: LawsRequest) -> CaseRecord:
    """Return the record of one law on one case, as docs/results.md describes a case's."""
    about = LAWS.about(pair.law)
    name = f"{pair.law}/{pair.case.name.replace('/', '.')}"
    exhibit = next((one.exhibit for one in reports if one.alarms and one.exhibit), None)
    exhibit = exhibit or next((one.exhibit for one in reports if one.exhibit), None)
    words = (LAWS[pair.law].__doc__ or "").strip().split("\n")[0]
    case = Case(
        name=name,
        scene=exhibit.changed if exhibit else pair.case.scene,
        stresses=words,
        covers=about["implicates"],
        least_interior=0,
        most_edge=0.0,
    )
    checks = [check for report in reports for check in _checks(report)]
    worst = max((OUTCOMES.get(verdict(one), Outcome.UNSUPPORTED) for one in reports), key=list(Outcome).index)
    broken = next((check for check in checks if check["verdict"] == Outcome.FAIL), None)
    camera = case.scene.camera
    return {
        "name": name,
        "family": pair.law,
        "verdict": worst.value,
        "stage": broken["stage"] if broken else None,
        "item": about["implicates"][0] if broken else None,
        "reason": _reason(reports, broken),
        "stresses": words,
        "covers": list(about["implicates"]),
        "planned": len(checks),
        "seconds": 0.0,
        "reproduce": f"rayproof laws {pair.law} {pair.case.name}",
        "scene": write_scene(folder, case),
        "picture": None,
        "width": camera.width,
        "height": camera.height,
        "lights": len(case.scene.lights),
        "shapes": [type(shape).__name__ for shape in case.scene.shapes],
        "settings": {},
        "renders": _renders(folder, name, reports, request) if exhibit else [],
        "ran": {one.configuration: list(about["implicates"]) for one in reports},
        "unsupported": [],
        "notes": [{"reference": REFERENCE, "note": f"{exhibit.what}: the law is what it says of that"}]
        if exhibit
        else [],
        "checks": checks,
        "expectations": [],
        "adjudication": {},
        "pixels": None,
        "masks": None,
    }


def _reason(reports: Sequence[LawReport], broken: CheckRecord | None) -> str:
    if broken is not None:
        return str(broken["reason"])
    said = [one.error or one.unsupported for one in reports if one.error or one.unsupported]
    return str(said[0]) if said else ""


def _checks(report: LawReport) -> list[CheckRecord]:
    """Return a check for each stage: the worst of its relations."""
    if report.error is not None or not any(one.examined for one in report.judged):
        why = report.error or report.unsupported or "The law has nothing to say of this scene."
        outcome = Outcome.ERROR if report.error is not None else Outcome.UNSUPPORTED
        return [_check(report, str(LAWS.about(report.law)["stage"]), outcome, why, None)]
    found = []
    for stage in Stage:
        some = [one for one in report.judged if one.stage is stage and one.examined]
        if some:
            worst = max(some, key=lambda one: (one.alarm, one.worst))
            outcome = Outcome.FAIL if worst.alarm else Outcome.PASS
            found.append(_check(report, stage.value, outcome, worst.what if worst.alarm else "", worst))
    return found


def _check(report: LawReport, stage: str, outcome: Outcome, why: str, judged: Judged | None) -> CheckRecord:
    measurement: MeasurementRecord | None = None
    if judged is not None:
        measurement = {
            "worst_ratio": judged.worst,
            "pixel": list(judged.pixel) if judged.pixel else None,
            "ours": list(judged.measured),
            "theirs": list(judged.expected),
            "interior": judged.examined - judged.excused,
            "over_inside": judged.outside,
            "edge": judged.excused,
            "differ_at_edge": judged.excused,
        }
    return {
        "configuration": report.configuration,
        "reference": REFERENCE,
        "stage": stage,
        "verdict": outcome.value,
        "reason": why,
        "ratio": judged.worst if judged is not None else 0.0,
        "end_to_end": measurement,
        "continued": None,
        "because": BECAUSE,
    }


def _renders(folder: Path, name: str, reports: Sequence[LawReport], request: LawsRequest) -> list[RenderRecord]:
    """Write the images of the subject and what the law says of them; return the record's renders."""
    found = []
    # Of numbers that are no stage's image, such as a matrix or one pixel's sum, there is nothing to show.
    shown = [one for one in reports if one.exhibit and one.exhibit.measured]
    chosen = next((one for one in shown if one.alarms), next(iter(shown), None))
    if chosen is None or chosen.exhibit is None:
        return []
    lights = len(chosen.exhibit.changed.lights)
    renderer = request.subject.renderer(chosen.configuration)
    both = ((renderer, chosen.configuration, chosen.exhibit.measured), (REFERENCE, None, chosen.exhibit.expected))
    for who, configuration, images in both:
        path = Path("images", name, f"{who.replace('/', '+')}.exr")
        (folder / path).parent.mkdir(parents=True, exist_ok=True)
        write_answers(folder / path, images, lights=lights, comments=f"{name}: {chosen.exhibit.what}")
        found.append(
            {
                "renderer": who,
                "configuration": configuration,
                "seconds": 0.0,
                "image": path.as_posix(),
                "error": None,
                "cached": False,
            }
        )
    return found
