"""The table of commands and their groups, `main`, exit codes, and the messages for errors.

Each command is a file in `reports/commands` and is imported when it is called, so `rayproof --help` imports no large
library.
"""

import errno
import sys
from collections.abc import Sequence
from typing import TYPE_CHECKING

from rayproof.reports.processes.signals import Stopping
from rayproof.reports.program_name import called, remember

if TYPE_CHECKING:
    from cyclopts import App

HELP = """A conformance harness for ray tracers: every stage checked against closed forms and independent renderers.

Exit codes: 0 all pass or warn, 1 some fail, 2 bad usage or input, 3 something could not be measured, 130 interrupted.
"""

_IN = "rayproof.reports.commands"
# Group -> an example, and its commands: name -> the function and its summary. A command of two words is defined by the
# application of its first word.
GROUPS: dict[str, tuple[str, dict[str, tuple[str, str]]]] = {
    "test": (
        'run primitives shadows --subject "exec:./mine {scene} {output}"',
        {
            "run": (f"{_IN}.run:run", "Judge the tracer or another renderer on cases or scene files; write a report."),
            "random": (f"{_IN}.run:random", "Judge it on scenes drawn at random, with hostile features."),
            "merge": (f"{_IN}.merge:merge", "Merge the parts of a run that several machines made, into one run."),
            "gate": (f"{_IN}.gate:app", "Keep a file of known failures, and check a run against it."),
        },
    ),
    "look": (
        "probe primitives/sphere 48 36",
        {
            "report": (f"{_IN}.report:app", "Publish a run again, compare two runs, show their history or two images."),
            "list": (
                f"{_IN}.list:catalogue",
                "List cases, formulas, references, metrics, mistakes, ladders, terms or a schema.",
            ),
            "show": (f"{_IN}.show:show", "Show one case: its scene, its requirements, how to reproduce it."),
            "probe": (f"{_IN}.probe:probe", "Show one pixel, every stage, as each renderer answers it."),
            "certify": (f"{_IN}.certify:certify", "Enclose the exact values of pixels, with proof."),
            "call": (f"{_IN}.call:call", "Call a program under test once, and keep all that it got and wrote."),
            "shrink": (f"{_IN}.shrink:shrink", "Find the smallest scene that fails as a case does; write an issue."),
        },
    ),
    "study": (
        "compare sphere/textbook sphere/haines",
        {
            "compare": (f"{_IN}.compare:compare", "Compare two formulas, configurations or runs: errors and time."),
            "stability": (f"{_IN}.stability:stability", "Measure formulas on ladders of ill-conditioned inputs."),
            "worst": (f"{_IN}.stability:worst_inputs", "Search for the inputs that a formula answers worst."),
            "limits": (f"{_IN}.stability:limits", "Measure up to where a renderer is right on ever harder scenes."),
            "vectors": (
                f"{_IN}.vectors:app",
                "Write test vectors of ray formulas for any language; judge answers to them.",
            ),
            "tradeoff": (f"{_IN}.tradeoff:tradeoff", "Draw error against run time: formulas, precisions, samples."),
        },
    ),
    "begin": (
        "new adapter mine.py",
        {
            "new": (f"{_IN}.new:app", "Write a starter: a formula, an adapter of a renderer, a workflow for CI."),
        },
    ),
    "scenes": (
        "render primitives/sphere sphere.exr --stages distance,radiance",
        {
            "render": (f"{_IN}.scenes:render", "Render a scene file with the tracer alone."),
            "import": (f"{_IN}.scenes:import_scene", "Turn another program's scene into a scene file."),
            "export": (f"{_IN}.scenes:export_scene", "Write a scene as Mitsuba 3 XML or for POV-Ray."),
        },
    ),
    "upkeep": ("cache verify", {"cache": (f"{_IN}.cache:cache", "List, verify or clear what earlier runs kept.")}),
}
COMMANDS: dict[str, tuple[str, str]] = {
    name: command for _, commands in GROUPS.values() for name, command in commands.items()
}

BAD_USAGE, NOT_MEASURED, INTERRUPTED = 2, 3, 130
# Errors of the machine when a file is written or a process started. They are not errors in rayproof, and a traceback
# would not help the user.
OF_THE_MACHINE = {
    errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EROFS, errno.EACCES, errno.EPERM, errno.EIO,
    errno.EMFILE, errno.ENFILE, errno.ENOMEM, errno.EAGAIN,
}  # fmt: skip


def application() -> "App":
    """Return the command line's parser; commands are imported when they are called."""
    from cyclopts import App

    # Plain text, because rich's Markdown would take a quarter of the time of --help.
    app = App(
        name="rayproof",
        help=HELP,
        help_format="plaintext",
        version=version_line,
        version_flags="--version",
        suppress_keyboard_interrupt=False,
    )
    for order, (name, (path, _)) in enumerate(COMMANDS.items()):
        app.command(path, name=name, sort_key=order)
    return app


def version_line() -> str:
    """Return the command's name and version."""
    from importlib.metadata import version

    return f"rayproof {version('rayproof')}"


def main(arguments: Sequence[str] | None = None, program: "App | None" = None) -> int:
    """Run the command of `arguments` (default: the arguments of the process) and return the exit code.

    `program` is the parser of another program with the same exit codes and messages; by default rayproof's.
    """
    # The signal handlers are installed before large imports, so that an interrupted start ends with one line, too.
    with Stopping() as stopping:
        try:
            remember(arguments)
            words = sys.argv[1:] if arguments is None else list(arguments)
            if program is None and words in ([], ["--help"], ["-h"]):
                return _overview()
            return _called(words, program)
        except KeyboardInterrupt:
            pass
        except Exception as error:
            # A library that is interrupted during its import may raise an exception of its own.
            if not stopping.told:
                # An unforeseen error is a bug in rayproof, not a verdict; exit code 1 would mean that a case failed.
                sys.excepthook(type(error), error, error.__traceback__)
                return NOT_MEASURED
        sys.stderr.write("rayproof: interrupted\n")
        return INTERRUPTED


def _overview() -> int:
    """Print the list of commands, without importing the parser of arguments."""
    wide = max(map(len, COMMANDS))
    lines: list[str] = []
    for group, (example, commands) in GROUPS.items():
        lines += [f"{group.capitalize()}, for example: {called()} {example}"]
        lines += [f"  {name:<{wide}}  {help_line}" for name, (_, help_line) in commands.items()]
        lines += [""]
    about, codes = HELP.strip().split("\n\n")
    end = f"{called()} COMMAND --help shows a command's options; {called()} list terms TERM explains a word.\n"
    try:
        sys.stdout.write("\n".join([f"Usage: {called()} COMMAND", "", about, "", *lines, codes, end]))
        sys.stdout.flush()
    except BrokenPipeError:  # the reader has closed the pipe; Python would report it again at exit
        sys.stdout = None
        return NOT_MEASURED
    return 0


def _called(words: list[str], program: "App | None") -> int:
    """Run a command and return the exit code; report usage errors and errors of the machine in one line."""
    from cyclopts import CycloptsError

    from rayproof.reports.commands.usage import UsageError, disown, one_line
    from rayproof.tracer.kernel.compiler import NoBackendError

    try:
        result = (program or application())(words, exit_on_error=False, print_error=False, result_action="return_value")
    except (UsageError, CycloptsError) as error:
        sys.stderr.write(f"rayproof: {one_line(error)}\n")
        return BAD_USAGE
    except ValueError as error:
        from rayproof.reports.results.case_table import DamagedTableError

        if not isinstance(error, DamagedTableError):
            raise
        # The user's file is damaged. Records are validated when they are read, which may be late in a command.
        sys.stderr.write(f"rayproof: {one_line(error)}\n")
        return BAD_USAGE
    except NoBackendError as error:
        sys.stderr.write(f"rayproof: {one_line(error)}\n")
        return NOT_MEASURED
    except OSError as error:
        if error.errno not in OF_THE_MACHINE:
            raise
        sys.stderr.write(f"rayproof: {one_line(error)}\n")
        return NOT_MEASURED
    except MemoryError:
        sys.stderr.write("rayproof: there is not enough memory\n")
        return NOT_MEASURED
    except SystemExit:  # rich exits with 1 if the reader of the output has closed the pipe; that is not a verdict
        return NOT_MEASURED
    finally:
        disown()
    return result if isinstance(result, int) else 0
