"""Features of cameras: where the eye is, how wide it sees, what it clips, how large its image is; and of the whole."""

import numpy as np

from rayproof.cases.placement import mapped
from rayproof.cases.random.draft import Draft
from rayproof.cases.random.features import FEATURES, Step
from rayproof.cases.scene import Cube, Sphere, Square


@FEATURES.register("eye_inside", step=Step.CAMERA, group="eye", what="The eye is inside a shape.")
def eye_inside(draft: Draft) -> None:
    """Put the eye into a sphere or a cube."""
    draft.eye = draft.inner_point(draft.any_of(Sphere, Cube))
    draft.near = 1e-3


@FEATURES.register("eye_on_surface", step=Step.CAMERA, group="eye", what="The eye lies on a surface.")
def eye_on_surface(draft: Draft) -> None:
    """Put the eye onto a shape's surface."""
    index = draft.draws.whole(0, len(draft.shapes) - 1)
    draft.eye = draft.surface_point(index)
    draft.near = draft.draws.choice((1e-3, 0.05))


@FEATURES.register("grazing_view", step=Step.CAMERA, group="eye", what="The view all but grazes a square.")
def grazing_view(draft: Draft) -> None:
    """Look at a square from 1e-3 to 1e-1 above its plane."""
    shape = draft.shapes[draft.any_of(Square)]
    draft.eye = mapped(shape.to_world, (2.5, draft.draws.uniform(-0.4, 0.4), draft.draws.logarithmic(1e-3, 1e-1)))
    draft.target = mapped(shape.to_world, (0.0, 0.0, 0.0))


@FEATURES.register("on_axis", step=Step.CAMERA, group="eye", what="The view is along an axis, with unturned shapes.")
def on_axis(draft: Draft) -> None:
    """Look along an axis of the world at a cube that is not turned."""
    axis = draft.draws.whole(0, 2)
    eye, up = [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]
    eye[axis], up[(axis + 1) % 3] = draft.draws.choice((-4.0, 4.0)), 1.0
    draft.shapes.append(Cube(albedo=(0.7, 0.5, 0.3)))
    draft.eye, draft.target, draft.up = (eye[0], eye[1], eye[2]), (0.0, 0.0, 0.0), (up[0], up[1], up[2])


@FEATURES.register("tight_near", step=Step.CAMERA, group="near", bare=True, what="The near plane cuts the geometry.")
def tight_near(draft: Draft) -> None:
    """Put the near plane where the camera looks."""
    draft.near = draft.distance * draft.draws.uniform(0.9, 1.02)


@FEATURES.register("tight_far", step=Step.CAMERA, group="far", bare=True, what="The far plane cuts the geometry.")
def tight_far(draft: Draft) -> None:
    """Put the far plane where the camera looks."""
    draft.far = draft.distance * draft.draws.uniform(1.0, 1.1)


@FEATURES.register("deep_frustum", step=Step.CAMERA, group="near", bare=True, what="far / near is 1e7.")
def deep_frustum(draft: Draft) -> None:
    """Put the near plane next to the eye and the far plane very far."""
    draft.near = 1e-3
    draft.far = max(draft.far, 1e4)


@FEATURES.register("shell_clip", step=Step.CAMERA, group="clip", bare=True, what="Clipping is a spherical shell.")
def shell_clip(draft: Draft) -> None:
    """Clip by distance, somewhere in the geometry."""
    draft.clip, draft.near = "shell", draft.distance * draft.draws.uniform(0.2, 1)


@FEATURES.register("no_clip", step=Step.CAMERA, group="clip", bare=True, what="Nothing is clipped.")
def no_clip(draft: Draft) -> None:
    """Clip nothing."""
    draft.clip = "none"


@FEATURES.register("one_pixel", step=Step.CAMERA, group="size", bare=True, what="The image has 1 x 1 pixel.")
def one_pixel(draft: Draft) -> None:
    """Make the image one pixel."""
    draft.width, draft.height = 1, 1


@FEATURES.register("few_pixels", step=Step.CAMERA, group="size", bare=True, what="The image has 7 x 3 pixels.")
def few_pixels(draft: Draft) -> None:
    """Make the image 7 x 3 pixels."""
    draft.width, draft.height = 7, 3


@FEATURES.register("one_column", step=Step.CAMERA, group="size", bare=True, what="The image has 1 x 200 pixels.")
def one_column(draft: Draft) -> None:
    """Make the image 1 x 200 pixels."""
    draft.width, draft.height = 1, 200


@FEATURES.register("narrow_view", step=Step.CAMERA, group="fovy", what="fovy is 1e-3 to 1e-2 degrees.")
def narrow_view(draft: Draft) -> None:
    """Look at a point of a surface through a telescope."""
    draft.target = draft.surface_point(draft.draws.whole(0, len(draft.shapes) - 1))
    if draft.distance == 0:
        draft.target = (draft.eye[0] + 1.0, draft.eye[1], draft.eye[2])
    draft.fovy = draft.draws.choice((1e-3, draft.draws.logarithmic(1e-3, 1e-2)))


@FEATURES.register("wide_view", step=Step.CAMERA, group="fovy", bare=True, what="fovy is 150 to 175 degrees.")
def wide_view(draft: Draft) -> None:
    """Look with a very wide angle from close by."""
    draft.fovy = draft.draws.choice((175.0, draft.draws.uniform(150, 175)))
    if draft.eye == draft.target:
        return
    x, y, z = np.asarray(draft.target) + 0.35 * np.subtract(draft.eye, draft.target)
    draft.eye = (float(x), float(y), float(z))


@FEATURES.register("tiny", step=Step.WHOLE, group="scale", bare=True, what="The scene is 1e-4 to 1e-2 m large.")
def tiny(draft: Draft) -> None:
    """Shrink everything."""
    draft.scale = draft.draws.choice((1e-4, draft.draws.logarithmic(1e-4, 1e-2)))


@FEATURES.register("huge", step=Step.WHOLE, group="scale", bare=True, what="The scene is 1e2 to 1e4 m large.")
def huge(draft: Draft) -> None:
    """Enlarge everything."""
    draft.scale = draft.draws.choice((1e4, draft.draws.logarithmic(1e2, 1e4)))


@FEATURES.register("far_away", step=Step.WHOLE, bare=True, what="The scene is 10 to 10 000 m from the origin.")
def far_away(draft: Draft) -> None:
    """Move everything away from the origin; of a tiny scene by as many of its own sizes."""
    reach = draft.draws.logarithmic(10, 1e4) * min(1.0, draft.scale)
    x, y, z = np.asarray(draft.draws.direction()) * reach
    draft.offset = (float(x), float(y), float(z))
