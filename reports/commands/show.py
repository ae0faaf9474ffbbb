"""`rayproof show`: the scene and requirements of a case, and the commands that reproduce it."""

from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path

from rayproof.cases.case import Case
from rayproof.cases.scene import Mesh, Scene
from rayproof.reports.commands.lookup import one_case
from rayproof.reports.commands.output import say, show_table, write_json
from rayproof.reports.program_name import called

Shown = str | float | tuple["Shown", ...] | None  # the value of a field of a case or scene


def show(case: str, *, json: Path | None = None) -> int:
    """Show a case: its scene, its requirements, and the commands that reproduce it.

    Parameters
    ----------
    case
        The name of the case, family/case.
    json
        Also write the case with its whole scene to this file.

    """
    from rayproof.cases.scene_json import scene_to_json

    shown = one_case(case)
    commands = reproduce(shown)
    expected = [{"kind": type(expectation).__name__, **asdict(expectation)} for expectation in shown.expectations]
    about = {"name": shown.name, "stresses": shown.stresses, "covers": list(shown.covers), "reproduce": commands}
    least = {"least_interior": shown.least_interior, "most_explained": shown.most_explained, "samples": shown.samples}
    write_json(json, about | least | {"expectations": expected, "scene": scene_to_json(shown.scene)})
    say(f"{shown.name}: {shown.stresses}")
    say(f"covers {', '.join(shown.covers)}")
    show_table("Requirements", ["what", "must hold", "because"], requirements(shown))
    show_table("Scene", ["what", "values"], contents(shown.scene))
    say(f"traced with: {traced(shown.scene)} (for one stage; where several are asked for, they have kernels each)")
    say("Reproduce:")
    for line in commands:
        say(f"  {line}")
    return 0


def traced(scene: Scene) -> str:
    """Return a description of the tracer's plan for a scene with its default formulas."""
    from rayproof.tracer.kernel.compiler import choose_packaged_llvm

    choose_packaged_llvm()
    from rayproof.tracer.configuration import Configuration
    from rayproof.tracer.plan import plan

    return plan(scene, Configuration()).text


def requirements(case: Case) -> list[list[str]]:
    """Return the rows of the table of requirements, which apply in addition to the limits of each pixel."""
    rows = [
        ["pixels within their limits", f">= {case.least_interior}", "fewer would decide nothing"],
        ["pixels explained by rounding", f"<= {case.most_explained:.1%} of the image", "more would hide an error"],
    ]
    for expectation in case.expectations:
        about = {key: value for key, value in asdict(expectation).items() if key != "because"}
        rows.append([type(expectation).__name__, listed(about), expectation.because])
    return rows


def contents(scene: Scene) -> list[list[str]]:
    """Return the scene's camera, lights, shapes and modes, one row each; of arrays only the size."""
    rows = [["camera", listed(asdict(scene.camera))]]
    rows += [[f"light {index}", listed(asdict(light))] for index, light in enumerate(scene.lights)]
    for index, shape in enumerate(scene.shapes):
        about = {name: getattr(shape, name) for name in shape.__dataclass_fields__}
        if isinstance(shape, Mesh):
            about |= {"vertices": len(shape.vertices), "faces": len(shape.faces)}
        rows.append([f"shape {index}: {type(shape).__name__}", listed(about)])
    return [*rows, ["shading, clip", f"{scene.shading}, {scene.clip}"]]


def listed(about: Mapping[str, Shown]) -> str:
    """Return names and values in one line, with numbers of nine digits."""
    return ", ".join(f"{name} {short(value)}" for name, value in about.items())


def short(value: Shown) -> str:
    """Return the text of a value; numbers have nine digits."""
    if isinstance(value, float):
        return f"{value:.9g}"
    return f"({', '.join(map(short, value))})" if isinstance(value, tuple) else str(value)


def reproduce(case: Case) -> list[str]:
    """Return the commands that run only this case and show its central pixel."""
    camera = case.scene.camera
    return [f"{called()} run {case.name}", f"{called()} probe {case.name} {camera.width // 2} {camera.height // 2}"]
