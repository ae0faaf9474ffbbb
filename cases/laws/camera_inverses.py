"""The camera's matrices undo each other, and its pixels lie about the image's middle."""

from collections.abc import Iterator

import numpy as np

from rayproof.cases.laws import LAWS
from rayproof.cases.relations import Ask, Relation
from rayproof.cases.scene import Scene
from rayproof.cases.stages import Stage


@LAWS.register("camera_inverses", stage=Stage.CAMERA, implicates=("CAM-1", "CAM-2", "CAM-3"), staged=True)
def camera_inverses(scene: Scene, ask: Ask) -> Iterator[Relation]:
    """Multiply view and projection by their inverses, take pixels to NDC and back, move the eye to the origin.

    Proof: M^-1 M = 1; pixel centres lie at whole numbers and a half, symmetrically, so that NDC changes sign under a
    half turn of the image. Source: specification, CAM-1 to CAM-3.
    """
    camera = ask(scene).get(Stage.CAMERA)
    if camera is None:
        return

    def relation(what: str, expected: np.ndarray, measured: np.ndarray, terms: np.ndarray) -> Relation:
        return Relation(
            stage=Stage.CAMERA,
            expected=expected[..., np.newaxis],
            measured=measured[..., np.newaxis],
            terms=terms[..., np.newaxis],
            scene=scene,
            changed=scene,
            what=what,
        )

    for name in ("view", "projection"):
        one, other = camera[name], camera[f"{name}_inverse"]
        # An inverse is right as a whole, not entry by entry (Higham 2002, section 14.1).
        sizes = np.full((4, 4), (np.abs(other) @ np.abs(one)).max())
        yield relation(f"{name} times its inverse", np.eye(4), other @ one, sizes)
    eye = np.array([[*scene.camera.eye, 1.0]])
    carried = eye @ camera["view"].T
    yield relation(
        "the eye in camera space", np.array([[0.0, 0, 0, 1]]), carried, np.abs(eye) @ np.abs(camera["view"]).T
    )
    ndc, pixel = camera["ndc"], camera["pixel"]
    across = np.arange(scene.camera.width) + 0.5
    down = np.arange(scene.camera.height) + 0.5
    for axis, numbers in enumerate(np.meshgrid(across, down)):
        yield relation("pixel centres", numbers, pixel[..., axis], numbers)
        yield relation("NDC after half a turn", -ndc[::-1, ::-1, axis], ndc[..., axis], np.ones(numbers.shape))
