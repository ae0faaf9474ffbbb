"""The table of publishers, which make files from a results folder. They render and judge nothing.

To add a publisher: a function `(folder, results) -> list[Path]` in a new file, and a line in the table. It
reads `results` (see docs/results.md) and what lies below `folder`, writes below `folder` only, each file through
`reports.results.files`, and returns what it wrote. Names, paths and messages in `results` are hostile input. What
`reports.results.headline.shouts` returns stands on the first line of everything written.
"""

from collections.abc import Callable
from pathlib import Path

from rayproof.cases.registry import Entry, Table
from rayproof.reports.results.records import RunRecord

Publisher = Callable[[Path, RunRecord], list[Path]]

PUBLISHERS: Table[Publisher] = Table(
    "publisher",
    package="rayproof.reports.publish",
    entries={
        "annotations": Entry("summaries:publish_annotations"),
        "badge": Entry("summaries:publish_badge"),
        "history": Entry("page.comparisons:publish"),
        "html": Entry("page.page:publish"),
        "junit": Entry("junit:publish_junit"),
        "plots": Entry("page.plots:publish"),
        "summary": Entry("summaries:publish_summary"),
        "viewer": Entry("page.case_data:publish_viewer"),
    },
)


def publish_all(folder: Path, results: RunRecord | None = None) -> list[Path]:
    """Write every publication of the results folder anew and return the paths written.

    `results` are what `load_results` gave, where that was asked already: reading them takes as long as most publishers.
    Worst cases get a `thumbnail`, which publishers may point to.

    Raises:
        ResultsError: results.json is missing or not what docs/results.md describes.

    """
    from rayproof.reports.publish.page.thumbnails import draw_thumbnails
    from rayproof.reports.results.document import load_results

    if results is None:
        results = load_results(folder)
    drawn = draw_thumbnails(folder, results)
    return drawn + [path for name in PUBLISHERS for path in PUBLISHERS[name](folder, results)]
