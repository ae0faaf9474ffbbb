"""Put the test vectors to public libraries and print the table of docs/vectors.md: python table.py FOLDER.

The packages are installed into FOLDER at the versions that are pinned beside this file, unless they are there already.
It needs rayproof, Node.js with npm and Rust with cargo; a language that is missing is left out, and a line says so.
"""

import re
import shutil
import subprocess
import sys
import venv
from pathlib import Path

from rayproof.reports.vectors.check import EITHER, RowVerdict, read_answers, read_vectors, scored
from rayproof.reports.vectors.files import write

HERE = Path(__file__).parent
FILES = ("sphere", "triangle", "box")
# Library -> the file that pins its version, and whether it computes in float64.
LIBRARIES = {
    "three": ("package.json", True),
    "babylon": ("package.json", True),
    "playcanvas": ("package.json", True),
    "trimesh": ("requirements.txt", True),
    "embreex": ("requirements.txt", False),
    "warp": ("requirements.txt", False),
    "fcpw": ("requirements.txt", False),
    "mujoco": ("requirements.txt", True),
    "mitsuba": ("requirements.txt", False),
    "parry3d": ("Cargo.toml", False),
    "bvh": ("Cargo.toml", False),
    "obvhs": ("Cargo.toml", False),
}
PACKAGES = {"babylon": "@babylonjs/core", "warp": "warp-lang"}


def version_of(library: str) -> str:
    """Return the version that is pinned."""
    text = (HERE / LIBRARIES[library][0]).read_text()
    found = re.search(rf'"?{re.escape(PACKAGES.get(library, library))}"?\s*(?:==|:|=)\s*"?=?([\w.]+)', text)
    assert found is not None, library
    return found[1]


def installed(folder: Path) -> dict[str, list[str]]:
    """Install what is pinned, where it is not there yet, and return the command that answers for each pin file."""
    commands: dict[str, list[str]] = {}
    node, packages = folder / "js", folder / "py"
    if shutil.which("npm") is not None:
        node.mkdir(parents=True, exist_ok=True)
        for name in ("package.json", "answers.mjs"):
            shutil.copy(HERE / name, node)
        if not (node / "node_modules").exists():
            subprocess.run(["npm", "install", "--no-audit", "--no-fund"], cwd=node, check=True, stdout=sys.stderr)
        commands["package.json"] = ["node", str(node / "answers.mjs")]
    if not (packages / "bin").exists():
        venv.create(packages, with_pip=True)
        pip = [str(packages / "bin" / "python"), "-m", "pip", "install", "-q", "-r", str(HERE / "requirements.txt")]
        subprocess.run(pip, check=True, stdout=sys.stderr)
    commands["requirements.txt"] = [str(packages / "bin" / "python"), str(HERE / "answers.py")]
    if shutil.which("cargo") is not None:
        build = ["cargo", "build", "--release", "-q", "--manifest-path", str(HERE / "Cargo.toml")]
        subprocess.run([*build, "--target-dir", str(folder / "rs")], check=True, stdout=sys.stderr)
        commands["Cargo.toml"] = [str(folder / "rs" / "release" / "answers")]
    return commands


def cell(verdicts: list[RowVerdict], required: set[str]) -> str:
    """Return how many of the rows that require something fail."""
    asked = [verdict for verdict in verdicts if verdict.outcome != "skipped" and verdict.id in required]
    failed = [verdict for verdict in asked if verdict.outcome == "failed"]
    return f"{len(failed)} of {len(asked)}"


def row(library: str, folder: Path) -> list[str]:
    """Return a library's row: what fails at float32's limits, and of those in float64 at float64's too."""
    rows, relations = read_vectors(folder)
    skipped, cells = 0, list[str]()
    between: list[RowVerdict] = []
    for file in FILES:
        path = folder / f"{library}-{file}.csv"
        if not path.is_file():
            cells.append("-")
            continue
        answers, parts = read_answers(path, rows), []
        for precision in ("float32", "float64")[: 1 + LIBRARIES[library][1]]:
            bits = precision[-2:]
            required = {name for name in answers.rows if rows[name].get(f"decision{bits}") != EITHER}
            verdicts = scored(rows, relations, answers, precision)
            parts.append(cell([one for one in verdicts if one.id in rows], required))
            between += [one for one in verdicts if one.id not in rows and precision == "float32"]
        skipped += sum("skip" in answer.values() for answer in answers.rows.values())
        cells.append("; ".join(parts))
    arithmetic = "float64" if LIBRARIES[library][1] else "float32"
    related = cell(between, {one.id for one in between})
    return [f"{library} {version_of(library)}", arithmetic, *cells, related, str(skipped)]


def main(folder: Path) -> None:
    """Answer with every library and print the table."""
    folder, vectors = folder.absolute(), folder.absolute() / "vectors"
    vectors.mkdir(parents=True, exist_ok=True)
    write(vectors, [*FILES])
    commands = installed(folder)
    head = ["library", "arithmetic", *FILES, "relations", "left out"]
    sys.stdout.write(f"| {' | '.join(head)} |\n{'|---' * len(head)}|\n")
    for library, (pin, _) in LIBRARIES.items():
        if pin not in commands:
            sys.stderr.write(f"{library} is left out: its language is not installed\n")
            continue
        for file in FILES:
            (vectors / f"{library}-{file}.csv").unlink(missing_ok=True)
        subprocess.run([*commands[pin], library, str(vectors)], check=True, stdout=sys.stderr)
        sys.stdout.write(f"| {' | '.join(row(library, vectors))} |\n")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
