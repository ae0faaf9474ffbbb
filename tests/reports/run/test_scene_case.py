"""Scene files become cases of one name each, and a case says how it is run again."""

import json
import shlex
from pathlib import Path
from typing import cast

import pytest

from rayproof.cases.families import all_cases
from rayproof.cases.scene_json import load_scene
from rayproof.reports.commands.lookup import scene_named
from rayproof.reports.publish.page.case_data import commands_of
from rayproof.reports.results.case_records import CaseRecord
from rayproof.reports.run.case_record import reproduce, write_scene
from rayproof.reports.run.plan import DEFAULTS, PlannedCase
from rayproof.reports.run.scenes import cases_of_files, scene_path

SCENE = {
    "camera": {
        "eye": [0, -3, 1],
        "target": [0, 0, 0],
        "up": [0, 0, 1],
        "fovy": 40,
        "width": 4,
        "height": 3,
        "near": 0.1,
        "far": 9,
    },
    "shapes": [{"type": "sphere", "albedo": [0.5, 0.5, 0.5]}],
}


def written(path: Path) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(SCENE), encoding="utf-8")
    return path


def test_files_of_one_stem_get_a_name_each_so_that_no_scene_takes_anothers_verdict(tmp_path: Path):
    paths = [written(tmp_path / folder / "room.json") for folder in ("a", "b", "c")]

    assert [case.name for case in cases_of_files(paths)] == ["file/room", "file/room-2", "file/room-3"]


def test_a_number_that_a_file_bears_itself_is_not_given_twice(tmp_path: Path):
    paths = [written(tmp_path / name) for name in ("room-2.json", "a/room.json", "b/room.json")]

    assert len({case.name for case in cases_of_files(paths)}) == 3


def test_a_file_named_twice_is_asked_once(tmp_path: Path):
    path = written(tmp_path / "room.json")

    assert len(cases_of_files([path, tmp_path / "." / "room.json"])) == 1


def test_the_command_of_a_users_scene_finds_the_very_scene(tmp_path: Path):
    (case,) = cases_of_files([written(tmp_path / "two rooms.json")])
    folder = tmp_path / "out put"

    path = write_scene(folder, case)
    *command, named = shlex.split(reproduce(folder, PlannedCase(case=case, configurations=DEFAULTS)))

    assert command == ["rayproof", "run"]
    assert Path(named) == folder / path
    assert load_scene(named) == case.scene


def test_the_command_that_a_report_shows_works_in_its_folder_and_in_that_of_the_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (case,) = cases_of_files([written(tmp_path / "two rooms.json")])
    scene = write_scene(tmp_path / "out put", case)
    (tmp_path / "out put" / "results.json").touch()
    for out in (Path("out put"), tmp_path / "out put"):
        command = reproduce(out, PlannedCase(case=case, configurations=DEFAULTS))
        shown, _ = commands_of(cast(CaseRecord, {"name": case.name, "scene": scene, "reproduce": command}))
        assert shown == f"rayproof run 'out put/{scene}'"
        for folder, words in ((tmp_path, shown), (tmp_path / "out put", shown), (tmp_path / "out put", command)):
            monkeypatch.chdir(folder)
            assert load_scene(scene_path(shlex.split(words)[2])) == case.scene
            assert scene_named(shlex.split(words)[2]) == case.scene
    # Elsewhere a file that is not there is not looked for.
    (tmp_path / "out put" / "results.json").unlink()
    assert scene_path(f"out put/{scene}") == Path("out put", scene)


def test_a_configuration_that_was_asked_for_is_asked_for_again(tmp_path):
    case = all_cases()[0]

    planned = PlannedCase(case=case, configurations=("float64/sphere=textbook",))

    assert reproduce(tmp_path, planned).endswith(" --configuration float64/sphere=textbook")
