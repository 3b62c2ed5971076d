"""Arrays as protobuf has them on the wire, without a Python object for each number.

A list of doubles is on the wire what a numpy array is in memory. So a million triangles cost two copies and no loop.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import numpy.typing as npt

_LENGTH_DELIMITED = 2
_MOST_VARINT_BYTES = 10


def varint(value: int) -> bytes:
    """A whole number of 0 or more."""
    out = bytearray()
    while value > 0x7F:
        out.append(value & 0x7F | 0x80)
        value >>= 7
    out.append(value)
    return bytes(out)


def block(number: int, *parts: bytes | memoryview) -> bytes:
    """A field that has a length: a message, or a packed list."""
    length = sum(len(part) for part in parts)
    return b"".join((varint(number << 3 | _LENGTH_DELIMITED), varint(length), *parts))


def whole(number: int, value: int) -> bytes:
    """A field with a whole number of 0 or more."""
    return varint(number << 3) + varint(value)


def doubles(number: int, values: npt.NDArray[np.float64]) -> bytes:
    """A packed list of doubles."""
    flat = np.ascontiguousarray(values, "<f8").reshape(-1)
    return block(number, flat.data.cast("B"))


def uint32s(number: int, values: npt.NDArray[np.uint32]) -> bytes:
    """A packed list of 32-bit whole numbers, each as a varint."""
    column = values.reshape(-1, 1).astype(np.uint64)
    shifts = 7 * np.arange(5, dtype=np.uint64)
    rest = column >> shifts
    more = (rest >> np.uint64(7)) > 0
    coded = (rest & np.uint64(0x7F)).astype(np.uint8) | (more.astype(np.uint8) << 7)
    used = rest > 0
    used[:, 0] = True
    return block(number, coded[used].tobytes())


def fields(buffer: memoryview) -> Iterator[tuple[int, memoryview, memoryview | None]]:
    """The fields of a message: number, all bytes of it, and its content where it has a length."""
    at, end = 0, len(buffer)
    while at < end:
        begin = at
        key, at = _read_varint(buffer, at)
        kind = key & 7
        content = None
        if kind == 0:
            _, at = _read_varint(buffer, at)
        elif kind == 1:
            at += 8
        elif kind == _LENGTH_DELIMITED:
            length, at = _read_varint(buffer, at)
            content = buffer[at : at + length]
            at += length
        elif kind == 5:
            at += 4
        else:
            raise ValueError(f"a field of kind {kind}")
        if at > end:
            raise ValueError("a field that is cut off")
        yield key >> 3, buffer[begin:at], content


def _read_varint(buffer: memoryview, at: int) -> tuple[int, int]:
    value = 0
    for place in range(_MOST_VARINT_BYTES):
        if at >= len(buffer):
            raise ValueError("a number that is cut off")
        byte = buffer[at]
        at += 1
        value |= (byte & 0x7F) << (7 * place)
        if byte < 0x80:
            return value, at
    raise ValueError("a number that is too long")


def split(buffer: memoryview, lists: dict[int, str], message: Any) -> tuple[Any, dict[str, npt.NDArray[np.float64]]]:
    """A message without its lists of doubles, and these as arrays that share the buffer. `lists` has their names by
    their number; a list that is not there is empty."""
    arrays = {name: np.empty(0) for name in lists.values()}
    rest = []
    for number, whole_field, content in fields(buffer):
        if number in lists and content is not None:
            arrays[lists[number]] = np.frombuffer(content, "<f8")
        else:
            rest.append(whole_field)
    return message.FromString(b"".join(rest)), arrays
