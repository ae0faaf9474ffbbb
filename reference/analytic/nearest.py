"""The nearest crossing of camera rays with all shapes, inside the clip interval (HIT-2, HIT-9)."""

import numpy as np

from rayproof.cases.scene import Scene
from rayproof.reference.analytic.camera_frame import view_of
from rayproof.reference.analytic.polygons import Polygons
from rayproof.reference.analytic.surfaces import surface_of


def clip_interval(scene: Scene, directions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the open interval (low, high) of t in which hits count, along directions (N, 3) of any length."""
    camera = scene.camera
    near, far = np.full(len(directions), camera.near), np.full(len(directions), camera.far)
    if scene.clip == "shell":
        return near, far
    if scene.clip == "none":
        return np.zeros(len(directions)), np.full(len(directions), np.inf)
    with np.errstate(all="ignore"):
        depth_speed = directions @ view_of(camera).forward
        return near / depth_speed, far / depth_speed


def nearest(scene: Scene, directions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return (shape index, face index) (N, 2), -1 on a miss, and t (N,), inf on a miss. Equal t: the lower index."""
    eye = np.asarray(scene.camera.eye, dtype=np.float64)
    low, high = clip_interval(scene, directions)
    distances, objects = np.full(len(directions), np.inf), np.full((len(directions), 2), -1.0)
    for index, shape in enumerate(scene.shapes):
        crossing, face = surface_of(shape).first(eye, directions, low, high)
        nearer = crossing < distances
        distances = np.where(nearer, crossing, distances)
        objects[nearer, 0], objects[nearer, 1] = index, face[nearer]
    return objects, distances


def distances_to(scene: Scene, directions: np.ndarray, objects: np.ndarray) -> np.ndarray:
    """Return t (N,) of the first crossing, inside the clip interval, with the given (shape, face); inf without."""
    eye = np.asarray(scene.camera.eye, dtype=np.float64)
    low, high = clip_interval(scene, directions)
    distances = np.full(len(directions), np.inf)
    for index, shape in enumerate(scene.shapes):
        asked = np.flatnonzero(objects[:, 0] == index)
        surface = surface_of(shape)
        arguments = (eye, directions[asked], low[asked], high[asked])
        if isinstance(surface, Polygons):
            distances[asked] = surface.first(*arguments, only=objects[asked, 1])[0]
        else:
            distances[asked] = surface.first(*arguments)[0]
    return distances
