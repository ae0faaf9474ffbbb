"""A small results folder as `rayproof run` leaves it, made up: a sphere over a plane, some answers wrong."""

import json
from pathlib import Path
from typing import Any

import numpy as np

from rayproof.cases.case import ITEMS
from rayproof.cases.stages import IMAGE_STAGES, Stage
from rayproof.reports.results.case_records import Check
from rayproof.reports.results.document import save_results
from rayproof.reports.results.files import SCHEMA
from rayproof.reports.results.float_codec import pack
from rayproof.reports.results.images import write_answers
from rayproof.reports.results.outcomes import Outcome
from tests.reports.checks import recorded

ROUNDING, EPSILON = 1, 2  # values of the mask of explained pixels
HOSTILE = "evil/<script>alert(1)</script><img src=x onerror=alert(2)>\"'&|`*@everyone\u202e"
EYE = np.array([0.4, -3.2, 1.6])
LIGHTS = (np.array([1.5, -1.0, 2.5]), np.array([-2.0, -2.0, 1.5]))
ALBEDO = np.array([[0.8, 0.3, 0.2], [0.4, 0.5, 0.6]])


def answers(*, width: int = 40, height: int = 30, rounding: float = 0.0, seed: int = 1) -> dict[Stage, np.ndarray]:
    """Return every image stage of the sample scene, float64, each with relative noise of size `rounding`."""
    forward = -EYE / np.linalg.norm(EYE)
    right = np.cross(forward, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    up = np.cross(right, forward)
    x, y = (np.arange(width) + 0.5) * 2 / width - 1, 1 - (np.arange(height) + 0.5) * 2 / height
    tangent = np.tan(np.radians(25))
    ray = forward + tangent * (x[None, :, None] * width / height * right + y[:, None, None] * up)
    ray /= np.linalg.norm(ray, axis=-1, keepdims=True)
    b = ray @ EYE
    discriminant = b * b - (EYE @ EYE - 1)
    sphere = np.where(discriminant > 0, -b - np.sqrt(np.maximum(discriminant, 0)), np.inf)
    with np.errstate(divide="ignore"):
        plane = np.where(ray[..., 2] < 0, (-1 - EYE[2]) / ray[..., 2], np.inf)
    plane = np.where(plane < 9, plane, np.inf)
    distance = np.minimum(sphere, plane)
    index = np.where(np.isinf(distance), -1, np.where(sphere <= plane, 0, 1))
    hit = index >= 0
    position = np.where(hit[..., None], EYE + np.where(hit, distance, 0)[..., None] * ray, 0)
    normal = np.where((index == 0)[..., None], position, np.where(hit[..., None], [0.0, 0.0, 1.0], 0.0))
    irradiance, visible = np.zeros_like(position), []
    for light in LIGHTS:
        to = light - position
        squared = np.sum(to * to, axis=-1)
        cosine = np.sum(normal * to, axis=-1) / np.sqrt(squared)
        direction = to / np.sqrt(squared)[..., None]
        along = np.sum(position * direction, axis=-1)
        blocked = (index == 1) & (along < 0) & (np.sum(position * position, axis=-1) - along**2 < 1)
        lit = hit & (cosine > 0) & ~blocked
        visible.append(lit.astype(float))
        flux = np.array([60.0, 50.0, 40.0])
        irradiance += np.where(lit, cosine / (4 * np.pi * squared), 0)[..., None] * flux
    exitance = irradiance * np.where(hit[..., None], ALBEDO[np.maximum(index, 0)], 0)
    images = {
        Stage.RAY: ray,
        Stage.OBJECT: np.stack([index, np.where(hit, 0, -1)], axis=-1).astype(float),
        Stage.DISTANCE: distance[..., None],
        Stage.POSITION: position,
        Stage.NORMAL: normal,
        Stage.VISIBILITY: np.stack(visible, axis=-1),
        Stage.IRRADIANCE: irradiance,
        Stage.EXITANCE: exitance,
        Stage.RADIANCE: exitance / np.pi,
    }
    noise = np.random.default_rng(seed)
    for stage in set(images) - {Stage.OBJECT, Stage.VISIBILITY}:
        images[stage] = images[stage] * (1 + rounding * noise.uniform(-1, 1, images[stage].shape))
    return images


SCENE: dict[str, Any] = {
    "camera": {"eye": [0.4, -3.2, 1.6], "target": [0, 0, 0], "up": [0, 0, 1], "fovy": 50, "width": 40, "height": 30,
               "near": 0.1, "far": 100},
    "shapes": [
        {"type": "sphere", "albedo": [0.8, 0.3, 0.2]},
        {"type": "plane", "albedo": [0.4, 0.5, 0.6],
         "to_world": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, -1], [0, 0, 0, 1]]},
    ],
    "lights": [{"position": light.tolist(), "flux": [60, 50, 40]} for light in LIGHTS],
}  # fmt: skip


def make_folder(folder: Path, *, extra_cases: int = 0, width: int = 40, height: int = 30) -> Any:
    """Fill `folder` and return its results: pass, fail, unsupported, error, missing, suspect and a hostile name."""
    size = {"width": width, "height": height}
    cases = [
        _case(folder, "sphere/plain", "pass", size=size),
        _case(folder, "sphere/sheared", "fail", size=size, stage="normal", item="NRM-3", wrong=Stage.NORMAL),
        _case(folder, "lights/acne", "fail", size=size, stage="visibility", item="LIT-5", wrong=Stage.VISIBILITY),
        _case(folder, "lights/broken", "fail", size=size, stage="radiance", item="RAD-4", wrong=Stage.RADIANCE),
        _case(folder, HOSTILE, "reference_suspect", size=size, stage="distance", item="HIT-1"),
        _case(folder, "mesh/crash", "error", size=size, images=False, reason="worker ended with signal 6\x07\ud800"),
        _case(folder, "mesh/empty", "missing", size=size, images=False, reason="no interior pixel"),
        _case(folder, "mesh/huge", "unsupported", size=size, images=False, reason="the tracer has no such shape"),
        _case(folder, "plane/tilted", "warn", size=size, reason="0.93 of the limit"),
    ]
    cases += [_case(folder, f"more/case_{index:03}", "pass", size=size, seed=index) for index in range(extra_cases)]
    results = results_of(cases)
    save_results(folder, results)
    return results


def results_of(cases: list[Any], *, faults: tuple[str, ...] = ()) -> Any:
    """Return results.json's contents for `cases`, ledgers added up."""
    checks = [check for case in cases for check in case["checks"]]

    def ledger(verdicts: list[str]) -> dict[str, int]:
        return {"planned": len(verdicts), **{outcome.value: verdicts.count(outcome.value) for outcome in Outcome}}

    coverage = {item: sum(item in case["covers"] for case in cases) for item in ITEMS}
    details = {
        item: {"cases": count, "failed": sum(item == case["item"] for case in cases), "worst_check": "a/b ray",
               "worst_ratio": "inf" if item == "RAD-4" else 0.03 * index, "references": ["analytic", "mitsuba_scalar"]}
        for index, (item, count) in enumerate(coverage.items())
    }  # fmt: skip
    summary = ledger([case["verdict"] for case in cases])
    return {
        "schema": SCHEMA, "rayproof": "0.1.0", "command": "rayproof run --out report",
        "started": "2026-01-02T03:04:05+00:00",
        "seconds": 61.5, "verdict": "fail" if summary["fail"] else "pass", "finished": True, "faults": list(faults),
        "environment": {"python": "3.11.7", "drjit": "1.5.0", "backend": "llvm", "gl": "vtkEGLRenderWindow"},
        "configurations": ["float32", "float64"],
        "references": {
            "analytic": {"version": "numpy 2", "precision": "float64", "independent": True},
            "mitsuba_scalar": {"version": "mitsuba 3.9", "precision": "float32", "independent": True},
        },
        "summary": summary, "checks": ledger([check.outcome for check in checks]),
        "coverage": coverage, "coverage_detail": details,
        "review": [{"check": "plane/tilted float32 analytic ray", "ratio": 0.93, "why": "above 0.8"}],
        "cases": cases,
    }  # fmt: skip


def _case(
    folder: Path, name: str, verdict: str, *, size: dict[str, int], stage: str | None = None, item: str | None = None,
    wrong: Stage | None = None, images: bool = True, reason: str = "", seed: int = 0,
) -> dict[str, Any]:  # fmt: skip
    # The folders of a hostile case are named harmlessly here, as a run would have to.
    safe = name if name != HOSTILE else "evil/hostile"
    covers = ["CAM-1", "CAM-4", "HIT-1", "HIT-4", "NRM-1", "LIT-1", "RAD-2", "RAD-4"]
    case: dict[str, Any] = {
        "name": name, "family": name.split("/")[0], "verdict": verdict, "stage": stage, "item": item,
        "reason": reason or (f"{stage} differs: 12 interior pixels beyond the limit" if stage else ""),
        "stresses": "A unit sphere over a plane, two lights, one shadow each.",
        "covers": [*covers, *([item] if item and item not in covers else [])], "seconds": 0.4 + seed % 7,
        "renders": [], "reproduce": f"rayproof run {safe}", "scene": f"scenes/{safe}.json", "picture": None,
        **size, "lights": 2, "shapes": ["Sphere", "Plane"],
        "unsupported": [{"reference": "mitsuba_scalar", "stage": "camera", "why": "has no such matrices"}],
        "checks": [], "expectations": [],
    }  # fmt: skip
    scene = folder / case["scene"]
    scene.parent.mkdir(parents=True, exist_ok=True)
    scene.write_text(json.dumps(SCENE))
    if not images:
        return case
    for renderer, rounding in (
        ("tracer-float32", 1e-7),
        ("tracer-float64", 0.0),
        ("analytic", 0.0),
        ("mitsuba_scalar", 3e-7),
    ):
        image = answers(**size, rounding=rounding, seed=seed + len(renderer))
        if renderer == "mitsuba_scalar":
            image.pop(Stage.EXITANCE)
        if wrong is not None and renderer.startswith("tracer"):
            _spoil(image, wrong)
        path = f"images/{safe}/{renderer}.exr"
        write_answers(folder / path, image, 2)
        case["renders"].append({"renderer": renderer, "seconds": 0.12, "image": path, "error": None, "cached": False})
    case["masks"] = _masks(size["width"], size["height"])
    case["adjudication"] = {"normal": _panel(stage == "normal")}
    for configuration in ("float32", "float64"):
        for reference in ("analytic", "mitsuba_scalar"):
            for checked in (Stage.CAMERA, *IMAGE_STAGES) if reference == "analytic" else IMAGE_STAGES:
                case["checks"].append(_check(configuration, reference, checked, case))
    case["expectations"].append({
        "because": "E = I h / d^3 under the light", "stage": "irradiance", "verdict": "pass", "measured": 111.1112,
        "expected": 111.1111, "limit": 1e-4, "configuration": "float32",
    })  # fmt: skip
    return case


def _masks(width: int, height: int) -> dict[str, Any]:
    """Return pixels that rounding explains in the middle and above, and below some that an epsilon explains."""
    bits = np.zeros((height, width), np.uint8)
    bits[height // 3, width // 3 : 2 * width // 3], bits[2, -4:] = ROUNDING, ROUNDING
    bits[2 * height // 3, :5] = EPSILON
    return {"configuration": "float32", "height": height, "width": width, "data": pack(bits.tobytes())}


def _panel(odd: bool) -> dict[str, Any]:
    """Return what everybody thinks of everybody, ours alone if it is `odd`."""
    names = ["float32", "float64", "analytic", "mitsuba_scalar"]
    apart = {("float32", other) for other in names[1:]} | {(other, "float32") for other in names[1:]} if odd else set()
    table = [
        [
            None if a == b else "inf" if (a, b) in apart and b == "analytic" else 40.0 if (a, b) in apart else 0.2
            for b in names
        ]
        for a in names
    ]
    return {
        "baseline": "analytic", "renderers": names, "ratio": table,
        "differing": [[None if a == b else 12 if (a, b) in apart else 0 for b in names] for a in names],
        "alone": "float32" if odd else None,
        "why": "float32 stands alone against <three> others." if odd else "All agree.",
    }  # fmt: skip


def _spoil(image: dict[Stage, np.ndarray], stage: Stage) -> None:
    """Make the middle third of a stage wrong; of radiance also a NaN, infinities and a negative zero."""
    rows, columns = (slice(size // 3, 2 * size // 3) for size in image[stage].shape[:2])
    block = image[stage][rows, columns]
    if stage is Stage.VISIBILITY:
        image[stage][rows, columns] = 1 - block
    else:
        image[stage][rows, columns] = block * np.array([1.02, 0.98, 1.0])
    if stage is Stage.RADIANCE:
        image[stage][2, 3, 1] = np.nan
        image[stage][4, 5] = np.inf
        image[stage][0, 0, 0] = -0.0


def _check(configuration: str, reference: str, stage: Stage, case: dict[str, Any]) -> Check:
    blamed = case["stage"] == stage and case["verdict"] in ("fail", "reference_suspect")
    precise = configuration == "float64"
    beyond = "inf" if stage is Stage.RADIANCE else 1.2e5
    ratio = beyond if blamed else 0.93 if case["verdict"] == "warn" else 0.21
    measurement = {
        "worst_ratio": ratio, "worst_error": 0.02 if blamed else 1e-16 if precise else 1.1e-7,
        "limit": 5e-16 if precise else 5.3e-7, "pixel": [18, 14], "ours": [0.1, 0.2, 0.3], "theirs": [0.1, 0.2, 0.3],
        "interior": 640, "wrong": 12 if blamed else 0, "explained": 31, "mean_wrong": 0.017 if blamed else 0.0,
        "hit_miss": 0, "nan": 1 if blamed else 0, "inf": 0, "ulp": 3.1,
        "metrics": {"relative_mse": 1e-15, "ssim": 0.99999, "psnr": 141.2, "nrmse": 1e-8}, "range": [0.0, 1.3],
    }  # fmt: skip
    return recorded(
        configuration=configuration, reference=reference, stage=stage.value,
        verdict=case["verdict"] if blamed or case["verdict"] == "warn" else "pass",
        reason="12 interior pixels beyond the limit" if blamed else "", ratio=ratio,
        examined={"pixels": 4000, "rounding": 31, "wrong": 12 * blamed}, end_to_end=measurement,
        continued={**measurement, "worst_ratio": 0.11} if reference == "analytic" else None,
        because="gamma(9) of float32 times the conditioning of the normal, |J| <= 2.4, for the inverse transpose.",
    )  # fmt: skip
