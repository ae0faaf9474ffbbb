"""The results of the API: `Run`, `CaseResult`, `Judgement`, `FormulaComparison`, also as tables in a notebook."""

import base64
import html
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, cast

import numpy as np
from msgspec.structs import asdict

from rayproof.cases.scene_json import load_scene
from rayproof.cases.stages import Stage
from rayproof.reports.api.asking import image_stages
from rayproof.reports.publish.page.thumbnails import picture
from rayproof.reports.results.case_records import CaseRecord, Check
from rayproof.reports.results.case_table import briefs, named
from rayproof.reports.results.document import load_results
from rayproof.reports.results.files import legible, several
from rayproof.reports.results.headline import of_the_whole, worst_first
from rayproof.reports.results.images import kept_images
from rayproof.reports.results.outcomes import MEASURED, Outcome
from rayproof.reports.results.records import RunRecord
from rayproof.tracer.kernel.compiler import choose_packaged_llvm

if TYPE_CHECKING:
    from rayproof.reports.studies.compare.records import FormulaComparisonRecord, RunComparison

GOOD = ("pass", "warn")
PICTURES = 4  # of the worst cases, in a notebook
SHOWN = 12  # rows of a table in a notebook, and lines of an assertion


@dataclass(frozen=True)
class ResultTable(Sequence[Mapping[str, Any]]):
    """Rows with the same columns: a sequence of mappings, shown as a table in a notebook; see `to_pandas()`."""

    columns: tuple[str, ...]
    rows: tuple[Mapping[str, Any], ...]

    def __getitem__(self, index: Any) -> Any:
        """Return the row at an index, or the rows of a slice."""
        return self.rows[index]

    def __len__(self) -> int:
        """Return the number of rows."""
        return len(self.rows)

    def __iter__(self) -> Iterator[Mapping[str, Any]]:
        """Iterate over the rows."""
        return iter(self.rows)

    def to_pandas(self) -> Any:
        """Return a `pandas.DataFrame`; raise ImportError if pandas is not installed."""
        import pandas  # pyright: ignore[reportMissingImports]

        return pandas.DataFrame([dict(row) for row in self.rows], columns=list(self.columns))

    def __repr__(self) -> str:
        """Return the rows as text, one per line."""
        lines = ["  ".join(_cell(row.get(name)) for name in self.columns) for row in self.rows[:SHOWN]]
        more = [f"and {len(self) - SHOWN} more"] if len(self) > SHOWN else []
        return "\n".join(["  ".join(self.columns), *lines, *more])

    def _repr_html_(self) -> str:
        head = "".join(f"<th>{html.escape(name)}</th>" for name in self.columns)
        body = "".join(
            "<tr>" + "".join(f"<td>{html.escape(_cell(row.get(name)))}</td>" for name in self.columns) + "</tr>"
            for row in self.rows[:SHOWN]
        )
        more = f"<p>and {len(self) - SHOWN} more</p>" if len(self) > SHOWN else ""
        return f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>{more}"


def _cell(value: Any) -> str:
    return legible(f"{value:.4g}" if isinstance(value, float) else "" if value is None else str(value))


def table(columns: Sequence[str], rows: Sequence[Mapping[str, Any]]) -> ResultTable:
    """Return rows as a table, without the keys that are not columns."""
    return ResultTable(
        tuple(columns), tuple(MappingProxyType({name: row.get(name) for name in columns}) for row in rows)
    )


CHECK_COLUMNS = ("reference", "stage", "verdict", "ratio", "reason")


def checks_table(columns: Sequence[str], checks: Sequence[Check]) -> ResultTable:
    """Return checks as a table, with only the fields that are columns."""
    return table(columns, [{**asdict(check), "verdict": check.outcome.value} for check in checks])


class _NoTruth:
    def __bool__(self) -> bool:
        """Raise TypeError, because a run without measurements is neither true nor false."""
        raise TypeError("neither true nor false: look at `.verdict` and `.counts`, or call `.raise_if_failed()`")


@dataclass(frozen=True, kw_only=True)
class CaseResult(_NoTruth):
    """One case of a run: its verdict, its checks, and its images with their limits."""

    folder: Path
    record: CaseRecord = field(repr=False)

    @property
    def name(self) -> str:
        """Return the case's name, family/case."""
        return str(self.record["name"])

    @property
    def verdict(self) -> str:
        """Return pass, warn, undecided, unsupported, missing, reference_suspect, error or fail."""
        return str(self.record["verdict"])

    @property
    def reason(self) -> str:
        """Return the reason in words if the case did not pass, otherwise an empty string."""
        return str(self.record.get("reason") or "")

    @property
    def blamed_items(self) -> tuple[str, ...]:
        """Return the specification's items that may be wrong according to the checks; none if the case passed."""
        blamed = self.record.get("blamed_items")
        if blamed is not None:
            return tuple(blamed)
        return (str(self.record["item"]),) if self.record.get("item") else ()

    @property
    def checks(self) -> ResultTable:
        """Return all checks: configuration, reference, stage, verdict, error / limit, and reason."""
        return checks_table(("configuration", *CHECK_COLUMNS), self.record["checks"])

    @property
    def renderers(self) -> tuple[str, ...]:
        """Return the renderers that may have images: the subject in each configuration, then the references."""
        renders = sorted(self.record["renders"], key=lambda render: render.get("configuration") is None)
        return tuple(render["renderer"] for render in renders)

    def image(self, stage: str, renderer: str | None = None) -> np.ndarray:
        """Return a renderer's image of a stage, float64 (height, width, channels), row 0 at the top.

        Files contain float32, so an image that was computed in float64 is rounded. `renderer` is by default the
        subject in its first configuration.

        Raises:
            LookupError: the case has no such renderer, or the renderer has no image of this stage.

        """
        (wanted,) = image_stages([stage])
        name = self._known(renderer)
        renders, notes = kept_images(self.folder, self.record, only=[name])
        if wanted not in renders.get(name, {}):
            why = f": {notes[0]}" if notes else ""
            raise LookupError(f"{self.name} kept no image of {stage} by {name}{why}")
        return np.asarray(renders[name][wanted], dtype=np.float64)

    def limit(self, stage: str, renderer: str | None = None) -> np.ndarray:
        """Return the largest allowed error of a renderer's image against the closed forms, float64.

        For directions it is an angle [rad] and for positions a distance [m], both (height, width); for other stages it
        has the shape and the unit of the image. It is computed again from the scene and the renderer's precision. A
        pixel is NaN if the answers of nearby problems differ there by more than the limit: its value must be one of
        these answers.

        Raises:
            LookupError: the case has no such renderer.

        """
        from rayproof.reports.api.asking import limit_of

        (wanted,) = image_stages([stage])
        name = self._known(renderer)
        configuration = next(
            render.get("configuration") for render in self.record["renders"] if render["renderer"] == name
        )
        precision = str(configuration or "").partition("/")[0]
        scene = load_scene(self.folder / str(self.record["scene"]))
        return limit_of(scene, wanted, precision if precision in ("float32", "float64") else "float32")

    def _known(self, renderer: str | None) -> str:
        renderers = self.renderers
        if not renderers or (renderer is not None and renderer not in renderers):
            raise LookupError(f"{self.name} has no renderer {renderer!r}; known: {', '.join(renderers) or 'none'}")
        return renderers[0] if renderer is None else renderer


@dataclass(frozen=True, kw_only=True)
class Run(_NoTruth):
    """A finished run: its coverage, the verdict, the failures with their causes, and the images of every case."""

    folder: Path  # of the results and the report; `index.html` opens in a browser
    record: RunRecord = field(repr=False)  # results.json, as docs/results.md describes it
    code: int  # the exit code of `rayproof run`

    @property
    def verdict(self) -> str:
        """Return the run's verdict, as shown on the first screen of the report."""
        return str(self.record["verdict"])

    @property
    def counts(self) -> Mapping[str, int]:
        """Return the numbers of planned, measured and unsupported cases, and the number of cases per verdict."""
        summary = self.record["summary"]
        counted = cast("dict[str, int]", summary)
        measured = sum(counted.get(outcome.value, 0) for outcome in MEASURED)
        return MappingProxyType({"planned": counted["planned"], "measured": measured, **counted})

    @property
    def names(self) -> tuple[str, ...]:
        """Return the names of the cases with a result."""
        return tuple(str(case["name"]) for case in briefs(self.record["cases"]))

    @property
    def failures(self) -> ResultTable:
        """Return the cases that did not pass: verdict, first wrong stage, the items to blame, the reason."""
        rows = [
            {**case, "case": case["name"], "items": ", ".join(self.case(case["name"]).blamed_items)}
            for case in briefs(self.record["cases"])
            if case["verdict"] not in GOOD and case["verdict"] != Outcome.UNSUPPORTED.value
        ]
        return table(("case", "verdict", "stage", "items", "reason"), rows)

    @property
    def diagnosis(self) -> tuple[str, ...]:
        """Return a sentence per cause: the mistake, its item, and the failures that it explains."""
        return tuple(str(cause["sentence"]) for cause in self.record.get("diagnosis") or ())

    def case(self, name: str) -> CaseResult:
        """Return the result of the case with this name; raise LookupError if the run has no such case."""
        case = named(self.record["cases"], name)
        if case is not None:
            return CaseResult(folder=self.folder, record=case)
        raise LookupError(f"this run has no case {name!r}; it has {', '.join(self.names[:SHOWN])}")

    def raise_if_failed(self) -> None:
        """Raise an exception unless the run's exit code is 0.

        Raises:
            AssertionError: cases failed or could not be measured; the message lists them.

        """
        if self.code != 0:
            raise AssertionError(str(self))

    def __str__(self) -> str:
        """Return the numbers of cases, then the verdict, the causes and the failures."""
        counts = self.counts
        planned = several(counts["planned"], "case")
        line = f"{planned} planned, {counts['measured']} measured, {counts['unsupported']} unsupported"
        failed = [f"{row['case']}: {row['verdict']} {row['items']}: {row['reason']}" for row in self.failures[:SHOWN]]
        more = [f"and {len(self.failures) - SHOWN} more"] if len(self.failures) > SHOWN else []
        return legible_lines([f"{line}: {self.verdict}", *of_the_whole(self.record), *self.diagnosis, *failed, *more])

    def _repr_html_(self) -> str:
        first, *rest = str(self).split("\n")
        causes = "".join(f"<p>{html.escape(line)}</p>" for line in rest[: len(self.diagnosis)])
        pictures = "".join(
            f"<figure><figcaption>{html.escape(legible(case['name']))}: ours, the reference's, the difference"
            f'</figcaption><img style="image-rendering: pixelated" src="data:image/png;base64,'
            f'{base64.b64encode(drawing).decode("ascii")}"></figure>'
            for case in worst_first(self.record["cases"])[:PICTURES]
            if case["verdict"] not in GOOD and (drawing := picture(self.folder, case)) is not None
        )
        failed = self.failures._repr_html_() if len(self.failures) else ""
        return f"<p><b>{html.escape(first)}</b></p>{causes}{pictures}{failed}"


def legible_lines(lines: Sequence[str]) -> str:
    """Join lines to a text without control characters."""
    return "\n".join(legible(line) for line in lines)


def loaded(folder: Path, code: int) -> Run:
    """Load a run from its results folder; raise OSError or ValueError if the results cannot be read."""
    return Run(folder=folder, record=cast(RunRecord, MappingProxyType(load_results(folder))), code=code)


def view3d(result: Run, case: str) -> Any:
    """Show the scene of a case in a notebook, with the 3-D view of the report.

    The view can be rotated if PyVista's notebook packages are installed (`pip install pyvista[jupyter]`); otherwise it
    is an image.

    Raises:
        LookupError: the run has no such case, or did not store its scene.
        RuntimeError: OpenGL is missing.

    """
    record = result.case(case).record
    if not record.get("scene"):
        raise LookupError(f"the run kept no scene of {case}")
    from rayproof.reports.publish.scene3d.plotting import open_view

    return open_view(result.folder, record)


@dataclass(frozen=True, kw_only=True)
class Judgement(_NoTruth):
    """An answer compared with the references: its verdict, its checks, and its limits."""

    verdict: str
    stage: str | None  # the first wrong stage
    blamed_items: tuple[str, ...]  # items of the specification that may be wrong, as in `CaseResult`
    reason: str
    checks: ResultTable
    limits: Mapping[str, np.ndarray] = field(repr=False)  # stage -> float64, as described at `CaseResult.limit`
    references: tuple[str, ...]

    def raise_if_failed(self) -> None:
        """Raise AssertionError unless the answer passed, also if nothing could be measured."""
        if self.verdict not in GOOD:
            raise AssertionError(str(self))

    def __str__(self) -> str:
        """Return the number of measured checks, then the verdict and the reason."""
        where = f" at {self.stage}" if self.stage else ""
        item = f" ({', '.join(self.blamed_items)})" if self.blamed_items else ""
        why = f": {self.reason}" if self.reason else ""
        against = ", ".join(self.references)
        done = sum(row["verdict"] != Outcome.UNSUPPORTED.value for row in self.checks)
        return legible(f"{done} of {len(self.checks)} checks measured, by {against}: {self.verdict}{where}{item}{why}")


def stage_name(stage: Stage | None) -> str | None:
    """Return the name of a stage, or None without a stage."""
    return None if stage is None else stage.value


@dataclass(frozen=True, kw_only=True)
class FormulaComparison:
    """The errors and run times of two formulas or runs: a sentence, its data, and the record of `rayproof compare`."""

    verdict: str
    rows: ResultTable  # one row per family of cases; for two runs, one row per case
    record: Mapping[str, Any] = field(repr=False)

    def __str__(self) -> str:
        """Return the verdict."""
        return legible_lines([self.verdict])

    def _repr_html_(self) -> str:
        from html import escape

        return f"<p><b>{escape(str(self))}</b></p>{self.rows._repr_html_()}"


def compare(
    base: "str | Path | Run",
    candidate: "str | Path | Run",
    cases: Sequence[str] = (),
    *,
    repetitions: int = 31,
    precision: str = "float32",
    tell: Callable[[str], None] = lambda line: None,
) -> FormulaComparison:
    """Compare two formulas, two configurations, or the common cases of two finished runs.

    A formula is a name such as "sphere/haines", or a function of the caller's, "sphere=./mine.py:nearest_hit"; a
    configuration is a name such as "float32/triangle=woop"; a run is a `Run` or the path of its folder. `cases` are
    families, cases or stresses for the comparison, by default all cases that depend on the difference. `tell` is called
    with each line of progress.

    Raises:
        LookupError, ValueError, OSError: there is no such formula, configuration or run, or the two runs have no case
            in common.

    """
    folders = [run.folder if isinstance(run, Run) else Path(run) for run in (base, candidate)]
    runs = [isinstance(run, Run) or folder.is_dir() for run, folder in zip((base, candidate), folders, strict=True)]
    if all(runs):
        if cases:
            raise ValueError("two finished runs are compared on what they hold; `cases` cannot add to it")
        from rayproof.reports.history.run_difference import compare_runs

        return _comparison(compare_runs(*folders))
    if any(runs):
        raise ValueError("a run can only be compared with another run")
    choose_packaged_llvm()
    from rayproof.reports.studies.compare.comparison import compare as compare_formulas
    from rayproof.reports.studies.compare.contenders import contender, questions, seen
    from rayproof.tracer.formulas.own_file import forget

    forget()
    pair = seen(*(contender(str(name), precision=precision) for name in (base, candidate)))
    return _comparison(compare_formulas(questions(cases, *pair), *pair, repetitions=repetitions | 1, tell=tell))


def _comparison(record: "FormulaComparisonRecord | RunComparison") -> FormulaComparison:
    from rayproof.reports.studies.compare.records import COLUMNS, rows

    columns = COLUMNS["runs" if "changed" in record else "formulas"]
    named_rows = [dict(zip(columns, row, strict=False)) for row in rows(record)]
    return FormulaComparison(
        verdict=record["verdict"], rows=table(columns, named_rows), record=MappingProxyType(record)
    )
