"""The command line, thin: what commands there are, how errors are told, what the exit code says.

Each command is a file in `reports/commands`, imported when it is called: `rayproof --help` imports nothing heavy.
"""

import sys
import traceback
from collections.abc import Sequence
from importlib.metadata import version

from cyclopts import App, CycloptsError

from reports.commands.usage import UsageError, one_line

HELP = """A conformance harness for ray tracers: every stage checked against closed forms and independent renderers.

Exit codes: 0 all pass or warn, 1 some fail, 2 bad usage or input, 3 something could not be measured, 130 interrupted.
"""

COMMANDS: dict[str, tuple[str, str]] = {
    "run": ("reports.commands.run:run", "Judge the tracer on cases or scene files and write a report."),
    "report": ("reports.commands.report:report", "Publish a results folder again, without rendering."),
    "list": ("reports.commands.list:catalogue", "List cases, formulas, references or metrics."),
    "show": ("reports.commands.show:show", "Show one case: its scene, its requirements, how to reproduce it."),
    "probe": ("reports.commands.probe:probe", "Show one pixel, every stage, as each renderer answers it."),
    "render": ("reports.commands.render:render", "Render a scene file with the tracer alone."),
    "schema": ("reports.commands.schema:schema", "Print the JSON Schema of scene files."),
}

BAD_USAGE, NOT_MEASURED, INTERRUPTED = 2, 3, 130


def application() -> App:
    """Return the command line's parser, its commands still unimported."""
    app = App(name="rayproof", help=HELP, version=lambda: f"rayproof {version('rayproof')}", version_flags="--version")
    for name, (path, help_line) in COMMANDS.items():
        app.command(path, name=name, help=help_line)
    return app


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command that `arguments` (default: the process's) name and return the exit code."""
    try:
        given = sys.argv[1:] if arguments is None else list(arguments)
        result = application()(given, exit_on_error=False, print_error=False, result_action="return_value")
    except (UsageError, CycloptsError) as error:
        sys.stderr.write(f"rayproof: {one_line(error)}\n")
        return BAD_USAGE
    except KeyboardInterrupt:
        sys.stderr.write("rayproof: interrupted\n")
        return INTERRUPTED
    except (
        Exception
    ):  # an unforeseen error is a bug of rayproof, not a verdict: Python's own exit code 1 would claim one
        traceback.print_exc()
        return NOT_MEASURED
    return result if isinstance(result, int) else 0
