"""Two formulas, two configurations or two runs side by side."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from rayproof.reports.api.outcome import Run, Table, legible_lines, table
from rayproof.tracer.kernel.compiler import choose_packaged_llvm

if TYPE_CHECKING:
    from rayproof.reports.studies.compare.records import FormulaComparison, RunComparison


@dataclass(frozen=True, kw_only=True)
class Comparison:
    """Which errs less, and at what price: the sentence, the rows behind it, and the record of `rayproof compare`."""

    verdict: str
    rows: Table  # a family of cases each; of two runs a case each
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
) -> Comparison:
    """Compare two formulas, two configurations, or two finished runs on what both hold.

    A formula is a name such as "sphere/haines", or a function of one's own, "sphere=./mine.py:nearest_hit"; a
    configuration is one such as "float32/triangle=woop"; a run is what `run` returned, or its folder. `cases` are
    families, cases or stresses to compare on, by default those that the difference concerns. `tell` hears of the
    progress.

    Raises:
        LookupError, ValueError, OSError: there is no such formula, configuration or run, or the two have nothing in
            common.

    """
    folders = [one.folder if isinstance(one, Run) else Path(one) for one in (base, candidate)]
    runs = [isinstance(one, Run) or folder.is_dir() for one, folder in zip((base, candidate), folders, strict=True)]
    if all(runs):
        if cases:
            raise ValueError("two finished runs are compared on what they hold; `cases` cannot add to it")
        from rayproof.reports.runs.difference.runs import compare_runs

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


def _comparison(record: "FormulaComparison | RunComparison") -> Comparison:
    from rayproof.reports.studies.compare.records import COLUMNS, rows

    columns = COLUMNS["runs" if "changed" in record else "formulas"]
    told = [dict(zip(columns, row, strict=False)) for row in rows(record)]
    return Comparison(verdict=record["verdict"], rows=table(columns, told), record=MappingProxyType(record))
