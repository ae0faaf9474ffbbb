"""A script that shuts a program off by Linux namespaces and control groups: mounts, no network, secrets hidden.

    python -I -S isolate.py ORDER PROGRAM ARGUMENT...

ORDER is JSON: `folder` stays writable, `hidden` folders are empty, what lies at `shown` paths can be read all the same,
but never what lies in `secret` folders. With an `enclosure` the program instead finds nothing but the folders that are
allowed, its own, and a scratch folder of limited size; what all its processes take together is limited as well.
By user namespaces (Linux, user_namespaces(7), mount_namespaces(7)): what is mounted here cannot be taken away by the
program, which has no capability, nor from namespaces of its own, where these mounts are locked.
"""

# pathlib takes as long to import as all else here:
# ruff: noqa: PTH101, PTH102, PTH103, PTH106, PTH110, PTH112, PTH114, PTH115, PTH117, PTH118, PTH119, PTH120, PTH123
# ruff: noqa: PTH208, PTH211
import contextlib
import ctypes
import json
import os
import resource
import signal
import stat
import struct
import sys
import time

TYPE_CHECKING = False
if TYPE_CHECKING:  # `typing` takes as long to import as all else here
    from typing import TypedDict

    class Order(TypedDict):
        """What the program may see, as paths; only `folder` stays writable."""

        folder: str
        hidden: list[str]
        shown: list[str]
        secret: list[str]
        enclosure: "Enclosed | None"

    class Enclosed(TypedDict):
        """What a stranger's program finds, and what it and all that it starts may take."""

        allowed: list[str]  # readable at their own places
        masked: list[str]  # folders below them that are empty
        submission: str  # the folder that it finds as /submission, read-only
        products: str | None  # of a build: where /submission, which it may change, is written when it ends well
        processes: int
        memory: int  # bytes
        disk: int  # bytes of each of its folders
        seconds: float  # of processor time


CANNOT, BEYOND = 125, 124
NEWNS, NEWIPC, NEWUSER, NEWPID, NEWNET = 0x20000, 0x8000000, 0x10000000, 0x20000000, 0x40000000  # linux/sched.h
READ_ONLY, NOSUID, NODEV, BIND, RECURSIVE, PRIVATE = 1, 2, 4, 0x1000, 0x4000, 0x40000  # linux/mount.h
PDEATHSIG, NO_NEW_PRIVS = 1, 38  # linux/prctl.h
MOUNT_SETATTR, AT_FDCWD, AT_RECURSIVE = 442, -100, 0x8000
STRANGER = 1000  # the user's number inside where it is 0 outside: the program must not keep root's capabilities
FIRST_UNUSED = 2**30  # users' numbers that no system gives away, so that the kernel's limit of a user's processes holds
# The C library has no function of pivot_root; x86-64 has a number of its own.
PIVOT_ROOT, DETACH = 155 if os.uname().machine == "x86_64" else 41, 2  # unistd.h, linux/fs.h
OTHERS_UNSEEN = "hidepid=2"
HOME, CALL, SUBMISSION = "/tmp", "/tmp/call", "/submission"  # as an enclosed program finds them
DEVICES = ("null", "zero", "full", "random", "urandom")
MOST_FILES = 50_000  # on each file system that an enclosed program writes
GLANCE = 0.01  # s between looks at what lives in an enclosure
BLOCK = 2**20  # bytes

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


def shut_off(*, enclosed: bool) -> None:
    """Enter namespaces of its own; of root's, an enclosed program is a user that nobody else is."""
    user, group, root = os.getuid(), os.getgid(), os.getuid() == 0
    maps = [
        ("setgroups", "deny"),
        ("uid_map", f"{user or STRANGER} {user} 1"),
        ("gid_map", f"{group or STRANGER} {group} 1"),
    ]
    if not (enclosed and root):
        checked(libc.unshare(NEWUSER | NEWNS | NEWPID | NEWNET | NEWIPC), "new namespaces")
        return write_maps("self", maps)
    # Two users can be mapped only from outside, by a process that stays there.
    unused = FIRST_UNUSED + os.getpid()
    maps = [("uid_map", f"0 0 1\n{STRANGER} {unused} 1"), ("gid_map", f"0 0 1\n{STRANGER} {unused} 1")]
    reading, writing = os.pipe()
    helper = os.fork()
    if helper == 0:
        try:
            os.close(writing)
            os.read(reading, 1)
            write_maps(str(os.getppid()), maps)
        except BaseException:
            os._exit(1)
        os._exit(0)
    checked(libc.unshare(NEWUSER | NEWNS | NEWPID | NEWNET | NEWIPC), "new namespaces")
    os.write(writing, b"!")
    if os.waitpid(helper, 0)[1] != 0:
        raise CannotError("users of the namespace: they cannot be mapped")
    return None


def write_maps(process: str, maps: list[tuple[str, str]]) -> None:
    """Write who is who in a process's namespace of users."""
    for name, content in maps:
        try:
            with open(f"/proc/{process}/{name}", "w") as file:
                file.write(content)
        except OSError as error:
            raise CannotError(f"{name}: {error.strerror}") from None


def furnish(folder: str, hidden: list[str], shown: list[str], secret: list[str]) -> None:
    """Make everything read-only, hide some folders and put back what is shown; in process 1 of its namespace."""
    mount("none", "/", None, RECURSIVE | PRIVATE)
    kept = [(path, os.open(path, os.O_PATH), os.path.isdir(path)) for path in (*shown, folder)]
    read_only("/")
    for path in sorted(map(os.path.realpath, hidden)):
        empty(path)
    # A folder before those in it: one that is made for them would pass for it.
    for path, handle, is_folder in sorted(kept):
        if not os.path.exists(path) or path == folder:
            if is_folder:
                os.makedirs(path, exist_ok=True)
            else:
                os.makedirs(os.path.dirname(path), exist_ok=True)
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
    if os.path.isdir(path):
        mount("tmpfs", path, "tmpfs", NOSUID | NODEV, "mode=0755,size=64m")


def writable(path: str) -> None:
    """Undo `read_only` for one mount."""
    attributes = struct.pack("<4Q", 0, READ_ONLY, 0, 0)
    result = libc.syscall(MOUNT_SETATTR, AT_FDCWD, path.encode(), ctypes.c_uint(0), attributes, ctypes.c_size_t(32))
    checked(result, f"mount writable {path}")


def enclose(folder: str, order: "Enclosed") -> "list[tuple[str, int]]":
    """Make a root of its own with what is allowed alone; return open folders by what they are for."""
    checked(libc.unshare(NEWNS), "mounts of its own")  # pivot_root moves all processes that share them
    mount("none", "/", None, RECURSIVE | PRIVATE)
    opened = {path: os.open(path, os.O_PATH) for path in order["allowed"] if not os.path.islink(path)}
    links = {path: os.readlink(path) for path in order["allowed"] if os.path.islink(path)}
    devices = {f"/dev/{name}": os.open(f"/dev/{name}", os.O_PATH) for name in DEVICES}
    kept = [(CALL, os.open(folder, os.O_RDONLY)), (SUBMISSION, os.open(order["submission"], os.O_RDONLY))]
    if order["products"] is not None:
        kept.append(("products", os.open(order["products"], os.O_RDONLY)))
    mount("tmpfs", folder, "tmpfs", NOSUID | NODEV, "mode=0755,size=1m")
    for path, handle in (*opened.items(), *devices.items()):
        place(folder + path, handle)
    for path, target in links.items():
        os.makedirs(os.path.dirname(folder + path), exist_ok=True)
        os.symlink(target, folder + path)
    for path in order["masked"]:
        empty(folder + path)
    read_only(folder)
    writable(folder)  # itself, until all is there
    limited = f"mode=0777,size={order['disk']},nr_inodes={MOST_FILES}"
    for path in (HOME, SUBMISSION, "/proc"):
        os.mkdir(folder + path)
    mount("tmpfs", folder + HOME, "tmpfs", NOSUID | NODEV, limited)
    os.mkdir(folder + CALL)
    os.chmod(folder + CALL, 0o777)
    handles = dict(kept)
    copied(f"/proc/self/fd/{handles[CALL]}", folder + CALL, order["disk"], open_to_all=True)
    if order["products"] is None:
        mount(f"/proc/self/fd/{handles[SUBMISSION]}", folder + SUBMISSION, None, BIND | RECURSIVE)
        read_only(folder + SUBMISSION)
    else:
        mount("tmpfs", folder + SUBMISSION, "tmpfs", NOSUID | NODEV, limited)
        copied(f"/proc/self/fd/{handles[SUBMISSION]}", folder + SUBMISSION, order["disk"], open_to_all=True)
    mount("proc", folder + "/proc", "proc", NOSUID | NODEV, OTHERS_UNSEEN)
    attributes = struct.pack("<4Q", READ_ONLY, 0, 0, 0)
    result = libc.syscall(MOUNT_SETATTR, AT_FDCWD, folder.encode(), ctypes.c_uint(0), attributes, ctypes.c_size_t(32))
    checked(result, "mount the enclosure read-only")
    os.chdir(folder)
    checked(libc.syscall(PIVOT_ROOT, b".", b"."), "pivot_root")
    checked(libc.umount2(b".", DETACH), "leave the old root")
    os.chdir(SUBMISSION)
    return kept


def place(path: str, handle: int) -> None:
    """Bind what was opened, a folder or a file, at a path that is not there yet."""
    if stat.S_ISDIR(os.fstat(handle).st_mode):
        os.makedirs(path, exist_ok=True)
    else:
        os.makedirs(os.path.dirname(path), exist_ok=True)
        os.close(os.open(path, os.O_CREAT | os.O_WRONLY, 0o644))
    mount(f"/proc/self/fd/{handle}", path, None, BIND | RECURSIVE)


class RefusedError(Exception):
    """What an enclosed program left or took, in words."""


def copied(source: str, target: str, most: int, *, open_to_all: bool = False) -> int:
    """Copy a tree of files, folders and links that stay below it; return what of `most` bytes is left."""
    for where, folders, names in os.walk(source):
        inside = os.path.relpath(where, source)
        for name in (*folders, *names):
            path, there = os.path.join(where, name), os.path.join(target, inside, name)
            facts = os.lstat(path)
            if stat.S_ISLNK(facts.st_mode):
                link = os.readlink(path)
                if os.path.isabs(link) or os.path.normpath(os.path.join(inside, link)).startswith(".."):
                    raise RefusedError(f"a link leads out of its folder: {os.path.join(inside, name)}")
                os.symlink(link, there)
            elif stat.S_ISDIR(facts.st_mode):
                os.mkdir(there)
                os.chmod(there, 0o777 if open_to_all else 0o755)
            elif stat.S_ISREG(facts.st_mode):
                most = written(path, there, most)
                os.chmod(there, (0o666 if open_to_all else 0o644) | facts.st_mode & 0o111)
            else:
                raise RefusedError(f"it is neither file, folder nor link: {os.path.join(inside, name)}")
    return most


def written(source: str, target: str, most: int) -> int:
    """Copy one regular file, no link, of at most so many bytes; return how many are left."""
    facts = os.lstat(source)
    if not stat.S_ISREG(facts.st_mode):
        raise RefusedError(f"it made of {os.path.basename(source)} something that is no regular file")
    reading = os.open(source, os.O_RDONLY | os.O_NOFOLLOW)
    if facts.st_size > most:
        raise RefusedError(f"it holds more than is allowed: {os.path.basename(source)}")
    writing = os.open(target, os.O_CREAT | os.O_EXCL | os.O_WRONLY | os.O_NOFOLLOW, 0o600)
    left = facts.st_size
    while left > 0 and (block := os.read(reading, min(BLOCK, left))):
        os.write(writing, block)
        left -= len(block)
    os.close(reading)
    os.close(writing)
    return most - facts.st_size


def end_all() -> None:
    """Kill all that lives in this namespace beside its process 1, and wait until nothing does."""
    with contextlib.suppress(ProcessLookupError):
        os.kill(-1, signal.SIGKILL)
    with contextlib.suppress(ChildProcessError):
        while True:
            os.wait()


def beyond(order: "Enclosed", beside: int) -> str | None:
    """Return in words what the processes of this namespace take too much of, together; None if nothing."""
    threads, memory, ticks = 0, 0, 0
    for name in os.listdir("/proc"):
        if name.isdigit() and int(name) != beside:
            with contextlib.suppress(OSError), open(f"/proc/{name}/stat", "rb") as file:
                # proc(5), from the third field on: after the name in parentheses, which may hold anything.
                numbers = file.read().rpartition(b")")[2].split()
                ticks += sum(map(int, numbers[11:15]))
                threads, memory = threads + int(numbers[17]), memory + int(numbers[21]) * resource.getpagesize()
    own = resource.getrusage(resource.RUSAGE_CHILDREN)  # of orphans that were waited for
    seconds = ticks / os.sysconf("SC_CLK_TCK") + own.ru_utime + own.ru_stime
    if threads > order["processes"]:
        return f"it had more than {order['processes']} processes and threads"
    if memory > order["memory"]:
        return f"its processes held more than {order['memory'] / 2**20:g} MiB of memory"
    return f"it took more than {order['seconds']:g} s of processor time" if seconds > order["seconds"] else None


def control_groups(order: "Enclosed") -> list[str]:
    """Make control groups that hold the limits, where this process may; return their folders."""
    made = []
    limits = {"pids.max": order["processes"] + 2, "memory.max": order["memory"] + 2 * order["disk"]}
    limits["memory.limit_in_bytes"] = limits["memory.max"]
    with open("/proc/self/cgroup") as file:
        lines = [line.rstrip("\n").split(":", 2) for line in file]
    for _, names, path in lines:
        above = f"/sys/fs/cgroup/{names}{path.rstrip('/')}"
        group = f"{above}/rayproof-{os.getpid()}"
        with contextlib.suppress(OSError):
            for name in os.listdir(above):  # of calls that were killed
                if name.startswith("rayproof-") and not os.path.exists(f"/proc/{name[9:]}"):
                    os.rmdir(f"{above}/{name}")
            os.mkdir(group)
            made.append(group)
            held = False
            for name, most in limits.items():
                if os.path.exists(f"{group}/{name}"):
                    with contextlib.suppress(OSError), open(f"{group}/{name}", "w") as file:
                        file.write(str(most))
                        held = True
            if not held:
                os.rmdir(made.pop())
    return made


def run(order: "Order", command: list[str]) -> int:
    """Run the program as process 2 of a namespace of its own and return its wait status."""
    enclosure = order.get("enclosure")
    groups = control_groups(enclosure) if enclosure else []
    entrances = []
    for group in groups:
        with contextlib.suppress(OSError):
            entrances.append(os.open(f"{group}/cgroup.procs", os.O_WRONLY))
    try:
        shut_off(enclosed=enclosure is not None)
        libc.prctl(PDEATHSIG, signal.SIGKILL, 0, 0, 0)
        reading, writing = os.pipe()
        if os.fork() == 0:
            for entrance in entrances:
                with contextlib.suppress(OSError):
                    os.write(entrance, b"0")
            first(order, command, writing)
        os.close(writing)
        os.wait()
    finally:
        for group in groups:
            with contextlib.suppress(OSError):
                os.rmdir(group)
    told = os.read(reading, 4096)
    if told[:1] == b"!":
        raise RefusedError(told[1:].decode(errors="replace"))
    if told[:1] != b"=":
        raise CannotError(told.decode(errors="replace") or "the program's keeper ended")
    return int(told[1:])


def first(order: "Order", command: list[str], writing: int) -> None:
    """Be process 1: furnish, start the program, wait for it alone; all that is left ends with this process."""
    try:
        libc.prctl(PDEATHSIG, signal.SIGKILL, 0, 0, 0)
        folder, enclosure = order["folder"], order.get("enclosure")
        if enclosure is not None:
            status = kept_within(folder, enclosure, command)
        else:
            furnish(folder, order["hidden"], order["shown"], order["secret"])
            os.chdir(folder)
            program = start(command, None)
            ended, status = os.wait()
            while ended != program:
                ended, status = os.wait()
        os.write(writing, f"={status}".encode())
    except RefusedError as error:
        os.write(writing, f"!{error}".encode(errors="replace")[:1000])
    except (CannotError, OSError) as error:
        os.write(writing, str(error).encode()[:1000])
    os._exit(0)


def start(command: list[str], enclosure: "Enclosed | None") -> int:
    """Start the program, without a way to more rights and without an open file beyond the usual three."""
    program = os.fork()
    if program == 0:
        try:
            if enclosure is not None:
                os.closerange(3, resource.getrlimit(resource.RLIMIT_NOFILE)[0])
                if os.getuid() == 0:
                    os.setgroups([])
                    os.setgid(STRANGER)
                    os.setuid(STRANGER)
                resource.setrlimit(resource.RLIMIT_NPROC, (enclosure["processes"], enclosure["processes"]))
                seconds = int(enclosure["seconds"]) + 2
                resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds))
                os.nice(5)  # so that its keeper is never starved
            libc.prctl(NO_NEW_PRIVS, 1, 0, 0, 0)
            os.execvp(command[0], command)
        except OSError as error:
            sys.stderr.write(f"it cannot be started: {error.strerror}: {command[0]}\n")
            sys.stderr.flush()
        os._exit(126)
    return program


def kept_within(folder: str, order: "Enclosed", command: list[str]) -> int:
    """Run a program in an enclosure, count what it takes, and bring out what it made; return its wait status."""
    handles = dict(enclose(folder, order))
    program = start(command, order)
    ended, status = os.waitpid(-1, os.WNOHANG)
    while ended != program:
        if ended == 0:
            time.sleep(GLANCE)
        if (why := beyond(order, os.getpid())) is not None:
            end_all()
            raise RefusedError(why)
        ended, status = os.waitpid(-1, os.WNOHANG)
    end_all()
    if order["products"] is not None:
        if status == 0:
            copied(SUBMISSION, f"/proc/self/fd/{handles['products']}", order["disk"])
        return status
    for name in ("image.exr", "image.pfm"):
        if os.path.lexists(f"{CALL}/{name}"):
            written(f"{CALL}/{name}", f"/proc/self/fd/{handles[CALL]}/{name}", order["disk"])
    return status


def main() -> None:
    """Run the program and end as it did; say why where this platform cannot shut it off."""
    try:
        status = run(json.loads(sys.argv[1]), sys.argv[2:])
    except RefusedError as error:
        sys.stderr.write(f"{error}\n")
        sys.exit(BEYOND)
    except (CannotError, OSError) as error:
        sys.stderr.write(f"it cannot be confined here: {error}\n")
        sys.exit(CANNOT)
    if os.WIFSIGNALED(status):
        signal.signal(os.WTERMSIG(status), signal.SIG_DFL)
        os.kill(os.getpid(), os.WTERMSIG(status))
    os._exit(os.waitstatus_to_exitcode(status) & 0xFF)


if __name__ == "__main__":
    main()
