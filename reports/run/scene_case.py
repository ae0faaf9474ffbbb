"""A user's scene files as cases: what they cover is read off the scenes."""

import hashlib
from collections.abc import Sequence
from pathlib import Path

from rayproof.cases.case import Case, covering
from rayproof.cases.scene import Scene
from rayproof.cases.scene_json import load_scene
from rayproof.reports.results.json_numbers import legible

# What a scene that nobody tuned may have: rounding reaches few pixels, but its author owes us no share of them.
MOST_EDGE = 0.5


FAMILY = "file"


def place_of(name: str) -> str:
    """Return where a case's files lie below `scenes`, `images` and `calls` of a results folder: under its name.

    Of scene files there may be any number, so that they are spread over 256 folders by a digest: of a hundred thousand
    none has more than some 500 entries.
    """
    family, _, rest = name.partition("/")
    if family != FAMILY:
        return name
    digest = hashlib.sha256(rest.partition("/rows-")[0].encode(errors="replace")).hexdigest()
    return f"{family}/{digest[:2]}/{rest}"


def cases_of_files(paths: Sequence[Path]) -> tuple[Case, ...]:
    """Return a case for each scene file, named by its stem; a file named twice is asked once.

    Results are filed by name: files of one stem in several folders are told apart by a number.

    Raises:
        SceneError, OSError: a file cannot be read.

    """
    cases: list[Case] = []
    taken: set[str] = set()
    for path in {path.resolve(): path for path in paths}.values():
        # A stem of dots alone would name a folder, this one or the one above.
        stem = legible(path.stem.strip(".") or "scene")
        name = next(name for name in (stem, *(f"{stem}-{n}" for n in range(2, len(paths) + 2))) if name not in taken)
        taken.add(name)
        cases.append(case_of_file(path, name=name))
    return tuple(cases)


def case_of_file(path: Path, *, name: str | None = None) -> Case:
    """Return the case that asks about a scene file; raise SceneError or OSError if it cannot be read."""
    words = f"The scene that {legible(path.name)} describes."
    return case_of_scene(load_scene(path), name=f"{FAMILY}/{name or legible(path.stem)}", stresses=words)


def case_of_scene(scene: Scene, *, name: str, stresses: str) -> Case:
    """Return the case that asks about a scene that nobody tuned."""
    return Case(
        name=name,
        scene=scene,
        stresses=stresses,
        covers=covering(scene),
        least_interior=0,
        most_edge=MOST_EDGE,
        tuned=False,
    )
