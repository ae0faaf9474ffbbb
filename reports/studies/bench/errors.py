"""How wrong the pictures are: against the analytic oracle at sampled pixels that both find lit."""

import numpy as np

from rayproof.cases.scene import Mesh, Scene
from rayproof.cases.stages import Stage
from rayproof.reference.analytic import Analytic
from rayproof.reports.studies.bench.measuring import Timed
from rayproof.reports.studies.bench.records import ErrorRecord

TESTS = 2**28  # ray-triangle tests that the oracle may make for one scene; it has no tree
MOST = 4096  # pixels
LEAST = 64
SEED = 11


def sampled(scene: Scene) -> tuple[np.ndarray, np.ndarray]:
    """Return pixels (n, 2) as column and row, and the oracle's radiance there (n, 3) [W/(m^2 sr)]."""
    camera = scene.camera
    each = sum(len(shape.faces) if isinstance(shape, Mesh) else 1 for shape in scene.shapes) * (1 + len(scene.lights))
    count = int(np.clip(TESTS // each, LEAST, min(MOST, camera.width * camera.height)))
    chosen = np.random.default_rng(SEED).choice(camera.width * camera.height, size=count, replace=False)
    pixels = np.stack([chosen % camera.width, chosen // camera.width], axis=1)
    return pixels, np.asarray(Analytic().at(scene, [Stage.RADIANCE], pixels + 0.5)[Stage.RADIANCE])


def error(one: Timed, pixels: np.ndarray, truth: np.ndarray) -> ErrorRecord | None:
    """Return median and 99th percentile of the relative error where both are lit, and how many disagree on that."""
    if one.prepared is None or one.prepared.image is None:
        return None
    ours = np.asarray(one.prepared.image(), dtype=np.float64)[pixels[:, 1], pixels[:, 0]]
    lit, true = ours.max(axis=-1) > 0, truth.max(axis=-1) > 0
    both = lit & true
    if not both.any():
        return None
    relative = (np.abs(ours - truth)[both] / np.where(truth[both] > 0, truth[both], 1.0)).max(axis=-1)
    return {
        "median": float(np.median(relative)),
        "p99": float(np.quantile(relative, 0.99)),
        "pixels": int(both.sum()),
        "disagree": int((lit != true).sum()),
    }
