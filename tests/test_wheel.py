"""What is installed is one package, and a project that has packages of our folders' names can use it."""

import os
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

pytestmark = pytest.mark.process

CHECKOUT = Path(__file__).parents[1]
FOLDERS = ("cases", "reference", "reports", "tracer")
SCRIPT = """
import cases, reference, reports, tracer, rayproof
assert tracer.OWN and cases.OWN and reference.OWN and reports.OWN
print(rayproof.__file__)
rayproof.run(["primitives/plane"], configurations=["float32"], quiet=True).raise_if_failed()
"""
TEST = """
import tracer
import pytest

@pytest.mark.rayproof("primitives/plane")
def test_ours(conformance):
    assert tracer.OWN
    conformance.check()
"""

FORMULA = """
import tracer
from rayproof.tracer.formulas import FORMULAS

def mine(ray, plane, interval):
    assert tracer.OWN
    return FORMULAS["plane/dot_products"].function(ray, plane, interval)
"""


def built(source: Path, out: Path, *targets: str) -> Path:
    """Build in `source` and return the one file that was made in `out`."""
    words = [word for target in targets for word in ("-t", target)]
    subprocess.run([sys.executable, "-m", "hatchling", "build", *words, "-d", str(out)], cwd=source, check=True)
    (made,) = out.iterdir()
    return made


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return built(CHECKOUT, tmp_path_factory.mktemp("wheel"), "wheel")


def test_the_wheel_holds_one_package_also_by_way_of_the_source_distribution(wheel: Path, tmp_path: Path) -> None:
    source = built(CHECKOUT, tmp_path / "source", "sdist")
    (tmp_path / "unpacked").mkdir()
    # Older releases of Python 3.11 have no `filter` in tarfile, and newer ones warn without it.
    subprocess.run(["tar", "-xzf", str(source), "-C", str(tmp_path / "unpacked")], check=True)
    (unpacked,) = (tmp_path / "unpacked").iterdir()

    names, again = (
        sorted(zipfile.ZipFile(file).namelist()) for file in (wheel, built(unpacked, tmp_path / "again", "wheel"))
    )

    assert names == again
    assert {name.split("/")[0].partition("-")[0] for name in names} == {"rayproof"}
    # In particular no tests, and nothing of what tests rayproof itself.
    assert {name.split("/")[1] for name in names if name.startswith("rayproof/")} == {*FOLDERS, "__init__.py"}
    sources = [path.relative_to(CHECKOUT) for folder in FOLDERS for path in (CHECKOUT / folder).rglob("*.py")]
    assert {f"rayproof/{path.as_posix()}" for path in sources} <= set(names)


@pytest.fixture(scope="module")
def project(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, str]]:
    """Return a project with packages of the folders' names, and the environment in which the wheel is installed."""
    site, folder = tmp_path_factory.mktemp("site"), tmp_path_factory.mktemp("project")
    zipfile.ZipFile(wheel).extractall(site)
    for name in (*FOLDERS, "tests"):
        (folder / name).mkdir()
        (folder / name / "__init__.py").write_text("OWN = True\n")
    (folder / "tests" / "test_ours.py").write_text(TEST)
    (folder / "script.py").write_text(SCRIPT)
    (folder / "mine.py").write_text(FORMULA)
    return folder, {**os.environ, "PYTHONPATH": os.pathsep.join([str(site), str(folder)])}


@pytest.mark.parametrize(
    ("command", "said"),
    [
        pytest.param(["script.py"], "{site}", id="script"),
        pytest.param(["-m", "pytest", "-q", "-p", "no:cacheprovider", "tests"], "1 passed", id="pytest"),
        pytest.param(
            [
                "-c",
                "import sys; from rayproof.reports.cli import main; sys.exit(main())",
                "run", "primitives/plane", "--configuration", "float32", "--out", "report",
            ],
            "1 planned, 1 pass",
            id="command",
        ),
        pytest.param(
            [
                "-c",
                "import sys; from rayproof.reports.cli import main; sys.exit(main())",
                "render", "primitives/plane", "a.exr", "--formula", "plane=mine.py:mine",
            ],
            "float32/plane=mine.py:mine",
            id="formula",
        ),
    ],
)  # fmt: skip
def test_a_project_with_packages_of_the_same_names_can_use_it(
    project: tuple[Path, dict[str, str]], command: list[str], said: str
) -> None:
    folder, environment = project

    ended = subprocess.run([sys.executable, *command], cwd=folder, env=environment, capture_output=True, text=True)

    assert ended.returncode == 0, ended.stdout + ended.stderr
    assert said.format(site=environment["PYTHONPATH"].split(os.pathsep)[0]) in ended.stdout


def test_a_checkout_without_symbolic_links_judges_a_case(tmp_path: Path) -> None:
    # File systems and archives without links lose them; only the type checker and import-linter need them.
    package = tmp_path / "python" / "rayproof"
    package.mkdir(parents=True)
    shutil.copy(CHECKOUT / "python" / "rayproof" / "__init__.py", package)
    shutil.copy(CHECKOUT / "pyproject.toml", tmp_path)
    for folder in FOLDERS:
        shutil.copytree(CHECKOUT / folder, tmp_path / folder, ignore=shutil.ignore_patterns("__pycache__"))
    script = (
        "import rayproof, rayproof.tracer; "
        'result = rayproof.run(["primitives/plane"], configurations=["float32"], quiet=True); '
        "result.raise_if_failed(); print(*rayproof.tracer.__path__)"
    )

    ended = subprocess.run(
        [sys.executable, "-c", script],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(tmp_path / "python")},
        capture_output=True,
        text=True,
    )

    assert ended.returncode == 0, ended.stdout + ended.stderr
    assert ended.stdout.split()[0] == str(tmp_path / "tracer")
