"""Temporary folders with an owner, and the removal of folders whose owner was killed."""

import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from rayproof.reports.ownership import abandoned, acquired
from rayproof.reports.processes.signals import put_off

PREFIX = "rayproof-"


class Scratch:
    """A new folder, in `within` or the system's temporary folder, that this process owns until it removes it."""

    def __init__(self, within: Path | None = None) -> None:
        self.folder = Path(tempfile.mkdtemp(prefix=PREFIX, dir=within))
        self._lock = acquired(self.folder)

    def remove(self) -> None:
        """Remove the folder and its contents, as far as possible."""
        shutil.rmtree(self.folder, ignore_errors=True)
        self._lock.release(force=True)


@contextmanager
def scratch() -> Iterator[None]:
    """Use a new folder for this process's temporary files inside the body, and remove abandoned folders."""
    with put_off():  # gettempdir writes a file to test the folder
        sweep(Path(tempfile.gettempdir()))
    before, own = tempfile.tempdir, None
    try:
        with put_off():  # a signal cannot separate making the folder from assigning it
            own = Scratch()
        tempfile.tempdir = str(own.folder)
        yield
    finally:
        tempfile.tempdir = before
        if own is not None:
            own.remove()


def sweep(folder: Path) -> None:
    """Remove the scratch folders in `folder` whose owners have ended, except those of other users."""
    for path in folder.glob(f"{PREFIX}*"):
        try:
            own = path.lstat().st_uid == os.geteuid() if os.name == "posix" else True
        except OSError:
            continue
        if own and not path.is_symlink() and abandoned(path):
            shutil.rmtree(path, ignore_errors=True)
