"""Laws of the camera: inverses, unit rays, roll, sliding `up` and target, dolly, crop, resolution."""

from collections.abc import Iterator
from dataclasses import replace
from math import atan, degrees, radians, tan

import numpy as np

from rayproof.cases.laws.relations import (
    Ask,
    Conditions,
    Relation,
    camera_axes,
    everywhere,
    related,
    with_camera,
    with_shapes,
)
from rayproof.cases.placement import vector
from rayproof.cases.scene import Scene
from rayproof.cases.stages import Stage


# The camera's matrices undo each other, and its pixels lie about the image's middle.
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
        matrix, inverse = camera[name], camera[f"{name}_inverse"]
        # An inverse is right as a whole, not entry by entry (Higham 2002, section 14.1).
        sizes = np.full((4, 4), (np.abs(inverse) @ np.abs(matrix)).max())
        yield relation(f"{name} times its inverse", np.eye(4), inverse @ matrix, sizes)
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


# The camera's matrices, its frustum and its rays are of one camera.
CORNER_SIGNS = np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)])


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
    expected = np.concatenate([np.tile(CORNER_SIGNS, (2, 1)), np.repeat([0.0, 1.0], 4)[:, np.newaxis]], axis=1)
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


# Rays and normals have length 1, and a two-sided surface's normal looks back along the ray.
def unit_vectors(scene: Scene, ask: Ask) -> Iterator[Relation]:
    """Measure rays and normals, of the scene with every surface two-sided: length 1, and dot(N, d) <= 0.

    Proof: both are normalised last, and N is turned towards the viewer. Source: specification, CAM-4, NRM-3.
    """
    changed = with_shapes(scene, lambda shape: replace(shape, two_sided=True))
    answers = ask(changed)

    def relation(stage: Stage, expected: np.ndarray, measured: np.ndarray, what: str) -> Relation:
        return Relation(stage=stage, expected=expected, measured=measured, scene=changed, changed=changed, what=what)

    for stage in (Stage.RAY, Stage.NORMAL):
        if stage in answers:
            lengths = np.linalg.norm(answers[stage], axis=-1, keepdims=True)
            yield relation(stage, np.where(lengths > 0, 1.0, 0.0), lengths, "its length")
    if Stage.RAY in answers and Stage.NORMAL in answers:
        towards = np.sum(answers[Stage.RAY] * answers[Stage.NORMAL], axis=-1, keepdims=True)
        yield relation(Stage.NORMAL, -np.abs(towards), towards, "dot(N, d), two-sided")


# A hit lies on its ray, as far along as the distance says.
def point_on_ray(scene: Scene, ask: Ask) -> Iterator[Relation]:
    """Follow each ray by its distance: that is the position, and on a miss both say so.

    Proof: x = eye + t d, with d of length 1 in world space. Source: specification, stages and XF-1.
    """
    answers = ask(scene)
    if all(stage in answers for stage in (Stage.RAY, Stage.OBJECT, Stage.DISTANCE, Stage.POSITION)):
        distance = answers[Stage.DISTANCE]
        hit = answers[Stage.OBJECT][..., :1] >= 0
        point = np.asarray(scene.camera.eye) + np.where(hit, distance, 0.0) * answers[Stage.RAY]
        both = {
            Stage.POSITION: (np.where(hit, point, 0.0), answers[Stage.POSITION]),
            Stage.DISTANCE: (np.where(hit, distance, np.inf), distance),
        }
        for stage, (expected, measured) in both.items():
            yield Relation(
                stage=stage, expected=expected, measured=measured, scene=scene, changed=scene, what="eye + t d"
            )


# A camera upside down sees the image upside down.
ROLL_SIDE = 29


def roll(scene: Scene, ask: Ask) -> Iterator[Relation]:
    """Turn the camera about its line of sight by half a turn, and a square image by a quarter: the image turns back.

    Proof: right and up turn with the camera, and pixel centres lie symmetrically about the image's middle.
    Source: specification, CAM-1 and CAM-3.
    """
    camera = scene.camera
    over = with_camera(scene, up=vector(-np.asarray(camera.up)))
    turned = everywhere(lambda image: image[::-1, ::-1])
    yield from related(ask, scene, over, what="the camera upside down", before=turned)
    square = with_camera(scene, width=ROLL_SIDE, height=ROLL_SIDE)
    beside = with_camera(square, up=vector(camera_axes(camera).right))
    # Up is where right was: what stood at the right edge stands at the top.
    quarter = everywhere(lambda image: np.rot90(image, 1))
    yield from related(ask, square, beside, what="the camera turned by a quarter", before=quarter)


# Which way is up matters only across the line of sight.
def up_slid(scene: Scene, ask: Ask) -> Iterator[Relation]:
    """Lengthen `up` and slide it along the line of sight: nothing changes.

    Proof: right = forward x up, normalised, does not see what is added along forward, nor up's length.
    Source: specification, CAM-1.
    """
    axes = camera_axes(scene.camera)
    up = np.asarray(scene.camera.up)
    for along, length in ((0.7, 1.0), (-0.4, 2.5)):
        slid = length * (up + along * np.linalg.norm(up) * axes.forward)
        changed = with_camera(scene, up=vector(slid))
        what = f"up times {length:g}, slid by {along:g} along the line of sight"
        yield from related(ask, scene, changed, what=what, conditions=Conditions(factor=2.0))


# How far away the target is does not matter.
def target_slid(scene: Scene, ask: Ask) -> Iterator[Relation]:
    """Slide the target along the line of sight, nearer and farther: nothing changes.

    Proof: any t > 0 of ref = eye + t F gives the same ray. Source: specification, CAM-4.
    """
    axes = camera_axes(scene.camera)
    for share in (0.6, 1.7):
        target = vector(axes.eye + share * axes.distance * axes.forward)
        what = f"the target at {share:g} of its distance"
        yield from related(ask, scene, with_camera(scene, target=target), what=what)


# Radiance does not change along a ray.
DOLLY_SIDE = 5


def dolly(scene: Scene, ask: Ask) -> Iterator[Relation]:
    """Move the camera ahead by less than what its near plane left out: the central pixel stays, but for its distance.

    Proof: the central ray is the same line, and light is invariant along it; nothing is nearer than the near plane was.
    Source: specification, RAD-5.
    """
    axes, camera = camera_axes(scene.camera), scene.camera
    step = 0.5 * camera.near
    still = with_camera(scene, width=DOLLY_SIDE, height=DOLLY_SIDE)
    # Where the planes stand stays the same.
    ahead = with_camera(
        still,
        eye=vector(axes.eye + step * axes.forward),
        target=vector(axes.eye + (step + axes.distance) * axes.forward),
        near=camera.near - step,
        far=camera.far - step,
    )
    middle = slice(DOLLY_SIDE // 2, DOLLY_SIDE // 2 + 1)
    central = everywhere(lambda image: image[middle, middle])
    nearer = {Stage.DISTANCE: lambda image: image[middle, middle] - step}
    yield from related(
        ask, still, ahead, what=f"the camera moved {step:g} m ahead", before=central | nearer, after=central
    )


# A narrower camera sees the middle of what a wider one sees.
WIDE, TALL = 10, 6  # px on either side
WIDTH, HEIGHT = 21, 17


def crop(scene: Scene, ask: Ask) -> Iterator[Relation]:
    """Add columns on both sides, then rows above and below with the wider angle that they need: the middle stays.

    Proof: tan(alpha) / H is the height of a pixel at distance 1, and its width too; both are kept, and with them the
    direction of each pixel counted from the middle. Source: specification, CAM-4.
    """
    middle = with_camera(scene, width=WIDTH, height=HEIGHT)
    wide = with_camera(middle, width=WIDTH + 2 * WIDE)
    after = everywhere(lambda image: image[:, WIDE:-WIDE])
    yield from related(ask, middle, wide, what="more columns on both sides", after=after)
    height = HEIGHT + 2 * TALL
    angle = degrees(2 * atan(tan(radians(scene.camera.fovy) / 2) * height / HEIGHT))
    tall = with_camera(middle, height=height, fovy=angle)
    after = everywhere(lambda image: image[TALL:-TALL])
    yield from related(ask, middle, tall, what="more rows above and below", after=after)


# Every third pixel of an image three times as fine is a pixel of the coarse one.
COARSE_SIZE = (13, 11)


def resolution(scene: Scene, ask: Ask) -> Iterator[Relation]:
    """Ask for W x H and 3 W x 3 H pixels: the centre of a pixel is the centre of its middle ninth.

    Proof: sx = 2 (c + 1/2) / W - 1 = 2 (3 c + 1 + 1/2) / (3 W) - 1, and likewise for rows.
    Source: specification, CAM-3.
    """
    width, height = COARSE_SIZE
    coarse = with_camera(scene, width=width, height=height)
    fine = with_camera(scene, width=3 * width, height=3 * height)
    after = everywhere(lambda image: image[1::3, 1::3])
    yield from related(ask, coarse, fine, what="three times as many pixels each way", after=after)
