"""Laws of radiometry: linear in flux and albedo, channels apart, harmonic in the light's place, free of the view."""

from collections.abc import Iterator
from dataclasses import replace
from math import pi

import numpy as np

from rayproof.cases.laws.relations import (
    LIGHT,
    Ask,
    Conditions,
    Relation,
    camera_axes,
    related,
    strong,
    times,
    with_camera,
    with_lights,
    with_shapes,
)
from rayproof.cases.placement import vector
from rayproof.cases.scene import PointLight, Rgb, Scene
from rayproof.cases.stages import Stage

# Light is proportional to flux.
FLUX_FACTORS = np.array((3.0, 0.7, 11.0))


def flux_linear(scene: Scene, ask: Ask) -> Iterator[Relation]:
    """Multiply every light's flux by 3, 0.7 and 11, channel by channel: irradiance, exitance, radiance go with it.

    Proof: E is a sum over lights of Phi times what does not depend on Phi, and M and L are E times constants.
    Source: Kajiya, The Rendering Equation (1986); specification, RAD-1 and RAD-5.
    """
    if scene.lights:
        brighter = (replace(light, flux=vector(np.asarray(light.flux) * FLUX_FACTORS)) for light in scene.lights)
        changed = with_lights(scene, *brighter)
        before = {stage: lambda image: image * FLUX_FACTORS for stage in LIGHT}
        yield from related(ask, scene, changed, what="flux times (3, 0.7, 11)", before=before)


# Light scales with a power of two to the last bit.
BRIGHTER = 2.0**12  # bright enough for any value to pass 1, where displays clamp


def flux_power(scene: Scene, ask: Ask) -> Iterator[Relation]:
    """Multiply every flux by 2^12: irradiance, exitance and radiance are 2^12 times as large, to the last bit.

    Proof: each is a product with Phi or a sum of such, and rounding commutes with powers of two as long as nothing
    overflows or vanishes. Source: IEEE 754-2019, section 4.3; specification, RAD-1.
    """
    if scene.lights:
        changed = with_lights(scene, *(replace(light, flux=times(light.flux, BRIGHTER)) for light in scene.lights))
        before = {stage: lambda image: image * BRIGHTER for stage in LIGHT}
        conditions = Conditions(exact=True)
        yield from related(ask, scene, changed, what="flux times 2^12", before=before, conditions=conditions)


# Reflected light is proportional to albedo.
ALBEDO_FACTORS = np.array((0.3, 0.9, 0.6))


def albedo_linear(scene: Scene, ask: Ask) -> Iterator[Relation]:
    """Multiply every albedo by 0.3, 0.9 and 0.6, channel by channel: exitance and radiance go with it, E stays.

    Proof: M = albedo E, and E does not depend on albedo, since light is reflected only once.
    Source: specification, RAD-4.
    """
    changed = with_shapes(scene, lambda shape: replace(shape, albedo=vector(np.asarray(shape.albedo) * ALBEDO_FACTORS)))
    before = {stage: lambda image: image * ALBEDO_FACTORS for stage in (Stage.EXITANCE, Stage.RADIANCE)}
    yield from related(ask, scene, changed, what="albedos times (0.3, 0.9, 0.6)", before=before)


# What albedo gains and flux loses by a power of two, radiance does not notice, to the last bit.
def albedo_flux(scene: Scene, ask: Ask) -> Iterator[Relation]:
    """Halve every albedo and double every flux: irradiance doubles, exitance and radiance stay, to the last bit.

    Proof: M = albedo E is linear in either, and a product with a power of two is not rounded.
    Source: specification, RAD-4; IEEE 754-2019, section 4.3.
    """
    if scene.lights:
        darker = with_shapes(scene, lambda shape: replace(shape, albedo=times(shape.albedo, 0.5)))
        lights = (replace(light, flux=times(light.flux, 2.0)) for light in scene.lights)
        changed = with_lights(darker, *lights)
        before = {Stage.IRRADIANCE: lambda image: image * 2.0}
        conditions = Conditions(exact=True)
        yield from related(
            ask, scene, changed, what="albedo halved, flux doubled", before=before, conditions=conditions
        )


# Red, green and blue are three numbers that nothing mixes and nothing prefers.
def turned(colour: Rgb) -> Rgb:
    """Return a colour with its channels moved on by one."""
    red, green, blue = colour
    return blue, red, green


def channels(scene: Scene, ask: Ask) -> Iterator[Relation]:
    """Move the channels of every flux and albedo on by one: those of the image move on by one, to the last bit.

    Proof: the specification's formulas are the same for each channel, and none has two channels in it.
    Source: specification, RAD-1 to RAD-4.
    """
    if scene.lights:
        painted = with_shapes(scene, lambda shape: replace(shape, albedo=turned(shape.albedo)))
        changed = with_lights(painted, *(replace(light, flux=turned(light.flux)) for light in scene.lights))
        before = {stage: lambda image: image[..., [2, 0, 1]] for stage in LIGHT}
        conditions = Conditions(exact=True)
        yield from related(ask, scene, changed, what="channels moved on by one", before=before, conditions=conditions)


# What one channel holds does not depend on the others.
RED = np.array((1.0, 0.0, 0.0))


def channels_apart(scene: Scene, ask: Ask) -> Iterator[Relation]:
    """Take green and blue out of every flux: red stays to the last bit, green and blue are 0.

    Proof: the specification's formulas are the same for each channel, and none has two channels in it.
    Source: specification, RAD-1 to RAD-4.
    """
    if scene.lights:
        red = (replace(light, flux=vector(np.asarray(light.flux) * RED)) for light in scene.lights)
        before = {stage: lambda image: image * RED for stage in LIGHT}
        conditions = Conditions(exact=True)
        changed = with_lights(scene, *red)
        yield from related(ask, scene, changed, what="only red light", before=before, conditions=conditions)


# Light is never negative, and is a number.
def not_negative(scene: Scene, ask: Ask) -> Iterator[Relation]:
    """Look at the scene as it is: no value of light is below 0, infinite or no number.

    Proof: E is a sum of products of what is not negative; below the horizon a light gives 0.
    Source: Lambert, Photometria (1760); specification, RAD-2.
    """
    answers = ask(scene)
    for stage in LIGHT:
        if stage in answers:
            image = answers[stage]
            yield Relation(
                stage=stage,
                expected=np.maximum(np.nan_to_num(image, posinf=0.0), 0.0),
                measured=image,
                scene=scene,
                changed=scene,
                what="the scene as it is",
                conditions=Conditions(exact=True),
            )


# Irradiance follows from visibility, exitance from irradiance, radiance from exitance.
NEEDED = (Stage.RAY, Stage.OBJECT, Stage.POSITION, Stage.NORMAL, Stage.VISIBILITY)
GRAZING = 1e-3  # cosine: nearer to the horizon a light may be on either side


def light_in_stages(scene: Scene, ask: Ask) -> Iterator[Relation]:
    """Go on from each stage's own numbers: E = sum V Phi cos / (4 pi r^2), M = albedo E, L = M / pi on the seen side.

    Proof: these are the stages' definitions (with simplified light E = sum V Phi cos and L = M). A pixel whose normal
    is at right angles to its ray may be on either side. Source: specification, RAD-1 to RAD-4.
    """
    answers = ask(scene)
    if not scene.lights or not all(stage in answers for stage in (*NEEDED, Stage.IRRADIANCE)):
        return
    simplified = scene.shading == "simplified"
    position, normal = answers[Stage.POSITION], answers[Stage.NORMAL]
    hit = answers[Stage.OBJECT][..., :1] >= 0
    total, sizes = np.zeros(position.shape), np.zeros(position.shape)
    for index, light in enumerate(scene.lights):
        towards = np.asarray(light.position) - position
        squared = np.sum(towards * towards, axis=-1, keepdims=True)
        with np.errstate(divide="ignore", invalid="ignore"):
            cosine = np.sum(normal * towards, axis=-1, keepdims=True) / np.sqrt(squared)
            arriving = np.asarray(light.flux) * (1.0 if simplified else 1 / (4 * pi * squared))
        lit = answers[Stage.VISIBILITY][..., index : index + 1] > 0
        total += np.where(lit, cosine * arriving, 0.0)
        below = lit & hit & (cosine < -GRAZING)
        yield Relation(
            stage=Stage.VISIBILITY,
            expected=np.where(below, 0.0, 1.0 * lit),
            measured=1.0 * lit,
            scene=scene,
            changed=scene,
            what=f"light {index} above the horizon",
        )
        # A position that is off by some u of its coordinates turns the light's direction by as much over r.
        moved = np.linalg.norm(position, axis=-1, keepdims=True) + np.linalg.norm(light.position)
        sizes += np.where(lit, arriving * (1 + 3 * moved / np.sqrt(squared)), 0.0)

    def relation(stage: Stage, expected: np.ndarray, what: str, terms: np.ndarray | None = None) -> Relation:
        return Relation(
            stage=stage, expected=expected, measured=answers[stage], scene=scene, changed=scene, what=what, terms=terms
        )

    yield relation(Stage.IRRADIANCE, total, "from position, normal and visibility", sizes)
    index = answers[Stage.OBJECT][..., 0].astype(int)
    albedo = np.array([*(shape.albedo for shape in scene.shapes), (0.0, 0.0, 0.0)])[index]
    if Stage.EXITANCE in answers:
        yield relation(Stage.EXITANCE, albedo * answers[Stage.IRRADIANCE], "albedo times irradiance")
    if Stage.EXITANCE in answers and Stage.RADIANCE in answers:
        two_sided = np.array([*(shape.two_sided for shape in scene.shapes), False])[index]
        facing = np.sum(normal * answers[Stage.RAY], axis=-1)
        shown = (two_sided | (facing < 0))[..., np.newaxis]
        reflected = answers[Stage.EXITANCE] / (1.0 if simplified else pi)
        yield relation(Stage.RADIANCE, np.where(shown, reflected, 0.0), "exitance over pi")


# The light of a point is the mean of twelve about it: n.L / r^2 is harmonic in the light's place.
GOLDEN = (1 + 5**0.5) / 2
VERTICES = np.array([(0, a, b * GOLDEN) for a in (-1, 1) for b in (-1, 1)], dtype=np.float64)
ICOSAHEDRON = np.concatenate([np.roll(VERTICES, turn, axis=1) for turn in range(3)]) / np.hypot(1, GOLDEN)
# A wide one shows a wrong cosine in float32, a narrow one leaves nothing out in float64.
HARMONIC_SHARES = (0.1, 0.004)


def light_harmonic(scene: Scene, ask: Ask) -> Iterator[Relation]:
    """Put a light at twelve vertices of an icosahedron about its place, one after the other: the mean is the same.

    Proof: n.L / r^2 = -n.grad(1/r) is harmonic where r > 0, and the twelve vertices average polynomials up to degree 5
    as the sphere does, so that the mean differs by terms of (radius / r)^6. Only pixels that all thirteen light are
    looked at. Source: Axler, Bourdon and Ramey, Harmonic Function Theory (2001), theorem 1.4; Delsarte, Goethals and
    Seidel, Spherical Codes and Designs (1977).
    """
    if scene.shading == "simplified":
        return
    axes = camera_axes(scene.camera)
    nearest = 0.3 * axes.distance
    center = axes.eye - nearest * axes.forward + 0.1 * axes.distance * axes.right
    alone = with_lights(scene, PointLight(position=vector(center), flux=strong(scene)))
    for share in HARMONIC_SHARES:
        ring = [
            with_lights(scene, PointLight(position=vector(center + share * nearest * vertex), flux=strong(scene)))
            for vertex in ICOSAHEDRON
        ]
        middle, about = ask(alone), [ask(moved_scene) for moved_scene in ring]
        for stage in LIGHT:
            if stage in middle and all(stage in answers for answers in about):
                images = np.stack([answers[stage] for answers in about])
                lit = np.all(images > 0, axis=(0, -1)) & np.all(middle[stage] > 0, axis=-1)
                # The seventh term of the expansion about r >= nearest; a degree that is added up from seven on.
                yield Relation(
                    stage=stage,
                    expected=images.mean(axis=0),
                    measured=middle[stage],
                    scene=ring[0],
                    changed=alone,
                    what=f"the mean of twelve lights about one, {share:g} of its distance away",
                    examined=lit,
                    conditions=Conditions(truncation=8 * share**6),
                )


# A point's radiance does not depend on who looks at it.
PIXELS = 4
SIDE = 3  # px: the point in the middle, its neighbours about it
KEPT = (Stage.OBJECT, Stage.NORMAL, Stage.VISIBILITY, Stage.IRRADIANCE, Stage.EXITANCE, Stage.RADIANCE)


def view_free(scene: Scene, ask: Ask) -> Iterator[Relation]:
    """Look at a hit from an eye beside the first one: its normal, its light and its radiance are the same.

    Proof: a diffuse surface is equally bright from everywhere on the same side (Lambert's law), and nothing between
    point and light moved. A point that the other eye does not see is left out. Source: Lambert, Photometria (1760).
    """
    answers = ask(scene)
    if not all(stage in answers for stage in (Stage.OBJECT, Stage.DISTANCE, Stage.POSITION)):
        return
    axes, camera = camera_axes(scene.camera), scene.camera
    rows, columns = np.nonzero(answers[Stage.OBJECT][..., 0] >= 0)
    beside = axes.eye + 0.02 * axes.distance * (axes.right - 0.6 * axes.up)
    for pick in range(min(PIXELS, len(rows))):
        row, column = (list_[(2 * pick + 1) * len(list_) // (2 * PIXELS)] for list_ in (rows, columns))
        point = answers[Stage.POSITION][row, column]
        fovy = camera.fovy * SIDE / camera.height
        looking = {"eye": vector(beside), "target": vector(point), "fovy": fovy, "width": SIDE, "height": SIDE}
        from_beside = with_camera(scene, **looking)
        aside = ask(from_beside)
        middle = SIDE // 2
        place = aside[Stage.POSITION][middle, middle]
        if np.linalg.norm(place - point) > 1e-4 * np.linalg.norm(point - beside):
            continue
        for stage in KEPT:
            if stage in answers and stage in aside:
                expected = aside[stage].copy()
                expected[middle, middle] = answers[stage][row, column]
                centre = np.zeros((SIDE, SIDE), dtype=bool)
                centre[middle, middle] = True
                yield Relation(
                    stage=stage,
                    expected=expected,
                    measured=aside[stage],
                    scene=from_beside,
                    changed=scene,
                    what=f"pixel ({column}, {row}) seen from beside",
                    examined=centre,
                )
