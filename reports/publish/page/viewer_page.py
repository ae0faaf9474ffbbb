"""viewer/: one page for the 3-D views of all cases, with vtk.js's viewer beside it, opened in a frame of the report.

It has a policy of its own: its script and style by hash, the vendored viewer from its own folder, and nothing else.
"""

import base64
import hashlib
import html
from importlib.resources import files
from pathlib import Path

from rayproof.reports.publish.page.case_data import has_view
from rayproof.reports.results.atomic import write_text
from rayproof.reports.results.case_table import briefs
from rayproof.reports.results.records import RunRecord

# In the order in which they build on each other: the report's own, then the viewer's.
SHARED, SCRIPTS = ("elements", "colors"), ("view3d",)
LIBRARY = "vtk-viewer.js"


def publish(folder: Path, results: RunRecord) -> list[Path]:
    """Write viewer/index.html and the library, where the scene of any case is kept."""
    if not any(has_view(folder, case) for case in briefs(results["cases"])):
        return []
    return [
        write_text(folder / "viewer" / "index.html", page()),
        write_text(folder / "viewer" / LIBRARY, vendored(LIBRARY)),
    ]


def page() -> str:
    """Return the page, which expects the library beside itself."""
    return _page(f'<script src="{LIBRARY}"></script>', "'self' file:")


def page_in_one() -> str:
    """Return the page with the library in it, for a frame of a report that is a single file.

    Such a frame is under the report's policy, too, which must name `digests_in_one`.
    """
    library = vendored(LIBRARY)
    return _page(f"<script>{library}</script>", f"'{_digest(library)}'")


def digests_in_one() -> tuple[list[str], list[str]]:
    """Return the hashes of the scripts and of the styles of `page_in_one`, as a policy names them."""
    return [_digest(vendored(LIBRARY)), _digest(viewer_script())], [_digest(_text("scene3d", "viewer", "style.css"))]


def _page(library: str, sources: str) -> str:
    script, style = viewer_script(), _text("scene3d", "viewer", "style.css")
    policy = (
        f"default-src 'none'; script-src {sources} '{_digest(script)}'; style-src '{_digest(style)}'; "
        "img-src data: blob:; base-uri 'none'; form-action 'none'"
    )
    template = _text("scene3d", "viewer", "page.html")
    return template.format(policy=html.escape(policy), style=style, library=library, script=script)


def viewer_script() -> str:
    """Return the page's own script."""
    shared = (_text("page", "html", f"{name}.js") for name in SHARED)
    return "\n".join([*shared, *(_text("scene3d", "viewer", f"{name}.js") for name in SCRIPTS)])


def vendored(name: str) -> str:
    """Return a vendored library's text."""
    return _text("vendor", name)


def _digest(text: str) -> str:
    return "sha256-" + base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()


def _text(*path: str) -> str:
    return files("rayproof.reports.publish").joinpath(*path).read_text(encoding="utf-8")
