"""A PyVista plotter as the state that vtk.js builds a scene from: plain data and arrays, without server or OpenGL.

Source: the serializers of trame-vtk (Kitware), which its own viewer reads; semi-private, so the version is bounded and
a browser test looks at what comes out.
"""

import json
import re
from typing import Any, TypedDict

import numpy as np

# VTK names things by their addresses in memory; the same scene must give the same bytes.
_ADDRESS = re.compile(r'(?<=["{])[0-9a-f]{16}(?=["}-])')

TABLE = "vtkColorTransferFunction"  # what vtk.js makes of a lookup table


class Instance(TypedDict, total=False):
    """An object of VTK's as trame-vtk tells it, with those that it depends on."""

    id: str
    type: str
    mtime: int
    properties: dict[str, Any]  # as the class of vtk.js has them
    calls: list[list[Any]]  # a method's name and its arguments
    dependencies: list["Instance"]


def new_recorder() -> Any:
    """Return a plotter that is never shown; without OpenGL it needs `gl.recording_environment`."""
    import pyvista
    from trame_vtk.modules.vtk.serializers import configure_serializer, initialize_serializers

    initialize_serializers()
    # The viewer has a light of its own.
    configure_serializer(skip_light=True, encode_lut=True)
    plotter = pyvista.Plotter(off_screen=True, window_size=[600, 450], lighting="none")
    plotter.renderer.set_background("#f3f5f8")
    return plotter


def state(plotter: Any) -> tuple[Instance, dict[str, np.ndarray]]:
    """Return the scene as plain data, and its arrays by the names that it calls them."""
    from trame_vtk.modules.vtk.serializers import SynchronizationContext, reference_id, serialize

    _shrink_unused_tables(plotter)
    context = SynchronizationContext()
    # Without it a second scene would be told as changes to the first.
    context.set_ignore_last_dependencies(True)
    window = plotter.render_window
    scene = serialize(None, window, reference_id(window), context, 0)
    if scene is None:
        raise ValueError("trame-vtk has no serializer for this machine's render window")
    _drop_unused_tables(scene)
    names: dict[str, str] = {}
    text = _ADDRESS.sub(lambda found: names.setdefault(found[0], f"v{len(names)}"), json.dumps(scene))
    arrays = {name: _array(context, name) for name in context.data_array_cache}
    # The window's class is this machine's; its count of changes is this process's.
    return json.loads(text) | {"type": "vtkRenderWindow", "mtime": 1}, arrays


def _shrink_unused_tables(plotter: Any) -> None:
    """Give what has one colour a table of two: it is dropped, and to write down 256 took a sixth of the time."""
    from vtkmodules.vtkCommonCore import vtkLookupTable

    table = vtkLookupTable()
    table.SetNumberOfTableValues(2)
    for actor in plotter.renderer.actors.values():
        if not actor.GetMapper().GetScalarVisibility():
            actor.GetMapper().SetLookupTable(table)


def _drop_unused_tables(instance: Instance) -> None:
    """Leave out the colour tables of what has one colour, most of a scene's text; in place."""
    if instance.get("properties", {}).get("scalarVisibility") == 0:
        instance["calls"] = [call for call in instance["calls"] if call[0] != "setLookupTable"]
        instance["dependencies"] = [one for one in instance["dependencies"] if one["type"] != TABLE]
    for dependency in instance.get("dependencies", []):
        _drop_unused_tables(dependency)


def _array(context: Any, name: str) -> np.ndarray:
    """Return an array as the viewer will read it: JavaScript gets indices of four bytes for eight."""
    from vtkmodules.util.numpy_support import vtk_to_numpy

    values = vtk_to_numpy(context.data_array_cache[name]["array"])
    narrow = {np.dtype(np.int64): np.int32, np.dtype(np.uint64): np.uint32}.get(values.dtype, values.dtype)
    return np.ascontiguousarray(values.astype(narrow)).reshape(-1)
