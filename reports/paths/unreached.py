"""What the suite never executes in the tracer, and why that is right: whole functions, and single lines."""

from collections.abc import Mapping

BENCH = "asked by `bench` and by tests of branches; it computes no image"
JUDGE = "asked by the judge and the command line; nothing is rendered by it"
HUGE = "trees beyond 2^80 m are walked without culling, in float64: tests/tracer/shapes/test_representable.py"
SEVERAL = "leaves of several items, over 2^21 faces: tests/tracer/test_acceleration.py"
HALVES = "trees of over 2^19 items are cut in halves: tests/tracer/acceleration/test_builder.py"
OWN = "a formula from a user's own file, which no case has"
NOT_ASKED = "a refusal: only kinds that have it are asked"
REFUSED = "a refusal: tests/tracer/shapes/test_representable.py and test_configuration.py"

DIAGNOSIS = "continues a stage from another renderer's, for the diagnosis: tests/tracer/test_render.py"

# "file:function" -> why.
FUNCTIONS: Mapping[str, str] = {
    "device/coherent_branches.py:asked": BENCH,
    "frames.py:Frames.asked": BENCH,
    "frames.py:Frames.pixels": "a copy of what was rendered, which nothing is here",
    "shapes/shape.py:TracedShape.arrays": NOT_ASKED,
    "shapes/shape.py:TracedShape.center_and_half": NOT_ASKED,
    "shapes/triangles.py:layers": "asked about images of 2^17 samples or more: tests/tracer/test_plan.py",
    "catalogue.py:Catalogue.__contains__": JUDGE,
    "catalogue.py:Catalogue.named": JUDGE,
    "configuration.py:parts_of": JUDGE,
    "configuration.py:Configuration.own": OWN,
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
    "shapes/error_bounds.py:bound": JUDGE,
    "plan.py:Plan.text": JUDGE,
    "stages/shadow_epsilon.py:shadow_epsilon": JUDGE,
    "device/versions.py:versions": JUDGE,
    "device/llvm.py:packaged_library": "chosen before anything is rendered: tests/tracer/device/test_llvm.py",
    "device/llvm.py:select": "chosen before anything is rendered: tests/tracer/device/test_llvm.py",
    "render.py:continue_from": DIAGNOSIS,
    "stages/trace.py:continued": DIAGNOSIS,
}
# "file:text of the line" -> why.
LINES: Mapping[str, str] = {
    "stages/illumination.py:return _unrolled(world, surfaces, known)": DIAGNOSIS,
    "stages/illumination.py:free = known": DIAGNOSIS,
    "acceleration/packet_bounds.py:return": HUGE,
    "acceleration/grid_boxes.py:return GridBoxes(rows=rows, base=base, step=np.ones(AXES), exact=False)": HUGE,
    (
        "acceleration/quantised_boxes.py:others = boxes.rows.take(tree.slots[np.minimum(first[:-1] + place, "
        "first[1:] - 1)], axis=0)"
    ): SEVERAL,
    "acceleration/quantised_boxes.py:np.minimum(leaves, others, out=leaves)": SEVERAL,
    (
        "acceleration/builder.py:return longest, self._first(leaves * nodes.number + leaves // 2) - "
        "self._first(leaves * nodes.number)"
    ): HALVES,
    "acceleration/triangle_bvh.py:return None": "meshes without a face that has an area: tests/tracer/test_render.py",
    "device/arrays.py:if wanted:": REFUSED,
    "device/coherent_branches.py:found.append(some)": BENCH,
    "device/coherent_branches.py:return compute()": BENCH,
    'catalogue.py:slot, _, variant = name.partition("/")': OWN,
    "catalogue.py:if is_own(variant):": OWN,
    'catalogue.py:return own_formula(variant, default=self[f"{slot}/{self.slots[slot]}"])': OWN,
    "catalogue.py:if slot not in self.slots:": REFUSED,
    'shapes/kinds.py:known = ", ".join(kind.__name__ for kind in KINDS)': REFUSED,
    (
        'shapes/representable.py:return f"{name} is {value:g}, which {precision} cannot hold (at most {greatest:.3g})"'
    ): REFUSED,
    'shapes/representable.py:return f"up is {camera.up}: {precision} cannot tell it from zero"': REFUSED,
    (
        'shapes/representable.py:return f"{where} reaches {length:.3g} m; the squares of lengths beyond '
        '{largest:.3g} m overflow {precision}"'
    ): REFUSED,
    (
        'shapes/representable.py:return f"nothing in the scene is larger than {length:.3g} m; '
        'squares of that vanish in {precision}"'
    ): REFUSED,
    "stages/trace.py:return dr.select((surface.albedo == 0) & dr.isinf(irradiance), 0, leaving)": (
        "a black channel under an irradiance that overflows: tests/tracer/shapes/test_representable.py"
    ),
}
