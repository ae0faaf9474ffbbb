"""Which diagrams there are: slots that a family's scenes exercise, and scenes with light for the samples per pixel."""

from collections.abc import Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase

from rayproof.cases.families import select
from rayproof.cases.ladders import Ladder
from rayproof.cases.scene import Scene
from rayproof.cases.stresses import STRESSES
from rayproof.reports.studies.compare.concerned import concerned
from rayproof.reports.studies.tradeoff.formulas import Task, variants
from rayproof.reports.studies.tradeoff.ladders import ladders
from rayproof.tracer.formulas import SHAPES_OF, Formula

DEFAULT = (
    "far_sphere_*", "far_cube_1e3", "far_triangle_1e3", "tangent_sphere", "sliver_*", "grazing_plane",
    "primitives", "antialiased", "shadows", "SPH-FAR", "SPH-TAN", "TRI-SLIV", "BOX-FAR", "CAM-NEAR",
)  # fmt: skip
QUICK = ("far_sphere_1e3", "antialiased", "SPH-FAR")
SLOTS = ("sphere", "cube", "square", "plane", "triangle")
MOST_SCENES = 2  # of a family in one diagram


@dataclass(frozen=True, kw_only=True)
class Sampled:
    """A family's diagrams of a whole image to be: of samples per pixel, and of the tracer's routes."""

    family: str
    scene: Scene


def tasks(
    selectors: Sequence[str], formulas: Sequence[Formula] = ()
) -> tuple[tuple[Task, ...], tuple[Sampled, ...], tuple[Ladder, ...]]:
    """Return the diagrams of formulas, of whole images and of ladders that `selectors` name.

    If formulas are named, they are what is drawn, beside the defaults of their slots, and no whole images.

    Raises:
        LookupError: a selector names neither a case nor a stress nor a ladder, or nothing named shows the formulas.

    """
    named = tuple(formulas)
    climbed = tuple(one for one in ladders(selectors) if any(variants(slot, named) for slot in one.slots))
    selectors = [one for one in selectors if not ladders([one])]
    stresses = [name for name in STRESSES if any(fnmatchcase(name, one) for one in selectors)]
    patterns = [one for one in selectors if not any(fnmatchcase(name, one) for name in STRESSES)]
    cases = select(patterns) if patterns else ()
    families = {
        name: [case for case in cases if case.family == name] for name in dict.fromkeys(c.family for c in cases)
    }
    found = [
        task
        for name in stresses
        for slot in STRESSES.about(name)["slots"]
        if slot in SLOTS and (task := _task(name, slot, [scene for _, scene in STRESSES[name]()], named)) is not None
    ]
    found += [
        task
        for name, members in families.items()
        for slot in SLOTS
        if (task := _task(name, slot, [case.scene for case in members], named)) is not None
    ]
    sampled = []
    for name, members in families.items() if not named else ():
        lit = [case for case in members if case.scene.lights and case.scene.clip == "depth"]
        # The family's own word that its pixels are averages comes first.
        lit.sort(key=lambda case: -case.samples)
        if lit:
            sampled.append(Sampled(family=name, scene=lit[0].scene))
    if named and not found and not climbed:
        raise LookupError("none of the scenes and ladders named shows any of the formulas named")
    return tuple(found), tuple(sampled), climbed


def _task(family: str, slot: str, scenes: Sequence[Scene], named: tuple[Formula, ...]) -> Task | None:
    """Return the diagram of a slot on a family, or None where there is nothing to choose from or nothing to see."""
    formulas = variants(slot, named)
    if slot not in SHAPES_OF or len(formulas) < 2:
        return None
    showing = tuple(scene for scene in scenes if concerned(scene, [slot]))[:MOST_SCENES]
    return Task(diagram=f"{slot}/{family}", slot=slot, formulas=formulas, scenes=showing) if showing else None
