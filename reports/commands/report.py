"""`rayproof report`: publish a results folder again, so that a new page costs no rendering."""

from pathlib import Path

from reports.commands.output import say
from reports.commands.usage import told_in_one_line, writable_folder


def report(folder: Path, *, single_file: bool = False) -> int:
    """Publish a results folder again, without rendering.

    Parameters
    ----------
    folder
        A folder that `rayproof run --out` filled.
    single_file
        Also write report.html: the whole report in one file.

    """
    from reports.publish import publish_all
    from reports.publish.headline import shouts
    from reports.publish.results import load_results

    with told_in_one_line():
        results = load_results(folder)
        writable_folder(folder)
    for line in shouts(results):
        say(line)
    publish_all(folder)
    say(f"report: {folder / 'index.html'}")
    if single_file:
        write_one_file(folder)
    return 0


def write_one_file(folder: Path) -> None:
    """Write the report of a published results folder as one file, and say where and how large it is."""
    from reports.publish.results import load_results
    from reports.publish.single_file import write_single_file

    path = write_single_file(folder, load_results(folder))
    say(f"single file: {path} ({path.stat().st_size / 1e6:.1f} MB)")
