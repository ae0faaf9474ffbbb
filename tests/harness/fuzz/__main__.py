"""`python -m tests.harness.fuzz`: run a campaign over some or all targets and tell its figures."""

import argparse
import json
import sys
from dataclasses import asdict
from pathlib import Path

from tests.harness import fuzz as harness
from tests.harness.fuzz.campaign import fuzz
from tests.harness.fuzz.targets import TARGETS


def main() -> int:
    """Return 0 where nothing was found, 1 where something was."""
    parser = argparse.ArgumentParser(prog="python -m tests.harness.fuzz", description=harness.__doc__)
    parser.add_argument("--inputs", type=int, default=10_000, help="files in all, shared by the targets")
    parser.add_argument("--seconds", type=float, default=3600.0, help="time in all, shared likewise")
    parser.add_argument("--seed", type=int, default=1, help="the same seed gives the same files")
    parser.add_argument("--target", action="append", choices=tuple(TARGETS), help="one of them; repeatable")
    parser.add_argument("--out", type=Path, help="folder for the files that were found")
    parser.add_argument("--json", type=Path, help="file for the figures")
    chosen = parser.parse_args()
    names = chosen.target or list(TARGETS)
    figures = {}
    for name in names:
        share = {"inputs": chosen.inputs // len(names), "seconds": chosen.seconds / len(names)}
        figures[name] = fuzz(name, seed=chosen.seed, out=chosen.out, **share)
        told = figures[name]
        sys.stdout.write(
            f"{name}: {told.inputs} inputs, {told.refused} refused, {told.taken} taken, {len(told.findings)} findings, "
            f"slowest {told.slowest:.2f} s\n"
        )
        for what in sorted({finding["what"] for finding in told.findings}):
            sys.stdout.write(f"  {what!a}\n")
        sys.stdout.flush()
    if chosen.json is not None:
        chosen.json.write_text(json.dumps({name: asdict(one) for name, one in figures.items()}, indent=1) + "\n")
    return 1 if any(one.findings for one in figures.values()) else 0


if __name__ == "__main__":
    sys.exit(main())
