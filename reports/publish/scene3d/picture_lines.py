"""Lines and points of one colour: `add_mesh` looks at all that a mesh may be, and takes six times as long."""

from typing import Any, Required, TypedDict


class LineStyle(TypedDict, total=False):
    """How lines or points look."""

    color: Required[str]
    line_width: float
    point_size: float
    opacity: float
    lighting: bool


def add_lines(
    plotter: Any,
    mesh: Any,
    *,
    name: str,
    color: str,
    line_width: float = 1.0,
    point_size: float = 5.0,
    opacity: float = 1.0,
    lighting: bool = True,
) -> None:
    """Add a mesh of lines or points, looking as `plotter.add_mesh` would have it."""
    import pyvista
    from vtkmodules.vtkCommonMath import vtkMatrix4x4
    from vtkmodules.vtkRenderingCore import vtkActor, vtkPolyDataMapper

    mapper = vtkPolyDataMapper()
    mapper.SetInputData(mesh)
    mapper.ScalarVisibilityOff()
    mapper.InterpolateScalarsBeforeMappingOn()
    actor = vtkActor()
    actor.SetMapper(mapper)
    actor.SetUserMatrix(vtkMatrix4x4())
    look = actor.GetProperty()
    look.SetColor(*pyvista.Color(color).float_rgb)
    look.SetInterpolationToFlat()
    look.SetSpecularPower(100.0)
    look.SetLineWidth(line_width)
    look.SetPointSize(point_size)
    look.SetOpacity(opacity)
    look.SetLighting(lighting)
    plotter.add_actor(actor, name=name, render=False)
