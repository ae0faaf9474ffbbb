"""From a stage that failed to the specification item whose formula is to blame."""

from collections.abc import Collection, Sequence

import numpy as np

from rayproof.cases.case import ITEMS
from rayproof.cases.scene import Cube, Mesh, Plane, Scene, Shape, Sphere, Square, Triangle
from rayproof.cases.stages import Stage

HITS: dict[type[Shape], tuple[str, ...]] = {
    Sphere: ("HIT-1",),
    Cube: ("HIT-3",),
    Plane: ("HIT-4",),
    Triangle: ("HIT-5", "HIT-6"),
    Mesh: ("HIT-5", "HIT-6"),
    Square: ("HIT-7", "HIT-8"),
}
# rad: a normal that is wrong for another reason comes this near to one of two by chance in one case of a million.
CLOSE = 1e-3
NORMALS: dict[type[Shape], str] = {Sphere: "NRM-1", Cube: "NRM-2"}
MATRICES = ("XF-1", "XF-2")
_HITS = ("HIT-1", "HIT-2", "HIT-3", "HIT-4", "HIT-5", "HIT-6", "HIT-7", "HIT-8", "HIT-9")
# Items whose formula can make a stage wrong though the stages before it are right. A feeler meets shapes as well,
# behind the eye and from inside, where no ray of the camera shows it; a light is left out of visibility or of the sum.
COMPUTED: dict[Stage, tuple[str, ...]] = {
    Stage.CAMERA: ("CAM-1", "CAM-2", "CAM-3", "CAM-5"),
    Stage.RAY: ("CAM-1", "CAM-2", "CAM-3", "CAM-4", "CAM-5"),
    Stage.OBJECT: (*MATRICES, *_HITS),
    Stage.DISTANCE: (*MATRICES, *_HITS),
    Stage.POSITION: MATRICES,
    Stage.NORMAL: ("XF-2", "NRM-1", "NRM-2", "NRM-3"),
    Stage.VISIBILITY: (*MATRICES, *_HITS, "LIT-1", "LIT-2", "LIT-3", "LIT-4", "LIT-5", "RAD-2"),
    Stage.IRRADIANCE: ("LIT-1", "RAD-1", "RAD-2", "RAD-3", "RAD-5"),
    Stage.EXITANCE: ("RAD-4",),
    Stage.RADIANCE: ("NRM-3", "RAD-4"),
}
# Kinds of shapes without which an item is not asked for.
OF_SHAPES: dict[str, tuple[type[Shape], ...]] = {
    **{name: tuple(kind for kind, names in HITS.items() if name in names) for names in HITS.values() for name in names},
    **{name: (kind,) for kind, name in NORMALS.items()},
}


def candidates(stage: Stage, passing: Collection[Stage], shapes: Collection[str]) -> tuple[str, ...]:
    """Return the items that may be to blame where `stage` is the first that is wrong.

    That is those of the stage itself and of each stage before it that nobody has seen pass. `passing` are the stages
    written that pass in the case, `shapes` the names of the scene's kinds of shapes.
    """
    order = list(Stage)
    suspects = [stage, *(before for before in order[: order.index(stage)] if before not in passing)]
    if Stage.RAY in passing and stage is not Stage.CAMERA:
        suspects = [one for one in suspects if one is not Stage.CAMERA]  # of a camera images show nothing but its rays
    named = {name for one in suspects for name in COMPUTED[one]}
    kinds = {name: {kind.__name__ for kind in kinds} for name, kinds in OF_SHAPES.items()}
    return tuple(name for name in ITEMS if name in named and (name not in kinds or kinds[name] & set(shapes)))


def item(
    stage: Stage,
    scene: Scene,
    items: Collection[str],
    *,
    ours: int,
    theirs: int,
    alone: bool,
    part: str | None = None,
    phantom: bool = False,
    misplaced: bool = False,
) -> str:
    """Return the item to blame for `stage`, among the `items` that the configuration's formulas cover.

    `ours` and `theirs` are the shape indices at the worst pixel (-1: none). `alone` says that the stage is wrong even
    given the tracer's own previous stages; `part` is the camera stage's worst item; `phantom` says that distances are
    wrong by themselves, so that something was hit where it is not; `misplaced` that a normal was brought into the world
    by the wrong matrix.
    """
    if stage is Stage.CAMERA:
        return part or "CAM-1"
    if stage is Stage.RAY:
        return _first(("CAM-5", "CAM-4"), items)
    if stage in (Stage.OBJECT, Stage.DISTANCE):
        # Two hits of which the farther was taken: choosing is to blame, not the shapes' own tests.
        if stage is Stage.OBJECT and ours >= 0 and theirs >= 0 and ours != theirs and not phantom:
            return "HIT-9"
        index = theirs if theirs >= 0 and not (phantom and ours >= 0) else ours
        if index < 0:
            return "HIT-9"
        if stage is Stage.DISTANCE and not alone:
            return _first(("CAM-5", "CAM-4"), items)
        return _first(tuple(reversed(HITS[type(scene.shapes[index])])), items)
    if stage is Stage.POSITION:
        return "XF-2"
    if stage is Stage.NORMAL:
        index = ours if ours >= 0 else theirs
        local = NORMALS.get(type(scene.shapes[index])) if index >= 0 and not misplaced else None
        return local or "NRM-3"
    if stage is Stage.VISIBILITY:
        return _first(("LIT-2", "LIT-3", "LIT-4"), items, otherwise="LIT-1")
    if stage is Stage.IRRADIANCE:
        return "RAD-3" if scene.shading == "simplified" else "RAD-2"
    return "RAD-4"


def misplaced(shape: Shape, ours: Sequence[float], theirs: Sequence[float]) -> bool:
    """Say whether a wrong normal is the right one of object space, turned by the model matrix itself or not at all."""
    matrix = np.asarray(shape.to_world, dtype=np.float64)[:3, :3]
    wrong, right = np.asarray(ours, dtype=np.float64), np.asarray(theirs, dtype=np.float64)
    usable = all(len(one) == 3 and np.isfinite(one).all() and np.any(one) for one in (wrong, right))
    if not usable or _angle(wrong, right) <= CLOSE:
        return False
    local = matrix.T @ right
    return min(_angle(wrong, matrix @ local), _angle(wrong, local)) <= CLOSE


def _angle(one: np.ndarray, other: np.ndarray) -> float:
    """Return the angle [rad] between two lines: a normal may have been turned towards the viewer."""
    return float(np.arctan2(np.linalg.norm(np.cross(one, other)), abs(np.dot(one, other))))


def _first(wanted: tuple[str, ...], items: Collection[str], otherwise: str | None = None) -> str:
    """Return the first of `wanted` that the configuration covers."""
    return next((name for name in wanted if name in items), otherwise or wanted[-1])
