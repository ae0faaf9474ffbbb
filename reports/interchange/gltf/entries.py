"""The objects of a glTF document, a class each, with the members that are read.

They are as the specification has them. A file may hold anything: whoever reads a member checks what it depends on.
"""

from collections.abc import Collection
from typing import TypedDict, TypeVar


class Light(TypedDict, total=False):
    """A light of KHR_lights_punctual."""

    type: str
    name: str
    intensity: float  # candela
    color: list[float]
    range: float


class LightsOfDocument(TypedDict, total=False):
    """All lights."""

    lights: list[Light]


class LightOfNode(TypedDict, total=False):
    """Which light is there."""

    light: int


class DocumentExtensions(TypedDict, total=False):
    """What extensions add to the document."""

    KHR_lights_punctual: LightsOfDocument


class NodeExtensions(TypedDict, total=False):
    """What extensions add to a node."""

    KHR_lights_punctual: LightOfNode


class Root(TypedDict, total=False):
    """The document itself (section 5.17), beside its lists of the objects below."""

    scene: int
    extensionsRequired: list[str]
    extensionsUsed: list[str]
    extensions: DocumentExtensions


class SceneEntry(TypedDict, total=False):
    """A scene: its root nodes."""

    nodes: list[int]


class NodeEntry(TypedDict, total=False):
    """A node: what is there and where."""

    name: str
    children: list[int]
    mesh: int
    camera: int
    matrix: list[float]  # by columns
    rotation: list[float]  # x, y, z, w
    scale: list[float]
    translation: list[float]
    extensions: NodeExtensions


class LensEntry(TypedDict, total=False):
    """A perspective projection."""

    yfov: float  # radians
    znear: float
    zfar: float
    aspectRatio: float


class CameraEntry(TypedDict, total=False):
    """A camera."""

    type: str
    perspective: LensEntry


class PrimitiveEntry(TypedDict, total=False):
    """A part of a mesh with one material."""

    mode: int
    attributes: dict[str, int]  # accessors
    indices: int
    material: int
    extensions: Collection[str]


class MeshEntry(TypedDict, total=False):
    """A mesh."""

    name: str
    primitives: list[PrimitiveEntry]


class SurfaceEntry(TypedDict, total=False):
    """How a material reflects."""

    baseColorFactor: list[float]
    metallicFactor: float


class MaterialEntry(TypedDict, total=False):
    """A material."""

    pbrMetallicRoughness: SurfaceEntry
    emissiveFactor: list[float]
    alphaMode: str
    doubleSided: bool
    extensions: Collection[str]


class AccessorEntry(TypedDict, total=False):
    """A typed array in a buffer view."""

    type: str
    componentType: int
    count: int
    bufferView: int
    byteOffset: int
    normalized: bool


class BufferViewEntry(TypedDict, total=False):
    """A part of a buffer."""

    buffer: int
    byteOffset: int
    byteStride: int


class BufferEntry(TypedDict, total=False):
    """Bytes, here or in a file."""

    byteLength: int
    uri: str


class AnimationEntry(TypedDict, total=False):
    """An animation, of which nothing is read."""


Entry = TypeVar("Entry")
# Where a document lists them.
LISTS: dict[type, str] = {
    SceneEntry: "scenes",
    NodeEntry: "nodes",
    CameraEntry: "cameras",
    MeshEntry: "meshes",
    MaterialEntry: "materials",
    AccessorEntry: "accessors",
    BufferViewEntry: "bufferViews",
    BufferEntry: "buffers",
    AnimationEntry: "animations",
}
