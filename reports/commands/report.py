"""`rayproof report`: publish a run again, compare two runs, reproduce results, or compare images; renders nothing."""

from pathlib import Path

from cyclopts import App

from rayproof.reports.commands.output import say, shout, show_table, write_json
from rayproof.reports.commands.usage import UsageError, own, told_in_one_line, writable_folder
from rayproof.reports.results.files import several
from rayproof.reports.results.records import ComparisonRowRecord, RunRecord
from rayproof.reports.studies.stability.limit_records import changes, load_limits, place_of

NOT_MEASURED = 3
FEW = 12  # names in a line
MOST = 40  # rows of a table in the terminal; the report and the JSON contain all
app = App(name="report")
app.command("rayproof.reports.commands.history:history", help="Show error and time of each case over the kept runs.")


@app.default
def report(
    folder: Path,
    other: Path | None = None,
    *,
    out: Path | None = None,
    single_file: bool = False,
    all: bool = False,
    draw: str | None = None,
    pictures: Path | None = None,
    case: str | None = None,
    figures: bool = False,
    json: Path | None = None,
) -> int:
    """Publish a results folder again, without rendering, or show the changes between two runs.

    For example: rayproof report before after --out changes

    Parameters
    ----------
    folder
        A folder that `rayproof run --out` filled.
    other
        The folder of a later run: show the changes between the two runs, with the images of both. If both folders or
        files contain limits of renderers, from `rayproof limits`, compare these limits instead.
    out
        With two runs: the folder for the report of the changes. Default: only a table is printed.
    single_file
        Also write report.html: the report in one file of at most 8 MB, with the failing cases and the worst ten cases.
    all
        With --single-file: include every case, whatever the size of the file.
    draw
        First draw the stills of these cases: a case's name, worst:N, or all. A run draws the stills of at most 100
        failing cases, and of the worst twelve.
    pictures
        Also save pictures of the report in this folder; needs Chromium and Playwright.
    case
        The case that the pictures show. Default: the worst case.
    figures
        Also write the report as a single file, and print the size and the opening time of both; needs Chromium and
        Playwright.
    json
        With two runs: also write the changes to this file.

    """
    if other is not None:
        if pictures is not None or figures or draw is not None:
            raise UsageError("--draw, --pictures and --figures need one folder, got two")
        return report_between(folder, other, out, single_file=single_file, json=json)
    if all and not single_file:
        raise UsageError("--all needs --single-file")
    if out is not None or json is not None:
        raise UsageError("--out and --json need the folders of two runs, got one")
    from rayproof.reports.publish import publish_all
    from rayproof.reports.results.document import load_results
    from rayproof.reports.results.headline import shouts

    with told_in_one_line():
        results = load_results(folder)
        own(folder)
        if pictures is not None:
            writable_folder(pictures)
    for line in shouts(results):
        say(line)
    if draw is not None:
        draw_cases(folder, results, draw)
    publish_all(folder, results)
    say(f"report: {folder / 'index.html'}")
    write_one_file(folder, results, asked=single_file or figures, everything=all)
    if pictures is not None or figures:
        look(folder, results, pictures, case, figures=figures)
    return 0


@app.command
def reproduce(folder: Path, *, trust: bool = False) -> int:
    """Print the command, code and inputs from which the results in a folder were made.

    Parameters
    ----------
    folder
        A folder that a command filled.
    trust
        Run the command again with the inputs in the folder, and print the differences; the exit code is 1 if there are
        any. This executes the formulas in that folder.

    """
    from rayproof.reports.results import provenance

    with told_in_one_line():
        kinds = provenance.kinds(folder)
        if not kinds:
            raise LookupError(f"{folder}: it does not hold where its results come from ({provenance.FOLDER}/)")
        records = {kind: provenance.load(folder, kind) for kind in kinds}
    different = False
    for kind, record in records.items():
        say(f"{kind}: {provenance.command(record)}")
        say(f"  made by {provenance.caption(record)}")
        say(f"  here is {provenance.caption(provenance.origin(record['seed']))}")
        for name, digest in {**record["files"], **record["left_out"]}.items():
            say(f"  {digest}  {name}{'' if name in record['files'] else ' (too large, not kept)'}")
        say(f"  {record['result'] or provenance.digest_of(provenance.essence(folder, kind))}  result")
        if record["program"]:
            say("  the program under test is not kept; it is called as it is here")
        if trust:
            different |= not made_again(folder, kind)
    return 1 if different else 0


def made_again(folder: Path, kind: str) -> bool:
    """Run a command again and print the differences; return whether the results are equal within their limits."""
    from tempfile import TemporaryDirectory

    from rayproof.reports.results import provenance

    with TemporaryDirectory(prefix="rayproof-again-") as temporary:
        with told_in_one_line():
            words, paths = provenance.again(folder, kind, Path(temporary) / "out")
            before = provenance.essence(folder, kind)
        code = provenance.run_again(words)
        try:
            after = provenance.essence(Path(temporary) / "out", kind)
        except (OSError, ValueError, LookupError) as error:
            say(f"{kind}: made again, it ended with {code} and without a result: {error}")
            return False
    equal, lines = provenance.differences(before, provenance.renamed(after, paths))
    if equal or not lines:
        say(f"{kind}: {'equal' if equal else 'equal within the limits of its numbers'}, {len(before)} results")
        return True
    say(f"{kind}: {len(lines)} of {len(before)} results differ")
    for line in lines[:FEW]:
        say(f"  {line}")
    if len(lines) > FEW:
        say(f"  and {len(lines) - FEW} more")
    return False


def draw_cases(folder: Path, results: RunRecord, which: str) -> None:
    """Draw stills of the cases that `which` names, and write their paths into the results of the folder."""
    from rayproof.reports.publish.scene3d.stills import chosen, draw_stills
    from rayproof.reports.results.document import save_results

    with told_in_one_line():
        cases = chosen(results["cases"], which)
    count, why = draw_stills(folder, results["cases"], cases)
    results.setdefault("environment", {})["pictures"] = why or "drawn"
    save_results(folder, results)
    say(f"drawn: {count} of {len(cases)} cases{f'; {why}' if why else ''}")


def look(folder: Path, results: RunRecord, pictures: Path | None, case: str | None, *, figures: bool) -> None:
    """Open a published report in Chromium, to save pictures of it or to measure the time that it takes to open."""
    from rayproof.reports.publish.browser import figures as measured
    from rayproof.reports.publish.browser import missing, take_pictures

    with told_in_one_line():
        if case is not None and all(record["name"] != case for record in results["cases"]):
            raise LookupError(f"{folder} has no case called {case}")
        if (why := missing()) is not None:
            raise LookupError(why)
    if pictures is not None:
        for path in take_pictures(folder, results, pictures, case=case):
            say(f"picture: {path} ({path.stat().st_size / 1e3:.0f} kB)")
    if figures:
        show_table(str(folder), ["", "folder", "single file"], measured(folder, results))


def write_one_file(folder: Path, results: RunRecord | None = None, *, asked: bool, everything: bool = False) -> None:
    """Write the report of a published results folder as a single file, and print its path and size [MB].

    If not `asked`, write it only if there is an earlier single file, which would otherwise show another run.
    """
    from rayproof.reports.publish.page.page import NAME, write_single_file
    from rayproof.reports.results.document import load_results

    if not (asked or (folder / NAME).is_file()):
        return
    path = write_single_file(folder, load_results(folder) if results is None else results, everything=everything)
    say(f"single file: {path} ({path.stat().st_size / 1e6:.1f} MB)")


def report_between(before: Path, after: Path, out: Path | None, *, single_file: bool, json: Path | None) -> int:
    """Print the changes between two runs, and publish a report of them if `out` is a folder; return the exit code."""
    if place_of(before).is_file() and place_of(after).is_file():
        return limits_between(before, after, json)
    from rayproof.reports.history.run_difference import comparison, moved, names_of, sentence
    from rayproof.reports.publish import publish_all
    from rayproof.reports.results.document import load_results

    if single_file and out is None:
        raise UsageError("--single-file needs --out, the folder for the report of both runs")
    with told_in_one_line():
        runs = (load_results(before), load_results(after))
        record = comparison(*runs, names_of(before, after))
        if out is not None and out.resolve() in (before.resolve(), after.resolve()):
            raise UsageError(f"--out {out} is the folder of one of the two runs; name another folder")
        if out is not None:
            own(out)
        if json is not None:
            writable_folder(json.parent)
    shout(record["faults"])
    if out is not None:
        from rayproof.reports.history.image_difference import write_folder

        write_folder(out, (before, after), runs, record)
        publish_all(out)
    rows = [row for row in record["rows"] if moved(row)]
    if rows:
        columns = ["case", "verdict", "largest change of error / limit", "pixels that differ", "time [s]"]
        show_table(f"{before} -> {after}", columns, [_cells(row) for row in rows[:MOST]])
    if len(rows) > MOST:
        say(f"and {len(rows) - MOST} more")
    for word in ("appeared", "vanished"):
        if record[word]:
            named = ", ".join(f"{name} ({verdict})" for name, verdict in record[word][:FEW])
            say(f"{len(record[word])} {word}: {named}{', ...' if len(record[word]) > FEW else ''}")
    say(record.get("sentence") or sentence(record))
    write_json(json, record)
    if out is not None:
        say(f"report: {out / 'index.html'}")
        write_one_file(out, asked=single_file)
    return 0


def limits_between(before: Path, after: Path, json: Path | None) -> int:
    """Print the changes between two records of `rayproof limits`, each a folder or file; return the exit code."""
    with told_in_one_line():
        changed = changes(load_limits(before), load_limits(after))
        if json is not None:
            writable_folder(json.parent)
    rows = [[row.ladder, row.quantity, row.unit, row.before, row.after, row.rungs] for row in changed]
    show_table("right up to", ["ladder", "what grows", "unit", str(before), str(after), "rungs"], rows)
    lower, higher = (sum(sign * row.rungs > 0 for row in changed) for sign in (-1, 1))
    say(f"{several(len(changed), 'limit')}: {higher} higher and {lower} lower in {after}")
    write_json(json, changed)
    return 0


def _cells(row: ComparisonRowRecord) -> list[str]:
    worst, (before, after, quotient) = row["worst"], row["seconds"]
    verdict = row["after"] if row["before"] == row["after"] else f"{row['before']} -> {row['after']}"
    change = "-"
    if worst is not None and worst["before"] is not None and worst["after"] is not None and row["decades"] > 0:
        place = f"{worst['stage']} {worst['configuration']} {worst['reference']}"
        change = f"{place}: {worst['before'][1]:.3g} -> {worst['after'][1]:.3g}"
    pixels = row.get("pixels")
    time = "-" if quotient is None else f"{before:.3g} -> {after:.3g}"
    return [row["case"], verdict, change, "-" if pixels is None else str(pixels), time]


@app.command
def view(*images: Path, out: Path = Path("view.html")) -> int:
    """Write an HTML page that compares images side by side, swiped, flickering or blended, and shows their differences.

    More files can be opened in the page, or dropped into it.

    Parameters
    ----------
    images
        EXR (every layer), PFM or PNG files. Without any, the page is empty, and files can be dropped into it.
    out
        The file to write, ending in .html.

    """
    if out.suffix.lower() not in (".html", ".htm"):
        raise UsageError(f"--out must end in .html, got {out}")
    from rayproof.reports.publish.page.image_page import read_image, write_page

    with told_in_one_line():
        read = [(str(path), read_image(path)) for path in images]
        writable_folder(out.parent)
        write_page(out, read)
    say(f"{out}: {', '.join(map(str, images)) or 'nothing yet; drop files into it'}")
    return 0
