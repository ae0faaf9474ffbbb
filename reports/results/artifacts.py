"""Images of cases that passed, kept in a store that all machines of a run reach: a bucket, or a shared folder.

An object is named by the SHA-256 of its content, so that the same image is stored once, whoever made it. A case's
record holds digest and length of each of its images, and who fetches one checks both: the store may be anybody's. What
reads and writes is fsspec, which finds credentials in the environment; an address that has some in it is refused, since
addresses stand in records.
"""

import hashlib
import threading
import time
import uuid
from collections.abc import Callable
from concurrent.futures import Future, wait
from pathlib import Path, PurePosixPath
from typing import TYPE_CHECKING, Any, TypeVar, cast
from urllib.parse import urlsplit

from rayproof.reports.results.images import inside
from rayproof.reports.results.outcomes import Outcome
from rayproof.reports.results.records import ArtifactRecord, CaseRecord

if TYPE_CHECKING:
    from fsspec import AbstractFileSystem

PATIENCE = 20.0  # s that a store may take for an object
AWAY = 60.0  # s for which a store that failed is not asked again
LONGEST = 200  # characters of what a store's package says

Found = TypeVar("Found")


class ArtifactsError(ValueError):
    """A store that cannot be used; one line."""


class Artifacts:
    """The store at a URL such as `s3://bucket/prefix` or `file:///shared/folder`.

    Raises:
        ArtifactsError: it is no such URL, it has credentials in it, or what reads such a store is not installed.

    """

    def __init__(self, url: str) -> None:
        parts = urlsplit(url)
        if not parts.scheme or "://" not in url:
            raise ArtifactsError(f"--artifacts is a URL such as s3://BUCKET/PREFIX or file:///FOLDER, got {url}")
        if "@" in parts.netloc or parts.query:
            raise ArtifactsError("--artifacts: credentials come from the environment, not in the URL")
        try:
            from fsspec.core import url_to_fs
        except ImportError:
            raise ArtifactsError("--artifacts needs fsspec: pip install 'rayproof[artifacts]'") from None
        try:
            found: tuple[AbstractFileSystem, str] = url_to_fs(url)
        except (ImportError, ValueError, OSError) as error:
            raise ArtifactsError(f"--artifacts {url}: {_line(error)}") from None
        self.url = url
        self._system, self._root = found[0], found[1].rstrip("/")
        self._away, self._why = 0.0, ""  # until when [s of the monotonic clock], and what was wrong

    def check(self) -> None:
        """Raise ArtifactsError if nothing can be written there."""
        path = f"{self._root}/.rayproof-{uuid.uuid4().hex}"

        def probe() -> None:
            self._write(path, b"rayproof")
            self._system.rm_file(path)

        try:
            self._asked(probe)
        except Exception as error:
            raise ArtifactsError(f"--artifacts {self.url}: nothing can be written there: {_line(error)}") from None

    def put(self, data: bytes) -> ArtifactRecord:
        """Store an object, unless it is there; return its digest and length.

        Raises:
            OSError: it cannot be stored, or could not a moment ago.

        """
        digest = hashlib.sha256(data).hexdigest()
        path = self._path(digest)
        if time.monotonic() < self._away:
            raise OSError(self._why)

        def store() -> None:
            if not self._system.exists(path):
                self._write(path, data)

        try:
            self._asked(store)
        except Exception as error:  # of whatever package reads such a store
            self._away, self._why = time.monotonic() + AWAY, _line(error)
            raise OSError(self._why) from error
        return {"sha256": digest, "bytes": len(data)}

    def get(self, about: ArtifactRecord) -> bytes:
        """Return an object; raise OSError if it is not there, or not what the record says."""
        digest, length = about["sha256"], about["bytes"]

        def load() -> bytes:
            return cast(bytes, self._system.cat_file(self._path(digest), end=length + 1))

        try:
            data = self._asked(load)
        except Exception as error:
            raise OSError(_line(error)) from error
        if len(data) != length or hashlib.sha256(data).hexdigest() != digest:
            raise OSError(f"the object {digest[:16]} is not what the record says: its digest or length differs")
        return data

    def _path(self, digest: str) -> str:
        return f"{self._root}/{digest[:2]}/{digest}"

    def _write(self, path: str, data: bytes) -> None:
        self._system.makedirs(path.rpartition("/")[0], exist_ok=True)
        draft = f"{path}.{uuid.uuid4().hex}"
        self._system.pipe_file(draft, data)  # an object that is half written has no digest for a name
        self._system.mv(draft, path)

    @staticmethod
    def _asked(ask: Callable[[], Found]) -> Found:
        """Return what a store answers; raise TimeoutError where it does not within PATIENCE."""
        future: Future[Found] = Future()

        def answer() -> None:
            try:
                future.set_result(ask())
            except BaseException as error:
                future.set_exception(error)

        # Not of a pool of threads, which would be waited for when the process ends.
        threading.Thread(target=answer, daemon=True).start()
        if not wait([future], PATIENCE).done:
            raise TimeoutError(f"no answer within {PATIENCE:g} s")
        return future.result()


def hand_over(store: Artifacts, record: CaseRecord, folder: Path) -> None:
    """Put the images of a case that passed into the store, and their digests into its record.

    What cannot be stored is lost, and the record's notes say so; the verdict stands. Of a case that did not pass the
    images stay in the folder, since causes are sought in them.
    """
    if record["verdict"] != Outcome.PASS:
        return
    stored: dict[str, ArtifactRecord] = {}
    lost: str | None = None
    for path in dict.fromkeys(images_of(record)):
        if not inside(folder, path):
            continue
        try:
            stored[path] = store.put((folder / path).read_bytes())
        except OSError as error:
            lost = str(error)
        (folder / path).unlink()
    record["artifacts"] = stored
    if lost is None:
        return
    if record.get("pixels") not in stored:
        record["pixels"] = record["masks"] = None
    for render in record.get("renders", []):
        if render.get("image") not in stored:
            render["image"] = None
    told = f"images could not be stored at {store.url}, and are lost: {lost}"
    record["notes"] = [*record.get("notes", []), {"reference": "the run", "note": told}]


def fetch(store: Artifacts, record: CaseRecord, folder: Path) -> list[str]:
    """Bring the images of a case from the store into its results folder; return what is wrong, a sentence each."""
    wrong = []
    for path, about in record.get("artifacts", {}).items():
        parts = PurePosixPath(path).parts
        if path not in images_of(record) or parts[0] != "images" or ".." in parts:
            wrong.append(f"{record['name']}: {path} is no image of it")
            continue
        if inside(folder, path):
            continue
        try:
            data = store.get(about)
        except OSError as error:
            wrong.append(f"{record['name']}: {path}: {error}")
            continue
        (folder / path).parent.mkdir(parents=True, exist_ok=True)
        (folder / path).write_bytes(data)
    return wrong


def images_of(record: CaseRecord) -> list[str]:
    """Return the paths of a case's images in its results folder, whether they are there or in a store."""
    named: list[Any] = [record.get("pixels"), *(render.get("image") for render in record.get("renders", []))]
    return [path for path in named if isinstance(path, str) and path]


def _line(error: BaseException) -> str:
    return (" ".join(str(error).split()) or type(error).__name__)[:LONGEST]
