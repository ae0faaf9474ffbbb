"""Small files that ask for gigabytes or never end: each is one line and exit code 2, in little time and memory.

The smallest lie in `endless/` as they are; what would be long there is written here.
"""

import json
import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

pytestmark = pytest.mark.process

HERE = Path(__file__).with_name("endless")
SECONDS = 10  # of processor time, this process's and its parsers'; the machine may have other work
MEMORY = 2**30  # bytes, of each process
# Runs a command and writes what it used. A process of its own, since a child's largest memory counts from before it
# became another program, when it was as large as the tests are by then.
MEASURING = """
import resource, subprocess, sys
code = subprocess.run(sys.argv[2:], check=False).returncode
used = resource.getrusage(resource.RUSAGE_CHILDREN)
open(sys.argv[1], "w").write(f"{used.ru_utime + used.ru_stime} {used.ru_maxrss}")
sys.exit(code)
"""


def of_this_folder(name: str) -> Callable[[Path], Path]:
    """Return what copies a file of `endless/` with all that lies beside it."""
    return lambda folder: Path(shutil.copytree(HERE, folder / "endless")) / name


def instances(folder: Path) -> Path:
    """Write 2000 instances of a group of 2000 spheres."""
    group = '<shape type="shapegroup" id="g">' + '<shape type="sphere"/>' * 2000 + "</shape>"
    placed = '<shape type="instance"><ref id="g"/></shape>' * 2000
    file = folder / "instances.xml"
    file.write_text(f'<scene version="3.0.0">{group}{placed}</scene>')
    return file


def buffers(folder: Path) -> Path:
    """Write 40 000 buffers of one file of 200 kB, and a mesh that is not there."""
    (folder / "b").write_bytes(bytes(200_000))
    listed = [{"byteLength": 200_000, "uri": "b"}] * 40_000
    whole = {"asset": {"version": "2.0"}, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}], "buffers": listed}
    file = folder / "buffers.gltf"
    file.write_text(json.dumps(whole, separators=(",", ":")))
    return file


def nested(folder: Path) -> Path:
    """Write 100 000 elements in each other."""
    file = folder / "nested.xml"
    file.write_text('<scene version="3.0.0">' + "<a>" * 100_000 + "</a>" * 100_000 + "</scene>")
    return file


def fifo(folder: Path) -> Path:
    """Include a pipe that nobody writes to."""
    os.mkfifo(folder / "pipe.xml")
    file = folder / "fifo.xml"
    file.write_text('<scene version="3.0.0"><include filename="pipe.xml"/></scene>')
    return file


def one_mesh_many_times(folder: Path) -> Path:
    """Name one mesh of 30 000 triangles 15 000 times: 450 million."""
    corners = "".join(f"v {number} 0 0\nv 0 {number} 1\n" for number in range(15_000))
    (folder / "mesh.obj").write_text(corners + "f 1 2 3\n" * 30_000)
    file = folder / "many.xml"
    file.write_text(
        '<scene version="3.0.0">'
        + '<shape type="obj"><string name="filename" value="mesh.obj"/></shape>' * 15_000
        + "</scene>"
    )
    return file


Written = tuple[Callable[[Path], Path], str]  # what writes the file, and what its refusal says
FILES: dict[str, Written] = {
    "parameters made of parameters": (of_this_folder("defaults_of_defaults.xml"), "may unfold to at most"),
    "30 includes on 7 levels": (of_this_folder("includes/0.xml"), "at most 256 includes"),
    "60 million corners without data": (of_this_folder("array_without_data.gltf"), "may unfold to at most"),
    "4 million instances": (instances, "4000000 shapes"),
    "40 000 buffers of one file": (buffers, "none at 0"),
    "100 000 nested elements": (nested, "levels of nesting"),
    "a pipe to include": (fifo, "must name a regular file"),
    "450 million triangles of one mesh": (one_mesh_many_times, "may unfold to at most"),
}


@pytest.mark.parametrize("name", FILES)
def test_it_ends_in_one_line_and_takes_little(name: str, tmp_path: Path) -> None:
    write, message = FILES[name]
    file = write(tmp_path)
    command = [
        sys.executable,
        "-c",
        "import sys; from rayproof.reports.cli import main; sys.exit(main())",
        "import",
        str(file),
    ]

    # Its own processor time and memory, and those of the parsers that it waited for.
    used = tmp_path / "used"
    ended = subprocess.run(
        [sys.executable, "-c", MEASURING, str(used), *command, "--out", str(tmp_path / "out.json")],
        capture_output=True,
        text=True,
        check=False,
    )
    lines = (ended.stdout + ended.stderr).splitlines()
    seconds, memory = map(float, used.read_text().split())

    assert ended.returncode == 2, lines
    assert len(lines) == 1
    assert lines[0].startswith(f"rayproof: {file}: ")
    assert message in lines[0]
    assert seconds < SECONDS
    assert memory * (1 if sys.platform == "darwin" else 1024) < MEMORY
    assert not (tmp_path / "out.json").exists()
