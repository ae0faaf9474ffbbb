"""A script that limits memory and output, executes a program, and ends the program's processes if its caller dies.

    python -I -S keeper.py CALLER MEMORY OUTPUT PROGRAM ARGUMENT...

It is a separate process, since Python code between fork and exec may wait for another thread forever. On Linux it
remains as the program's keeper: it ends with the program's exit code or signal, and if its caller (a process number)
is killed, it ends the program and all processes that the program started, also those in other sessions.
"""

import contextlib
import ctypes
import os
import signal
import sys
import time

CANNOT_START = 126  # the exit code of shells for this
PDEATHSIG, SUBREAPER = 1, 36  # PR_SET_PDEATHSIG and PR_SET_CHILD_SUBREAPER, linux/prctl.h
PARTING = 5.0  # s, waiting for killed processes to end
PAUSE = 0.005  # s


def keep(caller: int) -> None:
    """Fork and return in the child, which executes the program; the parent ends with the child, or with the caller."""
    prctl = ctypes.CDLL(None).prctl
    signal.signal(signal.SIGTERM, lambda *_: _end_all())
    prctl(SUBREAPER, 1, 0, 0, 0)  # orphaned descendants become children of this process
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
    for descriptor in (0, 1):  # so that the program's pipes close when it ends
        os.close(descriptor)
    ended, status = os.wait()
    while ended != child:
        ended, status = os.wait()
    if os.WIFSIGNALED(status):
        _limit_cores()
        with contextlib.suppress(OSError):  # signals that cannot be set
            signal.signal(os.WTERMSIG(status), signal.SIG_DFL)
        os.kill(os.getpid(), os.WTERMSIG(status))
    os._exit(os.waitstatus_to_exitcode(status) & 0xFF)


def _end_all() -> None:
    """Kill the children, and the orphans that become children of this process, until there are none; then exit."""
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
    children = []
    for name in os.listdir("/proc"):  # noqa: PTH208  importing pathlib takes as long as the rest of this script
        if name.isdigit():
            with contextlib.suppress(OSError), open(f"/proc/{name}/stat", "rb") as file:  # noqa: PTH123
                # The state and the parent follow the name in parentheses, which may contain any character.
                if int(file.read().rpartition(b")")[2].split()[1]) == parent:
                    children.append(int(name))
    return children


def _limit_cores() -> None:
    import resource

    resource.setrlimit(resource.RLIMIT_CORE, (0, resource.getrlimit(resource.RLIMIT_CORE)[1]))


def main(caller: int, memory: int, output: int, command: list[str]) -> None:
    """Set the limits `memory` (address space) and `output` (of a file) [bytes], and execute `command`."""
    if sys.platform == "linux":
        keep(caller)
    if os.name == "posix":
        import resource

        for kind, most in ((resource.RLIMIT_AS, memory), (resource.RLIMIT_FSIZE, output), (resource.RLIMIT_CORE, 0)):
            _, hard = resource.getrlimit(kind)
            most = most if hard == resource.RLIM_INFINITY else min(most, hard)
            resource.setrlimit(kind, (most, most))
    # rayproof's workers or Python ignore these signals, which the program would inherit.
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
