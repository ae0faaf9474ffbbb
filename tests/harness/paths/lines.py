"""Which lines of the tracer the suite executes: code that no path names is found by that it is never reached.

Scenes are traced, not rendered: whatever would evaluate an array is replaced by nothing, so that every line of Python
is reached that a rendering reaches, in milliseconds, and no kernel is compiled. That leaves Dr.Jit with work that must
never be done, so it is asked in a process of its own: `python -m tests.harness.paths.lines`, or `asked`.

A folder of formulas has its own registry and its own tests; what is counted is what puts formulas together. What
takes a formula from a user's file is no part of that: no case has one.
"""

import ast
import contextlib
import os
import subprocess
import sys
import threading
import types
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from rayproof import ROOT

TRACER = ROOT / "tracer"
FORMULAS = "formulas"
# Beside the cases that are chosen for routes: what one of them alone reaches.
ALONE = ("acne/light_on_the_sphere", "crowds/spheres_beside_a_mesh", "faces/one", "faces/over_two_to_the_16")
# Of shapes that are unrolled, and in trees of every kind: what another formula reaches, it reaches in these.
EVERY_FORMULA = ("shadows/every_blocker", "crowds/of_several_kinds", "alone/concave_mesh")
Places = dict[str, set[int]]  # file, relative to the tracer's folder -> lines


# What the suite never executes in the tracer, and why that is right: whole functions, and single lines.


BENCH = "asked by `bench` and by tests of branches; it computes no image"
JUDGE = "asked by the judge and the command line; nothing is rendered by it"
HUGE = "trees beyond 2^80 m are walked without culling, in float64: tests/tracer/shapes/test_bounds.py"
SEVERAL = "leaves of several items, over 2^21 faces: tests/tracer/test_acceleration.py"
HALVES = "trees of over 2^19 items are cut in halves: tests/tracer/trees/test_build.py"
ONE_THREAD = "small images of a run are rendered so: tests/reports/run/test_threads.py"
OWN = "a formula from a user's own file, which no case has"
NOT_ASKED = "a refusal: only kinds that have it are asked"
REFUSED = "a refusal: tests/tracer/shapes/test_bounds.py and test_configuration.py"

DIAGNOSIS = "continues a stage from another renderer's, for the diagnosis: tests/tracer/test_render.py"

LIGHTS_BEHIND_TREES = (
    "no case has a few lights and trees alone; tests/tracer/test_frames.py compares its pixels with the unrolled form's"
)

# "file:function" -> why.
FUNCTIONS: Mapping[str, str] = {
    "kernel/arrays.py:asked": BENCH,
    "frames.py:Frames.asked": BENCH,
    "frames.py:Frames.pixels": "a copy of what was rendered, which nothing is here",
    "shapes/shape.py:TracedShape.arrays": NOT_ASKED,
    "shapes/shape.py:TracedShape.center_and_half": NOT_ASKED,
    "shapes/meshes.py:layers": "asked about images of 2^17 samples or more: tests/tracer/test_plan.py",
    "light_path/illumination.py:_unblocked_by_loop": LIGHTS_BEHIND_TREES,
    "configuration.py:parts_of": JUDGE,
    "configuration.py:Configuration.own": OWN,
    "configuration.py:Configuration.parse": JUDGE,
    "configuration.py:Configuration.name": JUDGE,
    "configuration.py:Configuration.chosen": JUDGE,
    "configuration.py:Configuration.items": JUDGE,
    "configuration.py:Configuration.faults": JUDGE,
    "configuration.py:Configuration.controls": JUDGE,
    "configuration.py:Configuration.__eq__": JUDGE,
    "configuration.py:Configuration.__hash__": JUDGE,
    "shapes/bounds.py:bound": JUDGE,
    "plan.py:Plan.text": JUDGE,
    "light_path/shadow_stage.py:shadow_epsilon": JUDGE,
    "kernel/arrays.py:versions": JUDGE,
    "kernel/compiler.py:packaged_library": "chosen before anything is rendered: tests/tracer/kernel/test_compiler.py",
    "kernel/compiler.py:_libm": ONE_THREAD,
    "kernel/compiler.py:one_thread": ONE_THREAD,
    "kernel/compiler.py:choose_packaged_llvm": "chosen before the first render: tests/tracer/kernel/test_compiler.py",
    "render.py:continue_from": DIAGNOSIS,
    "light_path/__init__.py:_given_lights": DIAGNOSIS,
    "light_path/__init__.py:_given_hits": DIAGNOSIS,
    "light_path/__init__.py:_on_surface": DIAGNOSIS,
}
# "file:text of the line" -> why.
LINES: Mapping[str, str] = {
    "light_path/illumination.py:return _unrolled(world, surfaces, known)": DIAGNOSIS,
    "light_path/illumination.py:free = known": DIAGNOSIS,
    "light_path/illumination.py:free = _unblocked_by_loop(origins, surfaces)": LIGHTS_BEHIND_TREES,
    "trees/beams.py:return": HUGE,
    "trees/boxes.py:return GridBoxes(rows=rows, base=base, step=np.ones(AXES), exact=False)": HUGE,
    (
        "trees/boxes.py:others = boxes.rows.take(tree.slots[np.minimum(first[:-1] + place, first[1:] - 1)], axis=0)"
    ): SEVERAL,
    "trees/boxes.py:np.minimum(leaves, others, out=leaves)": SEVERAL,
    (
        "trees/build.py:return longest, self._first(leaves * nodes.number + leaves // 2) - "
        "self._first(leaves * nodes.number)"
    ): HALVES,
    "trees/trees.py:return None": "meshes without a face that has an area: tests/tracer/test_render.py",
    "kernel/arrays.py:if wanted:": REFUSED,
    "kernel/arrays.py:found.append(some)": BENCH,
    "kernel/arrays.py:return compute()": BENCH,
    'shapes/primitives.py:known = ", ".join(kind.__name__ for kind in KINDS)': REFUSED,
    ('shapes/bounds.py:return f"{name} is {value:g}, which {precision} cannot hold (at most {greatest:.3g})"'): REFUSED,
    'shapes/bounds.py:return f"up is {camera.up}: {precision} cannot tell it from zero"': REFUSED,
    'shapes/bounds.py:return f"up is {camera.up}: {precision} cannot tell it from the direction of view"': REFUSED,
    'shapes/bounds.py:return f"{precision} cannot tell the target {camera.target} m from the eye"': REFUSED,
    (
        'shapes/bounds.py:return f"{where} reaches {length:.3g} m; the squares of lengths beyond '
        '{largest:.3g} m overflow {precision}"'
    ): REFUSED,
    (
        'shapes/bounds.py:return f"nothing in the scene is larger than {length:.3g} m; '
        'squares of that vanish in {precision}"'
    ): REFUSED,
    "light_path/__init__.py:return dr.select((surface.albedo == 0) & dr.isinf(irradiance), 0, leaving)": (
        "a black channel under an irradiance that overflows: tests/tracer/shapes/test_bounds.py"
    ),
}


def files() -> dict[str, Path]:
    """Return the tracer's files outside the folder of formulas, by their place in it."""
    found = {str(path.relative_to(TRACER)): path for path in sorted(TRACER.rglob("*.py"))}
    return {name: path for name, path in found.items() if name.split("/")[0] != FORMULAS}


def _bodies(code: types.CodeType, *, imported: bool = True) -> Iterator[types.CodeType]:
    """Yield the functions in a piece of code; what is in no function ran when its module was imported."""
    for constant in code.co_consts:
        if isinstance(constant, types.CodeType):
            of_class = "__qualname__" in constant.co_names
            ran = imported and (of_class or constant.co_name in ("<listcomp>", "<dictcomp>", "<setcomp>", "<genexpr>"))
            if not ran:
                yield constant
            yield from _bodies(constant, imported=ran)


def lines_of(path: Path) -> set[int]:
    """Return the lines of a file that calls of its functions may execute."""
    code = compile(path.read_text(encoding="utf-8"), str(path), "exec")
    return {line for body in _bodies(code) for _, _, line in body.co_lines() if line}


def excused(name: str, path: Path) -> dict[int, str]:
    """Return why lines of a file need not be executed: by what they are, or by a list of them.

    A refusal is what tests of bad input ask for, and a body that ends with a docstring or three dots is a protocol's.

    Raises:
        LookupError: the list names a function or a line that is not there.

    """
    text = path.read_text(encoding="utf-8")
    found: dict[int, str] = {}
    missing = {key for key in (*FUNCTIONS, *LINES) if key.startswith(f"{name}:")}
    for node, qualified in _nodes(ast.parse(text), ""):
        because = FUNCTIONS.get(f"{name}:{qualified}")
        if isinstance(node, ast.Raise):
            because = "a refusal"
        elif isinstance(node, ast.FunctionDef) and because is not None:
            missing.discard(f"{name}:{qualified}")
        elif isinstance(node, ast.FunctionDef) and _says_nothing(node.body[-1]):
            because = "a protocol"
        if because is not None and isinstance(node, ast.Raise | ast.FunctionDef):
            first = min([node.lineno, *(one.lineno for one in getattr(node, "decorator_list", ()))])
            found |= dict.fromkeys(range(first, (node.end_lineno or first) + 1), because)
    for number, line in enumerate(text.splitlines(), start=1):
        key = f"{name}:{line.strip()}"
        if key in LINES:
            found[number] = LINES[key]
            missing.discard(key)
    if missing:
        raise LookupError(f"listed as never executed, but not there: {', '.join(sorted(missing))}")
    return found


def _says_nothing(last: ast.stmt) -> bool:
    return isinstance(last, ast.Expr) and isinstance(last.value, ast.Constant)


def _nodes(tree: ast.AST, prefix: str) -> Iterator[tuple[ast.AST, str]]:
    """Yield every node with the qualified name of the class or function that it is, or is in."""
    for node in ast.iter_child_nodes(tree):
        named = isinstance(node, ast.FunctionDef | ast.ClassDef)
        name = f"{prefix}.{node.name}".lstrip(".") if named else prefix
        yield node, name
        yield from _nodes(node, name)


@contextlib.contextmanager
def written_down(seen: Places) -> Iterator[None]:
    """Add to `seen` every line of the tracer that is executed, in any thread."""
    names = {str(path): name for name, path in files().items()}

    def local(frame: types.FrameType, event: str, arg: object) -> Any:
        seen.setdefault(names[frame.f_code.co_filename], set()).add(frame.f_lineno)
        return local

    def called(frame: types.FrameType, event: str, arg: object) -> Any:
        return local(frame, event, arg) if frame.f_code.co_filename in names else None

    sys.settrace(called)
    threading.settrace(called)
    try:
        yield
    finally:
        sys.settrace(None)
        threading.settrace(None)  # type: ignore[arg-type]


class _Numpy:
    """NumPy, but what would be a copy of a device array is zeros of its size."""

    def __init__(self, numpy: Any, drjit: Any) -> None:
        self._numpy, self._drjit = numpy, drjit

    def __getattr__(self, name: str) -> Any:
        return getattr(self._numpy, name)

    def array(self, value: Any, *rest: Any, **about: Any) -> Any:
        """Return what NumPy makes of host values, and zeros for a device array."""
        if self._drjit.is_jit_v(value):
            return self._numpy.zeros(self._drjit.width(value), **about)
        return self._numpy.array(value, *rest, **about)


def _evaluate_nothing() -> None:
    """Let nothing be computed in this process from now on."""
    import drjit as dr
    import numpy as np

    from rayproof.tracer import frames, render
    from rayproof.tracer.light_path import illumination

    dr.eval = lambda *values: None
    dr.make_opaque = lambda *values: None
    dr.freeze = lambda function: function
    for module in (frames, illumination, render):
        module.np = _Numpy(np, dr)  # type: ignore[attr-defined]


def _traced() -> None:
    """Trace what a run renders of the cases that are chosen for routes, and by every formula of two of them."""
    from rayproof.cases.families import select
    from rayproof.cases.stages import Stage
    from rayproof.tracer.configuration import Configuration
    from rayproof.tracer.formulas import FORMULAS as CATALOGUE
    from rayproof.tracer.frames import Frames
    from rayproof.tracer.render import render
    from tests.harness.paths.declared import FRAMES, NUMBERS
    from tests.harness.paths.ledger import renderings
    from tests.harness.paths.routes import CHOICE, ROUTED, asked, suiting

    for case in select([*CHOICE, *ALONE]):
        for name in ROUTED:
            configuration = Configuration(precision=name)
            render(case.scene, list(Stage), configuration)
            for route in suiting(asked(CHOICE.get(case.name, ()), name), case.scene, configuration):
                one = renderings(route, case.scene, configuration)
                if one.route == FRAMES:
                    Frames(
                        case.scene,
                        configuration,
                        samples=one.samples,
                        chosen=one.plan if one.samples == 1 else None,
                    )()
                elif one.route == NUMBERS:
                    render(case.scene, [Stage.RADIANCE], configuration, samples=one.samples)
                else:
                    render(case.scene, list(Stage), configuration, chosen=one.plan)
    for name in CATALOGUE:
        formula = CATALOGUE[name]
        if formula.kind != "fault" and not formula.default:
            configuration = Configuration(formulas={formula.slot: formula.variant})
            for case in select(EVERY_FORMULA):
                render(case.scene, list(Stage), configuration)


def left(name: str, path: Path, seen: set[int]) -> dict[int, str]:
    """Return the lines of a file, by number, that are neither `seen` nor excused."""
    text = path.read_text(encoding="utf-8").splitlines()
    return {number: text[number - 1].strip() for number in sorted(lines_of(path) - seen - set(excused(name, path)))}


def unexecuted() -> list[str]:
    """Return the lines that nothing executes and nobody excuses. The process is then good for nothing else."""
    from rayproof.tracer.kernel.compiler import choose_packaged_llvm

    choose_packaged_llvm()
    _evaluate_nothing()
    seen: Places = {}
    with written_down(seen):
        _traced()
    return [
        f"tracer/{name}:{number}: {line}"
        for name, path in files().items()
        for number, line in left(name, path, seen.get(name, set())).items()
    ]


def asked() -> list[str]:
    """Return the same, found out by a process of its own.

    Raises:
        RuntimeError: it ended otherwise than by saying so.

    """
    command = [sys.executable, "-m", "tests.harness.paths.lines"]
    ended = subprocess.run(command, capture_output=True, text=True, check=False)
    found = ended.stdout.splitlines()
    if ended.returncode != bool(found):
        raise RuntimeError(f"{' '.join(command)} ended with {ended.returncode}: {ended.stderr.strip()}")
    return found


if __name__ == "__main__":
    told = unexecuted()
    sys.stdout.writelines(f"{line}\n" for line in told)
    sys.stdout.flush()
    # What Dr.Jit was left with must not be computed on the way out.
    os._exit(1 if told else 0)
