"""`rayproof report`: publish a results folder again, so that a new page costs no rendering."""

from pathlib import Path

from reports.commands.output import say
from reports.commands.usage import told_in_one_line, writable_folder


def report(folder: Path) -> int:
    """Publish a results folder again, without rendering.

    Parameters
    ----------
    folder
        A folder that `rayproof run --out` filled.

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
    return 0
