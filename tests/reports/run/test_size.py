"""A scene that no machine could hold is refused before anything starts, in one line with its numbers."""

import json
from pathlib import Path

import pytest

from reports.cli import main

CAMERA = {"eye": [0, 0, 4], "target": [0, 0, 0], "up": [0, 1, 0], "fovy": 40, "near": 1, "far": 9}


@pytest.mark.parametrize("command", ["run", "render"])
def test_an_image_beyond_all_memory_is_refused(
    command: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    scene = tmp_path / "large.json"
    shapes = [{"type": "sphere", "albedo": [0.5, 0.5, 0.5]}]
    # A million on a side: 330 TB, so that the machine of the test does not matter.
    scene.write_text(json.dumps({"camera": CAMERA | {"width": 10**6, "height": 10**6}, "shapes": shapes}))
    out = [str(tmp_path / "image.exr")] if command == "render" else ["--out", str(tmp_path / "report")]

    code = main([command, str(scene), *out])

    said = capsys.readouterr().err
    assert code == 2
    assert said.startswith(f"rayproof: {scene}: 1000000 x 1000000 px and its meshes take 330000 GB of memory at least")
    assert said.count("\n") == 1
