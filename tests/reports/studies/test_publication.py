"""Figures and tables for a paper: text that stays text, captions, sizes; and the same numbers give the same bytes."""

import csv
import json
import re
import shutil
import subprocess
import zlib
from pathlib import Path

import pytest

from rayproof.reports.commands.stability import COLUMNS as CLIMBS
from rayproof.reports.commands.stability import FITS as CLIMBS_FIT
from rayproof.reports.commands.tradeoff import COLUMNS as POINTS
from rayproof.reports.commands.tradeoff import FITS as POINTS_FIT
from rayproof.reports.studies.compare.records import COLUMNS, FITS
from rayproof.reports.studies.publication import Paper, draw, latex_text, markdown_cell, write_table
from tests.reports.commands.conftest import Rayproof

MINE = """
import drjit as dr

def hit(ray, sphere, interval, eps=0.0):
    f = ray.origin - sphere.center
    a, h = dr.squared_norm(ray.direction), -dr.dot(f, ray.direction)
    quarter = h * h - a * (dr.squared_norm(f) - dr.square(sphere.radius * (1 + eps)))
    root = dr.sqrt(dr.select(quarter >= 0, quarter, 0))
    return dr.select(quarter >= 0, interval.smallest((h - root) / a, (h + root) / a), dr.inf)
"""


def panel(axes: object) -> None:
    axes.plot([1, 2], [3, 4], label="a line")  # type: ignore[attr-defined]


@pytest.mark.parametrize("ending", ["svg", "pdf"])
def test_a_figure_keeps_its_text_and_has_the_width_that_was_asked_for(ending: str, tmp_path: Path) -> None:
    paper = Paper(figure=tmp_path / f"a.{ending}", width=84.0, font_size=7.0)

    for name in ("a", "b"):
        copy = Paper(figure=tmp_path / f"{name}.{ending}", width=84.0, font_size=7.0)
        draw(copy, [[panel]], caption="made by <someone> & 1_2", height=40.0)

    assert paper.figure is not None
    data = paper.figure.read_bytes()
    assert data == (tmp_path / f"b.{ending}").read_bytes()
    points = 84 / 25.4 * 72
    if ending == "svg":
        text = data.decode()
        assert re.search(r"<text[^>]*>a line</text>", text)
        assert "made by &lt;someone&gt; &amp; 1_2</text>" in text
        width = re.search(r'width="([\d.]+)pt"', text)
    else:
        assert b"/Type3" not in data  # glyphs as drawings; /Type0 of a TrueType font is text
        assert b"/CIDFontType2" in data
        streams = [
            zlib.decompress(part)
            for part in re.findall(rb"stream\r?\n(.*?)\r?\nendstream", data, re.DOTALL)
            if part[:1] == b"x"
        ]
        assert any(b"Tj" in stream or b"TJ" in stream for stream in streams)
        width = re.search(rb"/MediaBox \[ 0 0 ([\d.]+)", data)
    assert width is not None
    assert float(width[1]) == pytest.approx(points, abs=0.01)


def test_tables_escape_what_their_language_would_obey(tmp_path: Path) -> None:
    rows = [["100 % a_b & c", "1 -> 2"], ["x|y", "<b>"]]
    for ending in ("tex", "csv", "md"):
        write_table(Paper(table=tmp_path / f"t.{ending}"), ("name", "value"), rows, caption="seed 4, a_b")

    tex, table, page = ((tmp_path / f"t.{ending}").read_text() for ending in ("tex", "csv", "md"))
    assert r"\caption{seed 4, a b}" in tex
    assert r"100 \% a b \& c & 1 $\rightarrow$ 2 \tabularnewline" in tex
    assert table.startswith("# seed 4, a_b\n")
    assert list(csv.reader(table.splitlines()[1:])) == [["name", "value"], *rows]
    assert "| x\\|y | &lt;b> |" in page
    assert latex_text("~^\\") == r"\textasciitilde{}\textasciicircum{}\textbackslash{}"
    assert markdown_cell("a\nb") == "a b"


LATEX = r"""\documentclass{article}
\begin{document}
\input{table.tex}
\end{document}
"""


@pytest.mark.process
@pytest.mark.parametrize("kind", [*COLUMNS, "stability", "tradeoff"])
@pytest.mark.skipif(shutil.which("pdflatex") is None, reason="LaTeX is not installed")
def test_a_table_fits_the_text_of_an_article(kind: str, tmp_path: Path) -> None:
    columns, fits = {
        **{name: (COLUMNS[name], FITS[name]) for name in COLUMNS},
        "stability": (CLIMBS, CLIMBS_FIT),
        "tradeoff": (POINTS, POINTS_FIT),
    }[kind]
    cells = {
        "family": "far_sphere_1e3_seen_from_afar", "case": "transforms/mesh_stretched",
        "diagram": "triangle/sliver_1e3",
        "formula": "triangle/moeller_trumbore_epsilon", "point": "moeller_trumbore_epsilon, float64",
        "outcome": "no difference shown", "digits gained": "-10.73 [-10.91, -10.52]",
        "wrong pixels": "1790 -> 107 of 60350", "time ratio": "1.029 [0.280, 1.087]",
        "slope": "-2.01 [-2.10, -1.92]", "breakpoint": "never right",
    }  # fmt: skip
    row = [cells.get(column, "1.25e+10") for column in columns]

    write_table(Paper(table=tmp_path / "table.tex"), columns, [row] * 20, caption="seed 4, a_b", fits=fits)

    text = (tmp_path / "table.tex").read_text()
    assert "_" not in text
    (tmp_path / "paper.tex").write_text(LATEX)
    command = ["pdflatex", "-interaction=nonstopmode", "-halt-on-error", "paper.tex"]
    log = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=True).stdout
    assert [line for line in log.splitlines() if "Overfull \\hbox" in line] == []


def test_columns_are_chosen_by_their_headings(tmp_path: Path) -> None:
    paper = Paper(table=tmp_path / "t.csv", columns="value, name")

    write_table(paper, ("name", "other", "value"), [["a", "b", "c"]], caption="")

    assert (tmp_path / "t.csv").read_text().splitlines()[1:] == ["value,name", "c,a"]
    with pytest.raises(ValueError, match="no column is called 'size'; there are name, value"):
        write_table(Paper(table=tmp_path / "t.csv", columns="size"), ("name", "value"), [], caption="")


@pytest.mark.parametrize(
    ("options", "named"),
    [
        (("--columns", "family"), "--columns chooses columns of --table FILE"),
        (("--table", "t.tex", "--columns", "nonsense"), "no column is called 'nonsense'"),
        (("--figure", "a.png"), "--figure must end in .pdf or .svg"),
        (("--table", "a.xls"), "--table must end in"),
        (("--figure", "a.svg", "--width", "3"), "--width"),
        (("--figure", "a.svg", "--font-size", "1"), "--font-size"),
        (("--figure", "absent/a.svg/b.svg"), ""),
    ],
)
@pytest.mark.parametrize("command", [("compare", "sphere/textbook", "sphere/haines"), ("stability",), ("tradeoff",)])
def test_what_cannot_be_drawn_is_refused_before_anything_is_measured(
    rayproof: Rayproof,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    command: tuple[str, ...],
    options: tuple[str, ...],
    named: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "absent").mkdir()
    (tmp_path / "absent" / "a.svg").touch()

    ended = rayproof(*command, *options)

    assert (ended.code, ended.error.count("\n")) == (2, 1)
    assert named in ended.error


def test_a_parameter_is_swept_and_drawn(rayproof: Rayproof, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine.py").write_text(MINE)
    mine, sweep = "sphere=./mine.py:hit", ("--sweep", "eps=1e-6..1e-2:3", "--figure", "a.svg")

    compared = rayproof(
        "compare",
        "sphere/haines",
        mine,
        "far_sphere_1e1",
        "--repetitions",
        9,
        *sweep,
        "--json",
        "c.json",
        "--table",
        "t.md",
    )
    drawing = (tmp_path / "a.svg").read_text()
    climbed = rayproof("stability", mine, "SPH-TAN", "--precision", "float32", "--quick", *sweep, "--json", "s.json")

    assert (compared.code, climbed.code) == (0, 0), compared.error + climbed.error
    found = json.loads((tmp_path / "c.json").read_text())
    assert (found["schema"], found["sweep"]["values"]) == (1, [1e-6, pytest.approx(1e-4), 1e-2])
    gained = [one["digits_gained"] for one in found["comparisons"]]
    # The radius is off by eps, which the distance inherits: a hundred times the parameter costs two digits.
    assert gained[0] - gained[1] == pytest.approx(2, abs=0.5)
    assert gained[1] - gained[2] == pytest.approx(2, abs=0.5)
    origin = found["origin"]
    for word in (origin["rayproof"], origin["processor"], "seed 4"):
        assert word in (tmp_path / "t.md").read_text()
        assert word in re.sub(r"</text>\s*<text[^>]*>", " ", drawing) or word.split()[-1] in drawing
    climbs = json.loads((tmp_path / "s.json").read_text())["ladders"]
    assert [one["formula"] for one in climbs] == [f"sphere=mine.py:hit(eps={x})" for x in ("1e-06", "0.0001", "0.01")]
    assert climbs[0]["worst_error_over_Ku"] < climbs[1]["worst_error_over_Ku"] < climbs[2]["worst_error_over_Ku"]
    assert ">eps</text>" in (tmp_path / "a.svg").read_text()


@pytest.mark.parametrize(
    "text", ["eps", "eps=1..2", "eps=0..1:3", "eps=1..1:3", "eps=a..b:3", "eps=1e-3..1:1", "eps=1..2:1000"]
)
def test_a_sweep_that_is_none_is_refused(rayproof: Rayproof, text: str) -> None:
    ended = rayproof("stability", "sphere=./mine.py:hit", "--sweep", text)

    assert (ended.code, ended.error.count("\n")) == (2, 1)
    assert "--sweep must read" in ended.error
