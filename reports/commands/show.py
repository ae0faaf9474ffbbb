"""`rayproof show`: one case - what it asks, what an answer must satisfy, its scene, how to reproduce it."""

from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path

from rayproof.cases.case import Case
from rayproof.cases.scene import Mesh, Scene
from rayproof.reports.commands.lookup import one_case
from rayproof.reports.commands.output import say, show_table, write_json
from rayproof.reports.program_name import called

Shown = str | float | tuple["Shown", ...] | None  # a field of a case's or a scene's


def show(case: str, *, json: Path | None = None) -> int:
    """Show one case: its scene, its requirements, how to reproduce it.

    Parameters
    ----------
    case
        Its name, family/case.
    json
        Also write the case, its whole scene included, to this file.

    """
    from rayproof.cases.scene_json import scene_to_json

    asked = one_case(case)
    commands = reproduce(asked)
    expected = [{"kind": type(one).__name__, **asdict(one)} for one in asked.expectations]
    about = {"name": asked.name, "stresses": asked.stresses, "covers": list(asked.covers), "reproduce": commands}
    least = {"least_interior": asked.least_interior, "most_explained": asked.most_explained, "samples": asked.samples}
    write_json(json, about | least | {"expectations": expected, "scene": scene_to_json(asked.scene)})
    say(f"{asked.name}: {asked.stresses}")
    say(f"covers {', '.join(asked.covers)}")
    show_table("Requirements", ["what", "must hold", "because"], requirements(asked))
    show_table("Scene", ["what", "values"], contents(asked.scene))
    say(f"traced with: {traced(asked.scene)} (for one stage; where several are asked for, they have kernels each)")
    say("Reproduce:")
    for line in commands:
        say(f"  {line}")
    return 0


def traced(scene: Scene) -> str:
    """Return how the tracer goes about a scene with its default formulas."""
    from rayproof.tracer.kernel.compiler import choose_packaged_llvm

    choose_packaged_llvm()
    from rayproof.tracer.configuration import Configuration
    from rayproof.tracer.plan import plan

    return plan(scene, Configuration()).text


def requirements(case: Case) -> list[list[str]]:
    """Return what an answer must satisfy, beyond agreeing with the references within their derived limits."""
    rows = [
        ["pixels within their limits", f">= {case.least_interior}", "fewer would decide nothing"],
        ["pixels explained by rounding", f"<= {case.most_explained:.1%} of the image", "more would hide an error"],
    ]
    for one in case.expectations:
        about = {key: value for key, value in asdict(one).items() if key != "because"}
        rows.append([type(one).__name__, listed(about), one.because])
    return rows


def contents(scene: Scene) -> list[list[str]]:
    """Return the scene's camera, lights, shapes and modes, one row each; arrays only by their size."""
    rows = [["camera", listed(asdict(scene.camera))]]
    rows += [[f"light {index}", listed(asdict(light))] for index, light in enumerate(scene.lights)]
    for index, shape in enumerate(scene.shapes):
        about = {name: getattr(shape, name) for name in shape.__dataclass_fields__}
        if isinstance(shape, Mesh):
            about |= {"vertices": len(shape.vertices), "faces": len(shape.faces)}
        rows.append([f"shape {index}: {type(shape).__name__}", listed(about)])
    return [*rows, ["shading, clip", f"{scene.shading}, {scene.clip}"]]


def listed(about: Mapping[str, Shown]) -> str:
    """Return names and values in one line, numbers shortened to nine digits."""
    return ", ".join(f"{name} {short(value)}" for name, value in about.items())


def short(value: Shown) -> str:
    """Return a value's text; of numbers nine digits."""
    if isinstance(value, float):
        return f"{value:.9g}"
    return f"({', '.join(map(short, value))})" if isinstance(value, tuple) else str(value)


def reproduce(case: Case) -> list[str]:
    """Return the commands that run this case alone and look at its central pixel."""
    camera = case.scene.camera
    return [f"{called()} run {case.name}", f"{called()} probe {case.name} {camera.width // 2} {camera.height // 2}"]
