"""Checks of arrays where they enter. Messages name the argument, the expected shape and what was given."""

from __future__ import annotations

import numbers
from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from .errors import InputError

Floats = npt.NDArray[np.float64]
Numbers = npt.NDArray[np.uint32]


def number(name: str, given: object, expected: str = "a number") -> float:
    """A finite number."""
    if isinstance(given, bool) or not isinstance(given, (numbers.Real, np.number)):
        raise InputError(f"{name}: expected {expected}, found {_short(given)}")
    value = float(given)
    if not np.isfinite(value):
        raise InputError(f"{name}: expected {expected}, found {value}")
    return value


def shape_text(shape: Sequence[int | str]) -> str:
    """(n, 3), as numpy writes it."""
    inner = ", ".join(map(str, shape))
    return f"({inner},)" if len(shape) == 1 else f"({inner})"


def floats(name: str, given: Any, shape: Sequence[int | str]) -> Floats:
    """An array of finite doubles of this shape; a letter in it stands for any size. Not copied where it fits."""
    try:
        array = np.asarray(given)
    except ValueError:
        raise InputError(
            f"{name}: expected numbers of shape {shape_text(shape)}, found rows of several lengths"
        ) from None
    if array.dtype.kind not in "fiu":
        raise InputError(f"{name}: expected numbers of shape {shape_text(shape)}, found an array of {array.dtype}")
    check_shape(name, array.shape, shape)
    array = np.ascontiguousarray(array, np.float64)
    if not np.isfinite(array).all():
        where = tuple(int(i) for i in np.argwhere(~np.isfinite(array))[0])
        raise InputError(f"{name}{list(where)}: expected a finite number, found {array[where]}")
    return array


def indices(name: str, given: Any, shape: Sequence[int | str], below: int, of: str) -> Numbers:
    """An array of whole numbers from 0 to `below` - 1, which number `of`."""
    array = np.asarray(given)
    if array.dtype.kind not in "iu":
        raise InputError(
            f"{name}: expected whole numbers of shape {shape_text(shape)}, found an array of {array.dtype}"
        )
    check_shape(name, array.shape, shape)
    if array.size and (array.min() < 0 or array.max() >= below):
        where = tuple(int(i) for i in np.argwhere((array < 0) | (array >= below))[0])
        raise InputError(
            f"{name}{list(where)}: expected the number of one of {below} {of}, 0 to {below - 1}, found {array[where]}"
        )
    return np.ascontiguousarray(array, np.uint32)


def check_shape(name: str, given: Sequence[int], expected: Sequence[int | str]) -> None:
    """Refuses another shape than the expected one."""
    fits = len(given) == len(expected) and all(isinstance(e, str) or g == e for g, e in zip(given, expected))
    if not fits:
        raise InputError(f"{name}: expected shape {shape_text(expected)}, found {shape_text(given)}")


def labels(name: str, given: Any, count: int, of: str) -> tuple[Numbers, list[str]]:
    """One label for each of `count` things, or one for all of them: the number of the label of each, and the labels as
    text, by their first appearance. Labels are text or whole numbers."""
    if isinstance(given, (str, numbers.Integral)):
        return np.zeros(count, np.uint32), [str(given)]
    array = np.asarray(given)
    if array.dtype.kind not in "iuUO":
        raise InputError(
            f"{name}: expected text or whole numbers, one for each of {count} {of}, found an array of {array.dtype}"
        )
    check_shape(name, array.shape, (count,))
    if count == 0:
        return np.zeros(0, np.uint32), []
    # equal labels follow one another as a rule
    starts = np.flatnonzero(np.concatenate(([True], array[1:] != array[:-1])))
    known: dict[object, int] = {}
    if array.dtype.kind == "O":
        for label in array[starts].tolist():
            if not isinstance(label, (str, numbers.Integral)):
                raise InputError(f"{name}: expected text or whole numbers, found {_short(label)}")
        codes = [known.setdefault(str(label), len(known)) for label in array[starts].tolist()]
    else:
        codes = [known.setdefault(label, len(known)) for label in array[starts].tolist()]
    lengths = np.diff(np.append(starts, count))
    return np.repeat(np.array(codes, np.uint32), lengths), [str(label) for label in known]


def _short(given: object) -> str:
    text = f"{type(given).__name__} {given!r}"
    return text if len(text) < 80 else text[:77] + "..."
