"""index.html and the single file report.html: scripts, styles and security policy put together.

Browsers refuse fetch() and module scripts on file://, so the page's scripts are inlined in order, and a case's data is
a script that the page adds when the case is opened. The content-security policy allows the inlined script and style by
hash: no request leaves the folder, and markup in a scene's name could not run even if it were not escaped.

In report.html the other files of the report are elements that no browser runs or shows; they are inflated when they are
opened. Its policy allows every script by its hash, and neither the network nor the disk. It contains the 3-D viewer
once, and each open view is a separate frame.
"""

import base64
import hashlib
import html
import math
import re
import shutil
from collections.abc import Iterator, Sequence
from importlib.resources import files
from pathlib import Path
from typing import Any

import msgspec

from rayproof.reports.publish.page.case_data import (
    digests_in_one,
    has_view,
    page_in_one,
    picture_of,
    thumbnail_of,
    vendored,
    write_case_data,
    writers,
)
from rayproof.reports.publish.page.comparisons import DATA as HISTORY
from rayproof.reports.publish.page.comparisons import (
    comparison_front,
    contest,
    history_front,
)
from rayproof.reports.publish.page.front import SHARD, Front, data_file, findings, rows_file
from rayproof.reports.publish.page.plots import FOLDER, LIBRARY, pages, write_times
from rayproof.reports.publish.page.plots import pages as plots
from rayproof.reports.publish.page.previews import preview_of
from rayproof.reports.publish.scene3d.parts import look
from rayproof.reports.results.case_records import CaseRecord
from rayproof.reports.results.case_table import briefs
from rayproof.reports.results.files import replacing, write_text
from rayproof.reports.results.float_codec import pack_json, pack_text
from rayproof.reports.results.headline import BAD, headline, shouts, standing, worst_first
from rayproof.reports.results.images import handed_over, inert, inside, script
from rayproof.reports.results.outcomes import Outcome
from rayproof.reports.results.records import RunRecord

# Each script depends only on earlier ones.
SCRIPTS = (
    "elements", "address", "floats", "records", "paint", "metrics", "front",
    "plot", "stability", "checks", "terms", "history", "cases", "pane", "viewer", "stage_view", "scene",
    "case", "start",
)  # fmt: skip

STYLES = ("style", "cases", "viewer", "scene", "pages", "history", "comparison")

_HEAD = """<!doctype html><!--{shout}-->
<html lang="en">
<head>
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" content="{policy}">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="color-scheme" content="light dark">
<meta name="referrer" content="no-referrer">
<link rel="icon" href="data:,">
<title>{title}</title>
<style>{style}</style>
</head>
<body>
<noscript><p>{shout}</p><p>{headline}</p><p>The report needs JavaScript; summary.md has the totals.</p></noscript>
<div id="app"></div>
<script type="application/json" id="results">{data}</script>
"""

_TAIL = """<script>{script}</script>
</body>
</html>
"""
# Files of `rayproof tradeoff`; other files in its folder are ignored.
DIAGRAM = re.compile(r"[A-Za-z0-9_.-]+\.svg")


def diagrams(folder: Path) -> list[str]:
    """Return the names of the diagrams in `folder`/tradeoff, overall ones first; none if their page is missing."""
    place = folder / "tradeoff"
    if not (place / "index.html").is_file():
        return []
    names = sorted(path.name for path in place.glob("*.svg") if DIAGRAM.fullmatch(path.name))
    return sorted(names, key=lambda name: not name.endswith("-overall.svg"))


def publish(folder: Path, results: RunRecord) -> list[Path]:
    """Write index.html and data/*.js, for a long run data/NNN/*.js; return paths, for a long run without the cases'."""
    front = Front(folder, results)
    written = list(_write_all(folder, results, front))
    written += write_times(folder, front.times)
    head, tail = page_parts(results, page_data(folder, results, front))
    return [write_text(folder / "index.html", head + tail), *written]


def page_data(folder: Path, results: RunRecord, front: Front) -> dict[str, Any]:
    """Return the data of a run that are in the page itself; `front` contains its cases, the worst first."""
    return {
        **front.data,
        "tradeoff": diagrams(folder),  # names of drawings
        "plots": pages(folder),  # page -> the script with its data
        "findings": findings(results),
        "history": history_front(results),
        "comparison": comparison_front(results),
        "contest": contest(folder),
        "look": msgspec.to_builtins(look()),  # how scenes look in 3-D
    }


def page_parts(
    results: RunRecord, data: dict[str, Any], *, alone: bool = False, digests: Sequence[Sequence[str]] = ((), ())
) -> tuple[str, str]:
    """Return the page before and after the elements with the other files, which a page that is `alone` contains.

    `digests` are the hashes of additional scripts and of additional styles that the policy allows.
    """
    style = "\n".join(_asset(f"{name}.css") for name in STYLES)
    script = "\n".join(_asset(f"{name}.js") for name in SCRIPTS)
    loud = " ".join(shouts(results))
    head = _HEAD.format(
        shout=html.escape(loud).replace("--", "&#45;&#45;"),
        policy=html.escape(policy([digest(script), *digests[0]], [digest(style), *digests[1]], alone=alone)),
        title=html.escape(f"{'! ' if loud else ''}rayproof: {standing(results)}"),
        headline=html.escape(headline(results)),
        style=style,
        data=script_safe(data),
    )
    return head, _TAIL.format(script=script)


def _write_all(folder: Path, results: RunRecord, front: Front) -> Iterator[Path]:
    """Write every case's data and add it to the front page; yield the written paths, for a long run only of the rows.

    Images are not written for cases with `pixels` in their record, because the run has written them.
    """
    cases = worst_first(results["cases"])
    heavy = sum(1 for case in briefs(cases) if not case.get("pixels"))
    kept: set[Path] = set()  # files in the folder that is being written
    with writers(heavy) as written:
        for place, paths in enumerate(written(write_case_data, _jobs(folder, cases, front)), start=1):
            kept |= set(paths)
            if not front.long:
                yield from paths
            elif place % SHARD == 0 or place == len(cases):
                path = folder / rows_file(place)
                rows = front.handed_over(place)
                yield write_text(path, script(rows_file(place), pack_json(rows)))
                _remove(set(path.parent.glob("[0-9][0-9][0-9][0-9]*.js")) - kept)
                kept = set()
    # Remove data of an earlier publication with more cases.
    _remove(set((folder / "data").glob("[0-9][0-9][0-9][0-9]*.js")) - kept)
    shards = -(-len(cases) // SHARD) if front.long else 0
    for shard in (folder / "data").glob("[0-9][0-9][0-9]"):
        if int(shard.name) >= shards:
            shutil.rmtree(shard)


def _jobs(folder: Path, cases: Sequence[CaseRecord], front: Front) -> Iterator[tuple[Path, Path, CaseRecord]]:
    for place, case in enumerate(cases, start=1):
        front.add(case)
        yield folder, folder / data_file(place, long=front.long), case


def _remove(stale: set[Path]) -> None:
    for path in stale:
        path.unlink()


def policy(scripts: Sequence[str], styles: Sequence[str], *, alone: bool = False) -> str:
    """Return a content-security policy that allows texts with these hashes and, unless `alone`, files of this folder.

    Plotly makes an empty style sheet and fills it rule by rule, which needs the hash of the empty string.
    """
    beside = "" if alone else " 'self' file:"
    frames = beside or " 'none'"
    return (
        f"default-src 'none'; script-src{beside} {_quoted(scripts)}; style-src {_quoted([*styles, digest('')])}; "
        f"img-src{beside} data: blob:; frame-src{frames}; base-uri 'none'; form-action 'none'"
    )


def script_safe(data: Any) -> str:
    """Return JSON that is safe inside a script element for any strings in it."""
    return inert(data)


def digest(text: str) -> str:
    """Return the hash of a script or a style in the format of a policy."""
    return "sha256-" + base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()


def _quoted(digests: Sequence[str]) -> str:
    return " ".join(f"'{hashed}'" for hashed in digests)


def _asset(name: str) -> str:
    return files("rayproof.reports.publish.page").joinpath("html", name).read_text(encoding="utf-8")


NAME = "report.html"


MOST_BYTES = 8_000_000  # of a single file, unless `everything` is requested
WORST = 10  # worst cases in the single file, also if they do not fail


def write_single_file(folder: Path, results: RunRecord, *, everything: bool = False) -> Path:
    """Write `folder`/report.html from the files of `publish_all` in `folder`, and return its path.

    It lists all cases, and contains the data of failing cases and of the worst ones, up to `MOST_BYTES`.
    """
    scripts, styles = digests_in_one()
    # Diagrams of `rayproof tradeoff` and their page are omitted; the page of plots contains all of their points.
    ordered, front = worst_first(results["cases"]), Front(folder, results)
    for number, case in enumerate(ordered, start=1):
        front.add(case)
        if front.long and (number % SHARD == 0 or number == len(ordered)):
            front.handed_over(number)  # drops the rows, which are also in a script
    beside = [*_beside(folder, ordered, long=front.long)]
    room = math.inf if everything else MOST_BYTES - sum(map(len, beside)) - 600_000
    held, elements = _held(folder, ordered, long=front.long, room=room, everything=everything)
    data: dict[str, Any] = {**page_data(folder, results, front), "alone": True, "tradeoff": []}
    for row in data.get("cases", []):
        if row["name"] not in held:
            row.pop("thumbnail", None)
    head, tail = page_parts(results, data, alone=True, digests=([*scripts, digest(vendored(LIBRARY))], styles))
    path = folder / NAME
    with replacing(path) as draft, draft.open("w", encoding="utf-8", errors="replace", newline="\n") as file:
        file.write(head)
        file.writelines(beside)
        file.writelines(elements)
        file.write(tail)
    return path


def _held(
    folder: Path, ordered: Sequence[CaseRecord], *, long: bool, room: float, everything: bool
) -> tuple[set[str], list[str]]:
    """Return names and HTML elements of the cases in a single-file report: failing cases, and the worst others."""
    names: set[str] = set()
    elements: list[str] = []
    for number, case in enumerate(briefs(ordered), start=1):
        if not everything and Outcome(case["verdict"]) not in BAD and number > WORST:
            break  # later cases are better
        own = [*_of_case(folder, case, data_file(number, long=long))]
        room -= sum(map(len, own))
        if room < 0:
            break
        names.add(case["name"])
        elements += own
    return names, elements


def _of_case(folder: Path, case: CaseRecord, record: str) -> Iterator[str]:
    kept, written = case.get("pixels"), record.replace(".js", ".pixels.js")
    for name in (record, kept if isinstance(kept, str) and inside(folder, kept) else written):
        yield from _script(folder, name)
    for picture in filter(None, (picture_of(folder, case), thumbnail_of(folder, case), preview_of(folder, case))):
        content = base64.b64encode((folder / picture).read_bytes()).decode("ascii")
        yield _element(picture, content, 'type="text/plain" data-type="image/png"')


def _beside(folder: Path, ordered: Sequence[CaseRecord], *, long: bool) -> Iterator[str]:
    """Yield the elements that belong to no case: the rows of a long list, plots, history, and the 3-D viewer."""
    for number in range(1, len(ordered) + 1, SHARD) if long else ():
        yield from _script(folder, rows_file(number))
    viewed = any(has_view(folder, case) for case in briefs(ordered))
    for name in (*plots(folder).values(), HISTORY):
        yield from _script(folder, name)
    if plots(folder):
        yield _deflated(f"{FOLDER}/{LIBRARY}", vendored(LIBRARY))
    if viewed:
        yield _deflated("viewer/index.html", page_in_one())


def _script(folder: Path, name: str) -> Iterator[str]:
    """Yield an element with the data of a script by `reports.results.images.script`, if the file exists."""
    if inside(folder, name):
        content = handed_over((folder / name).read_text(encoding="utf-8"))
        yield _element(name, content, 'type="application/json"')


def _deflated(name: str, text: str) -> str:
    return _element(name, pack_text(text), 'type="text/plain"')


def _element(name: str, content: str, attributes: str) -> str:
    return f'<script {attributes} data-path="{html.escape(name)}">{content}</script>\n'
