"""Irradiance follows from visibility, exitance from irradiance, radiance from exitance."""

from collections.abc import Iterator
from math import pi

import numpy as np

from rayproof.cases.laws import LAWS
from rayproof.cases.relations import Ask, Relation
from rayproof.cases.scene import Scene
from rayproof.cases.stages import Stage

NEEDED = (Stage.RAY, Stage.OBJECT, Stage.POSITION, Stage.NORMAL, Stage.VISIBILITY)
GRAZING = 1e-3  # cosine: nearer to the horizon a light may be on either side


@LAWS.register(
    "light_in_stages", stage=Stage.IRRADIANCE, implicates=("RAD-1", "RAD-2", "RAD-3", "RAD-4", "LIT-1"), staged=True
)
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
        seen = answers[Stage.VISIBILITY][..., index : index + 1] > 0
        total += np.where(seen, cosine * arriving, 0.0)
        below = seen & hit & (cosine < -GRAZING)
        yield Relation(
            stage=Stage.VISIBILITY,
            expected=np.where(below, 0.0, 1.0 * seen),
            measured=1.0 * seen,
            scene=scene,
            changed=scene,
            what=f"light {index} above the horizon",
        )
        # A position that is off by some u of its coordinates turns the light's direction by as much over r.
        moved = np.linalg.norm(position, axis=-1, keepdims=True) + np.linalg.norm(light.position)
        sizes += np.where(seen, arriving * (1 + 3 * moved / np.sqrt(squared)), 0.0)

    def relation(stage: Stage, expected: np.ndarray, what: str, terms: np.ndarray | None = None) -> Relation:
        return Relation(
            stage=stage,
            expected=expected,
            measured=answers[stage],
            scene=scene,
            changed=scene,
            what=what,
            terms=terms,
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
