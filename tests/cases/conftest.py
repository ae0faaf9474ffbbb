"""What the tests of scene files share: a valid document to spoil."""

from typing import Any

import pytest


@pytest.fixture
def document() -> dict[str, Any]:
    """Return a valid scene document that uses every kind of shape."""
    common = {"albedo": [0.5, 0.25, 0.75]}
    return {
        "$schema": "urn:rayproof:scene:1",
        "camera": {
            "eye": [4, -3, 2.5],
            "target": [0, 0.1, 0],
            "up": [0, 0, 1],
            "fovy": 40,
            "width": 96,
            "height": 72,
            "near": 0.1,
            "far": 100,
        },
        "shapes": [
            {"type": "sphere", **common, "center": [0, 0, 1], "radius": 0.5},
            {
                "type": "cube",
                **common,
                "to_world": [[1, 0, 0, 2], [0, 2, 0, 0], [0, 0, 3, 0], [0, 0, 0, 1]],
                "two_sided": True,
            },
            {"type": "square", **common},
            {"type": "plane", **common},
            {"type": "triangle", **common, "vertices": [[0, 0, 0], [1, 0, 0], [0, 1, 0]]},
            {
                "type": "mesh",
                **common,
                "vertices": [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]],
                "faces": [[0, 2, 1], [0, 1, 3], [1, 2, 3]],
            },
        ],
        "lights": [{"position": [1, 2, 3], "flux": [100, 80.5, 60]}],
        "shading": "simplified",
        "clip": "shell",
    }
