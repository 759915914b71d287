"""AV1 still pictures without their container, which is made again for the reader.

A container tells a size beside that in the frame's own header, and libraries take the memory that the latter
asks for. So what is kept is a sequence header and a frame, nothing else, and their size is read here first.
Bits are as section 5.5 of the AV1 specification has them; boxes are those of AVIF 1.1.
"""

from __future__ import annotations

import struct

_SEQUENCE, _FRAME, _BEGIN = b"\x0a", b"\x32", b"\x12\x00"  # headers of units that tell their size


def frame_of(avif: bytes) -> bytes:
    """What a file of one picture, as Pillow writes it, has in its container.

    Raises:
        ValueError: it is not laid out so.
    """
    at = 0
    while at + 8 <= len(avif):
        size, kind = struct.unpack_from(">I4s", avif, at)
        if kind == b"mdat":
            return avif[at + 8 : at + size].removeprefix(_BEGIN)
        at += max(size, 8)
    raise ValueError("a container without a picture")


def size_of(data: bytes) -> tuple[int, int]:
    """Height and width of the one frame, of 8 bits and as many samples of colour as of light.

    Raises:
        ValueError: it is another kind of picture, or more than one.
    """
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
    """What a unit of a kind holds, and what follows."""
    size, at = 0, 1
    while at < len(data) and at < 5:
        size |= (data[at] & 127) << 7 * (at - 1)
        at += 1
        if data[at - 1] < 128:
            break
    if not data.startswith(header) or at + size > len(data):
        raise ValueError("not a sequence header and a frame")
    return data[at : at + size], data[at + size :]


def contained(data: bytes) -> bytes:
    """The AVIF file of a frame.

    Raises:
        ValueError: as `size_of`.
    """
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
