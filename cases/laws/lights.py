"""Laws of lights: they add up, can be split, are dark without flux, and are hidden by what encloses them."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from rayproof.cases.laws.relations import (
    BLACK,
    LIGHT,
    Ask,
    Conditions,
    Relation,
    added,
    around,
    at_least_two,
    behind_the_eye,
    camera_axes,
    related,
    strong,
    switched_on,
    times,
    with_lights,
)
from rayproof.cases.placement import matrix, vector
from rayproof.cases.scene import Camera, Cube, PointLight, Scene, Sphere, Square
from rayproof.cases.stages import Stage


# The image by all lights is the sum of the images by each.
def lights_add(scene: Scene, ask: Ask) -> Iterator[Relation]:
    """Switch the lights on one by one: what each gives adds up, and nothing is clamped, averaged or left out.

    Proof: E is a sum over lights; whether one is seen does not depend on another.
    Source: Kajiya, The Rendering Equation (1986); specification, LIT-1 and RAD-5.
    """
    if scene.lights:
        whole = at_least_two(scene)
        parts = tuple(with_lights(whole, light) for light in whole.lights)
        yield from added(ask, parts, whole, what=f"{len(parts)} lights one by one")


# A light is eight lights of an eighth each in its place.
SPLIT_SHARES = (0.02, 0.08, 0.05, 0.2, 0.15, 0.1, 0.25, 0.15)  # in sum 1, and no two neighbours alike


def light_split(scene: Scene, ask: Ask) -> Iterator[Relation]:
    """Put eight lights that share its flux in the first light's place: the light stays.

    Proof: E is a sum over lights, and the eight have all but the flux in common, which adds up.
    Source: Kajiya, The Rendering Equation (1986); specification, RAD-5.
    """
    if scene.lights:
        first, *others = scene.lights
        parts = (replace(first, flux=times(first.flux, share)) for share in SPLIT_SHARES)
        changed = with_lights(scene, *others, *parts)
        yield from related(ask, scene, changed, what="the first light split into eight", stages=LIGHT)


# A light without flux gives no light.
def light_dark(scene: Scene, ask: Ask) -> Iterator[Relation]:
    """Put lights of 0 W before, among and after the others: nothing changes, to the last bit.

    Proof: each adds Phi cos / (4 pi r^2) = 0, and x + 0 = x also when rounded. Source: specification, RAD-5.
    """
    if scene.lights:
        axes = camera_axes(scene.camera)
        places = [axes.eye + axes.distance * (share * axes.right + 0.4 * axes.up) for share in (-0.5, 0.2, 0.6)]
        before, among, after = (PointLight(position=vector(place), flux=(0.0, 0.0, 0.0)) for place in places)
        first, *others = scene.lights
        changed = with_lights(scene, before, first, among, *others, after)
        conditions = Conditions(exact=True)
        yield from related(ask, scene, changed, what="three lights of 0 W", stages=LIGHT, conditions=conditions)


# A light in a closed box gives no light outside of it.
def light_hidden(scene: Scene, ask: Ask) -> Iterator[Relation]:
    """Switch on a light in a small closed cube, and in a sphere, behind the eye: nothing changes.

    Proof: every segment that leads to the light crosses a wall. Walls are there in both images, so that what else they
    hide cancels. Source: specification, LIT-1 and E10.
    """
    place = behind_the_eye(scene, 0.25)
    for kind in (Cube, Sphere):
        wall = around(scene, place, 0.02 * camera_axes(scene.camera).distance, kind)
        dark, lit = switched_on(scene, place, wall)
        what = f"a light switched on inside a closed {kind.__name__.lower()}"
        yield from related(ask, dark, lit, what=what, stages=LIGHT, conditions=Conditions(exact=True))


# A wall at nine tenths of the way to a light hides it as well as one that is near.
def light_caged(scene: Scene, ask: Ask) -> Iterator[Relation]:
    """Switch on a light in the middle of a sphere that begins at 0.9 and at 0.995 of the way: nothing changes.

    Proof: the segment from any point outside of the sphere to its centre crosses it, and feelers that end early do not
    notice. Source: specification, LIT-1.
    """
    for share in (0.9, 0.995):
        place = behind_the_eye(scene, 0.25)
        radius = (1 - share) * 1.25 * camera_axes(scene.camera).distance
        dark, lit = switched_on(scene, place, around(scene, place, radius, Sphere))
        what = f"a light switched on in a sphere that begins at {share:g} of the way"
        yield from related(ask, dark, lit, what=what, stages=LIGHT, conditions=Conditions(exact=True))


# What stands behind a light does not hide it.
def light_backed(scene: Scene, ask: Ask) -> Iterator[Relation]:
    """Put a wall and a cube behind the eye and behind the only light, at 1.02 to 1.2 of the way: nothing changes.

    Proof: a feeler ends at the light, and the wall lies beyond, on the far side of a plane that neither eye nor light
    nor anything seen lies on. Source: specification, E10.
    """
    axes = camera_axes(scene.camera)
    place = behind_the_eye(scene, 0.2)
    alone = with_lights(scene, PointLight(position=vector(place), flux=strong(scene)))
    for share in (0.02, 0.1, 0.2):
        back = place - share * 1.2 * axes.distance * axes.forward
        pose = np.eye(4)
        pose[:3, :3] = np.stack([axes.right, axes.up, -axes.forward], axis=1) * axes.distance
        pose[:3, 3] = back
        wall = Square(albedo=BLACK, to_world=matrix(pose), two_sided=True)
        pose[:3, 3] = back - 0.6 * axes.distance * axes.forward
        block = Cube(albedo=BLACK, to_world=matrix(pose))
        backed = replace(alone, shapes=(*alone.shapes, wall, block))
        yield from related(ask, alone, backed, what=f"a wall at {1 + share:g} of the way to the light")


# A light sees what it lights.
PIXELS = 3  # that are asked about, each by an image of its own
LEAST = 0.05  # cosine and share of the distance below which either answer would do


def light_sees(scene: Scene, ask: Ask) -> Iterator[Relation]:
    """Put the camera in the first light's place and look at a hit: it is seen there if, and only if, it is lit.

    Proof: the feeler and the line of sight are the same segment, and nothing but its ends tells them apart.
    Source: von Helmholtz, Handbuch der physiologischen Optik (1867), on reciprocity; specification, LIT-1.
    """
    answers = ask(scene)
    if not scene.lights or Stage.VISIBILITY not in answers or Stage.POSITION not in answers:
        return
    light = np.asarray(scene.lights[0].position)
    towards = light - answers[Stage.POSITION]
    r = np.linalg.norm(towards, axis=-1)
    with np.errstate(divide="ignore", invalid="ignore"):
        cosine = np.sum(towards * answers[Stage.NORMAL], axis=-1) / r
    above = (answers[Stage.OBJECT][..., 0] >= 0) & (cosine > LEAST)
    for lit in (1.0, 0.0):
        rows, columns = np.nonzero(above & (answers[Stage.VISIBILITY][..., 0] == lit))
        for pick in range(min(PIXELS, len(rows))):
            row, column = (list_[pick * len(list_) // PIXELS] for list_ in (rows, columns))
            point = answers[Stage.POSITION][row, column]
            upward = np.eye(3)[int(np.argmin(np.abs(light - point)))]
            camera = Camera(
                eye=vector(light),
                target=vector(point),
                up=vector(upward),
                fovy=1.0,
                width=1,
                height=1,
                near=1e-3 * float(r[row, column]),
                far=1e3 * float(r[row, column]),
            )
            back = replace(scene, camera=camera, clip="none")
            distance = float(ask(back)[Stage.DISTANCE][0, 0, 0])
            # What is hit just before the point may be the point itself.
            if not lit and distance > (1 - LEAST) * r[row, column]:
                continue
            yield Relation(
                stage=Stage.VISIBILITY,
                expected=np.full((1, 1, 1), float(distance > (1 - 1e-3 * LEAST) * r[row, column])),
                measured=np.full((1, 1, 1), lit),
                scene=back,
                changed=scene,
                what=f"pixel ({column}, {row}) seen from the first light",
                conditions=Conditions(exact=True),
            )
