"""Answer files to the vectors: exact ones, such as are off by a share of every limit, and those of a formula."""

from collections.abc import Mapping
from decimal import Decimal, localcontext
from pathlib import Path

from rayproof.reports.vectors.answering import answered, configured
from rayproof.reports.vectors.check import EITHER, FILES, Row, file_of
from rayproof.reports.vectors.rows import everything
from rayproof.tracer.formulas import FORMULAS

Cells = Mapping[str, Mapping[str, str]]


def exact(row: Row, precision: str, *, off: int = 0) -> dict[str, str]:
    """Return the right answer to a row, off by 1.01 limits in the first number of each group if `off` is 1 or -1."""
    bits, (decision, groups) = precision[-2:], FILES[file_of(row["id"])]
    cells = {decision: row[f"decision{bits}"].replace(EITHER, "1")} if decision else {}
    first = next(iter(groups), "")
    for group, names in groups.items():
        limit = row[f"limit{bits}" + ("" if group == first else f"_{group}")]
        for place, name in enumerate(names):
            column = ("t_out" if row["start"] in ("inside", "on") else "t_in") if group == "t" else name
            if not row.get(f"{column}_low"):
                continue
            with localcontext() as context:
                context.prec = 100
                value = Decimal(float(row[f"{column}_{'low' if off < 0 else 'high'}"]))
                if off and limit and place == 0:
                    value = (
                        value + off * Decimal("1.01") * Decimal(float(limit)) if value.is_finite() else Decimal("nan")
                    )
                cells[name] = str(value)
    return cells


def of_formula(name: str, file: str, precision: str) -> dict[str, dict[str, str]]:
    """Return what a formula answers to the rows of a file."""
    own = {identity: row for identity, row in everything()[0].items() if row.file == file}
    return answered(own, configured(FORMULAS[name], precision))


def written(path: Path, cells: Cells, *declared: str) -> Path:
    """Write an answer file."""
    names = list(dict.fromkeys(name for row in cells.values() for name in row))
    lines = [f"# {line}" for line in declared] + [",".join(["id", *names])]
    lines += [",".join([identity, *(row.get(name, "") for name in names)]) for identity, row in cells.items()]
    path.write_text("\n".join(lines) + "\n")
    return path
