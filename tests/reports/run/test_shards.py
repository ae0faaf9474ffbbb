"""Parts of a plan, put together, are the run that was not parted; what does not belong together is refused."""

import json
import shutil
import subprocess
import sys
from collections import Counter
from pathlib import Path
from typing import Any

import pytest

from rayproof.cases.families import select
from rayproof.cases.scene_json import save_scene
from rayproof.reports.results.document import ResultsError, load_results
from rayproof.reports.results.provenance import load
from rayproof.reports.run.options import RunOptions
from rayproof.reports.run.plan import plan
from rayproof.reports.run.shards import load_shards, merge, number_of, told

CASES = ("behind/sphere", "behind/cube", "behind/plane", "behind/square")
TIMES = {
    "seconds", "kernels", "launches", "judge_seconds", "started", "command", "cached", "remembered", "shard", "shards",
    "key",
}  # fmt: skip
START = "import sys; from rayproof.reports.cli import main; sys.exit(main())"


def rayproof(*words: object) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-c", START, *map(str, words)], capture_output=True, text=True, timeout=280, check=False
    )


def timeless(value: Any) -> Any:
    """Return JSON data without what may differ between two runs of the same."""
    if isinstance(value, dict):
        return {key: timeless(item) for key, item in value.items() if key not in TIMES}
    return [timeless(item) for item in value] if isinstance(value, list) else value


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with a whole run, and its two parts."""
    place = tmp_path_factory.mktemp("parts")
    # The sphere's scene as a file of the user's own, too: its command names the folder.
    scene = place / "mine.json"
    save_scene(select(CASES[:1])[0].scene, scene)
    for name, words in {"whole": (), "one": ("--shard", "1/2"), "two": ("--shard", "2/2")}.items():
        done = rayproof("run", *CASES, scene, *words, "--out", place / name)
        assert done.returncode == 0, done.stderr
    return place


@pytest.mark.process
def test_parts_put_together_are_the_whole(runs: Path) -> None:
    parts = [load_results(runs / name)["cases"] for name in ("one", "two")]
    assert min(map(len, parts)) > 0
    assert sum(map(len, parts)) == len(CASES) + 1
    # Links of whoever made a part are left out.
    (runs / "one" / "scenes" / "stray.json").symlink_to(runs / "mine.json")
    (runs / "two" / "scenes" / "away").symlink_to(runs / "first" / "scenes")

    done = rayproof("merge", runs / "two", runs / "one", "--out", runs / "all")

    assert done.returncode == 0, done.stderr
    whole, merged = (json.loads((runs / name / "results.json").read_text()) for name in ("whole", "all"))
    assert [case["name"] for case in merged["cases"]] == [case["name"] for case in whole["cases"]]
    text = json.dumps(timeless(merged)).replace(str(runs / "all"), str(runs / "whole"))
    assert json.loads(text) == timeless(whole)
    files = [
        {path.relative_to(runs / name) for path in (runs / name).rglob("*") if path.suffix in (".js", ".json", ".png")}
        for name in ("whole", "all")
    ]
    assert files[0] == files[1]
    # What the merged run is computed again by is the whole run's command and scenes.
    assert load(runs / "all", "run")["command"][:-2] == load(runs / "whole", "run")["command"][:-2]


@pytest.mark.process
def test_a_part_that_is_not_there_makes_its_cases_missing(runs: Path, tmp_path: Path) -> None:
    done = rayproof("merge", runs / "one", "--out", tmp_path / "half")

    assert done.returncode == 3
    assert "part 2/2 was not given: its cases are missing" in done.stdout
    results = load_results(tmp_path / "half")
    assert results["finished"] is False
    assert results["summary"]["planned"] == len(CASES) + 1
    assert results["summary"]["missing"] == len(load_results(runs / "two")["cases"])


@pytest.mark.process
def test_what_does_not_belong_together_is_refused_in_a_line(runs: Path, tmp_path: Path) -> None:
    other = tmp_path / "other"
    assert rayproof("run", *CASES[:3], "--shard", "2/2", "--out", other).returncode in (0, 3)
    for folders, said in (
        ((runs / "one", other), "do not belong together: their plan differs"),
        ((runs / "one", runs / "one"), "are both part 1/2"),
        ((runs / "one", runs / "whole"), "holds no part of a run"),
    ):
        done = rayproof("merge", *folders, "--out", tmp_path / "all")

        assert done.returncode == 2
        assert said in done.stderr
        assert done.stderr.count("\n") == 1
    assert not (tmp_path / "all").exists()


def changed(folder: Path, where: Path, **more: Any) -> Path:
    """Return a copy of a part's folder whose results say something else; what is about the part itself is `shard`."""
    shutil.copytree(folder, where, symlinks=True)  # one leads nowhere
    document = json.loads((folder / "results.json").read_text())
    document |= more | {"shard": document["shard"] | more.get("shard", {})}
    (where / "results.json").write_text(json.dumps(document))
    return where


@pytest.mark.process
@pytest.mark.parametrize("what", ["code", "plan", "subject", "demands", "of", "out"])
def test_parts_that_differ_in_anything_but_their_folder_do_not_belong_together(
    runs: Path, tmp_path: Path, what: str
) -> None:
    other = changed(runs / "two", tmp_path / "two", shard={what: 3 if what == "of" else "another"})
    folders = [runs / "one", other]

    if what == "out":
        assert len(load_shards(folders)) == 2
        return
    with pytest.raises(ResultsError, match=f"their {'number of parts' if what == 'of' else what} differs"):
        load_shards(folders)


@pytest.mark.process
@pytest.mark.parametrize("whole", [True, False])
def test_the_whole_is_finished_with_its_last_part(runs: Path, tmp_path: Path, whole: bool) -> None:
    """It began with the first of them, and parts that run side by side take as long as the longest."""
    first = changed(runs / "one", tmp_path / "one", started="2026-01-02T00:00:00+00:00", seconds=20.0)
    second = changed(runs / "two", tmp_path / "two", started="2026-01-01T00:00:00+00:00", seconds=7.0, finished=whole)

    document, _ = merge(load_shards([first, second]), tmp_path, tracer=True)

    assert document["finished"] is whole
    assert (document["started"], document["seconds"]) == ("2026-01-01T00:00:00+00:00", 20.0)


def test_every_name_has_one_part_and_parts_are_alike_in_size() -> None:
    count = Counter(number_of(f"family/{index}", 8) for index in range(8000))

    assert sorted(count) == list(range(1, 9))
    # Of a fair draw the standard deviation is 30; 5 of them.
    assert all(abs(number - 1000) < 150 for number in count.values())


def test_parts_of_other_configurations_have_another_plan() -> None:
    def plan_of(*configurations: str) -> str:
        request = RunOptions(
            selectors=CASES, out=Path("report"), resume=False, require=(), jobs=1, timeout=1.0, json=None,
            configurations=configurations, shard=(1, 2),
        )  # fmt: skip
        return told(request, plan(select(CASES), configurations), ("analytic",))["plan"]

    assert plan_of("float32") == plan_of("float32")
    assert plan_of("float32") != plan_of("float64")
