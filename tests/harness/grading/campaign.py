"""A class made from the switches of the C++ example, a Python and a Rust renderer, and what its grades come to."""

import ast
import random
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from rayproof import ROOT
from rayproof.reports.diagnosis import MISTAKES
from rayproof.reports.grading.classes import Graded
from rayproof.reports.grading.points import State
from rayproof.reports.grading.rubric import Rubric, graded_items
from tests.harness.audit.diagnosing import CALLED, KNOWN_NONE

STAGED, ALONE = "all stages", "radiance alone"
CPP, PYTHON, RUST = "C++", "Python", "Rust"
RENDERERS = ROOT / "examples" / "renderers"
PYTHON_SOURCE = Path(__file__).with_name("renderer.py")
RUST_SOURCE = Path(__file__).with_name("renderer.rs")
BUILD = "c++ -O2 -std=c++17 -o tracer mistaken.cpp"
RUST_BUILD = "rustc --edition 2021 -O -o tracer renderer.rs"
# Of a mistake that a fit of the whole camera finds: the item in which it lies.
OF_CAMERAS: Mapping[str, str] = {
    **dict.fromkeys(("linear_fov", "sine_fov", "fixed_fov", "diagonal_fov"), "CAM-2"),
    **dict.fromkeys(("width_minus_one", "quarter_pixel"), "CAM-3"),
    **dict.fromkeys(("right_not_normalised", "tilted"), "CAM-1"),
}
MOST = 3  # mistakes of one submission
# Languages, what their programs write, and how many of forty do so.
WAYS = (
    (CPP, STAGED, 16), (CPP, ALONE, 9), (PYTHON, STAGED, 5), (PYTHON, ALONE, 3), (RUST, STAGED, 5), (RUST, ALONE, 2),
)  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class Student:
    """One submission of the class and the mistakes planted in it, each with its item and the others it concerns."""

    name: str
    language: str
    written: str
    planted: tuple[str, ...]

    @property
    def items(self) -> dict[str, tuple[str, ...]]:
        """Return the items that each mistake concerns, its own first."""
        return {name: items_of(name) for name in self.planted}


def items_of(switch: str) -> tuple[str, ...]:
    """Return the graded items that a switch's mistake concerns, its own first."""
    if switch in OF_CAMERAS:
        return (OF_CAMERAS[switch],)
    return graded_items(MISTAKES[CALLED.get(switch, switch)].items)


def drawn(switches: Mapping[str, Sequence[str]], seed: int, share: float = 1.0) -> list[Student]:
    """Return the class: for each way of writing, students with 0, 1, 2 and 3 mistakes in turns, of different items.

    `switches` are the mistakes that the renderers of each language can make, `share` that of forty students. A
    language without switches has no students.
    """
    draws, found = random.Random(f"class {seed}"), []
    for language, written, number in WAYS:
        for place in range(max(1, round(number * share)) if switches.get(language) else 0):
            names, chosen = list(switches[language]), []
            draws.shuffle(names)
            while names and len(chosen) < (place % (MOST + 1)):
                name = names.pop()
                if items_of(name)[0] not in {items_of(other)[0] for other in chosen}:
                    chosen.append(name)
            found.append(Student(name=f"s{len(found):02}", language=language, written=written, planted=tuple(chosen)))
    return found


def python_switches() -> list[str]:
    """Return the mistakes that the Python renderer makes."""
    source = ast.parse(PYTHON_SOURCE.read_text(encoding="utf-8"))
    values = [
        node.value
        for node in source.body
        if isinstance(node, ast.Assign) and "MISTAKES" in map(ast.unparse, node.targets)
    ]
    return list(ast.literal_eval(values[0]))


def rust_switches() -> list[str]:
    """Return the mistakes that the Rust renderer makes."""
    table = RUST_SOURCE.read_text(encoding="utf-8").partition("MISTAKES")[2].partition("= [")[2].partition("]")[0]
    return table.replace('"', "").replace(",", " ").split()


def usable(listed: Sequence[tuple[str, str]]) -> list[str]:
    """Return the switches of the C++ example whose mistake is known, so that its item is."""
    return [name for name, kind in listed if kind != KNOWN_NONE]


def write(students: Sequence[Student], folder: Path) -> None:
    """Write the submissions, each a folder with its source and its own rayproof.toml."""
    for student in students:
        place = folder / student.name
        place.mkdir(parents=True, exist_ok=True)
        words = ["--mistake", ",".join(student.planted)] if student.planted else []
        words += ["--only", "radiance"] if student.written == ALONE else []
        if student.language == CPP:
            for name in ("mistaken.cpp", "rayproof.hpp"):
                shutil.copyfile(RENDERERS / name, place / name)
            program, build = "./tracer", BUILD
        elif student.language == RUST:
            shutil.copyfile(RUST_SOURCE, place / RUST_SOURCE.name)
            program, build = "./tracer", RUST_BUILD
        else:
            shutil.copyfile(PYTHON_SOURCE, place / "renderer.py")
            program, build = "/usr/bin/python3 renderer.py", ""
        run = " ".join([program, *words, "{scene} {output}"])
        (place / "rayproof.toml").write_text(f'build = "{build}"\nrun = "{run}"\n', encoding="utf-8")


@dataclass(frozen=True, kw_only=True)
class Figures:
    """What the grades of some students come to."""

    written: str
    mistakes: str  # how many each may have
    students: int
    planted: int
    cost: int  # planted mistakes that cost their item
    innocent: int  # items without a mistake
    lost: int  # of these, those that lose points
    open: int  # of these, those that a teacher has to decide

    def line(self) -> str:
        """Return a row of a Markdown table."""
        cells = (self.written, self.mistakes, self.students, self.planted, share(self.cost, self.planted))
        return " | ".join(map(str, ("", *cells, self.innocent, share(self.lost, self.innocent), self.open, ""))).strip()


def share(part: int, whole: int) -> str:
    """Return a count with its share in per cent."""
    return f"{part} ({100 * part / whole:.1f} %)" if whole else "-"


def figures(
    students: Sequence[Student], graded: Mapping[str, Graded], rubric: Rubric, written: str, mistakes: range
) -> Figures:
    """Return the figures of the students that write so and have so many mistakes."""
    those = [one for one in students if one.written == written and len(one.planted) in mistakes]
    planted = cost = innocent = lost = left = 0
    for student in those:
        states = {grade.item: grade.state for grade in graded[student.name].grades}
        own = [items[0] for items in student.items.values()]
        concerned = {item for items in student.items.values() for item in items}
        planted += len(own)
        cost += sum(states.get(item) is not State.EARNED for item in own)
        free = [item for item in rubric.points if item not in concerned]
        innocent += len(free)
        lost += sum(states[item] is not State.EARNED for item in free)
        left += sum(states[item] is State.UNDECIDED for item in free)
    named = f"{mistakes.start} to {mistakes.stop - 1}"
    return Figures(
        written=written, mistakes=named, students=len(those), planted=planted, cost=cost, innocent=innocent, lost=lost,
        open=left,
    )  # fmt: skip


# What docs/grading.md promises: the least share of mistakes that cost their item, the most of other items that lose.
PROMISED = ((STAGED, range(MOST + 1), 0.95, 0.02), (ALONE, range(2), 0.85, 0.05))


def report(students: Sequence[Student], graded: Mapping[str, Graded], rubric: Rubric) -> list[str]:
    """Return the table, and a line for each student whose grades are not as planted."""
    lines = ["| written | mistakes | students | planted | cost their item | other items | lose points | left open |"]
    lines.append("|---|---|---|---|---|---|---|---|")
    for written in (STAGED, ALONE):
        for mistakes in (range(MOST + 1), range(2), range(2, MOST + 1)):
            lines.append(figures(students, graded, rubric, written, mistakes).line())
    for student in students:
        states = {grade.item: grade.state for grade in graded[student.name].grades}
        concerned = {item for items in student.items.values() for item in items}
        missed = [f"{name} ({items[0]})" for name, items in student.items.items() if states[items[0]] is State.EARNED]
        more = [item for item in rubric.points if states[item] is not State.EARNED and item not in concerned]
        if missed or more:
            found = f"{student.name}, {student.language}, {student.written}: {', '.join(student.planted) or 'right'}"
            lines.append(f"{found}: not charged {', '.join(missed) or '-'}; charged as well {', '.join(more) or '-'}")
    return lines


def broken(students: Sequence[Student], graded: Mapping[str, Graded], rubric: Rubric) -> bool:
    """Say whether a promise is broken."""
    found = [
        (figures(students, graded, rubric, written, mistakes), least, most)
        for written, mistakes, least, most in PROMISED
    ]
    return any(one.cost < least * one.planted or one.lost > most * one.innocent for one, least, most in found)
