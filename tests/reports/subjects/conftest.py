"""What the tests of subjects share: a small scene, and programs written on the spot."""

import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from rayproof.cases.scene import Camera, Cube, Mesh, PointLight, Scene, Sphere, Square, Triangle
from rayproof.reports.subjects import PROGRAM, Subject

CAMERA = Camera(
    eye=(3.0, -4.0, 2.5), target=(0.1, 0.2, 0.3), up=(0.0, 0.0, 1.0), fovy=40.0, width=6, height=4, near=0.1, far=50.0
)
TILTED = ((0.8, -0.6, 0.0, 0.5), (0.6, 0.8, 0.3, 0.1), (0.0, 0.0, 1.5, 0.2), (0.0, 0.0, 0.0, 1.0))
GREY = (0.5, 0.5, 0.5)
SCENE = Scene(
    camera=CAMERA,
    shapes=(
        Sphere(albedo=GREY, center=(0.2, 0.1, 0.4), radius=0.9),
        Cube(albedo=GREY, to_world=TILTED, two_sided=True),
        Square(albedo=GREY, to_world=TILTED),
        Triangle(albedo=GREY, vertices=((0, 0, 0), (1, 0, 0.1), (0, 1, 0.3))),
        Mesh(
            albedo=GREY,
            to_world=TILTED,
            vertices=np.array(((0, 0, 0), (1, 0, 0), (0, 1, 0.1), (0.7, 0.7, 1))),
            faces=np.array(((0, 1, 2), (0, 2, 3))),
        ),
    ),
    lights=(PointLight(position=(1.5, -1.0, 4.0), flux=(100.0, 80.0, 60.0)),),
)

Writing = Callable[..., Subject]


@pytest.fixture
def program(tmp_path: Path) -> Writing:
    """Return a maker of subjects: a Python program that runs the given lines, with SCENE and OUTPUT in its hands."""

    def write(*lines: str, seconds: float = 20.0, memory: int = 4 * 2**30) -> Subject:
        path = tmp_path / "program.py"
        path.write_text("\n".join(["import os, sys", "SCENE, OUTPUT = (sys.argv[1:] + ['', ''])[:2]", *lines]))
        command = (sys.executable, "-S", str(path), "{scene}", "{output}")
        return Subject(
            name=PROGRAM, transport=PROGRAM, title="exec:test", command=command, seconds=seconds, memory=memory
        )

    return write
