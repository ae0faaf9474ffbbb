"""The notebooks run from their first cell to their last, and assert what their text says."""

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.process

NOTEBOOKS = sorted((Path(__file__).parents[2] / "examples" / "notebooks").glob("*.ipynb"))
# Cells as a kernel runs them, one after the other in one namespace; its last line is shown by nobody.
KERNEL = """
import json, sys
space = {"__name__": "__main__"}
for number, cell in enumerate(json.load(open(sys.argv[1]))["cells"]):
    if cell["cell_type"] == "code":
        exec(compile("".join(cell["source"]), f"cell {number}", "exec"), space)
"""


@pytest.mark.parametrize("notebook", NOTEBOOKS, ids=[path.stem for path in NOTEBOOKS])
def test_a_notebook_runs(notebook: Path, tmp_path: Path) -> None:
    ended = subprocess.run(
        [sys.executable, "-W", "error", "-c", KERNEL, str(notebook)], cwd=tmp_path, capture_output=True, text=True
    )

    assert ended.returncode == 0, ended.stdout + ended.stderr
    document = json.loads(notebook.read_text(encoding="utf-8"))
    assert document["nbformat"] == 4
    assert not any(cell.get("outputs") for cell in document["cells"]), "outputs are made, not kept"
    if notebook.stem == "the_figures_of_a_comparison":
        page = (Path(__file__).parents[2] / "docs" / "compare.md").read_text(encoding="utf-8")
        shown = re.findall(r"\]\(pictures/([\w.]+)\)", page)
        assert shown
        assert all((tmp_path / name).is_file() for name in shown)
