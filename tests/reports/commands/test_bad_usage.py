"""Whatever a user gets wrong ends with 2 and exactly one line that names it."""

from pathlib import Path

import pytest

from tests.reports.commands.conftest import Rayproof

WRONG = {
    "unknown command": (["juggle"], "juggle"),
    "missing argument": (["show"], "case"),
    "unknown case": (["show", "primitives/spher"], "primitives/sphere"),
    "a family for a case": (["show", "primitives"], "names"),
    "unknown selector": (["run", "primitives/spher"], "primitives/sphere"),
    "glob of nothing": (["run", "zzz*"], "zzz*"),
    "missing scene": (["run", "nowhere/scene.json"], "nowhere/scene.json"),
    "unknown reference": (["run", "--require", "tarot"], "analytic"),
    "unknown reference in a list": (["run", "--require", "analytic,tarot"], "tarot"),
    "unknown subject": (["run", "--subject", "maya"], "radiance"),
    "the oracle under test": (["run", "--subject", "analytic"], "certified"),
    "no program under test": (["run", "--subject", "exec:no-such-renderer {scene}"], "no-such-renderer"),
    "formulas of another": (["run", "--subject", "radiance", "--formula", "sphere=stable"], "--subject"),
    "its own witness": (["run", "--subject", "radiance", "--require", "radiance"], "under test"),
    "no memory": (["run", "--memory", "0"], "--memory"),
    "more memory than there are numbers for": (["run", "--memory", "inf", "--subject", "exec:true"], "--memory"),
    "unknown precision": (["run", "--configuration", "float17"], "float32"),
    "unknown slot": (["run", "--formula", "juggling=cascade"], "juggling"),
    "unknown variant": (["run", "--formula", "triangle=cascade"], "triangle/"),
    "no whole number": (["run", "--jobs", "many"], "many"),
    "no worker": (["run", "--jobs", "0"], "--jobs"),
    "no time": (["run", "--timeout", "nan"], "--timeout"),
    "unknown option": (["run", "--fast"], "--fast"),
    "no random scene": (["random", "--count", "0"], "--count"),
    "random scenes by run": (["run", "random"], "random/SEED/NUMBER"),
    "scenes beside a case": (["run", "scenes.jsonl", "primitives"], "scenes.jsonl"),
    "a gate for a part": (["run", "--shard", "1/2", "--history", "h.sqlite"], "rayproof merge"),
    "no part": (["merge"], "name the folders of the parts"),
    "unknown formula in a trade-off": (["tradeoff", "sphere/none"], "sphere/haines"),
    "unknown kind": (["list", "unicorns"], "unicorns"),
    "pixel outside": (["probe", "primitives/sphere", "4000", "0"], "X from 0 to"),
    "negative pixel": (["probe", "primitives/sphere", "0", "-1"], "Y from 0 to"),
    "no pixel": (["probe", "primitives/sphere", "left", "0"], "left"),
    "unknown stage": (["render", "primitives/sphere", "out.exr", "--stages", "ray,karma"], "karma"),
    "no image": (["render", "primitives/sphere", "out.png"], ".exr"),
    "folder without results": (["report", "."], "results.json"),
}


@pytest.mark.process
@pytest.mark.parametrize(("arguments", "named"), WRONG.values(), ids=WRONG.keys())
def test_bad_usage_ends_with_2_and_one_line(
    rayproof: Rayproof, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, arguments: list[str], named: str
) -> None:
    monkeypatch.chdir(tmp_path)

    ended = rayproof(*arguments)

    assert ended.code == 2
    assert ended.out == ""
    assert ended.error.count("\n") == 1
    assert named in ended.error
    assert list(tmp_path.iterdir()) == []


@pytest.mark.process
@pytest.mark.parametrize("scene", ["{", "[]", '{"camera": 7}', '{"shapes": [{"type": "sphere", "radius": -1}]}'])
def test_a_bad_scene_ends_in_one_line_that_names_the_file(rayproof: Rayproof, tmp_path: Path, scene: str) -> None:
    (tmp_path / "bad.json").write_text(scene)

    ended = rayproof("run", tmp_path / "bad.json", "--out", tmp_path / "out")

    assert ended.code == 2
    assert ended.error.count("\n") == 1
    assert "bad.json" in ended.error
    assert not (tmp_path / "out").exists()


def test_an_interrupt_ends_with_130(rayproof: Rayproof, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(family: str) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("rayproof.cases.families.cases_of", interrupted)

    ended = rayproof("list", "cases")

    assert ended.code == 130
    assert ended.error == "rayproof: interrupted\n"


@pytest.mark.parametrize(
    ("written", "meant"),
    [
        ("primtives/sphere", "primitives/sphere"),
        ("primitives/shpere", "primitives/sphere"),
        ("Primitives/Sphere", "primitives/sphere"),
        ("shadows/everyblocker", "shadows/every_blocker"),
        ("shadow", "shadows"),
    ],
)
def test_a_mistyped_case_is_told_what_was_meant_before_anything_starts(
    rayproof: Rayproof, monkeypatch: pytest.MonkeyPatch, written: str, meant: str
) -> None:
    def made(*_: object) -> None:
        raise AssertionError("a worker was started, or every scene made")

    monkeypatch.setattr("rayproof.reports.run.workers.early_workers", made)
    monkeypatch.setattr("rayproof.cases.families.all_cases", made)

    ended = rayproof("run", written)

    assert ended.code == 2
    assert ended.error == f"rayproof: no case matches {written!r}; did you mean {meant}?\n"
