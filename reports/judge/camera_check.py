"""The camera stage judged: matrices, inverses, frustum corners, pixel <-> NDC (CAM-1 to CAM-3), and their limits.

Besides the comparison with a reference, both cameras are tested for the properties of any camera (an inverse inverts,
the eye is mapped to 0, corners to the clip cube's corners with depth 0 and 1). This test needs no reference, and so it
decides if two cameras disagree.
"""

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from rayproof.cases.scene import Camera
from rayproof.reports.judge.forward.conditioning import basis_condition
from rayproof.reports.judge.forward.limits import Roundoff
from rayproof.reports.judge.measurement import WIDE, counted, kinds_of, over
from rayproof.reports.results.case_records import Examined

COUNT = 16  # roundings on the longest path: an axis (8), a 4x4 product (7), a store
ITEMS = {
    "view": "CAM-1",
    "view_inverse": "CAM-1",
    "projection": "CAM-2",
    "projection_inverse": "CAM-2",
    "frustum_corners": "CAM-2",
    "ndc": "CAM-3",
    "pixel": "CAM-3",
}


@lru_cache(maxsize=16)
def scales(camera: Camera) -> dict[str, np.ndarray | float]:
    """Return the size of each part's error per unit roundoff, broadcastable to the part's shape."""
    basis = basis_condition(camera)
    eye = float(np.linalg.norm(camera.eye))
    # The condition of far - near. The projection divides by it, so that its entries have this factor in size and error.
    depth = (camera.far + camera.near) / (camera.far - camera.near)
    tangent = np.tan(camera.alpha)
    wide = tangent * max(1.0, camera.aspect)
    # The condition of tan; a renderer may read either angle of the camera, and the wider one is worse conditioned.
    angle = np.arctan(wide)
    slope = 1 + angle / (np.sin(angle) * np.cos(angle))
    view = np.full((4, 4), basis)
    view[:3, 3] = basis * eye + eye
    view_inverse = np.full((4, 4), basis)
    view_inverse[:3, 3] = eye * (1 + basis)
    largest = max(1 / tangent, 1 / (tangent * camera.aspect)) * slope
    reach = np.repeat([camera.near, camera.far], 4)[:, np.newaxis]
    return {
        "view": view,
        "view_inverse": view_inverse,
        "projection": np.array([[largest] * 4] * 2 + [[depth**2 * max(1.0, camera.near)] * 4, [1.0] * 4]),
        "projection_inverse": np.array([[wide * slope] * 4] * 2 + [[1.0] * 4, [depth / camera.near] * 4]),
        "frustum_corners": eye + reach * (1 + wide) * (basis + slope),
        "ndc": 2.0,
        "pixel": 2.0 * max(camera.width, camera.height),
    }


OF_PIXELS = ("ndc", "pixel")


def _shapes(camera: Camera) -> dict[str, tuple[int, ...]]:
    """Return the shape of each part, as defined in cases/stages.py."""
    matrices = dict.fromkeys(("view", "view_inverse", "projection", "projection_inverse"), (4, 4))
    pixels = dict.fromkeys(OF_PIXELS, (camera.height, camera.width, 2))
    return matrices | {"frustum_corners": (8, 3)} | pixels


@dataclass(frozen=True, kw_only=True)
class Compared:
    """The comparison of two cameras: the worst entry of the worst part, and the counts of all entries."""

    ratio: float  # error over limit
    part: str
    error: float
    limit: float
    examined: Examined


def compared(parts: dict, expected: dict, camera: Camera, g: Roundoff) -> Compared:
    """Compare two cameras entry by entry; a missing or misshapen part is infinitely wrong."""
    ratio, part, error, limit = -1.0, "", 0.0, 0.0
    examined = Examined(pixels=0)
    shapes = _shapes(camera)
    for name, scale in scales(camera).items():
        entries, expected_entries = (
            np.asarray(answer.get(name, np.nan), dtype=np.float64) for answer in (parts, expected)
        )
        if not entries.shape == expected_entries.shape == shapes[name]:
            wrong = math.prod(shapes[name])
            examined += Examined(pixels=wrong, wrong=wrong)
            ratio, part, error, limit = np.inf, name, np.inf, 0.0
            continue
        allowed = np.broadcast_to(g(COUNT) * np.asarray(scale, dtype=np.float64), entries.shape)
        with np.errstate(invalid="ignore"):  # inf - inf is NaN, which `over` counts as infinitely wrong
            errors = np.where(entries == expected_entries, 0.0, np.abs(entries - expected_entries))
        # With the eye at the world's origin some limits are 0.
        ratios = over(errors, allowed)
        # An entry has the size of its part's largest entry: an entry of 0 is a difference of larger numbers.
        wide = allowed > WIDE * np.abs(expected_entries).max()
        kinds = kinds_of(ratios, wide, np.isfinite(allowed))
        examined += counted(kinds)
        worst = np.unravel_index(int(ratios.argmax()), ratios.shape)
        if ratios[worst] > ratio:
            ratio, part, error, limit = float(ratios[worst]), name, float(errors[worst]), float(allowed[worst])
    return Compared(ratio=ratio, part=part, error=error, limit=limit, examined=examined)


def inconsistency(answer: dict, camera: Camera, g: Roundoff) -> float:
    """Return the largest violation of the properties of any camera, in units of their rounding error."""
    parts = {name: np.asarray(value, dtype=np.float64) for name, value in answer.items()}
    if any(name not in parts or parts[name].shape != shape for name, shape in _shapes(camera).items()):
        return np.inf
    scale = scales(camera)
    view, projection = parts["view"], parts["projection"]
    eye = np.append(np.asarray(camera.eye, dtype=np.float64), 1.0)
    target = np.append(np.asarray(camera.target, dtype=np.float64), 1.0)
    forward = np.linalg.norm(target - eye)
    size = float(np.linalg.norm(camera.eye)) + forward
    unit = g(4 * COUNT) * basis_condition(camera) * (1 + size)
    target_in_view = view @ target
    residuals = [
        np.abs(view @ parts["view_inverse"] - np.eye(4)).max() / unit,
        np.abs(view @ eye - np.array([0, 0, 0, 1.0])).max() / unit,
        np.abs(target_in_view - np.array([0, 0, forward, 1.0])).max() / unit,
        # Axes right, up and forward in a right-handed world are a mirrored frame: x right, y up, z forward.
        abs(np.linalg.det(view[:3, :3]) + 1) / unit,
    ]
    up = view[:3, :3] @ np.asarray(camera.up, dtype=np.float64)
    residuals.append(abs(up[0]) / (np.linalg.norm(camera.up) * unit) if up[1] > 0 else np.inf)
    depth = (camera.far + camera.near) / (camera.far - camera.near)
    product = np.abs(projection) @ np.abs(parts["projection_inverse"])
    residuals.append(
        (np.abs(projection @ parts["projection_inverse"] - np.eye(4)) / (product + 1)).max() / g(4 * COUNT) / depth
    )
    corners = np.c_[parts["frustum_corners"], np.ones(8)]
    clip = corners @ (projection @ view).T
    with np.errstate(divide="ignore", invalid="ignore"):
        clip = clip[:, :3] / clip[:, 3:]
    cube = np.array([(x, y, z) for z in (0, 1) for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))], dtype=np.float64)
    near = camera.near
    amplified = (
        g(4 * COUNT) * depth**2 * (1 + basis_condition(camera) * (1 + size) / near / min(1.0, np.tan(camera.alpha)))
    )
    residuals.append(np.abs(clip - cube).max() / amplified)
    columns, rows = np.arange(camera.width) + 0.5, np.arange(camera.height) + 0.5
    centres = np.stack(np.meshgrid(columns, rows), axis=-1)
    residuals.append(np.abs(parts["pixel"] - centres).max() / (g(4 * COUNT) * scale["pixel"]))
    return float(np.max(np.where(np.isnan(residuals), np.inf, residuals)))
