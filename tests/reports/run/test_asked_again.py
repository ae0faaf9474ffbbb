"""A program that answers rightly once, or never, does not pass: runs by the command line, from end to end."""

import json
import sys
from pathlib import Path

import pytest

from rayproof import ROOT
from rayproof.reports.cli import main
from rayproof.reports.results.document import load_results
from rayproof.reports.results.headline import no_say, remarks
from rayproof.reports.run import totals

pytestmark = pytest.mark.process

# It draws spheres as the starter does, but zeros where it has seen a scene before.
FORGETFUL = """
import json, os, sys
sys.path.insert(0, @STARTERS@)
import adapter
def draw(scene, output):
    with open(scene) as file:
        scene = json.load(file)
    channels, mark = adapter.render(scene), @MARK@ + str(scene["camera"]["fovy"])
    if os.path.exists(mark):
        channels = {name: [[0.0] * len(row) for row in rows] for name, rows in channels.items()}
    open(mark, "w")
    adapter.write_exr(output, channels)
if sys.argv[1:] == ["--capabilities"]:
    print(json.dumps({"protocol": 1, **adapter.CAPABILITIES}))
elif sys.argv[1:]:
    draw(*sys.argv[1:])
else:
    for line in sys.stdin:
        request = json.loads(line)
        if "capabilities" in request:
            answer = {"capabilities": {**adapter.CAPABILITIES, "protocol": 2}}
        else:
            draw(request["scene"], request["output"])
            answer = {"ok": True}
        print(json.dumps({"id": request["id"], **answer}), flush=True)
"""


@pytest.mark.parametrize("protocol", ["exec", "serve"])
def test_a_program_that_is_right_about_a_scene_only_once_fails(
    tmp_path: Path, protocol: str, capsys: pytest.CaptureFixture[str]
) -> None:
    program = tmp_path / "forgetful.py"
    text = FORGETFUL.replace("@STARTERS@", repr(str(ROOT / "reports" / "subjects" / "starters")))
    program.write_text(text.replace("@MARK@", repr(str(tmp_path / "seen-"))))
    command = f"{protocol}:{sys.executable} -S {program}" + (" {scene} {output}" if protocol == "exec" else "")

    code = main(["run", "primitives/sphere", "--subject", command, "--jobs", "1", "--out", str(tmp_path / "out")])

    results = json.loads((tmp_path / "out" / "results.json").read_text())
    assert (code, results["verdict"], results["summary"]["pass"]) == (1, "fail", 1)
    assert "answers primitives/sphere differently when it is asked again" in results["changing"][0]
    assert "the run fails" in capsys.readouterr().out
    (record,) = load_results(tmp_path / "out")["cases"]
    growing = totals.of([{**record, "growth": 2_100_000}]).growing
    assert growing == ["at primitives/sphere the program's memory grew by 2.1 MB a scene over 100 scenes"]
    assert no_say({**results, "growing": growing})[0] == growing[0]
    assert f"A{growing[0][1:]}." in remarks({**results, "growing": growing})
