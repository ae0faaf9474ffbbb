"""The checks of a run as rows of a Parquet file.

A check is a row: whose it is, what became of it, and what end to end was measured. Records are read one at a time and
written a row group at a time, so that the memory that this takes does not grow with the run.
"""

import math
from collections.abc import Iterator
from itertools import islice
from pathlib import Path

import pyarrow as pa
from pyarrow import parquet

from rayproof.reports.results.case_records import CaseRecord
from rayproof.reports.results.files import encodable, replacing
from rayproof.reports.results.records import RunRecord

ROWS = 2**16  # of a row group
_WORD = pa.dictionary(pa.int32(), pa.string())
# Texts repeat, so that they are kept once and counted through. Nothing was measured where a number is null.
SCHEMA = pa.schema(
    [
        ("case", _WORD),
        ("family", _WORD),
        ("configuration", _WORD),
        ("reference", _WORD),
        ("stage", _WORD),
        ("verdict", _WORD),
        ("ratio", pa.float64()),  # error over limit
        ("worst_error", pa.float64()),  # in the stage's unit
        ("limit", pa.float64()),  # where the error is worst, in the stage's unit
        ("column", pa.int32()),  # of the worst pixel
        ("row", pa.int32()),
        ("interior", pa.int64()),  # pixels that are far from every edge
        ("edge", pa.int64()),  # and that are near one
        ("reason", _WORD),
    ]
)


def write_checks(path: Path, results: RunRecord) -> int:
    """Write every check of a run into a Parquet file, whole or not at all; return how many there are.

    Raises:
        OSError: the file cannot be written.

    """
    count = 0
    rows = (row for case in results["cases"] for row in _rows(case))
    with replacing(path) as draft, parquet.ParquetWriter(draft, SCHEMA, compression="zstd") as file:
        while group := list(islice(rows, ROWS)):
            file.write_table(pa.Table.from_pylist(group, schema=SCHEMA))
            count += len(group)
    return count


def _rows(case: CaseRecord) -> Iterator[dict[str, str | float | None]]:
    for check in case.get("checks", []):
        measured = check.end_to_end
        column, row = (measured and measured.pixel) or (None, None)
        texts = {
            "case": case["name"],
            "family": case["family"],
            "verdict": check.outcome,
            "configuration": check.configuration,
            "reference": check.reference,
            "stage": check.stage,
            "reason": check.reason,
        }
        yield {
            **{name: None if text is None else encodable(text) for name, text in texts.items()},
            "ratio": check.ratio,
            "worst_error": measured and measured.worst_error,
            "limit": measured and measured.limit,
            "column": column,
            "row": row,
            "interior": measured and measured.interior,
            "edge": measured and measured.edge,
        }


def _number(value: float | str | None) -> float | None:
    """Return a number of a record, which has those that JSON has not as texts."""
    if value is None:
        return None
    try:
        return float(value)
    except ValueError:
        return math.nan
