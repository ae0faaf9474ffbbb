"""Limit this process, then become the program: run by its path, alone, so that nothing of rayproof is in the program.

    python -I -S confine.py MEMORY OUTPUT PROGRAM ARGUMENT...

A process of its own does this, since what Python runs between fork and exec may wait for another thread for ever.
"""

import os
import signal
import sys

CANNOT_START = 126  # as shells say it


def main(memory: int, output: int, command: list[str]) -> None:
    """Set the limits [bytes of address space, bytes of a file] and become `command`."""
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
    main(int(sys.argv[1]), int(sys.argv[2]), sys.argv[3:])
