"""The elements of a Mitsuba XML file as a tree, read in double precision by Mitsuba's parser; nothing is loaded."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from cases.scene import SceneError
from cases.scene_fields import shown

DEEPEST_INCLUDE = 8


@dataclass(frozen=True, kw_only=True)
class Element:
    """One element: its kind ("Shape", "BSDF", "Emitter", ...), its plug-in's name and its properties."""

    kind: str
    plugin: str
    place: str  # file, line and column, with its id where it has one
    properties: Any  # mitsuba.Properties
    _nodes: Any

    def get(self, name: str, default: Any) -> Any:
        """Return a property, or `default` where the file does not say."""
        return self.properties.get(name, default)

    def children(self, kind: str | None = None) -> Iterator[tuple[str, "Element"]]:
        """Yield the names and elements below this one, in the file's order."""
        for name in self.properties.keys():  # noqa: SIM118 - Mitsuba's Properties iterate over nothing
            value = self.properties[name]
            if type(value).__name__ == "ResolvedReference":
                child = self._nodes(value.index())
                if kind is None or child.kind == kind:
                    yield name, child

    def matrix(self) -> np.ndarray:
        """Return `to_world`, float64 (4, 4); the identity where the file does not say."""
        value = self.get("to_world", None)
        if value is None:
            return np.eye(4)
        if not hasattr(value, "matrix"):
            raise SceneError(f"{self.place}: to_world must be a transform, got {shown(value)}")
        return np.array(value.matrix, dtype=np.float64)


def read_tree(path: Path) -> Element:
    """Return the root element of a file: its parameters filled in, older names brought up to date, references resolved.

    Raises:
        SceneError: Mitsuba's parser refuses the file, in its own words on one line; or it includes one from elsewhere.

    """
    import mitsuba as mi

    if mi.variant() is None:
        mi.set_variant("scalar_rgb")
    config = mi.parser.ParserConfig("scalar_rgb")
    config.max_include_depth = DEEPEST_INCLUDE
    try:
        state = mi.parser.parse_file(config, str(path))
        mi.parser.transform_upgrade(config, state)
        mi.parser.transform_resolve_references(config, state)
    except RuntimeError as error:
        raise SceneError(f"{path}: {' '.join(str(error).split())}") from None
    folder = path.parent.resolve()
    for included in [Path(str(name)) for name in state.files][1:]:
        if not included.resolve().is_relative_to(folder):
            raise SceneError(f"{path}: {included}, which it includes, must lie inside the file's folder")

    def node(index: int) -> Element:
        found = state.nodes[index]
        name = found.props.id()
        where = str(mi.parser.file_location(state, found)).removeprefix(f"{path.resolve().parent}/")
        return Element(
            kind=str(found.type).rpartition(".")[2],
            plugin=found.props.plugin_name(),
            place=f"{where}{f', {name!r}' if name else ''}",
            properties=found.props,
            _nodes=node,
        )

    return node(0)
