"""Laws of the clip interval: widened, joined or measured by hits; shapes that are out of sight change nothing."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from rayproof.cases.laws.relations import (
    GEOMETRY,
    Ask,
    Conditions,
    Relation,
    camera_axes,
    lit_from_the_eye,
    related,
    with_camera,
)
from rayproof.cases.placement import matrix, world_triangles
from rayproof.cases.scene import Cube, Mesh, Plane, Scene, Shape, Sphere, Square, Triangle
from rayproof.cases.stages import Stage

# Where the clip interval holds nothing, nothing is seen.
MARGIN = 1.5  # times the farthest distance that a shape can have


def farthest(shape: Shape, eye: np.ndarray) -> float:
    """Return a bound on the distance [m] of a bounded shape's points from the eye."""
    if isinstance(shape, Triangle | Mesh):
        return float(np.linalg.norm(world_triangles(shape).astype(np.float64) - eye, axis=-1).max())
    pose = np.asarray(shape.to_world)
    center, radius = (np.asarray(shape.center), shape.radius) if isinstance(shape, Sphere) else (np.zeros(3), 0.75**0.5)
    place = pose[:3, :3] @ center + pose[:3, 3]
    return float(np.linalg.norm(place - eye) + radius * np.linalg.norm(pose[:3, :3], ord=2))


def clip_beyond(scene: Scene, ask: Ask) -> Iterator[Relation]:
    """Move near and far beyond everything there is, as planes and as shells: the image is black.

    Proof: every hit lies nearer than the farthest point of any shape. Source: specification, HIT-2.
    """
    if any(isinstance(shape, Plane) for shape in scene.shapes) or not scene.shapes:
        return
    eye = np.asarray(scene.camera.eye)
    beyond = MARGIN * max(farthest(shape, eye) for shape in scene.shapes)
    for clip in ("depth", "shell"):
        changed = with_camera(replace(scene, clip=clip), near=beyond, far=4 * beyond)
        answers = ask(changed)
        for stage, nothing in ((Stage.OBJECT, -1.0), (Stage.DISTANCE, np.inf), (Stage.RADIANCE, 0.0)):
            if stage in answers:
                yield Relation(
                    stage=stage,
                    expected=np.full(answers[stage].shape, nothing),
                    measured=answers[stage],
                    scene=changed,
                    changed=changed,
                    what=f"clipped ({clip}) from {beyond:g} m on, beyond everything",
                    conditions=Conditions(exact=True),
                )


# What is seen between two planes is what is seen before a third between them, or else behind it.
def clip_join(scene: Scene, ask: Ask) -> Iterator[Relation]:
    """Clip from near to a middle distance and from there to far: each ray sees the first part's hit, else the second's.

    Proof: the intervals join, and the smallest of their two smallest numbers is the smallest of all. Looked at from
    radiance alone, what is black in the first part may be hit there or not, and either is right.
    Source: specification, HIT-2.
    """
    if scene.clip == "none":
        return
    camera, axes = scene.camera, camera_axes(scene.camera)
    for clip in ("depth", "shell"):
        joint = replace(scene, clip=clip)
        middle = axes.distance * 0.9731  # where no scene has a surface on purpose
        if not camera.near < middle < camera.far:
            continue
        front, back = with_camera(joint, far=middle), with_camera(joint, near=middle)
        whole, first, second = ask(joint), ask(front), ask(back)
        for stage in (*GEOMETRY[1:], Stage.RADIANCE):
            if not all(stage in images for images in (whole, first, second)):
                continue
            if Stage.OBJECT in first:
                hit = first[Stage.OBJECT][..., :1] >= 0
            else:
                hit = (first[stage] > 0).any(axis=-1, keepdims=True) | (whole[stage] == 0).all(axis=-1, keepdims=True)
            yield Relation(
                stage=stage,
                expected=np.where(hit, first[stage], second[stage]),
                measured=whole[stage],
                scene=front,
                changed=joint,
                what=f"clipped ({clip}) before and behind {middle:g} m",
            )


# A plane just before a hit leaves it, one just behind it takes it away.
def clip_measured(scene: Scene, ask: Ask) -> Iterator[Relation]:
    """Put near and far where the renderer's own rays find the median surface: hits outside are clipped, others stay.

    Proof: the plane's depth is t dot(d, F), and the shell's distance t, both of the renderer's own hits; what the
    first hit leaves behind when it is clipped is not asked about. Source: specification, HIT-2.
    """
    free = replace(scene, clip="none")
    unclipped = ask(free)
    if not all(stage in unclipped for stage in (Stage.RAY, Stage.OBJECT, Stage.DISTANCE)):
        return
    distance = unclipped[Stage.DISTANCE][..., 0]
    hit = np.isfinite(distance)
    # A ray in a surface's own plane meets it anywhere or nowhere.
    if Stage.NORMAL in unclipped:
        hit &= np.abs(np.sum(unclipped[Stage.NORMAL] * unclipped[Stage.RAY], axis=-1)) > 1e-3
    if not hit.any():
        return
    along = np.where(hit, distance, 0.0)
    depth = along * (unclipped[Stage.RAY] @ camera_axes(scene.camera).forward)
    for clip, measure in (("depth", depth), ("shell", along)):
        middle = float(np.median(measure[hit])) * 1.0137
        cut = with_camera(replace(scene, clip=clip), near=1e-3 * middle, far=middle)
        first = ask(cut)[Stage.OBJECT]
        sure = hit & (np.abs(measure - middle) > 1e-4 * middle) & (measure > 2e-3 * middle)
        yield Relation(
            stage=Stage.OBJECT,
            expected=np.where((measure < middle)[..., np.newaxis], unclipped[Stage.OBJECT], -1.0),
            measured=first,
            scene=free,
            changed=cut,
            what=f"the far {clip} at {middle:g} m, the median of what is seen",
            examined=sure,
        )
        beyond = with_camera(replace(scene, clip=clip), near=middle, far=1e6 * middle)
        second = ask(beyond)
        kept = sure & (measure > middle)
        yield Relation(
            stage=Stage.OBJECT,
            expected=unclipped[Stage.OBJECT],
            measured=second[Stage.OBJECT],
            scene=free,
            changed=beyond,
            what=f"the near {clip} at {middle:g} m, the median of what is seen",
            examined=kept,
        )


# What stands behind the eye and behind the light is neither seen nor in the way.
COUNTS = (1, 9)  # of each kind: few, and more than renderers treat one by one
TETRAHEDRON = ((0.0, 0.0, 0.5), (0.5, 0.0, -0.5), (-0.5, 0.4, -0.5), (-0.5, -0.4, -0.5))
TETRAHEDRON_FACES = ((0, 1, 2), (0, 2, 3), (0, 3, 1), (1, 3, 2))
ALBEDO = (0.9, 0.9, 0.9)
TRIANGLE = ((-0.5, -0.5, 0.0), (0.5, -0.5, 0.0), (0.0, 0.5, 0.0))


def crowd(scene: Scene, count: int) -> tuple[Shape, ...]:
    """Return `count` shapes of each kind, at most nine, all of them at least twice the near distance behind the eye."""
    axes = camera_axes(scene.camera)
    size = 0.2 * axes.distance
    shapes: list[Shape] = []
    for index in range(count):
        for row, kind in enumerate((Sphere, Cube, Square, Triangle, Mesh)):
            back = 2 * size + 2 * scene.camera.near + size * row
            across, upward = (index + 4) // 3 % 3 - 1, (index + 4) % 3 - 1  # the middle one first
            sideways = 1.5 * size * (across * axes.right + upward * axes.up)
            place = np.eye(4)
            place[:3, :3] = np.stack([axes.right, axes.up, -axes.forward], axis=1) * size
            place[:3, 3] = axes.eye - back * axes.forward + sideways
            more = {
                Sphere: {"radius": 0.5},
                Triangle: {"vertices": TRIANGLE},
                Mesh: {"vertices": np.array(TETRAHEDRON), "faces": np.array(TETRAHEDRON_FACES)},
            }
            shapes.append(kind(albedo=ALBEDO, to_world=matrix(place), **more.get(kind, {})))
    return tuple(shapes)


def unseen(scene: Scene, ask: Ask) -> Iterator[Relation]:
    """Put one shape of each kind, and nine, behind the eye, and the only light in front of it: nothing changes.

    Proof: what is seen and the light lie on the same side of the plane through the eye, and so does the segment between
    them; the crowd lies on the other. Source: specification, HIT-2 and E4.
    """
    lit = lit_from_the_eye(scene)
    for count in COUNTS:
        changed = replace(lit, shapes=(*lit.shapes, *crowd(scene, count)))
        yield from related(ask, lit, changed, what=f"{count} of each kind of shape behind the eye")
