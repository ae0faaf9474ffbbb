"""Pages for students, the gradebook, and files for Gradescope and GitHub Classroom.

A student's folder holds nothing of other students, and of hidden cases the item and the points alone. Gradescope reads
results.json (gradescope-autograders.readthedocs.io, "Autograder Specifications"), GitHub Classroom's reporter the JSON
in base64 of classroom.txt.
"""

import base64
import csv
import io
import json
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from html import escape

from rayproof.reports.grading.classes import Graded, equal_pairs, results_of, run_folder
from rayproof.reports.grading.points import ItemGrade, State
from rayproof.reports.grading.rubric import Rubric, covered_items
from rayproof.reports.grading.submission import Place
from rayproof.reports.judge.oracle import ORACLE
from rayproof.reports.publish.page.thumbnails import picture
from rayproof.reports.results.case_records import CaseRecord, Measurement
from rayproof.reports.results.files import legible_lines, several, write_text
from rayproof.reports.results.outcomes import TITLES

UNCONFINED = "Graded without confinement: the programs could read and change this machine while they were graded."
HIDDEN = "It shows in a hidden case."
LOOK = {  # what to look at next, by an item's part of the specification
    "CAM": "The rays of the corners and of the middle: their directions are easily computed by hand.",
    "XF": "One shape that is only moved, then one that is only turned, then one that is stretched.",
    "HIT": "One ray through the middle of that shape alone, and one that begins inside it.",
    "NRM": "The normal of one hit on a stretched shape: it must stay perpendicular to the surface.",
    "LIT": "One feeler: where it starts, where it ends, and what lies between.",
    "RAD": "One lit pixel straight below a light: the formula has a closed value there.",
    "IMG": "The order of rows and channels, and whether values are written as they are.",
}
STYLE = """<style>body{font:16px/1.5 system-ui,sans-serif;max-width:60rem;margin:2rem auto;padding:0 1rem}
table{border-collapse:collapse}td,th{text-align:left;padding:.2rem .8rem .2rem 0;vertical-align:top}
th{border-bottom:1px solid}pre{white-space:pre-wrap}.bad{font-weight:600}.note{border-left:4px solid;padding-left:1rem}
img{image-rendering:pixelated;max-width:100%;min-width:24rem}</style>"""


@dataclass(frozen=True, kw_only=True)
class Book:
    """A graded class, and where it is written."""

    rubric: Rubric
    place: Place
    graded: Sequence[Graded]

    def write(self) -> None:
        """Write all students' folders, and the teacher's files."""
        for student in self.graded:
            self._student(student)
        teacher = self.place.teacher
        write_text(teacher / "gradebook.csv", self._gradebook())
        write_text(teacher / "class.html", self._class())
        facts = {
            "rayproof": self.graded[0].rayproof if self.graded else "",
            "rubric": self.rubric.digest,
            "seed": self.rubric.file.cases.seed,
            "confined": self.place.confined,
            "submissions": {student.name: student.digest for student in self.graded},
            "points": {student.name: student.points for student in self.graded},
        }
        write_text(teacher / "grades.json", json.dumps(facts, indent=1) + "\n")

    @property
    def _of(self) -> float:
        return sum(self.rubric.points.values())

    def _student(self, student: Graded) -> None:
        folder = self.place.out / "students" / student.name
        folder.mkdir(parents=True, exist_ok=True)
        write_text(folder / "index.html", self._page(student))
        write_text(folder / "results.json", json.dumps(self._gradescope(student), indent=1) + "\n")
        encoded = json.dumps(self._classroom(student)).encode()
        write_text(folder / "classroom.txt", base64.b64encode(encoded).decode() + "\n")

    def _shown(self, grade: ItemGrade) -> str | None:
        """Return the worst visible case in which an item shows, or None."""
        return next((name for name in grade.cases if name not in self.rubric.hidden), None)

    def _sentence(self, grade: ItemGrade) -> str:
        """Return what a student is told of an item: nothing that a program printed about a hidden case."""
        known = grade.state in (State.WRONG, State.UNDECIDED) or not grade.cases or grade.cases[0] == self._shown(grade)
        told = grade.sentence if known else ""
        hidden = HIDDEN if grade.cases and self._shown(grade) is None else ""
        open_to = "Your teacher decides this item." if grade.state is State.UNDECIDED else ""
        return " ".join(filter(None, (told, hidden, open_to)))

    def _page(self, student: Graded) -> str:
        rows = [
            f"<tr><td>{grade.item}<td>{escape(TITLES[grade.item])}<td>{grade.points:g} of {grade.of:g}<td"
            f"{'' if grade.state is State.EARNED else ' class=bad'}>{grade.state.value}</tr>"
            for grade in student.grades
        ]
        lost = [grade for grade in student.grades if grade.state is not State.EARNED]
        body = [
            f"<p>{student.points:g} of {self._of:g} points.</p>",
            f"<pre class=note>{escape(legible_lines(student.problem))}</pre>" if student.problem else "",
            f"<table><tr><th>item<th>what it is<th>points<th>result</tr>{''.join(rows)}</table>",
            *([] if student.problem else self._details(student, lost)),
        ]
        return self._html(f"{self.rubric.file.title}: {student.name}", body)

    def _details(self, student: Graded, lost: Sequence[ItemGrade]) -> list[str]:
        """Return a section for each item without its points: the sentence, pictures, the worst pixel, what to try."""
        results = results_of(self.place, student.name) if lost else None
        found = []
        for grade in lost:
            name = self._shown(grade)
            case = next((case for case in results["cases"] if case["name"] == name), None) if results else None
            found += [f"<h2>{grade.item}: {escape(TITLES[grade.item])}</h2>", f"<p>{escape(self._sentence(grade))}</p>"]
            if case is not None:
                found += self._evidence(student, grade, case)
            if grade.state in (State.WRONG, State.UNDECIDED):
                found.append(f"<p>Look next at: {escape(LOOK[grade.item.split('-')[0]])}</p>")
        return found

    def _evidence(self, student: Graded, grade: ItemGrade, case: CaseRecord) -> list[str]:
        name = escape(str(case["name"]))
        found = [f"<p>The case {name}: {escape(case.get('stresses') or '')}</p>"]
        drawn = picture(run_folder(self.place, student.name), case)
        if drawn is not None:
            data = base64.b64encode(drawn).decode()
            found.append(
                f'<p>Yours, the right one, and the difference:<br><img alt="" src="data:image/png;base64,{data}">'
            )
        checks = [check for check in case.get("checks", []) if check.reference == ORACLE]
        check = next((check for check in checks if check.stage == (grade.stage or case.get("stage"))), None)
        if check is not None:
            measured = check.continued or check.end_to_end
            found += [f"<p>{check.stage}: {escape(_pixel(measured))}</p>"] if measured else []
        return found

    def _html(self, title: str, body: Sequence[str]) -> str:
        warning = "" if self.place.confined else f"<p class=note>{UNCONFINED}</p>"
        head = f'<!doctype html><html lang="en"><meta charset="utf-8"><title>{escape(title)}</title>{STYLE}'
        return "\n".join([head, f"<h1>{escape(title)}</h1>", warning, *body, "</html>"]) + "\n"

    def _gradescope(self, student: Graded) -> dict[str, object]:
        seen = {
            item for case in self.rubric.cases if case.name not in self.rubric.hidden for item in covered_items(case)
        }
        return {
            "stdout_visibility": "hidden",
            "output": "" if self.place.confined else UNCONFINED,
            "tests": [
                {
                    "name": _titled(grade),
                    "score": grade.points,
                    "max_score": grade.of,
                    "status": "passed" if grade.state is State.EARNED else "failed",
                    "output": self._told(student, grade),
                    "visibility": "visible" if grade.item in seen else "after_published",
                }
                for grade in student.grades
            ],
        }

    def _classroom(self, student: Graded) -> dict[str, object]:
        return {
            "version": 1,
            "status": "pass" if all(grade.state is State.EARNED for grade in student.grades) else "fail",
            "max_score": self._of,
            "tests": [
                {
                    "name": _titled(grade),
                    "status": "pass" if grade.state is State.EARNED else "fail",
                    "score": grade.points,
                    "message": self._told(student, grade),
                    "test_code": "",
                    "filename": "",
                    "line_no": 0,
                    "execution_time": 0,
                }
                for grade in student.grades
            ],
        }

    def _told(self, student: Graded, grade: ItemGrade) -> str:
        if grade.state is State.EARNED:
            return ""
        return f"{grade.state.value}: {student.problem or self._sentence(grade)}"

    def _gradebook(self) -> str:
        file = io.StringIO()
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["name", "points", "of", *self.rubric.points, "open", "problem"])
        for student in self.graded:
            cells = [student.name, student.points, self._of, *(grade.points for grade in student.grades)]
            cells += [" ".join(grade.item for grade in student.open), student.problem.splitlines()[:1]]
            writer.writerow([safe(cell) for cell in (*cells[:-1], *(cells[-1] or [""]))])
        return file.getvalue()

    def _class(self) -> str:
        grades = [(student, grade) for student in self.graded for grade in student.grades]
        failing = Counter(grade.item for _, grade in grades if grade.state is not State.EARNED)
        mistakes = Counter(
            sentence
            for _, sentence in {(one.name, grade.sentence) for one, grade in grades if grade.state is State.WRONG}
        )
        rows = "".join(f"<tr><td>{item}<td>{escape(TITLES[item])}<td>{n}</tr>" for item, n in failing.most_common())
        pairs = [f"{first} and {second}: {pixels} pixels" for first, second, pixels in equal_pairs(self.graded)]
        undecided = [f"{one.name}, {grade.item}: {grade.sentence}" for one in self.graded for grade in one.open]
        broken = [f"{one.name}: {one.problem.splitlines()[0]}" for one in self.graded if one.problem]
        sections = (
            ("Items that fail, the most frequent first", f"<table>{rows}</table>"),
            ("Mistakes", _listed(f"{several(n, 'time')}: {text}" for text, n in mistakes.most_common())),
            ("To be decided by you", _listed(undecided)),
            ("Not run", _listed(broken)),
            ("Equal to the last bit where independent programs round otherwise: a hint, no verdict", _listed(pairs)),
        )
        body = [
            f"<p>{several(len(self.graded), 'submission')}, {len(self.rubric.cases)} cases, {self._of:g} points.</p>"
        ]
        body += [f"<h2>{title}</h2>{content}" for title, content in sections]
        return self._html(f"{self.rubric.file.title}: the class", body)


def _titled(grade: ItemGrade) -> str:
    return f"{grade.item} {TITLES[grade.item]}"


def _listed(lines: Iterable[str]) -> str:
    return f"<ul>{''.join(f'<li>{escape(line)}' for line in lines)}</ul>"


def safe(cell: object) -> object:
    """Return a cell that no spreadsheet takes for a formula."""
    return f"'{cell}" if isinstance(cell, str) and cell[:1] in {"=", "+", "-", "@", "\t", "\r"} else cell


def _pixel(measured: Measurement) -> str:
    """Return the worst pixel in numbers."""
    x, y = measured.pixel or (0, 0)
    ours, theirs = (", ".join(map(str, values)) or "-" for values in (measured.ours, measured.theirs))
    return (
        f"pixel ({x}, {y}) is {ours} instead of {theirs}, off by {measured.worst_error}; the limit is {measured.limit}."
    )
