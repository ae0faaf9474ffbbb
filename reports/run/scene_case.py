"""A user's scene file as a case: what it covers is read off the scene."""

from pathlib import Path

from cases.case import Case
from cases.covering import covering
from cases.scene_json import load_scene

# What a scene that nobody tuned may have: rounding reaches few pixels, but its author owes us no share of them.
MOST_EDGE = 0.5


def case_of_file(path: Path) -> Case:
    """Return the case that asks about a scene file; raise SceneError or OSError if it cannot be read."""
    scene = load_scene(path)
    return Case(
        name=f"file/{path.stem}",
        scene=scene,
        stresses=f"The scene that {path.name} describes.",
        covers=covering(scene),
        least_interior=0,
        most_edge=MOST_EDGE,
    )
