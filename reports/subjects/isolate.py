"""Shut this process off, then run the program: without network, other processes, secrets or a way to write.

    python -I -S isolate.py ORDER PROGRAM ARGUMENT...

ORDER is JSON: `folder` stays writable, `hidden` folders are empty, what lies at `shown` paths can be read all the same,
but never what lies in `secret` folders.
By user namespaces (Linux, user_namespaces(7), mount_namespaces(7)): what is mounted here cannot be taken away by the
program, which has no capability, nor from namespaces of its own, where these mounts are locked.
"""

import ctypes
import json
import os
import signal
import struct
import sys

TYPE_CHECKING = False
if TYPE_CHECKING:  # `typing` takes as long to import as all else here
    from typing import TypedDict

    class Order(TypedDict):
        """What the program may see, as paths; only `folder` stays writable."""

        folder: str
        hidden: list[str]
        shown: list[str]
        secret: list[str]


CANNOT = 125
NEWNS, NEWIPC, NEWUSER, NEWPID, NEWNET = 0x20000, 0x8000000, 0x10000000, 0x20000000, 0x40000000  # linux/sched.h
READ_ONLY, NOSUID, NODEV, BIND, RECURSIVE, PRIVATE = 1, 2, 4, 0x1000, 0x4000, 0x40000  # linux/mount.h
PDEATHSIG, NO_NEW_PRIVS = 1, 38  # linux/prctl.h
MOUNT_SETATTR, AT_FDCWD, AT_RECURSIVE = 442, -100, 0x8000
STRANGER = 1000  # the user's number inside where it is 0 outside: the program must not keep root's capabilities

libc = ctypes.CDLL(None, use_errno=True)


class CannotError(Exception):
    """What this platform does not allow, in words."""


def checked(result: int, what: str) -> None:
    """Raise CannotError if a system call failed."""
    if result != 0:
        raise CannotError(f"{what}: {os.strerror(ctypes.get_errno())}")


def mount(source: str, target: str, kind: str | None, flags: int, data: str | None = None) -> None:
    """Mount; raise CannotError where that is refused."""
    texts = (text.encode() if text is not None else None for text in (source, target, kind))
    checked(libc.mount(*texts, ctypes.c_ulong(flags), data.encode() if data else None), f"mount on {target}")


def read_only(path: str) -> None:
    """Let nothing be written below `path`, other mounts below it included."""
    attributes = struct.pack("<4Q", READ_ONLY, 0, 0, 0)
    result = libc.syscall(
        MOUNT_SETATTR, AT_FDCWD, path.encode(), ctypes.c_uint(AT_RECURSIVE), attributes, ctypes.c_size_t(32)
    )
    checked(result, f"mount read-only {path}")


def shut_off() -> None:
    """Enter namespaces of its own."""
    user, group = os.getuid(), os.getgid()
    checked(libc.unshare(NEWUSER | NEWNS | NEWPID | NEWNET | NEWIPC), "new namespaces")
    for name, content in (
        ("setgroups", "deny"),
        ("uid_map", f"{user or STRANGER} {user} 1"),
        ("gid_map", f"{group or STRANGER} {group} 1"),
    ):
        try:
            with open(f"/proc/self/{name}", "w") as file:  # noqa: PTH123  pathlib takes as long to import as all else here
                file.write(content)
        except OSError as error:
            raise CannotError(f"{name}: {error.strerror}") from None


def furnish(folder: str, hidden: list[str], shown: list[str], secret: list[str]) -> None:
    """Make everything read-only, hide some folders and put back what is shown; in process 1 of its namespace."""
    mount("none", "/", None, RECURSIVE | PRIVATE)
    kept = [(path, os.open(path, os.O_PATH), os.path.isdir(path)) for path in (*shown, folder)]  # noqa: PTH112
    read_only("/")
    for path in sorted(map(os.path.realpath, hidden)):
        empty(path)
    for path, handle, is_folder in kept:
        if not os.path.exists(path) or path == folder:  # noqa: PTH110
            if is_folder:
                os.makedirs(path, exist_ok=True)  # noqa: PTH103
            else:
                os.makedirs(os.path.dirname(path), exist_ok=True)  # noqa: PTH103, PTH120
                os.close(os.open(path, os.O_CREAT | os.O_WRONLY, 0o600))
            mount(f"/proc/self/fd/{handle}", path, None, BIND | RECURSIVE)
            if path == folder:
                writable(path)
        os.close(handle)
    for path in map(os.path.realpath, secret):
        empty(path)
    mount("proc", "/proc", "proc", NOSUID | NODEV)


def empty(path: str) -> None:
    """Let nothing be seen of what lies in a folder, if there is one; what is written there is lost."""
    if os.path.isdir(path):  # noqa: PTH112
        mount("tmpfs", path, "tmpfs", NOSUID | NODEV, "mode=0755,size=64m")


def writable(path: str) -> None:
    """Undo `read_only` for one mount."""
    attributes = struct.pack("<4Q", 0, READ_ONLY, 0, 0)
    result = libc.syscall(MOUNT_SETATTR, AT_FDCWD, path.encode(), ctypes.c_uint(0), attributes, ctypes.c_size_t(32))
    checked(result, f"mount writable {path}")


def run(order: "Order", command: list[str]) -> int:
    """Run the program as process 2 of a namespace of its own and return its wait status."""
    shut_off()
    libc.prctl(PDEATHSIG, signal.SIGKILL, 0, 0, 0)
    reading, writing = os.pipe()
    if os.fork() == 0:
        first(order, command, writing)
    os.close(writing)
    os.wait()
    told = os.read(reading, 4096)
    if told[:1] != b"=":
        raise CannotError(told.decode(errors="replace") or "the program's keeper ended")
    return int(told[1:])


def first(order: "Order", command: list[str], writing: int) -> None:
    """Be process 1: furnish, start the program, wait for it alone; all that is left ends with this process."""
    try:
        libc.prctl(PDEATHSIG, signal.SIGKILL, 0, 0, 0)
        folder = order["folder"]
        furnish(folder, order["hidden"], order["shown"], order["secret"])
        os.chdir(folder)
        program = os.fork()
        if program == 0:
            os.close(writing)
            libc.prctl(NO_NEW_PRIVS, 1, 0, 0, 0)
            try:
                os.execv(command[0], command)
            except OSError as error:
                sys.stderr.write(f"it cannot be started: {error.strerror}: {command[0]}\n")
                sys.stderr.flush()
                os._exit(126)
        ended, status = os.wait()
        while ended != program:
            ended, status = os.wait()
        os.write(writing, f"={status}".encode())
    except (CannotError, OSError) as error:
        os.write(writing, str(error).encode()[:1000])
    os._exit(0)


def main() -> None:
    """Run the program and end as it did; say why where this platform cannot shut it off."""
    try:
        status = run(json.loads(sys.argv[1]), sys.argv[2:])
    except (CannotError, OSError) as error:
        sys.stderr.write(f"it cannot be confined here: {error}\n")
        sys.exit(CANNOT)
    if os.WIFSIGNALED(status):
        signal.signal(os.WTERMSIG(status), signal.SIG_DFL)
        os.kill(os.getpid(), os.WTERMSIG(status))
    os._exit(os.waitstatus_to_exitcode(status) & 0xFF)


if __name__ == "__main__":
    main()
