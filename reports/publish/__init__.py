"""The table of publishers, which write files from a results folder. They neither render nor judge.

To add a publisher, write a function `(folder, results) -> list[Path]` in a new file, and add a line to the table. The
function reads `results` (see docs/results.md) and files in `folder`, writes only into `folder`, each file through
`reports.results.files`, and returns the written paths. Names, paths and messages in `results` are hostile input. Each
file must contain the warnings of `reports.results.headline.shouts` in its first line.
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
    """Write every publication of the results folder again and return the written paths.

    `results` is the return value of `load_results`, if the caller has it: loading takes as long as most publishers. The
    worst cases get a `thumbnail`, which publishers may link.

    Raises:
        ResultsError: results.json is missing or does not have the format of docs/results.md.

    """
    from rayproof.reports.publish.page.thumbnails import draw_thumbnails
    from rayproof.reports.results.document import load_results

    if results is None:
        results = load_results(folder)
    drawn = draw_thumbnails(folder, results)
    return drawn + [path for name in PUBLISHERS for path in PUBLISHERS[name](folder, results)]
