"""Choose the rays of each ladder that become test vectors: `python -m tests.harness.choose_vectors`.

Of each value as few rays as break every formula that breaks there (rayproof stability's gate, both precisions) and no
formula that holds there; where nothing breaks, one ray that hits and one that misses. What is chosen is checked in as
`reports/vectors/chosen.json`: indices into the ladders' own draws, which `reports.vectors.rows` makes again.
"""

import json
import sys

import numpy as np

from rayproof.cases.ladders import Ladder
from rayproof.reports.studies.stability.climb import Drawn, climb
from rayproof.reports.studies.stability.questions import QUESTIONS
from rayproof.reports.vectors.rows import CHOSEN, LADDERS, drawn
from rayproof.tracer.formulas import FORMULAS
from rayproof.tracer.kernel.compiler import choose_packaged_llvm

MOST = 6  # rays of one value


def chosen(ladder: Ladder) -> list[list[int]]:
    """Return of each value the indices of its rays."""
    inputs, rungs = drawn(ladder)
    question = QUESTIONS[ladder.question]()
    truth = question.truth(ladder, inputs, rungs)
    bad: dict[tuple[str, str], np.ndarray] = {}
    breaks: dict[tuple[str, str], list[bool]] = {}
    for precision in ("float32", "float64"):
        for slot in ladder.slots:
            for formula in FORMULAS.variants(slot):
                key = (formula.name, precision)
                answer = question.answer(ladder, formula, inputs, precision)
                grades = question.grade(ladder, inputs, truth, answer, precision)
                off = np.nan_to_num(grades.index, nan=0.0) > ladder.gate.index
                bad[key] = grades.counted & (grades.false_hit | grades.false_miss | grades.invalid | off)
                given = Drawn(ladder=ladder, precision=precision, inputs=inputs, rungs=rungs, truth=truth)
                climbed = climb(given, formula)
                breaks[key] = [not climbed.holds(rung) for rung in climbed.rungs]
    return [
        _of_rung(ladder, rung, np.flatnonzero((rungs == rung) & truth.counted), bad, breaks, truth)
        for rung in range(len(ladder.values))
    ]


def _of_rung(ladder, rung, rays, bad, breaks, truth) -> list[int]:
    breaking = [key for key in bad if breaks[key][rung]]
    holding = [key for key in bad if not breaks[key][rung]]
    free = rays
    if holding:
        free = rays[~np.any([bad[key][rays] for key in holding], axis=0)]
    picked: list[int] = []
    left = [key for key in breaking if np.any(bad[key][free])]
    for key in breaking:
        if key not in left:
            sys.stderr.write(f"{ladder.name} {ladder.values[rung]:g}: no ray alone breaks {' '.join(key)}\n")
    while left and len(picked) < MOST:
        covers = np.sum([bad[key][free] for key in left], axis=0)
        ray = int(free[np.argmax(covers)])
        picked.append(ray)
        left = [key for key in left if not bad[key][ray]]
    if left:
        sys.stderr.write(f"{ladder.name} {ladder.values[rung]:g}: more than {MOST} rays needed, {len(left)} left\n")
    hit = truth.facts.get("hit")
    hits = getattr(hit, "hit", hit)
    if isinstance(hits, np.ndarray):
        for wanted in (True, False):
            if not any(hits[ray] == wanted for ray in picked) and np.any(hits[free] == wanted):
                picked.append(int(free[hits[free] == wanted][0]))
    elif not picked and len(free):
        picked.append(int(free[0]))
    return sorted(picked)


def main() -> None:
    """Choose for the ladders named, or all, and write the file."""
    choose_packaged_llvm()
    table = json.loads(CHOSEN.read_text()) if CHOSEN.exists() else {}
    for ladder in LADDERS:
        if not sys.argv[1:] or ladder.name in sys.argv[1:]:
            table[ladder.name] = chosen(ladder)
            sys.stderr.write(f"{ladder.name}: {sum(map(len, table[ladder.name]))}\n")
    lines = ",\n".join(f'  "{name}": {json.dumps(table[name])}' for name in sorted(table))
    CHOSEN.write_text("{\n" + lines + "\n}\n")


if __name__ == "__main__":
    main()
