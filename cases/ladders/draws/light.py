"""Hit points with a light and a blocker; ways to a light; normals."""

import numpy as np

from rayproof.cases.ladders.draws import across, directions, rounded
from rayproof.cases.ladders.ladder import Draw, Inputs


def _slanted(normal: np.ndarray, cosine: np.ndarray, generator: np.random.Generator) -> np.ndarray:
    c = cosine[:, None]
    return c * normal + np.sqrt(1 - c * c) * across(normal, generator)


def floors(*, scale: float = 1.0, gap: float = 1e-3, offset: float = 0.0, cosine: float = 0.0, swept: str = "") -> Draw:
    """Return a draw of hits on randomly turned planes, seen and lit from random sides; `swept` names what the value is.

    A unit of length is `scale`; the blocker is `gap` above; everything is moved by `offset`; a `cosine` of 0 means
    random angles of view and of light, 0.2 to 1.
    """

    def draw(value: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
        now = {"scale": scale, "gap": gap, "offset": offset, "cosine": cosine} | ({swept: value} if swept else {})
        normal = rounded(directions(count, generator), precision)
        unit = normal / np.linalg.norm(normal, axis=1, keepdims=True)
        anchor = directions(count, generator)
        # The plane's own point is not the one hit: an anchor elsewhere in the plane, as in any scene. Its distance
        # is what o + t d is off by.
        hit = anchor + across(unit, generator) * generator.uniform(0, 4, (count, 1))
        slopes = [
            generator.uniform(0.2, 1, count) if now["cosine"] == 0 else np.full(count, now["cosine"]) for _ in "ab"
        ]
        eye = hit + _slanted(unit, slopes[0], generator) * generator.uniform(2, 4, (count, 1))
        light = hit + _slanted(unit, slopes[1], generator) * generator.uniform(2, 4, (count, 1))
        shift = now["offset"] * directions(1, generator)
        origin = rounded((eye + shift) * now["scale"], precision)
        aimed = (hit + shift) * now["scale"] - origin
        return {
            "o": origin,
            "d": rounded(aimed / np.linalg.norm(aimed, axis=1, keepdims=True), precision),
            "point": rounded((anchor + shift) * now["scale"], precision),
            "normal": normal,
            "gap": np.full(count, rounded(np.array(now["gap"] * now["scale"]), precision)),
            "light": rounded((light + shift) * now["scale"], precision),
        }

    return draw


def lids(share: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
    """Return hits on planes, and blockers parallel to them, at `share` of the way's height before or behind the light.

    The blocker is anchored above the plane's own point, so that where it stands is what a formula has to find out.
    """
    drawn = floors()(0.0, count, generator, precision)
    height = np.sum((drawn["light"] - drawn["point"]) * drawn["normal"], axis=1)
    side = np.where(generator.random(count) < 0.5, -1.0, 1.0)
    above = (height * (1 + side * share))[:, None] * drawn["normal"]
    return drawn | {
        "blocker": rounded(drawn["point"] + above / np.sum(drawn["normal"] ** 2, axis=1)[:, None], precision)
    }


def balls(*, scale: float = 1.0, gap: float = 1e-3, offset: float = 0.0, swept: str = "") -> Draw:
    """Return a draw of hits on spheres of radius `scale`, likewise; the blocker is a plane across the normal."""

    def draw(value: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
        now = {"scale": scale, "gap": gap, "offset": offset} | ({swept: value} if swept else {})
        outward = directions(count, generator)
        center = now["offset"] * directions(1, generator) * np.ones((count, 1))
        hit = center + outward
        slopes = [generator.uniform(0.2, 1, count) for _ in "ab"]
        eye = hit + _slanted(outward, slopes[0], generator) * generator.uniform(2, 4, (count, 1))
        light = hit + _slanted(outward, slopes[1], generator) * generator.uniform(2, 4, (count, 1))
        origin = rounded(eye * now["scale"], precision)
        aimed = hit * now["scale"] - origin
        return {
            "o": origin,
            "d": rounded(aimed / np.linalg.norm(aimed, axis=1, keepdims=True), precision),
            "c": rounded(center * now["scale"], precision),
            "r": np.full(count, rounded(np.array(now["scale"]), precision)),
            "point": rounded(hit * now["scale"], precision),
            "normal": rounded(outward, precision),
            "gap": np.full(count, rounded(np.array(now["gap"] * now["scale"]), precision)),
            "light": rounded(light * now["scale"], precision),
        }

    return draw


def ways(*, flux: float = 100.0, length: float = 1.0, swept: str = "length", narrow: bool = False) -> Draw:
    """Return a draw of ways to a light in all directions above random unit normals, and a flux; one is `swept`.

    Swept "cosine": dot(N, L) is about the value.
    """

    def draw(value: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
        now = {"flux": flux, "length": length, "cosine": 0.0} | {swept: value}
        normal = rounded(directions(count, generator), precision)
        unit = normal / np.linalg.norm(normal, axis=1, keepdims=True)
        cosine = np.full(count, now["cosine"]) if now["cosine"] else generator.uniform(0.1, 1, count)
        way = _slanted(unit, cosine, generator) * generator.uniform(1.0, 1.9, (count, 1))
        with np.errstate(over="ignore"):
            way = way * now["length"]
        return {
            "flux": np.full(count, rounded(np.array(now["flux"]), precision)),
            "normal": normal,
            "away": rounded(way, precision),
        }

    return draw
