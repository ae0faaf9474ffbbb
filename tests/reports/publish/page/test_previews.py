"""Previews: images of the worst cases are kept up to a size, and the others say which command makes theirs."""

from pathlib import Path

from matplotlib.image import imread

from rayproof.reports.publish.page.previews import leave_previews
from rayproof.reports.results.images import keeps_images
from tests.reports.publish.sample import make_folder


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
