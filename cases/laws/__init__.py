"""Laws: relations between images of one renderer that hold whatever the scene, up to rounding. One file each.

To add one: a generator `law(scene, ask)` in a new file, under `@LAWS.register(name, stage=..., implicates=...)`, that
yields `cases.relations.Relation`s, and nothing where it has nothing to say. `stage` is the one that it concerns,
`implicates` names the specification's items that a broken one speaks of. Its docstring proves it in two lines and
names its source. `anchor=True`: not a relation but one number in closed form. Laws are homogeneous, so that a constant
factor or a length that is wrong everywhere is for anchors alone to see. `own=True`: the law makes its own scene,
whatever the case. `staged=True`: it says nothing of radiance alone.
"""

from collections.abc import Callable, Iterator

from rayproof.cases.registry import Registry
from rayproof.cases.relations import Ask, Relation
from rayproof.cases.scene import Scene

Law = Callable[[Scene, Ask], Iterator[Relation]]
LAWS: Registry[Law] = Registry("law", package="rayproof.cases.laws")
