"""Scenes from a folder or from the lines of a file: each by its name, read when needed, the first bad one told."""

import json
from pathlib import Path
from typing import Any

import pytest

from rayproof.cases.scene import SceneError
from rayproof.cases.scene_json import scene_from_json
from rayproof.reports.run.scenes import SceneStream
from tests.reports.commands.conftest import Rayproof

SCENE: dict[str, Any] = {
    "camera": {"eye": [0, -3, 1], "target": [0, 0, 0], "up": [0, 0, 1], "fovy": 40, "width": 4, "height": 3,
               "near": 0.1, "far": 9},
    "shapes": [{"type": "sphere", "albedo": [0.5, 0.5, 0.5]}],
}  # fmt: skip


def written(folder: Path, *lines: Any) -> Path:
    path = folder / "many.jsonl"
    path.write_text("".join((one if isinstance(one, str) else json.dumps(one)) + "\n" for one in lines))
    return path


def seen_at(fovy: float, **more: Any) -> dict[str, Any]:
    return {**SCENE, "camera": {**SCENE["camera"], "fovy": fovy}, **more}


def test_lines_are_cases_by_name_or_number_and_read_again(tmp_path: Path) -> None:
    stream = SceneStream(written(tmp_path, seen_at(30), "", seen_at(31, name="a/room.1"), seen_at(32)))

    assert [case.name for case in stream] == ["file/many/0/0", "file/a/room.1", "file/many/0/2"]
    assert [case.scene.camera.fovy for case in stream] == [30, 31, 32]
    assert stream[-1].scene == scene_from_json(seen_at(32), None, "")


def test_a_folder_s_scenes_are_named_by_their_paths(tmp_path: Path) -> None:
    for name in ("b.json", "a/b.json", "a/c.json"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(json.dumps(SCENE))

    assert [case.name for case in SceneStream(tmp_path)] == ["file/a/b", "file/a/c", "file/b"]


def test_a_link_out_of_the_folder_is_refused_and_one_within_is_followed(tmp_path: Path) -> None:
    inside = tmp_path / "inside"
    (inside / "a").mkdir(parents=True)
    (inside / "a" / "b.json").write_text(json.dumps(SCENE))
    (inside / "c.json").symlink_to(inside / "a" / "b.json")
    assert len(SceneStream(inside)) == 2

    (tmp_path / "secret.json").write_text(json.dumps(SCENE))
    (inside / "d.json").symlink_to(tmp_path / "secret.json")
    with pytest.raises(SceneError, match=r"d.json: is a link that leads out of .*inside"):
        SceneStream(inside)


@pytest.mark.process
@pytest.mark.parametrize(
    ("lines", "says"),
    [
        ((SCENE, "{"), r"line 2: is not JSON"),
        ((SCENE, "", "[]"), r"line 3: "),
        ((SCENE, {**SCENE, "shapes": 3}), r"line 2: shapes"),
        ((SCENE, b"\xff".decode("latin-1")), r"line 2: is not JSON"),
        ((seen_at(30, name="a"), SCENE, seen_at(31, name="a")), r"line 3: file/a is the name of .*line 1 too"),
        ((seen_at(30, name="../a"),), r"line 1: name: must be words"),
        ((seen_at(30, name="a/./b"),), r"line 1: name: must be words"),
        ((seen_at(30, name="/a"),), r"line 1: name: must be words"),
        ((seen_at(30, name=7),), r"line 1: name: must be words"),
        ((), r"there are no scenes in it"),
    ],
)
def test_the_first_line_that_is_wrong_is_named_and_nothing_is_written(
    rayproof: Rayproof, tmp_path: Path, lines: tuple[Any, ...], says: str
) -> None:
    path = written(tmp_path, *lines)

    with pytest.raises(SceneError, match=says):
        SceneStream(path)
    ended = rayproof("run", path, "--out", tmp_path / "out")
    assert ended.code == 2
    assert ended.error.count("\n") == 1
    assert not (tmp_path / "out").exists()


def test_a_file_that_changes_while_it_is_read_is_told(tmp_path: Path) -> None:
    path = written(tmp_path, seen_at(30), seen_at(31))
    stream = SceneStream(path)
    written(tmp_path, seen_at(30), seen_at(32))

    assert stream[0].scene.camera.fovy == 30
    with pytest.raises(OSError, match="changed while it was read"):
        stream[1]
