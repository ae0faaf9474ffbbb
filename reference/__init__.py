"""The table of references; none imports another or the tracer.

To add one: a class that keeps `cases.stages.Reference`, in a new file, and a line in the table.
`independent=True` says that it shares neither code nor Dr.Jit's compiler with the tracer and so has a vote.
`shares_code_with="NAME"` says that its answers come from the code of another reference: the two have one vote together.
`on_request=True` says that only `--require` asks it. All others are the panel of every run, whatever is installed: of
a reference that does not start, every check is undecided, and the run's headline says so.
A process imports only the references that it asks.

Beyond the protocol a class may have, each looked up by name:

    missing()                    class method; why it cannot run here and how to install it, in a sentence, or None.
                                 Cheap: it looks for a file or a module, and imports and starts nothing
    settings(scene)              a dict of text: the settings that its answer depends on, for report and cache
    resolution(scene, stage)     a cases.stages.Resolution where its output is coarser than its arithmetic, or None
    notes(scene)                 sentences: where it answers another question than the one asked
    epsilon_at(answers)          m, number or (height, width): what it ignores at a shadow ray's start
    epsilon_in(scene, answers)   the same, where it depends on more of the scene than was seen
    takes_sample_offset          true: its rays pass through the pixels where the camera's `sample_offset` says
    ray_epsilon                  m: hits nearer to a ray's origin than this are not seen
    edge_epsilon(scene)          m: so far beyond a flat shape's edge points may count as inside
    tie_epsilon(scene)           m: of surfaces no farther apart along a ray than this it names either
    light_epsilon                of a shadow ray's length: blockers nearer to the light than this are not seen
"""

from rayproof.cases.registry import Entry, Table
from rayproof.cases.stages import Reference

REFERENCES: Table[type[Reference]] = Table(
    "reference",
    package="rayproof.reference",
    entries={
        "analytic": Entry("analytic:Analytic", independent=True),
        "certified": Entry("certified:Certified", independent=True, on_request=True),
        "double_double": Entry("double_double:DoubleDouble", independent=False, on_request=True),
        "mitsuba_llvm": Entry("mitsuba3:MitsubaLlvm", independent=False, shares_code_with="mitsuba_scalar"),
        "mitsuba_scalar": Entry("mitsuba3:MitsubaScalar", independent=True),
        "radiance": Entry("radiance:Radiance", independent=True),
    },
)


def code_of(name: str) -> str:
    """Return the name of the reference whose code a reference runs: another's where its entry says so, or its own."""
    return str(REFERENCES.about(name).get("shares_code_with", name))
