"""The camera's matrices, its frustum and its rays are of one camera."""

from collections.abc import Iterator

import numpy as np

from rayproof.cases.laws import LAWS
from rayproof.cases.relations import Ask, Conditions, Relation
from rayproof.cases.scene import Scene
from rayproof.cases.stages import Stage

SIGNS = np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)])


@LAWS.register("camera_rays", stage=Stage.RAY, implicates=("CAM-2", "CAM-3", "CAM-4", "CAM-5"), staged=True)
def camera_rays(scene: Scene, ask: Ask) -> Iterator[Relation]:
    """Take the frustum's corners to clip space, where they are those of [-1, 1]^2 x [0, 1], and NDC back to rays.

    Proof: the near plane has depth 0 and the far plane 1, w is the depth along F, and a pixel's ray leads from the eye
    to its point on the far plane. Source: specification, CAM-2, CAM-4 and CAM-5.
    """
    answers = ask(scene)
    camera = answers.get(Stage.CAMERA)
    if camera is None:
        return
    corners = np.concatenate([camera["frustum_corners"], np.ones((8, 1))], axis=1)
    whole = camera["projection"] @ camera["view"]
    sizes = np.abs(corners) @ (np.abs(camera["projection"]) @ np.abs(camera["view"])).T
    clip = corners @ whole.T
    expected = np.concatenate([np.tile(SIGNS, (2, 1)), np.repeat([0.0, 1.0], 4)[:, np.newaxis]], axis=1)
    yield Relation(
        stage=Stage.CAMERA,
        expected=expected[..., np.newaxis],
        measured=(clip[:, :3] / clip[:, 3:])[..., np.newaxis],
        terms=((sizes[:, :3] + sizes[:, 3:]) / np.abs(clip[:, 3:]))[..., np.newaxis],
        scene=scene,
        changed=scene,
        what="the frustum's corners in clip space",
    )
    planes = np.repeat([scene.camera.near, scene.camera.far], 4)
    yield Relation(
        stage=Stage.CAMERA,
        expected=planes[:, np.newaxis, np.newaxis],
        measured=clip[:, 3:][..., np.newaxis],
        terms=sizes[:, 3:][..., np.newaxis],
        scene=scene,
        changed=scene,
        what="the depth of the frustum's corners",
    )
    if Stage.RAY in answers:
        ndc = camera["ndc"]
        far = np.concatenate([ndc, np.ones((*ndc.shape[:2], 2))], axis=-1) * scene.camera.far
        inverse = camera["view_inverse"] @ camera["projection_inverse"]
        towards = (far @ inverse.T)[..., :3] - np.asarray(scene.camera.eye)
        # w of the unprojected point is 1 as the difference of numbers of size far / near, and multiplies the eye.
        magnified = 1 + float(np.linalg.norm(scene.camera.eye)) / scene.camera.near
        yield Relation(
            stage=Stage.RAY,
            expected=towards / np.linalg.norm(towards, axis=-1, keepdims=True),
            measured=answers[Stage.RAY],
            scene=scene,
            changed=scene,
            what="rays by the inverse matrices",
            conditions=Conditions(factor=magnified),
        )
