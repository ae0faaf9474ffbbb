"""The light of a point is the mean of twelve about it: n.L / r^2 is harmonic in the light's place."""

from collections.abc import Iterator

import numpy as np

from rayproof.cases.changes import strong, vector, view, with_lights
from rayproof.cases.laws import LAWS
from rayproof.cases.relations import LIGHT, Ask, Conditions, Relation
from rayproof.cases.scene import PointLight, Scene
from rayproof.cases.stages import Stage

GOLDEN = (1 + 5**0.5) / 2
VERTICES = np.array([(0, a, b * GOLDEN) for a in (-1, 1) for b in (-1, 1)], dtype=np.float64)
ICOSAHEDRON = np.concatenate([np.roll(VERTICES, turn, axis=1) for turn in range(3)]) / np.hypot(1, GOLDEN)
# A wide one shows a wrong cosine in float32, a narrow one leaves nothing out in float64.
SHARES = (0.1, 0.004)


@LAWS.register("light_harmonic", stage=Stage.IRRADIANCE, implicates=("RAD-1", "RAD-2"))
def light_harmonic(scene: Scene, ask: Ask) -> Iterator[Relation]:
    """Put a light at twelve vertices of an icosahedron about its place, one after the other: the mean is the same.

    Proof: n.L / r^2 = -n.grad(1/r) is harmonic where r > 0, and the twelve vertices average polynomials up to degree 5
    as the sphere does, so that the mean differs by terms of (radius / r)^6. Only pixels that all thirteen light are
    looked at. Source: Axler, Bourdon and Ramey, Harmonic Function Theory (2001), theorem 1.4; Delsarte, Goethals and
    Seidel, Spherical Codes and Designs (1977).
    """
    if scene.shading == "simplified":
        return
    axes = view(scene.camera)
    nearest = 0.3 * axes.distance
    center = axes.eye - nearest * axes.forward + 0.1 * axes.distance * axes.right
    alone = with_lights(scene, PointLight(position=vector(center), flux=strong(scene)))
    for share in SHARES:
        ring = [
            with_lights(scene, PointLight(position=vector(center + share * nearest * vertex), flux=strong(scene)))
            for vertex in ICOSAHEDRON
        ]
        middle, about = ask(alone), [ask(one) for one in ring]
        for stage in LIGHT:
            if stage in middle and all(stage in one for one in about):
                images = np.stack([one[stage] for one in about])
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
