"""Pictures as materials: lossless WebP files, or AV1 still pictures without their container.

A container states a size of its own besides that in the frame's header, and libraries allocate the memory
that the header asks for. So an element stores a sequence header and a frame alone, and their size is checked
here before anything is decoded. Bits follow section 5.5 of the AV1 specification, boxes AVIF 1.1.
"""

from __future__ import annotations

import io
import struct
import warnings
from typing import TYPE_CHECKING, Final

from scenelang.assets.element import Element, Facts
from scenelang.assets.tensors import TensorError

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt

_SEQUENCE, _FRAME, _BEGIN = b"\x0a", b"\x32", b"\x12\x00"  # headers of units that tell their size


def frame_of(avif: bytes) -> bytes:
    """The sequence header and the frame in an AVIF file of one picture; raises `ValueError` without one."""
    at = 0
    while at + 8 <= len(avif):
        size, kind = struct.unpack_from(">I4s", avif, at)
        if kind == b"mdat":
            return avif[at + 8 : at + size].removeprefix(_BEGIN)
        at += max(size, 8)
    raise ValueError("a container without a picture")


def size_of(data: bytes) -> tuple[int, int]:
    """Height and width of the one frame, 8 bits, 4:4:4; raises `ValueError` for another kind of picture."""
    sequence, rest = _unit(data, _SEQUENCE)
    _, more = _unit(rest, _FRAME)
    if more:
        raise ValueError("more than one frame")
    bits = f"{int.from_bytes(sequence):0{8 * len(sequence)}b}"
    if len(bits) < 40 or bits[:5] != "00111":  # profile 1, still, reduced header: its frame is as large
        raise ValueError("not a still picture, 4:4:4")
    wide, high = int(bits[10:14], 2) + 1, int(bits[14:18], 2) + 1
    width, height = int(bits[18 : 18 + wide], 2) + 1, int(bits[18 + wide : 18 + wide + high], 2) + 1
    return height, width


def _unit(data: bytes, header: bytes) -> tuple[bytes, bytes]:
    """Payload of a first unit of a kind, and the bytes after it."""
    size, at = 0, 1  # leb128: 7 bits a byte, the lowest first, the top bit set on all but the last
    while at < len(data) and at < 5:
        size |= (data[at] & 127) << 7 * (at - 1)
        at += 1
        if data[at - 1] < 128:
            break
    if not data.startswith(header) or at + size > len(data):
        raise ValueError("not a sequence header and a frame")
    return data[at : at + size], data[at + size :]


def contained(data: bytes) -> bytes:
    """The AVIF file of a frame; raises as `size_of`."""
    height, width = size_of(data)
    level = (int.from_bytes(data[2:4]) >> 6) & 31
    properties = (
        _box(b"ispe", struct.pack(">3I", 0, width, height)),
        _box(b"pixi", bytes((0, 0, 0, 0, 3, 8, 8, 8))),
        _box(b"av1C", bytes((0x81, 0x20 | level, 0, 0))),
        _box(b"colr", b"nclx", bytes((0, 1, 0, 13, 0, 6, 0x80))),  # sRGB by the matrix of BT.601, full range
    )
    of_item = _box(b"ipma", bytes((0, 0, 0, 0, 0, 0, 0, 1, 0, 1, 4, 1, 2, 0x83, 4)))
    entry = _box(b"infe", bytes((2, 0, 0, 0, 0, 1, 0, 0)), b"av01\0")
    kind = _box(b"ftyp", b"avif\0\0\0\0avifmif1miaf")
    payload = _BEGIN + data

    def meta(first: int) -> bytes:
        place = struct.pack(">I2B4H2I", 0, 0x44, 0, 1, 1, 0, 1, first, len(payload))
        return _box(
            b"meta",
            bytes(4),
            _box(b"hdlr", bytes(8), b"pict", bytes(13)),
            _box(b"pitm", bytes((0, 0, 0, 0, 0, 1))),
            _box(b"iloc", place),
            _box(b"iinf", bytes((0, 0, 0, 0, 0, 1)), entry),
            _box(b"iprp", _box(b"ipco", *properties), of_item),
        )

    return kind + meta(len(kind) + len(meta(0)) + 8) + _box(b"mdat", payload)


def _box(kind: bytes, *parts: bytes) -> bytes:
    return struct.pack(">I", 8 + sum(map(len, parts))) + kind + b"".join(parts)


_FILES: Final = {"webp": "WEBP", "av1": "AVIF"}
"""Codings of pictures, and what Pillow calls their files; no other opener is tried."""


def pixels(element: Element) -> bytes:
    """RGB, 8 bits, of each texel, row after row from the top; raises `TensorError` for another picture."""
    from PIL import Image

    height, width = element.sizes
    bombs = Image.DecompressionBombError, Image.DecompressionBombWarning
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", Image.DecompressionBombWarning)
            data = contained(element.data) if element.coding == "av1" else element.data
            with Image.open(io.BytesIO(data), formats=[_FILES[element.coding]]) as image:
                if image.size != (width, height):
                    raise ValueError(f"a picture of {image.size[0]} x {image.size[1]}")
                if getattr(image, "n_frames", 1) > 1:
                    raise ValueError("more than one frame")
                return image.convert("RGB").tobytes()
    except (OSError, ValueError, RuntimeError, SyntaxError, EOFError, struct.error, *bombs) as error:
        raise TensorError(f"element `{element.name}` is damaged: {error}") from None


def texels(element: Element) -> npt.NDArray[np.float32]:
    """Colours of a material, sRGB in [0, 1]: (h, w, 3) from the top, or (n, n, n, 3) by x, y and z.

    Raises `TensorError` for a damaged one.
    """
    import numpy as np

    if element.form == "colours":
        from scenelang.assets.pyramid import unpacked_colours

        return np.moveaxis(unpacked_colours(element), 0, -1)
    flat = np.frombuffer(pixels(element), np.uint8).reshape((*element.sizes, 3))
    return flat.astype(np.float32) / np.float32(255)


def painted(name: str, colours: npt.NDArray[np.uint8], about: Facts | None = None) -> Element:
    """The element of a picture (h, w, 3), without loss."""
    from PIL import Image

    file = io.BytesIO()
    Image.fromarray(colours).save(file, "WEBP", lossless=True, quality=100, method=6)
    return Element(name, "picture", colours.shape[:2], "webp", file.getvalue(), about or {})
