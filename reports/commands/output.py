"""Output of all commands: lines, tables, JSON, and the warning of a planted fault."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from rich.table import Table

from rayproof.reports.commands.usage import told_in_one_line
from rayproof.reports.results.files import as_json, legible
from rayproof.reports.terminal import PIPED_WIDTH, console

ROOM = 34  # width [characters] per column of a table; in narrower ones long names would be broken


def say(line: str) -> None:
    """Print one line as it is, never wrapped or read as markup."""
    console().print(legible(line), soft_wrap=True)


def shout(faults: Sequence[str]) -> None:
    """Print a conspicuous warning if a planted fault is in use."""
    if faults:
        console().print(warning(faults), style="bold white on red", soft_wrap=True)


def warning(faults: Sequence[str]) -> str:
    """Return the line that heads every output of a tracer with planted faults."""
    return f"PLANTED FAULT IN USE: {', '.join(faults)} - what follows is wrong on purpose"


def show_table(title: str, columns: Sequence[str], rows: Sequence[Sequence[object]]) -> None:
    """Print a table; cells are plain text, not markup."""
    table = Table(title=title, title_justify="left")
    for column in columns:
        table.add_column(column, overflow="fold")
    for row in rows:
        table.add_row(*(str(cell) for cell in row))
    console(width=max(PIPED_WIDTH, ROOM * len(columns))).print(table)


def write_json(file: Path | None, content: Any) -> None:
    """Write `content` to `file` unless that is None; NaN and infinities, which JSON lacks, become strings.

    Raises:
        UsageError: the file cannot be written.

    """
    if file is not None:
        with told_in_one_line():
            file.write_text(as_json(content, indent=2) + "\n")
