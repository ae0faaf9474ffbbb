"""A script that limits memory and output, then becomes the program; it stays as keeper and ends what is left.

    python -I -S keeper.py CALLER MEMORY OUTPUT PROGRAM ARGUMENT...

A process of its own does this, since what Python runs between fork and exec may wait for another thread for ever. On
Linux it stays as the program's keeper: it ends as the program does, and if its caller (a process number) is killed it
ends the program with all that it started, be it in sessions of their own.
"""

import contextlib
import ctypes
import os
import signal
import sys
import time

CANNOT_START = 126  # as shells say it
PDEATHSIG, SUBREAPER = 1, 36  # PR_SET_PDEATHSIG and PR_SET_CHILD_SUBREAPER, linux/prctl.h
PARTING = 5.0  # s for what was killed to be gone
PAUSE = 0.005  # s


def keep(caller: int) -> None:
    """Return in a child that the program is to take the place of; end as that child does, or when the caller has."""
    prctl = ctypes.CDLL(None).prctl
    signal.signal(signal.SIGTERM, lambda *_: _end_all())
    prctl(SUBREAPER, 1, 0, 0, 0)  # whatever loses its parent becomes this process's child
    prctl(PDEATHSIG, signal.SIGTERM, 0, 0, 0)
    if os.getppid() != caller:
        os._exit(CANNOT_START)
    keeper, child = os.getpid(), os.fork()
    if child == 0:
        signal.signal(signal.SIGTERM, signal.SIG_DFL)
        prctl(PDEATHSIG, signal.SIGKILL, 0, 0, 0)
        if os.getppid() != keeper:
            os._exit(CANNOT_START)
        return
    for descriptor in (0, 1):  # the program's: whoever reads its output must see that it is closed
        os.close(descriptor)
    ended, status = os.wait()
    while ended != child:
        ended, status = os.wait()
    if os.WIFSIGNALED(status):
        _limit_cores()
        with contextlib.suppress(OSError):  # of those that cannot be set
            signal.signal(os.WTERMSIG(status), signal.SIG_DFL)
        os.kill(os.getpid(), os.WTERMSIG(status))
    os._exit(os.waitstatus_to_exitcode(status) & 0xFF)


def _end_all() -> None:
    """Kill the children, then theirs, which have become this process's, until there are none; end."""
    deadline = time.monotonic() + PARTING
    with contextlib.suppress(ChildProcessError):
        while time.monotonic() < deadline:
            for child in _children(os.getpid()):
                with contextlib.suppress(ProcessLookupError, PermissionError):
                    os.kill(child, signal.SIGKILL)
            while os.waitpid(-1, os.WNOHANG)[0]:
                pass
            time.sleep(PAUSE)
    os._exit(CANNOT_START)


def _children(parent: int) -> list[int]:
    found = []
    for name in os.listdir("/proc"):  # noqa: PTH208  pathlib takes as long to import as all else here
        if name.isdigit():
            with contextlib.suppress(OSError), open(f"/proc/{name}/stat", "rb") as file:  # noqa: PTH123
                # After the name in parentheses, which may hold anything: the state and the parent.
                if int(file.read().rpartition(b")")[2].split()[1]) == parent:
                    found.append(int(name))
    return found


def _limit_cores() -> None:
    import resource

    resource.setrlimit(resource.RLIMIT_CORE, (0, resource.getrlimit(resource.RLIMIT_CORE)[1]))


def main(caller: int, memory: int, output: int, command: list[str]) -> None:
    """Set the limits [bytes of address space, bytes of a file] and become `command`."""
    if sys.platform == "linux":
        keep(caller)
    if os.name == "posix":
        import resource

        for kind, most in ((resource.RLIMIT_AS, memory), (resource.RLIMIT_FSIZE, output), (resource.RLIMIT_CORE, 0)):
            _, hard = resource.getrlimit(kind)
            most = most if hard == resource.RLIM_INFINITY else min(most, hard)
            resource.setrlimit(kind, (most, most))
    # Which rayproof's workers or Python ignore, and a program would inherit.
    for name in ("SIGINT", "SIGPIPE", "SIGXFSZ"):
        if hasattr(signal, name):
            signal.signal(getattr(signal, name), signal.SIG_DFL)
    try:
        os.execv(command[0], command)
    except OSError as error:
        sys.stderr.write(f"it cannot be started: {error.strerror}: {command[0]}\n")
        sys.exit(CANNOT_START)


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3]), sys.argv[4:])
