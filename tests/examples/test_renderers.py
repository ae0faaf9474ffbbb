"""The shipped C++ ray tracer passes where it is put under test, and its twin with one planted bug is found out."""

import shutil
import subprocess
from dataclasses import replace
from pathlib import Path

import pytest

from rayproof.cases.case import Case
from rayproof.cases.families import all_cases, select
from rayproof.cases.stages import Stage
from rayproof.reference.analytic import Analytic
from rayproof.reports.cli import main
from rayproof.reports.judge.answers import Answers
from rayproof.reports.judge.case import judge_case
from rayproof.reports.judge.oracle import stages_of
from rayproof.reports.judge.repeated import changes
from rayproof.reports.judge.verdict import Judged, of_what_is_supported
from rayproof.reports.results.document import load_results
from rayproof.reports.results.outcomes import Outcome
from rayproof.reports.subjects import PROGRAM, SERVED, Subject
from rayproof.reports.subjects.program import ask_capabilities, ask_program
from rayproof.reports.subjects.protocol import hand_over
from rayproof.reports.subjects.serving import Server

RENDERERS = Path(__file__).parents[2] / "examples" / "renderers"
COMPILER = shutil.which("c++") or shutil.which("g++") or shutil.which("clang++")
# One of each family: what the family's others ask is of the same kind. No models, whose many faces take seconds.
# Nor scenes of 1e-9 m, in which the 1e-7 m that the examples declare as their shadow_rays' epsilon hide every shadow:
# there they fail, as they should.
TINY = ("tolerances/slit", "tolerances/crumbs")
ASKED = (case for case in reversed(all_cases()) if case.family != "models" and case.name not in TINY)
CASES = tuple({case.family: case for case in ASKED}.values())
ORACLE = Analytic()

pytestmark = pytest.mark.skipif(COMPILER is None, reason="there is no C++ compiler")


def built(folder: Path, source: Path, *flags: str) -> Subject:
    """Compile a renderer with every warning an error and return it as a subject."""
    program = folder / "renderer"
    command = [str(COMPILER), "-O1", "-std=c++17", "-Wall", "-Wextra", "-Werror", *flags, "-o", str(program)]
    subprocess.run([*command, str(source)], check=True, capture_output=True, timeout=120)
    return Subject(name=PROGRAM, transport=PROGRAM, title="exec:test", command=(str(program), "{scene}", "{output}"))


@pytest.fixture(scope="module")
def lecture(tmp_path_factory: pytest.TempPathFactory) -> Subject:
    subject = built(tmp_path_factory.mktemp("lecture"), RENDERERS / "lecture.cpp")
    return replace(subject, capabilities=ask_capabilities(subject, seconds=20))


@pytest.fixture(scope="module")
def mistaken(tmp_path_factory: pytest.TempPathFactory) -> Subject:
    return built(tmp_path_factory.mktemp("mistaken"), RENDERERS / "mistaken.cpp")


@pytest.fixture(scope="module")
def twin(tmp_path_factory: pytest.TempPathFactory) -> Subject:
    return built(tmp_path_factory.mktemp("twin"), RENDERERS / "lecture.cpp", "-DPLANTED_BUG")


@pytest.fixture(scope="module")
def by_corners(tmp_path_factory: pytest.TempPathFactory) -> Subject:
    """Compile the example with normals from the rounded corners of faces, which it declares."""
    folder = tmp_path_factory.mktemp("corners")
    subject = built(folder, RENDERERS / "lecture.cpp", "-DWORLD_NORMALS=true")
    return replace(subject, capabilities=ask_capabilities(subject, seconds=20))


@pytest.fixture(scope="module")
def short_of_pi(tmp_path_factory: pytest.TempPathFactory) -> Subject:
    """Compile the example with a pi of five digits where exitance becomes radiance, and nowhere else."""
    folder = tmp_path_factory.mktemp("short")
    source = (RENDERERS / "lecture.cpp").read_text()
    assert source.count("1 / PI)") == 1
    (folder / "lecture.cpp").write_text(source.replace("1 / PI)", "1 / 3.1415)"))
    return built(folder, folder / "lecture.cpp", f"-I{RENDERERS}")


# Few cases that between them show every mistake of the switched example.
TELLING = {
    "cameras/banked",
    "cameras/slanted_up",
    "clipping/sphere_depth",
    "clipping/sphere_shell",
    "inside/one_sided_sphere",
    "inside/sphere_in_cube",
    "nearest/lit_crowd",
    "normals/turned_to_the_viewer",
    "random_scenes/seed_1",
    "several_lights/simplified",
    "sidedness/square_lit_from_behind",
    "shadows/behind_the_light",
    "transforms/sphere_sheared",
    "transforms/triangle_mirrored",
}


def judged(subject: Subject, case: Case) -> Judged:
    """Judge a program on a case before the oracle alone."""
    given = ask_program(subject, case.scene, samples=1)
    answers = ORACLE.render(case.scene, stages_of(case.scene))
    truth = Answers(name="analytic", precision="float64", independent=True, answers=answers)
    return of_what_is_supported(judge_case(case, [given], [truth], ORACLE, {}), [given])


@pytest.mark.process
@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_the_example_passes_on_a_case_of_every_family(lecture: Subject, case: Case) -> None:
    if case.samples > 1:
        case = Case(**{name: value for name, value in vars(case).items() if name != "samples"})

    found = judged(lecture, case)

    assert (found.outcome, found.reason) == (Outcome.PASS, "")


@pytest.mark.process
def test_every_switch_is_wrong_somewhere_and_none_is_wrong_without_it(mistaken: Subject, tmp_path: Path) -> None:
    program = mistaken.command[0]
    listed = subprocess.run([program, "--mistakes"], check=True, capture_output=True, text=True).stdout.splitlines()
    names = [line.split("\t")[0] for line in listed]
    scenes = [hand_over(case.scene, folder(tmp_path, case.name)) for case in all_cases() if case.name in TELLING]

    def image(scene: Path, *words: str) -> bytes:
        subprocess.run([program, *words, scene, tmp_path / "image.exr"], check=True, timeout=20)
        return (tmp_path / "image.exr").read_bytes()

    right = {scene: image(scene) for scene in scenes}
    unseen = [name for name in names if all(image(one, "--mistake", name) == right[one] for one in scenes)]

    assert len(names) >= 60
    assert sum(line.split("\t")[1] == "U" for line in listed) >= 15
    assert unseen == []


def folder(tmp_path: Path, name: str) -> Path:
    made = tmp_path / name.replace("/", "-")
    made.mkdir()
    return made


@pytest.mark.process
@pytest.mark.parametrize("shape", ["sphere", "cube", "square", "plane", "triangle", "mesh"])
def test_the_twins_normals_are_blamed_under_a_shear(twin: Subject, shape: str) -> None:
    (case,) = (case for case in all_cases() if case.name == f"transforms/{shape}_sheared")

    found = judged(twin, case)

    assert (found.outcome, found.stage, "NRM-3" in found.blamed) == (Outcome.FAIL, Stage.NORMAL, True)


@pytest.mark.process
def test_a_pi_of_five_digits_is_blamed_at_radiance_by_what_the_program_promises(short_of_pi: Subject) -> None:
    (case,) = (case for case in all_cases() if case.name == "primitives/sphere")
    promising = replace(short_of_pi, capabilities=ask_capabilities(short_of_pi, seconds=20))

    found = judged(promising, case)
    without = judged(replace(promising, capabilities=replace(promising.capabilities, chained=False)), case)

    assert promising.capabilities.chained
    assert (found.outcome, found.stage, "RAD-4" in found.blamed) == (Outcome.FAIL, Stage.RADIANCE, True)
    assert [check.stage for check in found.checks if check.alone] == [Stage.RADIANCE]
    (radiance,) = (check for check in without.checks if check.stage is Stage.RADIANCE)
    assert radiance.continued is not None
    assert radiance.continued.worst_ratio <= 1, "passes of their own may differ by more than that"


@pytest.mark.process
@pytest.mark.parametrize("name", ["combined/19_mesh_turned", "combined/29_mesh_mirrored"])
def test_normals_of_rounded_corners_pass_where_they_are_declared_and_only_there(by_corners: Subject, name: str) -> None:
    (case,) = select([name])
    silent = replace(by_corners, capabilities=replace(by_corners.capabilities, world_normals=False))

    assert judged(by_corners, case).outcome is Outcome.PASS
    assert (judged(silent, case).outcome, judged(silent, case).stage) == (Outcome.FAIL, Stage.NORMAL)


@pytest.mark.process
def test_of_a_chained_program_a_wrong_normal_is_blamed_alone(twin: Subject) -> None:
    (case,) = (case for case in all_cases() if case.name == "transforms/sphere_sheared")
    promising = replace(twin, capabilities=ask_capabilities(twin, seconds=20))

    found = judged(promising, case)

    assert [check.stage for check in found.checks if check.alone] == [Stage.NORMAL]
    assert found.stage is Stage.NORMAL


@pytest.mark.process
@pytest.mark.parametrize(("which", "code"), [("lecture", 0), ("twin", 1)])
def test_a_run_ends_as_the_renderer_deserves(
    which: str, code: int, request: pytest.FixtureRequest, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    subject: Subject = request.getfixturevalue(which)
    title = f"exec:{subject.command[0]} {{scene}} {{output}}"

    ended = main(["run", "transforms/square_sheared", "--subject", title, "--out", str(tmp_path)])

    printed = capsys.readouterr().out
    results = load_results(tmp_path)
    (case,) = results["cases"]
    assert ended == code, printed
    assert results["subject"] == title
    assert any(text.startswith("lecture 1") for text in results["environment"].values())
    assert case["reproduce"] == f"rayproof run transforms/square_sheared --subject '{title}'"
    assert (case["stage"], "NRM-3" in case.get("blamed_items", [])) == (
        (None, False) if code == 0 else ("normal", True)
    )
    assert {check.stage for check in case["checks"] if check.outcome == "unsupported"} == {"camera"}


@pytest.mark.process
def test_the_starter_in_cpp_passes_on_spheres(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["new", "adapter", str(tmp_path / "mine.cpp")]) == 0
    assert "c++ -O2 -std=c++17 -o adapter mine.cpp" in capsys.readouterr().out

    subject = built(tmp_path, tmp_path / "mine.cpp")
    passes_on_spheres(subject)
    answers_line_by_line(subject.command[0])


def answers_line_by_line(*command: str) -> None:
    """Have a starter answer a case as a program that stays alive, to the bit as when it is called for each scene."""
    (sphere,), lost = select(["primitives/sphere"]), {"scene": "nowhere.json", "output": "nowhere.exr"}
    called = Subject(name=PROGRAM, transport=PROGRAM, title="exec:mine", command=(*command, "{scene}", "{output}"))
    subject = Subject(name=SERVED, transport=SERVED, title="serve:mine", command=command)
    server = Server(subject)
    able = replace(subject, capabilities=ask_capabilities(subject, seconds=10, server=server))
    answers = [ask_program(able, sphere.scene, samples=1, server=server).answers for _ in range(2)]
    error = server.ask(lost, seconds=10, output=2**26).problem
    server.close()

    assert able.capabilities.shapes == ("sphere",)
    assert "nowhere.json" in str(error)
    for answer in answers:
        assert changes(answer, ask_program(called, sphere.scene, samples=1).answers) == {}


def passes_on_spheres(subject: Subject) -> None:
    able = replace(subject, capabilities=ask_capabilities(subject, seconds=10))
    found = {case.name: judged(able, case).outcome for case in all_cases() if case.name in SPHERES}

    assert found == SPHERES


SPHERES = {
    "primitives/sphere": Outcome.PASS,
    "inside/one_sided_sphere": Outcome.PASS,
    "inside/sphere": Outcome.PASS,
    "nearest/spheres": Outcome.PASS,
    "transforms/sphere_rotated": Outcome.PASS,
    "transforms/sphere_scaled": Outcome.PASS,
    "transforms/sphere_sheared": Outcome.UNSUPPORTED,
    "primitives/cube": Outcome.UNSUPPORTED,
}
