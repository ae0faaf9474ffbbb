"""The JavaScript libraries beside the report's own scripts, made anew: `python -m tests.harness.vendoring`.

`vtk-viewer.js` is the viewer of the installed trame-vtk without what a report must not do: ask for icons on the web,
read addresses, wait for dropped files, talk to the console. `plotly-basic.min.js` is that of the npm package. Both
are pinned: what comes out must have the checksums of vendor/VENDOR.md, which a test compares, too.
"""

import hashlib
import re
import subprocess
import sys
import tarfile
import tempfile
from importlib.resources import files
from pathlib import Path

from rayproof import ROOT

VENDOR = ROOT / "reports" / "publish" / "vendor"
PLOTLY = "plotly.js-basic-dist-min@4.1.1"
MODULE = re.compile(r'<script type="module">(.*)</script>', re.DOTALL)
# (what it is, pattern, replacement); each must be found exactly once, or the viewer is not the one that was looked at.
CUTS = (
    ("styles that a strict policy refuses", r"if \(typeof document !== 'undefined'\) \{\n.*?\n\}\n", ""),
    ("icons on a web site", r"\w+&&\[16,32,96,160,196\]\.forEach\(t=>\{.*?\}\);", ""),
    (
        "what it does with a scene: call back when it is drawn",
        r"console\.log\(Object\.keys\(s\)\),a\.synchronize\(s\.scene\),a\.render\(\)",
        "a.synchronize(s.scene).then(()=>{a.render();e.ready(n)})",
    ),
    (
        "where a scene comes from: from the caller, unpacked",
        r"else if\(e\.base64Str\)\{",
        "else if(e.scene)i(e.scene);else if(e.base64Str){",
    ),
    (
        "what it does unasked: read the address, wait for files",
        r"var \w+=\w+\.extractURLParameters\(\);.*?window\.OfflineLocalView=\{initLocalFileLoader:\w+,load:(\w+)\};.*$",
        r"window.OfflineLocalView={load:\1};",
    ),
)


def vtk_viewer(page: str) -> str:
    """Return the viewer of trame-vtk's `static_viewer.html` as a plain script.

    Raises:
        ValueError: the page is not the one that the cuts were written for.

    """
    found = MODULE.search(page)
    if found is None:
        raise ValueError("static_viewer.html holds no module script")
    text = found[1]
    for what, pattern, replacement in CUTS:
        text, count = re.subn(pattern, replacement, text, flags=re.DOTALL)
        if count != 1:
            raise ValueError(f"{what}: found {count} times, not once")
    return f'"use strict";(()=>{{var global={{}};\n{text}\n}})();\n'


def checksums(notes: str) -> dict[str, str]:
    """Return file name to SHA-256, as VENDOR.md lists them."""
    return dict(re.findall(r"^\| `([\w.-]+)` \|.*`([0-9a-f]{64})` \|$", notes, re.MULTILINE))


def main() -> None:
    """Make both files anew and say how their checksums compare."""
    page = files("trame_vtk").joinpath("tools", "static_viewer.html").read_text(encoding="utf-8")
    (VENDOR / "vtk-viewer.js").write_text(vtk_viewer(page), encoding="utf-8")
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run(["npm", "pack", "--silent", PLOTLY], cwd=folder, check=True, stdout=subprocess.DEVNULL)
        (archive,) = Path(folder).glob("*.tgz")
        with tarfile.open(archive) as package:
            package.extractall(folder, filter="data")
        for name, kept in (("plotly-basic.min.js", "plotly-basic.min.js"), ("LICENSE", "plotly-LICENSE")):
            (VENDOR / kept).write_bytes(Path(folder, "package", name).read_bytes())
    for name, expected in checksums((VENDOR / "VENDOR.md").read_text(encoding="utf-8")).items():
        found = hashlib.sha256((VENDOR / name).read_bytes()).hexdigest()
        sys.stdout.write(f"{name} {found} {'as listed' if found == expected else 'NOT AS LISTED'}\n")


if __name__ == "__main__":
    main()
