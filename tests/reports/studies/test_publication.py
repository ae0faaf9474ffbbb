"""Figures and tables for a paper: text that stays text, captions, sizes; and the same numbers give the same bytes."""

import csv
import re
import zlib
from pathlib import Path

import pytest

from rayproof.reports.studies.publication import Paper, draw, latex_text, markdown_cell, write_table
from tests.reports.commands.conftest import Rayproof


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


@pytest.mark.parametrize(
    "text", ["eps", "eps=1..2", "eps=0..1:3", "eps=1..1:3", "eps=a..b:3", "eps=1e-3..1:1", "eps=1..2:1000"]
)
def test_a_sweep_that_is_none_is_refused(rayproof: Rayproof, text: str) -> None:
    ended = rayproof("stability", "sphere=./mine.py:hit", "--sweep", text)

    assert (ended.code, ended.error.count("\n")) == (2, 1)
    assert "--sweep must read" in ended.error
