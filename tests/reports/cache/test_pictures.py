"""Kept pictures: the same scene and images give them again, anything else does not."""

from pathlib import Path
from typing import Any

from rayproof.reports.cache import pictures
from rayproof.reports.cache.store import Store


def job(folder: Path, **changed: Any) -> dict[str, Any]:
    """Return a job whose files are there, with what it would draw."""
    for name, text in {
        "scenes/a/b.json": "scene",
        "images/a/b.js": "pixels",
        "p.png": "png",
        "p.view.js": "view",
    }.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text)
    return {
        "name": "a/b",
        "scene": str(folder / "scenes/a/b.json"),
        "folder": str(folder),
        "case": {"renders": [{"image": None}], "pixels": "images/a/b.js"},
        "ours": "tracer-float32",
        "theirs": "analytic",
        "stage": None,
        "picture": str(folder / "p.png"),
        "view": "p.view.js",
    } | changed


def test_what_was_drawn_of_the_same_images_is_written_into_another_folder(tmp_path: Path) -> None:
    store = Store(tmp_path / "cache")
    first, second = job(tmp_path / "first"), job(tmp_path / "second")
    pictures.keep(store, pictures.question(first), first)
    (tmp_path / "second/p.png").unlink()
    (tmp_path / "second/p.view.js").unlink()

    assert pictures.recall(store, pictures.question(second), second)

    assert (tmp_path / "second/p.png").read_text() == "png"
    assert (tmp_path / "second/p.view.js").read_text() == "view"


def test_anything_shown_makes_another_question(tmp_path: Path) -> None:
    known = pictures.question(job(tmp_path / "a"))
    for changed in ({"ours": "embree"}, {"theirs": "embree"}, {"stage": "normal"}, {"picture": None}, {"name": "a/c"}):
        assert pictures.question(job(tmp_path / "a", **changed)) != known
    for name in ("scenes/a/b.json", "images/a/b.js"):
        other = job(tmp_path / "b")
        (tmp_path / "b" / name).write_text("other")
        assert pictures.question(other) != known


def test_what_is_not_there_is_not_recalled(tmp_path: Path) -> None:
    one = job(tmp_path / "a")

    assert not pictures.recall(Store(tmp_path / "cache"), pictures.question(one), one)
