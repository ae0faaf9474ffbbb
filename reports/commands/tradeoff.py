"""`rayproof tradeoff`: error against run time, as work-precision diagrams in JSON, SVG and HTML."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from rayproof.reports.commands.lookup import formulas_among, scene_files
from rayproof.reports.commands.output import console, say, show_table, write_json
from rayproof.reports.commands.usage import own, told_in_one_line, writable_folder
from rayproof.reports.results.files import several
from rayproof.reports.results.provenance import caption, keep
from rayproof.reports.studies.publication import MOST_PANELS, Paper, chosen, draw, write_table

COLUMNS = ("diagram", "point", "time [ns]", "time interval", "error", "error interval", "wrong", "on the front")
FITS = ("diagram", "point", "time [ns]", "error", "wrong")  # fit into an article's text
REPETITIONS, QUICK_REPETITIONS = 13, 9  # with fewer than 9, the only interval of the median is the whole range


def tradeoff(
    *selectors: str,
    out: Path = Path("report"),
    json: Path | None = None,
    quick: bool = False,
    paper: Annotated[Paper, Parameter(name="*")] = Paper(),  # noqa: B008  frozen
) -> int:
    """Measure error against run time and draw work-precision diagrams.

    For example: rayproof tradeoff sphere SPH-FAR

    Parameters
    ----------
    selectors
        Formulas, as for stability: a slot such as sphere, a formula such as sphere/textbook, a pattern such as
        "sphere/*", or a function of your own, such as sphere=./mine.py:nearest_hit; only these and the defaults of
        their slots are drawn. Scenes, as for compare: families, cases, stresses or scene files. Ladders, or `ladders`
        for all. Default: scenes and ladders on which formulas differ, and a few ordinary ones.
    out
        The diagrams are written to OUT/tradeoff. `rayproof report OUT` adds them to a run's report.
    json
        Also write tradeoff.json to this file.
    quick
        Repeat measurements less often, and draw one diagram of each kind unless scenes or ladders are named.

    """
    from rayproof.tracer.kernel.compiler import choose_packaged_llvm

    choose_packaged_llvm()
    from rayproof.reports.studies.tradeoff.diagrams import DEFAULT, QUICK, measure, tasks
    from rayproof.reports.studies.tradeoff.drawing import cells, paper_rows, write
    from rayproof.reports.studies.tradeoff.points import without_error

    with told_in_one_line():
        named, others = formulas_among(selectors)
    patterns, files = scene_files(others or (QUICK if quick else DEFAULT))
    with told_in_one_line():
        planned = tasks(patterns, named, files)
        paper.check()
        chosen(paper, COLUMNS)
        own(out / "tradeoff")
        if json is not None:
            writable_folder(json.parent)
    with console().status("measuring") as status:
        repetitions = QUICK_REPETITIONS if quick else REPETITIONS
        result = measure(*planned, repetitions=repetitions, tell=status.update, named=named)
    written = write(out, result)
    keep(out, "tradeoff", result["origin"]["seed"])
    write_json(json, result)
    rows = [[diagram["name"], len(diagram["points"]), "; ".join(diagram["front"])] for diagram in result["diagrams"]]
    show_table("Pareto fronts, from the fastest to the most accurate", ("diagram", "points", "front"), rows)
    diagrams = result["diagrams"]
    if paper.figure is not None and len(diagrams) > MOST_PANELS:
        say(f"--figure shows the first {MOST_PANELS} of {len(diagrams)} diagrams")
    about = f"{', '.join(diagram['name'] for diagram in diagrams[:MOST_PANELS])}. {caption(result['origin'])}."
    points = [
        [diagram["name"], *cells(point), "yes" if point["front"] else ""]
        for diagram in diagrams
        for point in diagram["points"]
    ]
    write_table(paper, COLUMNS, points, caption=about, fits=FITS)
    for diagram in diagrams:
        if lost := [f"{point['label']} ({why})" for point in diagram["points"] if (why := without_error(point))]:
            say(f"{diagram['name']}: without an error, drawn at the upper edge: {'; '.join(lost)}")
    draw(paper, paper_rows(diagrams[:MOST_PANELS]), caption=about, height=0.5 * paper.width)
    say(f"{written[-1]}: {several(len(result['diagrams']), 'diagram')}, {result['seconds']:.0f} s")
    return 0
