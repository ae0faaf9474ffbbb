"""Which commit a run belongs to: the CI service's word for it, or git's in the current folder."""

import os
import subprocess

CI_VARIABLES = ("GITHUB_SHA", "CI_COMMIT_SHA", "GIT_COMMIT", "BUILD_SOURCEVERSION")  # GitHub, GitLab, Jenkins, Azure
SECONDS = 10.0


def revision() -> str:
    """Return a commit's id, with "+" where files differ from it; "" where nobody knows."""
    named = next((os.environ[name] for name in CI_VARIABLES if os.environ.get(name)), "")
    if named:
        return named[:40]
    commit = _git("rev-parse", "HEAD")
    if not commit:
        return ""
    changed = _git("status", "--porcelain", "--untracked-files=no")
    return f"{commit}{'+' if changed else ''}"


def _git(*arguments: str) -> str:
    try:
        done = subprocess.run(
            ["git", *arguments], capture_output=True, text=True, timeout=SECONDS, check=False, stdin=subprocess.DEVNULL
        )
    except (OSError, subprocess.TimeoutExpired):
        return ""
    return done.stdout.strip() if done.returncode == 0 else ""
