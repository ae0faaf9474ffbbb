"""What the suite never executes in the tracer, and why that is right: whole functions, and single lines."""

from collections.abc import Mapping

BENCH = "asked by `bench` and by tests of branches; it computes no image"
JUDGE = "asked by the judge and the command line; nothing is rendered by it"
HUGE = "trees beyond 2^80 m are walked without culling, in float64: tests/tracer/shapes/test_representable.py"
SEVERAL = "leaves of several items, over 2^21 faces: tests/tracer/test_acceleration.py"
REFUSED = "a refusal: tests/tracer/shapes/test_representable.py and test_configuration.py"

# "file:function" -> why.
FUNCTIONS: Mapping[str, str] = {
    "branches.py:asked": BENCH,
    "frames.py:Frames.asked": BENCH,
    "frames.py:Frames.pixels": "a copy of what was rendered, which nothing is here",
    "catalogue.py:Formula.summary": JUDGE,
    "catalogue.py:Catalogue.__contains__": JUDGE,
    "catalogue.py:Catalogue.__len__": JUDGE,
    "catalogue.py:Catalogue.variants": JUDGE,
    "configuration.py:Configuration.parse": JUDGE,
    "configuration.py:Configuration.name": JUDGE,
    "configuration.py:Configuration.chosen": JUDGE,
    "configuration.py:Configuration.items": JUDGE,
    "configuration.py:Configuration.faults": JUDGE,
    "configuration.py:Configuration.controls": JUDGE,
    "configuration.py:Configuration.__eq__": JUDGE,
    "configuration.py:Configuration.__hash__": JUDGE,
    "clearance.py:bound": JUDGE,
    "plan.py:Plan.text": JUDGE,
    "shadow_epsilon.py:shadow_epsilon": JUDGE,
    "versions.py:versions": JUDGE,
    "llvm.py:packaged_library": "chosen before anything is rendered: tests/tracer/device/test_llvm.py",
    "llvm.py:select": "chosen before anything is rendered: tests/tracer/device/test_llvm.py",
}
# "file:text of the line" -> why.
LINES: Mapping[str, str] = {
    "acceleration/beams.py:return": HUGE,
    "acceleration/nodes.py:items = np.zeros((2, lower.shape[1]), dtype=np.uint16)": HUGE,
    "acceleration/nodes.py:np.minimum(": SEVERAL,
    (
        "acceleration/nodes.py:level, np.take(items, tree.slots[np.minimum(first[:-1] + place, first[1:] - 1)], "
        "axis=1), out=level"
    ): SEVERAL,
    "acceleration/forest.py:return None": "meshes without a face that has an area: tests/tracer/test_render.py",
    "arrays.py:if wanted:": REFUSED,
    "branches.py:found.append(some)": BENCH,
    "branches.py:return compute()": BENCH,
    'camera_rays.py:row = row + self._parameters("first_row", types.Int(camera.first_row * self.per_side))': (
        "bands of an image too large for one piece: tests/reports/run/test_banded_run.py"
    ),
    'catalogue.py:slot = name.split("/")[0]': REFUSED,
    "catalogue.py:if slot not in self.slots:": REFUSED,
    "geometry.py:case _:": REFUSED,
    'geometry.py:known = ", ".join(kind.__name__ for kind in SLOTS)': REFUSED,
    'reach.py:return f"{name} is {value:g}, which {precision} cannot hold (at most {greatest:.3g})"': REFUSED,
    'reach.py:return f"up is {camera.up}: {precision} cannot tell it from zero"': REFUSED,
    (
        'reach.py:return f"{where} reaches {length:.3g} m; the squares of lengths beyond {largest:.3g} m overflow '
        '{precision}"'
    ): REFUSED,
    'reach.py:return f"nothing in the scene is larger than {length:.3g} m; squares of that vanish in {precision}"': (
        REFUSED
    ),
    "surfaces.py:return self.types.Vector(0)": "meshes without a face that has an area: tests/tracer/test_render.py",
    "trace.py:case _:": REFUSED,
    "trace.py:return dr.select((albedo == 0) & dr.isinf(irradiance), 0, leaving)": (
        "a black channel under an irradiance that overflows: tests/tracer/shapes/test_representable.py"
    ),
}
