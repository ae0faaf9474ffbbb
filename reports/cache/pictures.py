"""Pictures and 3-D views drawn before, of the same scene with the same images by the same code."""

import hashlib
from dataclasses import dataclass
from pathlib import Path
from typing import TypedDict

import numpy as np

from rayproof.reports.cache.digests import Key, code, machine
from rayproof.reports.cache.entries import DamagedEntryError
from rayproof.reports.cache.store import Store
from rayproof.reports.results.records import RenderRecord

CODE = ("rayproof.reports.publish.scene3d.picture_worker", "rayproof.reports.publish.scene3d.pictures")
PACKAGES = ("numpy", "pillow", "pyvista", "trame-vtk", "vtk")


@dataclass(frozen=True, kw_only=True)
class PictureKey(Key):
    """A case's picture and view: of which files, and what of them they show."""

    name: str
    files: tuple[tuple[str, str], ...]  # name and digest of each that is read, the scene first
    ours: str | None
    theirs: str | None
    stage: str | None
    view: str | None  # where it goes: it hands itself over under that name
    drawn: bool  # whether a picture is wanted too


class PicturedCase(TypedDict):
    """Where the images of a case are, as its record has them."""

    renders: list[RenderRecord] | None
    pixels: str | None


class PictureJob(TypedDict):
    """What a child must know to draw a case: its files, whose answers it shows, and where the drawings go."""

    name: str
    scene: str
    folder: str
    case: PicturedCase
    ours: str | None
    theirs: str | None
    stage: str | None
    picture: str | None
    view: str | None


def question(job: PictureJob) -> str:
    """Return the digest of all that a job's drawings depend on: the files it reads, and what it is told to show."""
    folder, case = Path(job["folder"]), job["case"]
    read = [case.get("pixels"), *(render.get("image") for render in case.get("renders") or ())]
    files = [(name, _digest(folder / name)) for name in map(str, filter(None, read))]
    return PictureKey(
        name=job["name"],
        # The scene's path names the folder, which the drawing does not depend on; its content is told.
        files=(("scene", _digest(Path(job["scene"]))), *files),
        ours=job["ours"],
        theirs=job["theirs"],
        stage=job["stage"],
        view=job["view"],
        drawn=job["picture"] is not None,
        code=code(CODE),
        machine=machine(PACKAGES),
    ).digest


def recall(store: Store, key: str, job: PictureJob) -> bool:
    """Write what was drawn before where the job wants it; say whether it was there."""
    try:
        drawn = store.read(key, lambda entry: {path: entry[1][kind].tobytes() for kind, path in _paths(job).items()})
    except DamagedEntryError:
        return False
    if drawn is None:
        return False
    for path, data in drawn.items():
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(data)
    return True


def keep(store: Store, key: str, job: PictureJob) -> None:
    """Keep what was drawn; a store that cannot be written keeps nothing, and nothing depends on it."""
    try:
        arrays = {kind: np.frombuffer(path.read_bytes(), dtype=np.uint8) for kind, path in _paths(job).items()}
        store.put(key, {"kind": "picture", "reference": job["name"]}, arrays)
    except OSError:
        return


def _paths(job: PictureJob) -> dict[str, Path]:
    wanted = {"picture": job["picture"], "view": job["view"]}
    return {kind: Path(job["folder"], path) for kind, path in wanted.items() if path is not None}


def _digest(path: Path) -> str:
    try:
        return hashlib.sha256(path.read_bytes()).hexdigest()
    except OSError:
        return ""
