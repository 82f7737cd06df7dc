"""glTF 2.0 files, .gltf and .glb: the container and the JSON of strangers as checked models.

The models hold the fields that a renderer needs (Khronos, glTF 2.0 specification, sections 4 and 5) and ignore others.
No buffer is read here: `Accessor.min` and `Accessor.max` alone give the bounding box of the positions.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from lippmann.errors import FieldProblem, InvalidText
from lippmann.untrusted.json_text import JsonLimits, read_json

GLB_MAGIC = b"glTF"
_JSON_CHUNK, _BINARY_CHUNK = 0x4E4F534A, 0x004E4942
_HEADER_BYTES, _CHUNK_HEADER_BYTES = 12, 8
JSON_LIMITS = JsonLimits(size_bytes=64 * 1024 * 1024, names=2_000_000, values=2_000_000)

Index = Annotated[int, Field(ge=0, le=2**31)]
Count = Annotated[int, Field(ge=1, le=2**40)]
Number = Annotated[float, Field(ge=-1e15, le=1e15)]
_Three = tuple[Number, Number, Number]
_Four = tuple[Number, Number, Number, Number]


class Part(BaseModel):
    """A part of a document; fields that no renderer needs are ignored."""

    model_config = ConfigDict(frozen=True, extra="ignore", allow_inf_nan=False)


class Buffer(Part):
    """A block of bytes: a file beside the document, a data URI, or the binary chunk of a .glb."""

    uri: str | None = None
    byteLength: Count


class BufferView(Part):
    """A range of a buffer."""

    buffer: Index
    byteOffset: Annotated[int, Field(ge=0, le=2**40)] = 0
    byteLength: Count
    byteStride: Annotated[int, Field(ge=4, le=252)] | None = None


class SparseView(Part):
    """The numbers, or the places, of the elements in which an accessor differs from its base."""

    bufferView: Index
    byteOffset: Annotated[int, Field(ge=0, le=2**40)] = 0
    componentType: Literal[5121, 5123, 5125] = 5125


class Sparse(Part):
    """The elements in which an accessor differs from its base, which is 0 without a buffer view."""

    count: Count
    indices: SparseView
    values: SparseView


class Accessor(Part):
    """An array of a buffer view: its element type, count and bounds."""

    bufferView: Index | None = None
    byteOffset: Annotated[int, Field(ge=0, le=2**40)] = 0
    componentType: Literal[5120, 5121, 5122, 5123, 5125, 5126]
    normalized: bool = False
    count: Count
    type: Literal["SCALAR", "VEC2", "VEC3", "VEC4", "MAT2", "MAT3", "MAT4"]
    min: tuple[Number, ...] = ()
    max: tuple[Number, ...] = ()
    sparse: Sparse | None = None


class TextureInfo(Part):
    """A reference to a texture from a material."""

    index: Index
    texCoord: int = 0
    scale: Number = 1.0
    extensions: dict[str, Any] = {}


class Roughness(Part):
    """The metallic-roughness model of a material."""

    baseColorFactor: _Four = (1.0, 1.0, 1.0, 1.0)
    baseColorTexture: TextureInfo | None = None
    metallicFactor: Annotated[float, Field(ge=0, le=1)] = 1.0
    roughnessFactor: Annotated[float, Field(ge=0, le=1)] = 1.0
    metallicRoughnessTexture: TextureInfo | None = None


class Material(Part):
    """A material."""

    name: str = ""
    pbrMetallicRoughness: Roughness = Roughness()
    normalTexture: TextureInfo | None = None
    occlusionTexture: TextureInfo | None = None
    emissiveTexture: TextureInfo | None = None
    emissiveFactor: _Three = (0.0, 0.0, 0.0)
    alphaMode: Literal["OPAQUE", "MASK", "BLEND"] = "OPAQUE"
    alphaCutoff: Annotated[float, Field(ge=0)] = 0.5
    doubleSided: bool = False
    extensions: dict[str, Any] = {}


class Texture(Part):
    """A picture and how it is sampled."""

    source: Index | None = None
    sampler: Index | None = None
    extensions: dict[str, Any] = {}


class Sampler(Part):
    """The interpolation and repetition of a texture."""

    magFilter: int | None = None
    wrapS: Literal[33071, 33648, 10497] = 10497
    wrapT: Literal[33071, 33648, 10497] = 10497


class Image(Part):
    """A picture: a file beside the document, a data URI or a buffer view."""

    uri: str | None = None
    bufferView: Index | None = None


class Primitive(Part):
    """A part of a mesh of one material."""

    attributes: dict[str, Index]
    indices: Index | None = None
    material: Index | None = None
    mode: Annotated[int, Field(ge=0, le=6)] = 4
    targets: tuple[dict[str, Index], ...] = ()
    extensions: dict[str, Any] = {}


class Mesh(Part):
    """A mesh."""

    name: str = ""
    primitives: tuple[Primitive, ...]
    weights: tuple[Number, ...] = ()


class Skin(Part):
    """The joints of a mesh that bends."""

    inverseBindMatrices: Index | None = None
    joints: tuple[Index, ...]


class Node(Part):
    """A node of the tree: its place, and what it holds."""

    name: str = ""
    children: tuple[Index, ...] = ()
    mesh: Index | None = None
    skin: Index | None = None
    camera: Index | None = None
    matrix: Annotated[tuple[Number, ...], Field(min_length=16, max_length=16)] | None = None
    translation: _Three = (0.0, 0.0, 0.0)
    rotation: _Four = (0.0, 0.0, 0.0, 1.0)
    scale: _Three = (1.0, 1.0, 1.0)
    weights: tuple[Number, ...] = ()
    extensions: dict[str, Any] = {}


class Perspective(Part):
    """A perspective camera."""

    yfov: Annotated[float, Field(gt=0, lt=math.pi)]
    aspectRatio: Annotated[float, Field(gt=0, le=1e4)] | None = None


class Camera(Part):
    """A camera."""

    type: str
    perspective: Perspective | None = None


class Target(Part):
    """The property of a node that a channel moves."""

    node: Index | None = None
    path: str


class Channel(Part):
    """A sampler and what it moves."""

    sampler: Index
    target: Target


class AnimationSampler(Part):
    """The keys of a movement: times in seconds, values, and the interpolation."""

    input: Index
    output: Index
    interpolation: Literal["LINEAR", "STEP", "CUBICSPLINE"] = "LINEAR"


class Animation(Part):
    """An animation."""

    name: str = ""
    channels: tuple[Channel, ...]
    samplers: tuple[AnimationSampler, ...]


class Scene(Part):
    """The roots of a scene."""

    nodes: tuple[Index, ...] = ()


class Asset(Part):
    """The version of the format."""

    version: str


class Document(Part):
    """The JSON of a glTF file."""

    asset: Asset
    extensionsRequired: tuple[str, ...] = ()
    scene: Index = 0
    scenes: tuple[Scene, ...] = ()
    nodes: tuple[Node, ...] = ()
    meshes: tuple[Mesh, ...] = ()
    materials: tuple[Material, ...] = ()
    textures: tuple[Texture, ...] = ()
    samplers: tuple[Sampler, ...] = ()
    images: tuple[Image, ...] = ()
    accessors: tuple[Accessor, ...] = ()
    bufferViews: tuple[BufferView, ...] = ()
    buffers: tuple[Buffer, ...] = ()
    skins: tuple[Skin, ...] = ()
    cameras: tuple[Camera, ...] = ()
    animations: tuple[Animation, ...] = ()
    extensions: dict[str, Any] = {}


@dataclass(frozen=True)
class GltfFile:
    """A glTF file that was read."""

    document: Document
    binary: bytes | None
    """The binary chunk of a .glb."""


def read_gltf(data: bytes, *, field: str) -> GltfFile:
    """Return the document of a .gltf or .glb, and the binary chunk.

    Raises
    ------
    InvalidText
        If the container or the JSON is damaged or beyond a limit, or the document is no glTF 2.0.
    """
    text, binary = _chunks(data, field) if data.startswith(GLB_MAGIC) else (data, None)
    value = read_json(text, field=field, limits=JSON_LIMITS)
    try:
        document = Document.model_validate(value)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        place = ".".join(map(str, first["loc"]))
        raise refusal(f"{field}: {place}", _words(first["msg"]), repr(first["input"])[:80]) from error
    if document.asset.version.partition(".")[0] != "2":
        raise refusal(f"{field}: asset.version", "2.0", document.asset.version[:80])
    return GltfFile(document, binary)


def refusal(field: str, expected: str, got: object) -> InvalidText:
    """Return the error for a part of a file that is wrong."""
    return InvalidText(FieldProblem(field=field, expected=expected, got=str(got)))


def _words(message: str) -> str:
    return message.removeprefix("Input should be ")


def _chunks(data: bytes, field: str) -> tuple[bytes, bytes | None]:
    """Return the JSON chunk and the binary chunk of a .glb."""
    version, length = (int.from_bytes(data[at : at + 4], "little") for at in (4, 8))
    if len(data) < _HEADER_BYTES or version != 2:
        raise refusal(f"{field}: header", "version 2 of the .glb container", version)
    if length != len(data):
        raise refusal(f"{field}: length", f"the size of the file, {len(data)} bytes", length)
    found: dict[int, bytes] = {}
    at = _HEADER_BYTES
    while at < length:
        size, kind = (int.from_bytes(data[at + skip : at + skip + 4], "little") for skip in (0, 4))
        at += _CHUNK_HEADER_BYTES
        if at > length or size > length - at:
            raise refusal(f"{field}: chunk", f"at most the {max(0, length - at)} bytes that follow", size)
        if not found and kind != _JSON_CHUNK:
            raise refusal(f"{field}: first chunk", "JSON", f"type {kind:#x}")
        found.setdefault(kind, data[at : at + size])
        at += size
    if _JSON_CHUNK not in found:
        raise refusal(f"{field}: chunks", "a chunk of JSON", "none")
    return found[_JSON_CHUNK], found.get(_BINARY_CHUNK)
