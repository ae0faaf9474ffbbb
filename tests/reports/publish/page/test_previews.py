"""Previews: images of the worst cases are kept up to a size, and the others say which command makes theirs."""

import base64
import re
import zlib
from pathlib import Path

import pytest
from matplotlib.image import imread

from rayproof.reports.cli import main
from rayproof.reports.publish.page.case_data import write_case_data
from rayproof.reports.publish.page.previews import leave_previews
from rayproof.reports.results.document import load_results
from rayproof.reports.results.images import keeps_images
from tests.reports.publish.sample import make_folder

FAULTY = ["--configuration", "float32/lambert=fault_missing"]


def size_of(folder: Path) -> int:
    """Return how many bytes the EXR files of a folder have."""
    return sum(path.stat().st_size for path in (folder / "images").rglob("*.exr"))


def test_the_worst_of_each_cause_keep_their_images_up_to_a_size(tmp_path: Path) -> None:
    results = make_folder(tmp_path)
    before = size_of(tmp_path)
    with_files = [case["name"] for case in results["cases"] if any(r.get("image") for r in case["renders"])]

    left = leave_previews(tmp_path, results, most=0.6 * before)

    previews = {case["name"]: case["preview"] for case in results["cases"] if "preview" in case}
    assert 0 < left == len(previews) < len(with_files)
    assert size_of(tmp_path) <= 0.6 * before
    assert "lights/broken" not in previews  # the worst
    for case in results["cases"]:
        assert keeps_images(case) != (case["name"] in previews) or case["name"] not in with_files
    for name, preview in filter(lambda pair: pair[1], previews.items()):
        assert imread(tmp_path / preview).shape[0] == 30, name


def test_without_need_nothing_is_left_out_and_old_previews_go(tmp_path: Path) -> None:
    results = make_folder(tmp_path)
    before = size_of(tmp_path)
    (tmp_path / "previews").mkdir()
    (tmp_path / "previews" / "0001.png").touch()

    assert leave_previews(tmp_path, results) == 0
    assert size_of(tmp_path) == before
    assert not (tmp_path / "previews").exists()


@pytest.mark.process
def test_a_failing_run_says_it_and_a_resumed_one_renders_what_has_no_images(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    run = ["run", "primitives/sphere", "primitives/plane", *FAULTY, "--out", str(tmp_path)]
    monkeypatch.setattr("rayproof.reports.publish.page.previews.leave_previews.__kwdefaults__", {"most": 2.0e6})
    assert main(run) == 1

    assert "of 1 case that did not pass only previews are kept; --keep-images all" in capsys.readouterr().out
    results = load_results(tmp_path)
    assert (results["images_kept"]["cases"], results["images_kept"]["previews"]) == (1, 1)
    (case,) = (case for case in results["cases"] if "preview" in case)
    (path, *_) = write_case_data(tmp_path, tmp_path / "data" / "0009.js", case)
    packed = max(re.findall(r"[A-Za-z0-9+/=]{100,}", path.read_text()), key=len)
    data = zlib.decompress(base64.b64decode(packed)).decode()
    assert '"preview":"previews/0001.png"' in data
    assert "--keep-images all` makes these" in data
    assert main([*run, "--resume"]) == 1
    assert "(kept)" in (said := capsys.readouterr().out)
    assert f"{case['name']} (kept)" not in said
    assert main([*run, "--keep-images", "all"]) == 1
    assert "previews" not in load_results(tmp_path)["images_kept"]
    assert not (tmp_path / "previews").exists()


@pytest.mark.process
def test_parts_of_a_run_keep_their_images_until_they_are_together(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("rayproof.reports.publish.page.previews.leave_previews.__kwdefaults__", {"most": 0.0})
    parts = [str(tmp_path / part) for part in "12"]
    for part in "12":
        main(["run", "primitives/s*", *FAULTY, "--shard", f"{part}/2", "--out", str(tmp_path / part)])

    assert main(["merge", *parts, "--out", str(tmp_path / "all")]) == 1

    results = load_results(tmp_path / "all")
    assert all("previews" not in load_results(Path(part))["images_kept"] for part in parts)
    assert results["images_kept"]["previews"] == 2
    assert len(results["diagnosis"][0]["cases"]) == 2
    assert size_of(tmp_path / "all") == 0
