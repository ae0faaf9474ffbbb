"""A store of images: what is wrong with it costs images at most, and nothing is taken from it unchecked."""

import json
import threading
import zlib
from base64 import b64decode
from pathlib import Path
from typing import Any

import pytest

from rayproof.reports.cli import main
from rayproof.reports.results import artifacts
from rayproof.reports.results.artifacts import Artifacts, ArtifactsError, fetch, hand_over
from rayproof.reports.results.document import load_results
from rayproof.reports.results.image_script import handed_over
from rayproof.reports.results.records import CaseRecord

pytest.importorskip("fsspec", reason="fsspec is not installed: rayproof[artifacts]")
PIXELS, DATA = "images/played/one.js", b"pixels"


@pytest.fixture
def store(tmp_path: Path) -> Artifacts:
    """Return a store in a folder."""
    return Artifacts((tmp_path / "store").as_uri())


def passed(folder: Path) -> CaseRecord:
    """Return the record of a case that passed, whose image lies in a folder."""
    (folder / PIXELS).parent.mkdir(parents=True)
    (folder / PIXELS).write_bytes(DATA)
    return {"name": "played/one", "family": "played", "verdict": "pass", "pixels": PIXELS, "masks": {}, "renders": []}


def test_an_image_goes_to_the_store_and_comes_back(store: Artifacts, tmp_path: Path) -> None:
    record = passed(tmp_path)

    hand_over(store, record, tmp_path)

    assert not (tmp_path / PIXELS).exists()
    (about,) = record["artifacts"].values()
    assert about["bytes"] == len(DATA)
    stored = [path for path in (tmp_path / "store").rglob("*") if path.is_file()]
    assert [path.name for path in stored] == [about["sha256"]]
    assert fetch(store, record, tmp_path) == []
    assert (tmp_path / PIXELS).read_bytes() == DATA


@pytest.mark.parametrize("content", [b"others", DATA + b"!", b""], ids=["digest", "longer", "shorter"])
def test_an_object_that_is_another_is_refused(store: Artifacts, tmp_path: Path, content: bytes) -> None:
    record = passed(tmp_path)
    hand_over(store, record, tmp_path)
    (stored,) = (path for path in (tmp_path / "store").rglob("*") if path.is_file())
    stored.write_bytes(content)

    (wrong,) = fetch(store, record, tmp_path)

    assert "is not what the record says" in wrong
    assert not (tmp_path / PIXELS).exists()


def test_a_record_that_names_another_place_fetches_nothing(store: Artifacts, tmp_path: Path) -> None:
    about = store.put(DATA)
    record = passed(tmp_path) | {"pixels": "images/../../out.js", "artifacts": {"images/../../out.js": about}}

    (wrong,) = fetch(store, record, tmp_path)

    assert "is no image of it" in wrong
    assert not (tmp_path.parent / "out.js").exists()


class Broken:
    """A store that fails, or that never answers."""

    def __init__(self, *, silent: bool) -> None:
        self.asked, self._silent = 0, silent

    def exists(self, path: str) -> bool:
        self.asked += 1
        if self._silent:
            threading.Event().wait()
        raise ConnectionError(f"nobody at {path[:0]}the other end")


@pytest.mark.parametrize("silent", [False, True], ids=["fails", "silent"])
def test_a_store_that_is_away_costs_images_and_no_verdict(
    store: Artifacts, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, silent: bool
) -> None:
    monkeypatch.setattr(artifacts, "PATIENCE", 0.2)
    broken: Any = Broken(silent=silent)
    store._system = broken
    record, why = passed(tmp_path / "a"), "no answer within 0.2 s" if silent else "nobody at the other end"

    hand_over(store, record, tmp_path / "a")
    hand_over(store, passed(tmp_path / "b"), tmp_path / "b")

    assert record["verdict"] == "pass"
    assert record["pixels"] is None
    assert record["artifacts"] == {}
    assert why in record["notes"][0]["note"]
    assert broken.asked == 1, "it is not asked again for a while"


def test_the_images_of_what_failed_stay(store: Artifacts, tmp_path: Path) -> None:
    record = passed(tmp_path) | {"verdict": "fail"}

    hand_over(store, record, tmp_path)

    assert (tmp_path / PIXELS).exists()
    assert "artifacts" not in record


@pytest.mark.parametrize(
    ("url", "complaint"),
    [
        ("nowhere", "is a URL such as"),
        ("no-such-scheme://bucket", "no-such-scheme"),
        ("ftp://me:secret@127.0.0.1/images", "credentials come from the environment"),
        ("file:///proc/rayproof", "nothing can be written there"),
    ],
)
def test_a_store_that_cannot_be_used_is_refused(url: str, complaint: str) -> None:
    with pytest.raises(ArtifactsError, match=complaint) as told:
        Artifacts(url).check()

    assert "secret" not in str(told.value)


@pytest.mark.process
@pytest.mark.process
@pytest.mark.references
@pytest.mark.parametrize("where", [(), ("--scheduler", "local:1")], ids=["pool", "cluster"])
def test_a_run_puts_the_images_of_what_passed_there_and_a_report_brings_them(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], where: tuple[str, ...]
) -> None:
    if where:
        pytest.importorskip("distributed", reason="Dask is not installed: rayproof[dask]")
    url, out = (tmp_path / "store").as_uri(), tmp_path / "out"

    assert main(["run", "primitives/sphere", "--artifacts", url, "--out", str(out), *where]) == 0
    (case,) = load_results(out)["cases"]
    kept = [path for path in out.rglob("images/**/*") if path.is_file()]
    assert kept == []
    assert list(case["artifacts"]) == [case["pixels"]]
    told = zlib.decompress(b64decode(json.loads(handed_over((out / "data" / "0001.js").read_text()))))
    assert b"report DIR --fetch primitives/sphere --artifacts URL" in told

    assert main(["report", str(out), "--fetch", "all", "--artifacts", url]) == 0
    assert "of 1 of 1 cases" in capsys.readouterr().out
    assert (out / str(case["pixels"])).stat().st_size == case["artifacts"][str(case["pixels"])]["bytes"]
