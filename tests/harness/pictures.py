"""All pictures of the report in README and docs: python -m tests.harness.pictures.

A run with a classic mistake, normals by the model matrix in a formula of one's own, and with its studies is
photographed in Chromium. It is no planted fault: a run with one says on top that it audits the harness. Beside the
pictures stays the digest of the page's scripts and styles that drew them, by which a test notices that they are old.
"""

import contextlib
import hashlib
import sys
import tempfile
from pathlib import Path

from rayproof.reports.cli import main
from tests.command_line import call

CHECKOUT = Path(__file__).parents[2]
PICTURES = CHECKOUT / "docs" / "pictures"
DRAWN_BY = PICTURES / "scripts.sha256"
MISTAKE = ("transforms", "--formula", "world_normal=./mine.py:model_matrix")
MINE = '''"""A classic mistake: normals are turned by the model matrix instead of its inverse transpose."""

import drjit as dr


def model_matrix(normal, transform):
    return dr.normalize(transform.vector_to_world(normal))
'''


def scripts_digest() -> str:
    """Return the SHA-256 of all scripts and styles of the report's page and of its 3-D view, in the order of names."""
    publish = CHECKOUT / "reports" / "publish"
    files = [*(publish / "page" / "html").iterdir(), *(publish / "scene3d" / "viewer").iterdir()]
    content = hashlib.sha256()
    for path in sorted(files):
        content.update(path.name.encode() + b"\0" + path.read_bytes())
    return content.hexdigest()


def draw() -> int:
    """Make a run, take all pictures of README and docs of it, and write which scripts drew them; takes a minute."""
    drawn_by = scripts_digest()
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        Path("mine.py").write_text(MINE, encoding="utf-8")
        for study in ("stability", "tradeoff"):
            main([study, "--quick", "--out", folder])
        code = main(["run", *MISTAKE, "--out", folder])
        if code != 1:  # the mistake must be found
            return code or 1
        code = main(["report", folder, "--pictures", str(PICTURES)])
    if code == 0:
        DRAWN_BY.write_text(f"{drawn_by}\n", encoding="utf-8")
    return code


if __name__ == "__main__":
    sys.exit(call(draw))
