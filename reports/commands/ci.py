"""`rayproof ci`: a workflow for a CI service, as a file to copy."""

import re
import shlex
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter

from rayproof import ROOT
from rayproof.reports.commands.output import say
from rayproof.reports.commands.usage import UsageError, told_in_one_line, writable_folder

WORKFLOWS = ROOT / "reports" / "workflows"
# Service -> the file that is filled in, where that service looks for it.
SERVICES = {
    "github": ("github.yml", Path(".github/workflows/rayproof.yml")),
    "gitlab": ("gitlab.yml", Path(".gitlab-ci.yml")),
    "jenkins": ("jenkins.groovy", Path("Jenkinsfile")),
}
REPORT = "rayproof-report"
LINE = re.compile(r"[\x00-\x1f\x7f']")  # what would end the line or the string that a word stands in


def ci(
    service: Literal["github", "gitlab", "jenkins"],
    *selectors: str,
    source: Annotated[str, Parameter(name="--from")],
    subject: str | None = None,
    expect: Path | None = None,
    least_coverage: float | None = None,
    out: Path | None = None,
) -> int:
    """Write a workflow that runs rayproof in continuous integration.

    It installs rayproof, runs it, gates it by a file of known failures if there is one, and keeps the report.

    Parameters
    ----------
    service
        Whose workflow: github, gitlab or jenkins.
    selectors
        Families, cases, patterns or scene files to run. Default: the default suite.
    source
        What pip is to install, since rayproof is on no package registry: the path of a wheel in your project, or
        git+https://HOST/PROJECT@COMMIT.
    subject
        Who is under test, as `rayproof run --subject` takes it. Default: the tracer.
    expect
        The file of known failures that `rayproof expect accept` wrote: anything else, or less, fails the job.
    least_coverage
        The share [%] of the checks that must be measured; with fewer the job fails.
    out
        The file to write. Default: where the service looks for it.

    """
    for word in (*selectors, source, subject or "", str(expect or "")):
        if LINE.search(word):
            raise UsageError(f"{word!r}: a quote or a control character cannot stand in a workflow")
    name, usual = SERVICES[service]
    file = out or usual
    command = ["rayproof", "run", *selectors, "--out", REPORT]
    command += ["--subject", subject] if subject is not None else []
    command += ["--expect", str(expect)] if expect is not None else []
    command += ["--least-coverage", f"{least_coverage:g}"] if least_coverage is not None else []
    filled = (WORKFLOWS / name).read_text(encoding="utf-8")
    # Double quotes: the services' own files quote by single ones, and YAML takes a shell's line for a string.
    words = [shlex.quote(word).replace("'", '"') for word in command]
    for mark, text in (("@INSTALL@", f'"{source}"'), ("@RUN@", " ".join(words)), ("@OUT@", REPORT)):
        filled = filled.replace(mark, text)
    with told_in_one_line():
        file.parent.mkdir(parents=True, exist_ok=True)
        writable_folder(file.parent)
        if file.exists():
            raise UsageError(f"{file}: exists already, and is not overwritten; --out names another file")
        file.write_text(filled, encoding="utf-8")
    say(f"wrote {file}; it runs: {' '.join(words)}")
    return 0
