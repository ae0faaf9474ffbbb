"""`rayproof new workflow`: what a service would run works, and gates; what cannot stand in its file is refused."""

import os
import re
import shlex
import subprocess
import sys
from pathlib import Path
from textwrap import dedent

import pytest

from rayproof.reports.commands.new import REPORT, SERVICES
from tests.reports.commands.conftest import Rayproof, rayproof

__all__ = ["rayproof"]

BUILD = "echo made > built"
SUBJECT = "exec:cp nothing.exr {scene} {output}"


def shell_lines(service: str, text: str) -> list[str]:
    """Return the lines that a service would hand to a shell, as its format has them, but for installing with apt."""
    blocks = r"^ +run: \|\n((?: {10}.*\n)+)" if service == "github" else r"^    - \|\n((?: {6}.*\n)+)"
    return [dedent(body) for body in re.findall(blocks, text, re.MULTILINE)]


@pytest.mark.process
@pytest.mark.parametrize("service", SERVICES)
def test_what_a_service_would_run_fails_by_its_exit_code_and_leaves_a_report(
    rayproof: Rayproof, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, service: str
) -> None:
    monkeypatch.chdir(tmp_path)
    wrong = "float32/sphere=fault_far_root"
    ended = rayproof(
        "new",
        "workflow",
        service,
        "primitives/plane",
        "--from",
        "wheels/rayproof.whl",
        "--build",
        BUILD,
        "--subject",
        "tracer",
    )
    (tmp_path / "known.json").write_text('{"schema": 1}')
    assert (ended.code, ended.error) == (0, "")
    text = SERVICES[service][1].read_text()
    lines = shell_lines(service, text)
    # The command itself, on everybody's PATH where rayproof is installed, and a pip that has nothing to do.
    command = "import sys; from rayproof.reports.cli import main; sys.exit(main())"
    programs = {
        "rayproof": f'exec {shlex.quote(sys.executable)} -c "{command}" "$@" --configuration $CHOSEN',
        "python": 'if [ "$2" = venv ]; then mkdir -p .rayproof/bin; ln -s "$(command -v python)" .rayproof/bin/; fi',
    }
    for name, code in programs.items():
        (tmp_path / "bin").mkdir(exist_ok=True)
        (tmp_path / "bin" / name).write_text(f"#!/bin/sh\n{code}\n")
        (tmp_path / "bin" / name).chmod(0o755)
    summary = tmp_path / "summary"
    surroundings = {"PATH": f"{tmp_path / 'bin'}{os.pathsep}{os.environ['PATH']}", "GITHUB_STEP_SUMMARY": str(summary)}

    for chosen, code in (("float32", 0), (wrong.replace("sphere=fault_far_root", "plane=fault_sign"), 1)):
        codes = [
            subprocess.run(
                ["bash", "-e", "-c", line], env={**os.environ, **surroundings, "CHOSEN": chosen}, capture_output=True
            ).returncode
            for line in lines
        ]
        assert max(codes) == code
        assert Path(REPORT, "index.html").is_file()
        assert Path(REPORT, "junit.xml").is_file()
        assert Path("built").read_text() == "made\n"
    assert (service == "github") == summary.exists()
    assert "slim" not in text, "an image without git and make"
    assert text.count("wheels/rayproof.whl") == 1
    assert "@" not in re.sub(r"@v\d", "", text)


def test_the_subject_and_the_gate_are_in_the_command(rayproof: Rayproof, tmp_path: Path) -> None:
    file = tmp_path / "job.yml"

    ended = rayproof(
        "new", "workflow", "gitlab", "--from", "git+https://127.0.0.1/rayproof@abc", "--build", BUILD,
        "--subject", SUBJECT,
        "--least-coverage", 62.5, "--out", file,
    )  # fmt: skip

    assert ended.code == 0
    build, line = map(str.strip, shell_lines("gitlab", file.read_text()))
    assert build == BUILD
    assert shlex.split(line) == [
        "rayproof", "run", "--out", REPORT, "--subject", SUBJECT, "--expect", "known.json",
        "--least-coverage", "62.5",
    ]  # fmt: skip
    again = rayproof(
        "new", "workflow", "gitlab", "--from", "x.whl", "--build", BUILD, "--subject", SUBJECT, "--out", file
    )
    assert (again.code, again.error.count("\n")) == (2, 1)
    assert "is not overwritten" in again.error


@pytest.mark.process
def test_the_action_s_lines_run_gate_and_keep_a_report(tmp_path: Path) -> None:
    text = (Path(__file__).parents[3] / "action.yml").read_text()
    install, *lines = [dedent(body) for body in re.findall(r"^ +run: \|\n((?: {8}.*\n)+)", text, re.MULTILINE)]
    command = "import sys; from rayproof.reports.cli import main; sys.exit(main())"
    (tmp_path / "rayproof").write_text(f'#!/bin/sh\nexec {shlex.quote(sys.executable)} -c "{command}" "$@"\n')
    (tmp_path / "rayproof").chmod(0o755)
    inputs = {
        "SELECTORS": "primitives/plane",
        "SUBJECT": "radiance",
        "EXPECT": "",
        "LEAST_COVERAGE": "1",
        "OUT": "a report",
    }
    path = f"{tmp_path}{os.pathsep}{os.environ['PATH']}"
    surroundings = {**os.environ, **inputs, "PATH": path, "GITHUB_STEP_SUMMARY": str(tmp_path / "summary")}

    codes = [
        subprocess.run(["bash", "-e", "-c", line], env=surroundings, cwd=tmp_path, check=False).returncode
        for line in lines
    ]

    assert codes == [0, 0]
    assert (tmp_path / "a report" / "index.html").is_file()
    assert "rayproof" in (tmp_path / "summary").read_text()
    assert "${{" not in "".join(lines)  # an input is no part of a script
    assert '"$GITHUB_ACTION_PATH"' in install
