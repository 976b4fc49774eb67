"""The container of a glTF 2.0 file: its tree and the arrays of its buffer, checked before use."""

import base64
import binascii
import json
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from studio.engine.animation.read.apart import MAX_BYTES
from studio.engine.base.errors import FormatError
from studio.engine.base.file_sentences import too_large, unreadable_give_other
from studio.engine.base.sentences import say

_MAGIC, _JSON, _BIN = b"glTF", 0x4E4F534A, 0x004E4942
_TYPES: dict[Any, str] = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_WIDTHS: dict[Any, int] = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}
_DATA = "data:"


class GltfFile:
    """A glTF file; `items(name)` is a list of its tree, `array(number)` an accessor's values,
    `buffers` the bytes.

    Raises:
        FormatError: the file is missing, damaged, or refers to other files.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        try:
            if path.stat().st_size > MAX_BYTES:
                raise FormatError(too_large(path, MAX_BYTES))
            content = path.read_bytes()
        except OSError as error:
            raise FormatError(unreadable_give_other(path, error)) from error
        text, binary = self._chunks(content) if content[:4] == _MAGIC else (content, None)
        try:
            self.tree: dict[str, Any] = json.loads(text)
        except (ValueError, RecursionError) as error:
            raise FormatError(
                "gltf.not_gltf",
                "{path} is not a glTF file: {error}; give a .glb file",
                path=path,
                error=str(error)[:100],
            ) from error
        if not isinstance(self.tree, dict) or not str(self.item("asset").get("version", "")).startswith("2"):
            raise FormatError(
                "gltf.not_version_2", "{path} is not a glTF 2.0 file; export it as glTF 2.0 (.glb)", path=path
            )
        needed = [name for name in self.items("extensionsRequired") if name not in ("KHR_mesh_quantization",)]
        if needed:
            raise FormatError(
                "gltf.extensions",
                "{path} needs extensions that are not known: {names}; export it without",
                path=path,
                names=needed,
            )
        self.buffers = [self._buffer(k, buffer, binary) for k, buffer in enumerate(self.items("buffers"))]

    def items(self, name: str) -> list[Any]:
        """Return a list of the tree, empty where the file has none."""
        value = self.tree.get(name, [])
        if not isinstance(value, list):
            raise self.wrong(say("gltf.no_list", "{name} is not a list", name=name))
        return value

    def item(self, name: str) -> dict[str, Any]:
        value = self.tree.get(name, {})
        return value if isinstance(value, dict) else {}

    def wrong(self, what: str) -> FormatError:
        """Return the error for an impossible value in the tree."""
        return FormatError(
            "animation.damaged", "{path} is damaged: {error}; export it again", path=self.path, error=what
        )

    def _chunks(self, content: bytes) -> tuple[bytes, bytes | None]:
        """Return the JSON and the binary chunk of a GLB."""
        length = int.from_bytes(content[8:12], "little")
        if len(content) < 20 or length > len(content):
            raise FormatError(
                "gltf.cut_off",
                "{path} is cut off: {n} of {all} bytes; copy or export it again",
                path=self.path,
                n=len(content),
                all=length,
            )
        chunks: dict[int, bytes] = {}
        at = 12
        while at + 8 <= length:
            size, kind = (int.from_bytes(content[at + k : at + k + 4], "little") for k in (0, 4))
            if at + 8 + size > length:
                raise self.wrong(say("gltf.chunk", "a chunk of {n} bytes does not fit into the file", n=size))
            chunks.setdefault(kind, content[at + 8 : at + 8 + size])
            at += 8 + size
        if _JSON not in chunks:
            raise self.wrong(say("gltf.no_json", "it has no JSON chunk"))
        return chunks[_JSON], chunks.get(_BIN)

    def _buffer(self, number: int, buffer: Any, binary: bytes | None) -> bytes:
        uri = buffer.get("uri") if isinstance(buffer, dict) else None
        if uri is None and number == 0 and binary is not None:
            return binary
        if isinstance(uri, str) and uri.startswith(_DATA) and ";base64," in uri[:200]:
            try:
                return base64.b64decode(uri.split(";base64,", 1)[1], validate=True)
            except (ValueError, binascii.Error) as error:
                raise self.wrong(say("gltf.base64", "buffer {n} is not base64", n=number)) from error
        raise FormatError(
            "gltf.other_file",
            "{path} keeps its data in another file ({file!r}), which is not followed; export it "
            "as one .glb file",
            path=self.path,
            file=str(uri)[:60],
        )

    def array(self, number: Any) -> NDArray[np.float64]:
        """Return an accessor's values as numbers, shape (count, width), normalised integers as -1..1.

        Raises:
            FormatError: the accessor does not fit into its buffer, or is of an unknown kind.
        """
        accessor = self._at("accessors", number)
        if "sparse" in accessor or "bufferView" not in accessor:
            raise self.wrong(
                say("gltf.sparse", "accessor {n} is sparse or empty, which animations are not", n=number)
            )
        view = self._at("bufferViews", accessor["bufferView"])
        buffer_number = view.get("buffer", 0)
        if not isinstance(buffer_number, int) or not 0 <= buffer_number < len(self.buffers):
            raise self.wrong(
                say(
                    "gltf.no_buffer",
                    "accessor {n} lies in buffer {buffer}, which is not there",
                    n=number,
                    buffer=buffer_number,
                )
            )
        kind, width = _TYPES.get(accessor.get("componentType")), _WIDTHS.get(accessor.get("type"))
        count, buffer = accessor.get("count"), self.buffers[buffer_number]
        start, inner, stride = (
            view.get("byteOffset", 0),
            accessor.get("byteOffset", 0),
            view.get("byteStride"),
        )
        length = view.get("byteLength", 0)
        if (
            kind is None
            or width is None
            or count is None
            or not all(isinstance(v, int) and v >= 0 for v in (count, start, inner, length))
        ):
            raise self.wrong(say("gltf.kind", "accessor {n} is of no known kind", n=number))
        size = np.dtype(kind).itemsize * width
        stride = size if stride is None else stride
        needed = inner + (count - 1) * stride + size if count else inner
        if not isinstance(stride, int) or stride < size or needed > length or start + length > len(buffer):
            raise self.wrong(
                say(
                    "gltf.fit",
                    "accessor {n} with {count} values does not fit into its buffer",
                    n=number,
                    count=count,
                )
            )
        rows = np.lib.stride_tricks.as_strided(
            np.frombuffer(buffer, "u1", offset=start + inner, count=needed - inner),
            (count, size),
            (stride, 1),
        )
        values = np.ascontiguousarray(rows).view(kind).reshape(count, width)
        if accessor.get("normalized") and values.dtype.kind != "f":
            return np.maximum(values / np.iinfo(values.dtype).max, -1.0)
        return values.astype(np.float64)

    def _at(self, name: str, number: Any) -> dict[str, Any]:
        items = self.items(name)
        if not isinstance(number, int) or not 0 <= number < len(items) or not isinstance(items[number], dict):
            raise self.wrong(say("gltf.no_item", "{name} has no number {n!r}", name=name, n=number))
        return items[number]
