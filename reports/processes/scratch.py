"""Temporary folders that name their owner, and the sweep of those whose owner was killed."""

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
    """A new folder, in `within` or where temporary files are made, that this process owns until it removes it."""

    def __init__(self, within: Path | None = None) -> None:
        self.folder = Path(tempfile.mkdtemp(prefix=PREFIX, dir=within))
        self._lock = acquired(self.folder)

    def remove(self) -> None:
        """Remove the folder with all that is in it, as far as that can be done."""
        shutil.rmtree(self.folder, ignore_errors=True)
        self._lock.release(force=True)


@contextmanager
def scratch() -> Iterator[None]:
    """Have this process's temporary files in a folder of their own for the body; sweep what killed ones left."""
    with put_off():  # to find the folder for temporary files a file is written there
        sweep(Path(tempfile.gettempdir()))
    before, own = tempfile.tempdir, None
    try:
        with put_off():  # from here on a folder is there, and is known
            own = Scratch()
        tempfile.tempdir = str(own.folder)
        yield
    finally:
        tempfile.tempdir = before
        if own is not None:
            own.remove()


def sweep(folder: Path) -> None:
    """Remove the scratch folders in `folder` whose owners have ended; what is another user's is left alone."""
    for path in folder.glob(f"{PREFIX}*"):
        try:
            ours = path.lstat().st_uid == os.geteuid() if os.name == "posix" else True
        except OSError:
            continue
        if ours and not path.is_symlink() and abandoned(path):
            shutil.rmtree(path, ignore_errors=True)
