"""The table of references; none imports another or the tracer.

To add one: a class that implements `cases.stages.Reference`, in a new file, and a line in the table.
`independent=True`: it shares neither code nor Dr.Jit's compiler with the tracer, and so has a vote.
`shares_code_with="NAME"`: its answers are computed by the code of another reference, and the two have one vote
together. `on_request=True`: it is used only with `--require`. All others are the panel of every run, whatever is
installed: if a reference does not start, each of its checks is undecided, and the run's headline names it. A process
imports only the references that it uses.

In addition to the protocol a class may have these members:

    missing()                    class method; a sentence on why it cannot run here and how to install it, or None.
                                 Cheap: it looks for a file or a module, and imports and starts nothing
    settings(scene)              a dict of text: the settings that its answer depends on, for report and cache
    resolution(scene, stage)     a cases.stages.Resolution if its output is coarser than its arithmetic, or None
    notes(scene)                 sentences: differences between the scene that it renders and the given one
    epsilon_at(answers)          m, number or (height, width): shadow rays ignore blockers nearer to their start
    epsilon_in(scene, answers)   the same, if it depends on more than the visible part of the scene
    takes_sample_offset          true: its rays are moved in the pixels by the camera's `sample_offset`
    ray_epsilon                  m: hits nearer to a ray's origin are ignored
    edge_epsilon(scene)          m: points no farther outside a flat shape's edge may count as inside
    tie_epsilon(scene)           m: of two surfaces no farther apart along a ray, either may be reported
    light_epsilon                share of a shadow ray's length: blockers nearer to the light are ignored
"""

from rayproof.cases.registry import Entry, Table
from rayproof.cases.stages import Reference

REFERENCES: Table[type[Reference]] = Table(
    "reference",
    package="rayproof.reference",
    entries={
        "analytic": Entry("analytic:Analytic", independent=True),
        "certified": Entry("certified:Certified", independent=True, on_request=True),
        "mitsuba_llvm": Entry("mitsuba3:MitsubaLlvm", independent=False, shares_code_with="mitsuba_scalar"),
        "mitsuba_scalar": Entry("mitsuba3:MitsubaScalar", independent=True),
        "radiance": Entry("radiance:Radiance", independent=True),
    },
)


def code_of(name: str) -> str:
    """Return the name of the reference whose code a reference runs: that of `shares_code_with`, or its own."""
    return str(REFERENCES.about(name).get("shares_code_with", name))
