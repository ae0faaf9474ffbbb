"""Images of a program under test, as bytes may be that no renderer means to write."""

import numpy as np
import OpenEXR

from rayproof.cases.stages import Stage
from rayproof.reports.subjects.program import take_back
from tests.reports.judge.scenes import SCENE


def test_a_signalling_nan_is_a_nan_like_others(tmp_path):
    # Found by the fuzz campaign: its conversion to float64 warns, and in the judge's tests warnings are errors.
    camera = SCENE.camera
    bits = np.full((camera.height, camera.width), 0x7FA00001, dtype=np.uint32).view(np.float32)
    header = {"compression": OpenEXR.NO_COMPRESSION, "type": OpenEXR.scanlineimage}
    OpenEXR.File(header, dict.fromkeys("RGB", bits)).write(str(tmp_path / "image.exr"))

    taken = take_back(tmp_path / "image.exr", SCENE, most=10**8)

    assert np.isnan(taken.images[Stage.RADIANCE]).all()
