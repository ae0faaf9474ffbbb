"""report.html: the whole report in one file, to be mailed or kept where only files are.

What lies beside index.html stands in the page as elements that no browser runs or shows, as it is compressed already
or deflated here, and is inflated when it is opened. The policy names every script by its hash and no place at all:
neither the network nor the disk. The 3-D viewer is there once, and each open view is a frame of its own.
"""

import base64
import html
from collections.abc import Iterator, Sequence
from pathlib import Path

from rayproof.reports.publish.page.case_data import has_view, picture_of, thumbnail_of
from rayproof.reports.publish.page.front_data import SHARD, Front, data_file, rows_file
from rayproof.reports.publish.page.history import DATA as HISTORY
from rayproof.reports.publish.page.page import PageData, digest, page_data, page_parts
from rayproof.reports.publish.page.plots import FOLDER, LIBRARY
from rayproof.reports.publish.page.plots import pages as plots
from rayproof.reports.publish.page.viewer_page import digests_in_one, page_in_one, vendored
from rayproof.reports.results.atomic import replacing
from rayproof.reports.results.case_table import briefs
from rayproof.reports.results.float_codec import pack_text
from rayproof.reports.results.headline import worst_first
from rayproof.reports.results.image_script import handed_over
from rayproof.reports.results.images import inside
from rayproof.reports.results.records import CaseRecord, RunRecord

NAME = "report.html"


def write_single_file(folder: Path, results: RunRecord) -> Path:
    """Write `folder`/report.html from what `publish_all` wrote into `folder`, and return its path."""
    scripts, styles = digests_in_one()
    # Drawings by `rayproof tradeoff` and their page are files beside; the page of plots has all of their points.
    ordered, front = worst_first(results["cases"]), Front(folder, results)
    for number, case in enumerate(ordered, start=1):
        front.add(case)
        if front.long and (number % SHARD == 0 or number == len(ordered)):
            front.handed_over(number)  # they are in a script, too
    data: PageData = {**page_data(folder, results, front), "alone": True, "tradeoff": []}
    head, tail = page_parts(results, data, alone=True, digests=([*scripts, digest(vendored(LIBRARY))], styles))
    path = folder / NAME
    with replacing(path) as draft, draft.open("w", encoding="utf-8", errors="replace", newline="\n") as file:
        file.write(head)
        for element in _elements(folder, ordered, long=front.long):
            file.write(element)
        file.write(tail)
    return path


def _elements(folder: Path, ordered: Sequence[CaseRecord], *, long: bool) -> Iterator[str]:
    viewed = False
    for number, case in enumerate(briefs(ordered), start=1):
        if long and number % SHARD == 1:
            yield from _script(folder, rows_file(number))
        record, kept = data_file(number, long=long), case.get("pixels")
        written = record.replace(".js", ".pixels.js")
        for name in (record, kept if isinstance(kept, str) and inside(folder, kept) else written):
            yield from _script(folder, name)
        viewed = viewed or has_view(folder, case)
        for picture in filter(None, (picture_of(folder, case), thumbnail_of(folder, case))):
            content = base64.b64encode((folder / picture).read_bytes()).decode("ascii")
            yield _element(picture, content, 'type="text/plain" data-type="image/png"')
    for name in (*plots(folder).values(), HISTORY):
        yield from _script(folder, name)
    if plots(folder):
        yield _deflated(f"{FOLDER}/{LIBRARY}", vendored(LIBRARY))
    if viewed:
        yield _deflated("viewer/index.html", page_in_one())


def _script(folder: Path, name: str) -> Iterator[str]:
    """Yield what a script that `reports.results.image_script.script` made hands over, where there is such a file."""
    if inside(folder, name):
        content = handed_over((folder / name).read_text(encoding="utf-8"))
        yield _element(name, content, 'type="application/json"')


def _deflated(name: str, text: str) -> str:
    return _element(name, pack_text(text), 'type="text/plain"')


def _element(name: str, content: str, attributes: str) -> str:
    return f'<script {attributes} data-path="{html.escape(name)}">{content}</script>\n'
