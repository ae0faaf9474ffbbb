"""The table of the suite's ranges in docs/specification.md; `python -m tests.suite_ranges` writes it, never smaller.

A number that no case exceeds is a limit that a renderer may have unnoticed.
"""

import re
import sys
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np

import rayproof
from rayproof.cases.case import Case
from rayproof.cases.families import all_cases
from rayproof.cases.scene import Mesh, Scene

PAGE = Path(__file__).parents[1] / "docs" / "specification.md"
TABLE = re.compile(r"(?<=tests\.suite_ranges -->\n\n)(.*?\n)(?=\n<!-- end -->)", re.DOTALL)
ROW = re.compile(
    r"\| (?P<name>[^|]+) \| (?P<low>\S+) \| `(?P<low_case>[^`]+)` \| (?P<high>\S+) \| `(?P<high_case>[^`]+)` \|"
)
# Of a value that is not counted: it is written with four digits, and machines round rendered values differently.
SLACK = 1e-3


@dataclass(frozen=True, kw_only=True)
class Range:
    """The smallest and the largest value of a quantity in the suite, and the first cases that have them."""

    name: str
    low: float  # an int if it is counted
    low_case: str
    high: float
    high_case: str

    @property
    def row(self) -> str:
        """Return it as a row in Markdown."""
        return f"| {self.name} | {_shown(self.low)} | `{self.low_case}` | {_shown(self.high)} | `{self.high_case}` |"

    def shrunk(self, now: "Range | None") -> str | None:
        """Return in words how the range of today is smaller, or None."""
        if now is None:
            return f"{self.name}: the table has it, and nothing computes it any more"
        if now.low > self.low + _slack(self.low):
            return f"{self.name}: the smallest value was {_shown(self.low)} ({self.low_case}), and is {_shown(now.low)}"
        if now.high < self.high - _slack(self.high):
            return (
                f"{self.name}: the largest value was {_shown(self.high)} ({self.high_case}), and is {_shown(now.high)}"
            )
        return None


def _shown(value: float) -> str:
    return str(value) if isinstance(value, int) else f"{value:.4g}"


def _slack(value: float) -> float:
    return 0 if isinstance(value, int) else SLACK * abs(value)


@lru_cache(maxsize=1)
def _rendered(scene: Scene) -> dict[str, np.ndarray]:
    return rayproof.oracle(scene, ["distance", "irradiance", "radiance"])


def _above_0(values: Iterable[float]) -> list[float]:
    return [value for value in values if 0 < value < np.inf]


def _scales(case: Case) -> list[np.ndarray]:
    """Return the singular values of each shape's matrix."""
    matrices = [np.asarray(shape.to_world)[:3, :3] for shape in case.scene.shapes]
    return [np.linalg.svd(matrix, compute_uv=False) for matrix in matrices]


def _angle_to_up(case: Case) -> float:
    camera = case.scene.camera
    forward, up = np.subtract(camera.target, camera.eye), np.asarray(camera.up, float)
    cosine = abs(forward @ up) / np.linalg.norm(forward) / np.linalg.norm(up)
    return float(np.degrees(np.arccos(min(cosine, 1.0))))


QUANTITIES: dict[str, Callable[[Case], Iterable[float]]] = {
    "lights": lambda case: [len(case.scene.lights)],
    "shapes": lambda case: [len(case.scene.shapes)],
    "faces of a mesh": lambda case: [len(shape.faces) for shape in case.scene.shapes if isinstance(shape, Mesh)],
    "width [px]": lambda case: [case.scene.camera.width],
    "height [px]": lambda case: [case.scene.camera.height],
    "pixels": lambda case: [case.scene.camera.width * case.scene.camera.height],
    "`fovy` [degrees]": lambda case: [case.scene.camera.fovy],
    "angle between view and up vector [degrees]": lambda case: [_angle_to_up(case)],
    "near plane [m]": lambda case: [case.scene.camera.near],
    "far plane [m]": lambda case: [case.scene.camera.far],
    "distance of the eye from the origin [m]": lambda case: [float(np.linalg.norm(case.scene.camera.eye))],
    "scale of a shape's matrix": lambda case: np.ravel(_scales(case)),
    "largest over smallest scale of a matrix": lambda case: [scales[0] / scales[2] for scales in _scales(case)],
    "albedo": lambda case: [channel for shape in case.scene.shapes for channel in shape.albedo],
    "flux above 0 [W]": lambda case: _above_0(channel for light in case.scene.lights for channel in light.flux),
    "distance of a hit [m]": lambda case: _above_0(_rendered(case.scene)["distance"].ravel()),
    "irradiance above 0 [W/m^2]": lambda case: _above_0(_rendered(case.scene)["irradiance"].ravel()),
    "radiance above 0 [W/(m^2 sr)]": lambda case: _above_0(_rendered(case.scene)["radiance"].ravel()),
    "largest irradiance of an image [W/m^2]": lambda case: _above_0([_rendered(case.scene)["irradiance"].max()]),
}  # fmt: skip


def ranges(cases: Iterable[Case], names: Iterable[str] = tuple(QUANTITIES)) -> list[Range]:
    """Return the range of each quantity over the cases."""
    values: dict[str, list[tuple[float, str]]] = {name: [] for name in names}
    for case in cases:
        for name, pairs in values.items():
            pairs += [(value, case.name) for value in QUANTITIES[name](case)]
    found = []
    for name, pairs in values.items():
        low, high = min(pairs, key=lambda pair: pair[0]), max(pairs, key=lambda pair: pair[0])
        found.append(Range(name=name, low=low[0], low_case=low[1], high=high[0], high_case=high[1]))
    return found


def table(rows: Iterable[Range]) -> str:
    """Return the table in Markdown."""
    return (
        "\n".join(["| quantity | smallest | in | largest | in |", "|---|---|---|---|---|", *(row.row for row in rows)])
        + "\n"
    )


def written(text: str) -> list[Range]:
    """Return the rows of the table in a page."""
    (rows,) = TABLE.findall(text)
    found = []
    for row in map(ROW.fullmatch, rows.splitlines()[2:]):
        assert row is not None, rows
        places = {end: int(row[end]) if row[end].isdigit() else float(row[end]) for end in ("low", "high")}
        found.append(Range(name=row["name"], low_case=row["low_case"], high_case=row["high_case"], **places))
    return found


def shrunk(before: Iterable[Range], now: Iterable[Range]) -> list[str]:
    """Return a sentence for each range that became smaller."""
    by_name = {row.name: row for row in now}
    return [sentence for row in before if (sentence := row.shrunk(by_name.get(row.name))) is not None]


if __name__ == "__main__":
    page = PAGE.read_text(encoding="utf-8")
    today = ranges(all_cases())
    if smaller := shrunk(written(page), today):
        sys.exit("\n".join([*smaller, "The table is not written: add a case, or remove these rows by hand."]))
    PAGE.write_text(TABLE.sub(lambda _: table(today), page), encoding="utf-8")
