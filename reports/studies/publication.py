"""Figures and tables for a paper (PDF, SVG, LaTeX, Markdown), each with its caption.

Text stays text: a PDF embeds its font, an SVG names it. The same numbers give the same file: it has no date and no
random identifiers. The caption contains version, commit, seed and processor of the measurement.
"""

import csv
import io
import textwrap
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rayproof.reports.results.files import replacing, write_text

if TYPE_CHECKING:  # matplotlib takes half a second
    from matplotlib.figure import Figure

FIGURES, TABLES = (".pdf", ".svg"), (".tex", ".csv", ".md")
INCH = 25.4  # mm
COLORS = ("#4477aa", "#ee6677", "#228833", "#ccbb44", "#66ccee", "#aa3377", "#777777", "#994455", "#004488", "#997700")
Draw = Callable[[Any], None]  # draws on the axes of one panel
MOST_PANELS = 12
LETTER, LINE = 0.58, 1.4  # average width of a letter and height of a line, in units of a sans serif's font size


@dataclass(frozen=True, kw_only=True)
class Paper:
    """The figure and the table for a paper.

    Parameters
    ----------
    figure
        Also draw a figure into this file, ending in .pdf or .svg; its text stays text.
    table
        Also write the table into this file, ending in .tex, .csv or .md.
    columns
        Columns of the table by their headings, separated by commas, in this order; by default all, and in a .tex file
        those that fit the text of an article.
    width
        Width of the figure [mm].
    font_size
        Size of the figure's text [pt].

    """

    figure: Path | None = None
    table: Path | None = None
    columns: str | None = None
    width: float = 160.0
    font_size: float = 8.0

    def check(self) -> None:
        """Raise ValueError or OSError if an option is invalid or a file cannot be written."""
        for option, file, suffixes in (("--figure", self.figure, FIGURES), ("--table", self.table, TABLES)):
            if file is not None:
                if file.suffix not in suffixes:
                    raise ValueError(f"{option} must end in {' or '.join(suffixes)}, got {file}")
                with replacing(file.with_name(f".{file.name}.try")) as draft:
                    draft.touch()
                file.with_name(f".{file.name}.try").unlink()
        if self.columns is not None and self.table is None:
            raise ValueError("--columns chooses columns of --table FILE")
        if not 20 <= self.width <= 1000:
            raise ValueError(f"--width must be from 20 to 1000 mm, got {self.width:g}")
        if not 4 <= self.font_size <= 72:
            raise ValueError(f"--font-size must be from 4 to 72 pt, got {self.font_size:g}")


def draw(paper: Paper, rows: Sequence[Sequence[Draw]], *, caption: str, height: float) -> None:
    """Draw panels, row by row, with a common legend below them and the caption at the foot.

    `height` is the height of one row [mm]. Nothing is drawn if no figure was requested.
    """
    if paper.figure is None:
        return
    import matplotlib as mpl
    from matplotlib.figure import Figure

    settings: dict[Any, Any] = {
        "svg.hashsalt": "rayproof",
        "svg.fonttype": "none",
        "pdf.fonttype": 42,  # TrueType, which stays text
        "font.size": paper.font_size,
        "axes.linewidth": 0.6,
        "lines.linewidth": 0.9,
        "lines.markersize": 3.0,
    }
    with mpl.rc_context(settings):
        figure = Figure()
        panels = figure.subplots(len(rows), max(map(len, rows)), squeeze=False)
        for line, draws in zip(panels, rows, strict=True):
            for axes, panel in zip(line, draws, strict=True):
                panel(axes)
                axes.grid(visible=True, linewidth=0.3)
                axes.title.set_fontsize(paper.font_size)
        _finish(figure, paper, caption, len(rows) * height / INCH)
        about = {"Date": None, "Creator": "rayproof", "Description": caption}
        if paper.figure.suffix == ".pdf":
            about = {"CreationDate": None, "Creator": "rayproof", "Producer": None, "Subject": caption}
        with replacing(paper.figure) as draft:
            figure.savefig(draft, format=paper.figure.suffix[1:], metadata=about)


def _finish(figure: "Figure", paper: Paper, caption: str, panels: float) -> None:
    """Add legend and caption to a figure and set its size; `panels` is the height of all panels [inches]."""
    legend: dict[str, Any] = {}
    for axes in figure.axes:
        handles, labels = axes.get_legend_handles_labels()
        legend |= {label: handle for label, handle in zip(labels, handles, strict=True) if label not in legend}
    points, small = paper.width / INCH * 72, 0.75 * paper.font_size
    text = textwrap.fill(caption, max(20, int(points / (LETTER * small))), break_long_words=True)
    foot = (text.count("\n") + 1.5) * LINE * small / 72
    key = columns = 0
    if legend:
        columns = max(
            1, min(len(legend), int(points / (paper.font_size * (0.9 * LETTER * max(map(len, legend)) + 3.5))))
        )
        key = (-(-len(legend) // columns) + 0.5) * LINE * paper.font_size / 72
    total = panels + key + foot
    figure.set_size_inches(paper.width / INCH, total)
    figure.text(0.5, 0.25 * LINE * small / 72 / total, text, ha="center", va="bottom", fontsize=small, color="0.35")
    if legend:
        figure.legend(
            list(legend.values()), list(legend), loc="lower center", bbox_to_anchor=(0.5, foot / total), ncols=columns,
            frameon=False, fontsize=0.9 * paper.font_size, borderpad=0, labelspacing=0.3, borderaxespad=0,
        )  # fmt: skip
    figure.set_layout_engine("constrained", rect=(0.0, (key + foot) / total, 1.0, 1 - (key + foot) / total))


# Tables.


def write_table(
    paper: Paper, columns: Sequence[str], rows: Sequence[Sequence[object]], *, caption: str, fits: Sequence[str] = ()
) -> None:
    """Write a table as LaTeX, CSV or Markdown with its caption; nothing if no file was requested.

    `fits` are the default columns of a LaTeX table; if empty, all.

    Raises:
        ValueError: a requested column does not exist.

    """
    file = paper.table
    if file is None:
        return
    places = chosen(paper, columns, fits if file.suffix == ".tex" else ())
    heads = [columns[place] for place in places]
    cells = [[str(row[place]) for place in places] for row in rows]
    if file.suffix == ".md":
        text = f"{markdown_cell(caption)}\n\n{markdown_table(heads, cells)}"
    elif file.suffix == ".csv":
        lines = io.StringIO()
        lines.write(f"# {caption}\n")
        writer = csv.writer(lines, lineterminator="\n")
        writer.writerows([heads, *cells])
        text = lines.getvalue()
    else:
        text = _latex(heads, cells, caption)
    write_text(file, text)


def chosen(paper: Paper, columns: Sequence[str], fits: Sequence[str] = ()) -> list[int]:
    """Return the indices of a table's columns: the requested columns, else the columns `fits`, else all.

    Raises:
        ValueError: a requested column does not exist.

    """
    headings = [name.strip() for name in paper.columns.split(",")] if paper.columns is not None else [*fits]
    for name in headings:
        if name not in columns:
            raise ValueError(f"--columns: no column is called {name!r}; there are {', '.join(columns)}")
    return [columns.index(name) for name in headings] if headings else [*range(len(columns))]


def markdown_table(columns: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return a table as Markdown."""
    lines = ["| " + " | ".join(columns) + " |", "|" + "---|" * len(columns)]
    return "\n".join([*lines, *("| " + " | ".join(map(markdown_cell, row)) + " |" for row in rows)]) + "\n"


def markdown_cell(text: str) -> str:
    """Return text escaped for a cell of a Markdown table, so that it cannot end the row or be read as markup."""
    return " ".join(text.split()).replace("|", "\\|").replace("<", "&lt;")


_LATEX = {
    "\\": r"\textbackslash{}", "~": r"\textasciitilde{}", "^": r"\textasciicircum{}", "<": r"\textless{}",
    ">": r"\textgreater{}", "|": r"\textbar{}", **{letter: f"\\{letter}" for letter in "&%$#_{}"},
}  # fmt: skip


# LaTeX's class `article` at 10 pt has lines of 345 pt. A letter or digit of \footnotesize (8 pt) has an average width
# of at most 4.5 pt, and a column has a margin of 3 pt on either side.
TEXT_WIDTH, LETTER_WIDTH, ROOM = 345.0, 4.5, 6.0
NARROWEST = 40.0  # least width [pt] of a column whose text is broken into lines


def _latex(columns: Sequence[str], rows: Sequence[Sequence[str]], caption: str) -> str:
    cells = [[latex_text(cell) for cell in row] for row in ([_spoken(name) for name in columns], *rows)]
    widths = _widths([[_spoken(cell) for cell in row] for row in (columns, *rows)])
    kinds = "".join(
        f"p{{{width:.0f}pt}}" if width is not None else "l" if place == 0 else "r" for place, width in enumerate(widths)
    )

    def line(row: Sequence[str]) -> str:
        broken = (cell if width is None else rf"\raggedright {cell}" for cell, width in zip(row, widths, strict=True))
        return "    " + " & ".join(broken) + r" \tabularnewline"

    head = ["\\begin{table}", r"  \centering", f"  \\caption{{{latex_text(caption)}}}"]
    head += [r"  \footnotesize", r"  \setlength{\tabcolsep}{3pt}", f"  \\begin{{tabular}}{{{kinds}}}"]
    body = [r"    \hline", line(cells[0]), r"    \hline", *map(line, cells[1:]), r"    \hline", r"  \end{tabular}"]
    return "\n".join([*head, *body, "\\end{table}"]) + "\n"


def _widths(rows: Sequence[Sequence[str]]) -> list[float | None]:
    """Return the width [pt] of each column whose text must be broken for the table to fit, None for the others.

    The widest columns are narrowed first, none below the width of its longest word.
    """
    natural = [LETTER_WIDTH * max(map(len, column)) for column in zip(*rows, strict=True)]
    words = [
        max(NARROWEST, LETTER_WIDTH * max((len(word) for cell in column for word in cell.split()), default=0))
        for column in zip(*rows, strict=True)
    ]
    room = TEXT_WIDTH - ROOM * len(natural)
    widths = natural.copy()
    while sum(widths) > room:
        place = max(range(len(widths)), key=lambda at: widths[at] - words[at])
        if widths[place] <= words[place]:
            break  # every column is as narrow as its longest word
        widths[place] = max(words[place], widths[place] - max(LETTER_WIDTH, (sum(widths) - room) / 4))
    return [width if width < whole else None for width, whole in zip(widths, natural, strict=True)]


def _spoken(text: str) -> str:
    """Return a name with blanks for underscores, as a paper prints it."""
    return text.replace("_", " ")


def latex_text(text: str) -> str:
    """Return text escaped for LaTeX; " -> " becomes an arrow."""
    parts = " ".join(_spoken(text).split()).split(" -> ")
    return r" $\rightarrow$ ".join("".join(_LATEX.get(letter, letter) for letter in part) for part in parts)
