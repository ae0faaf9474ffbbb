"""`UsageError`: a user's mistake, reported in one line; and the results folders that a command owns."""

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

from rayproof.reports.ownership import owned
from rayproof.reports.results.files import legible

_OWNED = ExitStack()  # the folders that this process's command writes


class UsageError(Exception):
    """Bad usage or bad input; the message is one line that names the mistake."""


def one_line(error: Exception) -> str:
    """Return an error's message as a single line."""
    if isinstance(error, OSError) and error.filename is not None:
        return legible(f"{error.filename}: {error.strerror}")
    message = error.args[0] if isinstance(error, KeyError) and error.args else error
    return legible(" ".join(str(message).split())) or type(error).__name__


@contextmanager
def told_in_one_line() -> Iterator[None]:
    """Convert the errors that a bad name, value or file causes in the body into a UsageError.

    Use it only around code that reads the user's input: around a computation it would report a bug as the user's
    mistake.
    """
    try:
        yield
    except (ValueError, LookupError, OSError) as error:
        raise UsageError(one_line(error)) from error


def writable_folder(folder: Path) -> None:
    """Create `folder` if it does not exist; raise OSError if nothing can be written there."""
    folder.mkdir(parents=True, exist_ok=True)
    probe = folder / ".writable"
    probe.touch()
    probe.unlink()


def own(folder: Path) -> None:
    """Create a folder of results if it does not exist, and own it until `disown`.

    Raises:
        OwnedError: another process owns the folder.
        OSError: nothing can be written there.

    """
    _OWNED.enter_context(owned(folder))


def disown() -> None:
    """Release every folder that `own` took, at the end of the command."""
    _OWNED.close()
