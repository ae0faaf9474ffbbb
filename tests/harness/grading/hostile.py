"""Eight hostile submissions beside a right one: each does its worst while it is built and run, and draws nothing."""

import json
import os
from collections.abc import Sequence
from pathlib import Path

from rayproof.reports.grading.classes import Graded
from tests.harness.grading.campaign import PYTHON_SOURCE

RUBRIC = """
title = "Strangers"
points = {HIT-1 = 2, RAD-4 = 1}
[program]
build = "/usr/bin/python3 attack.py || true"
run = "/usr/bin/python3 attack.py {scene} {output}"
own = true
[cases]
visible = ["combined/26*"]
hidden = ["combined/00*"]
[limits]
seconds = 2.0
build_seconds = 2.0
memory = 0.25
disk = 16.0
processes = 16
"""
# What each does; its folder is HERE on this machine, its neighbour's program NEIGHBOUR, a file beside them MARK.
ATTACKS = {
    "reads_a_neighbour": "shutil.copy(NEIGHBOUR, '/tmp/stolen.py'), "
    "os.execv(sys.executable, ['x', '/tmp/stolen.py', *sys.argv[1:]])",
    "writes_outside": "[attempt(lambda p=p: open(p, 'w').write('x')) "
    "for p in (MARK, '/usr/mark', '/etc/mark', HERE + '/x')]",
    "network": "socket.create_connection(('127.0.0.1', PORT), 1).send(b'mark')",
    "fork_bomb": "[attempt(os.fork) for _ in range(8)], time.sleep(1)",
    "endless_output": "[(print('x' * 1000000), sys.stderr.write('y' * 1000000)) for _ in range(10**6)]",
    "renames_itself": "ctypes.CDLL(None).prctl(15, b'kthreadd'), os.fork() or os.setsid(), time.sleep(3)",
    "detects_the_grader": "print([line for p in glob.glob('/proc/[0-9]*/cmdline') for line in [open(p).read()] "
    "if 'rayproof' in line], [name for name in os.environ if 'RAYPROOF' in name], os.path.exists(NEIGHBOUR))",
    "tampers_with_the_result": "[attempt(lambda p=p: open(p, 'w').write('{}')) for p in "
    "glob.glob('/proc/*/fd/*') + ['results.json', '/tmp/results.json', '/tmp/call/scene.json', GRADES]]",
}
HEAD = """
import ctypes, glob, os, shutil, socket, sys, time
NEIGHBOUR, MARK, HERE, PORT, GRADES = {neighbour!r}, {mark!r}, {here!r}, {port}, {grades!r}
def attempt(what):
    try:
        what()
    except BaseException:
        pass
attempt(lambda: ({attack}))
"""


def write(folder: Path, grades: Path, *, port: int) -> None:
    """Write the rubric and the submissions; `port` is one that this machine listens at."""
    (folder / "rubric.toml").write_text(RUBRIC, encoding="utf-8")
    right = folder / "submissions" / "a_right_one"
    right.mkdir(parents=True, exist_ok=True)
    (right / "renderer.py").write_text(PYTHON_SOURCE.read_text(encoding="utf-8"), encoding="utf-8")
    run = "/usr/bin/python3 renderer.py {scene} {output}"
    (right / "rayproof.toml").write_text(f'run = "{run}"\n', encoding="utf-8")
    for name, attack in ATTACKS.items():
        here = folder / "submissions" / name
        here.mkdir(exist_ok=True)
        facts = {"neighbour": str(right / "renderer.py"), "mark": str(folder / "mark"), "here": str(here)}
        text = HEAD.format(**facts, attack=attack, port=port, grades=str(grades / "teacher" / "grades.json"))
        (here / "attack.py").write_text(text, encoding="utf-8")


def problems(folder: Path, grades: Path, graded: Sequence[Graded], *, heard: bool) -> list[str]:
    """Return what a hostile submission gained or harmed; `heard` says that somebody connected to the port."""
    found = [f"{one.name} earns {one.points:g}" for one in graded if one.name in ATTACKS and one.points]
    found += [f"a right one earns {one.points:g}" for one in graded if one.name not in ATTACKS and one.points != 3]
    found += ["the network was reached"] if heard else []
    found += [
        f"{path} was written" for path in (folder / "mark", Path("/usr/mark"), Path("/etc/mark")) if path.exists()
    ]
    names = {path.name for path in (folder / "submissions").rglob("*")}
    found += [f"{name} was written" for name in names - {"attack.py", "renderer.py", "rayproof.toml", "a_right_one"}
              if name not in ATTACKS]  # fmt: skip
    facts = json.loads((grades / "teacher" / "grades.json").read_text(encoding="utf-8"))
    found += ["the grades were changed"] if facts.get("submissions", {}).keys() != {one.name for one in graded} else []
    left = [path for path in Path("/proc").glob("[0-9]*/cmdline") if _holds(path, b"attack.py")]
    return found + [f"process {path.parent.name} is left" for path in left if int(path.parent.name) != os.getpid()]


def _holds(path: Path, word: bytes) -> bool:
    try:
        return word in path.read_bytes()
    except OSError:
        return False
