"""CARIBU's files: .can, .opt, .light and .8."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from ..arrays import Floats
from ..errors import InputError
from .materials import Material


def _lines(path: str | Path) -> Iterator[tuple[str, list[str]]]:
    """The place and the words of every line that has some."""
    try:
        text = Path(path).read_text("utf-8", errors="replace")
    except OSError as error:
        raise InputError(f"{path}: expected a file, found {error.strerror}") from None
    for number, line in enumerate(text.splitlines(), 1):
        words = line.partition("#")[0].split()
        if words:
            yield f"{path}:{number}", words


def _numbers(place: str, words: list[str], expected: str) -> list[float]:
    try:
        return [float(word) for word in words]
    except ValueError:
        raise InputError(f"{place}: expected {expected}, found {' '.join(words)!r}") from None


def can(path: str | Path) -> dict[str, Floats]:
    """The triangles of each label; polygons become fans."""
    found: dict[str, list[Any]] = {}
    for place, words in _lines(path):
        polygon = "a polygon, 'p N label... V x y z ...'"
        if words[0] != "p" or len(words) < 2 or not words[1].isdigit():
            raise InputError(f"{place}: expected {polygon}")
        labels = int(words[1])
        rest = words[2 + labels :]
        if labels < 1 or not rest or not rest[0].isdigit() or len(rest) != 1 + 3 * int(rest[0]):
            raise InputError(f"{place}: expected {polygon}")
        points = np.array(_numbers(place, rest[1:], polygon)).reshape(-1, 3)
        for k in range(1, len(points) - 1):
            found.setdefault(words[2], []).append((points[0], points[k], points[k + 1]))
    return {label: np.array(triangles) for label, triangles in found.items()}


def opt(path: str | Path) -> tuple[float, list[tuple[float, Material]]]:
    """The reflectance of the soil, and for each species that of its stem and the four values of its leaves."""
    soil, species = 0.0, []
    for place, words in _lines(path):
        values = [word for word in words[1:] if word != "d"]
        if words[0] == "s":
            (soil,) = _numbers(place, values[:1] or [""], "'s d reflectance'")
        elif words[0] == "e":
            numbers = _numbers(place, values, "'e d stem  d rho tau  d rho tau'")
            if len(numbers) != 5:
                raise InputError(f"{place}: expected 'e d stem  d rho tau  d rho tau', found {len(numbers)} numbers")
            species.append((numbers[0], tuple(numbers[1:])))
    return soil, species


def material(path: str | Path, label: str, read: tuple[float, list[tuple[float, Material]]]) -> Material:
    """The material of a label: from the right its digits are element (3), leaf (3), plant (5) and species."""
    soil, species = read
    digits = label.zfill(12)
    kind, leaf = int(digits[:-11]), int(digits[-6:-3])
    if kind == 0:
        return (soil,)
    if kind > len(species):
        raise InputError(f"{path}: expected species {kind} of label {label}, found {len(species)} species")
    stem, leaves = species[kind - 1]
    return (stem,) if leaf == 0 else leaves


def light(path: str | Path) -> list[tuple[float, tuple[float, float, float]]]:
    """Sources: energy and direction of travel."""
    found = []
    for place, words in _lines(path):
        numbers = _numbers(place, words, "'energy x y z'")
        if len(numbers) != 4:
            raise InputError(f"{place}: expected 'energy x y z', found {len(numbers)} numbers")
        found.append((numbers[0], (numbers[1], numbers[2], numbers[3])))
    return found


def pattern(path: str | Path) -> list[float]:
    """Two opposite corners."""
    numbers = [n for place, words in _lines(path) for n in _numbers(place, words, "'x y' of two corners")]
    if len(numbers) < 4:
        raise InputError(f"{path}: expected 'x y' of two corners, found {len(numbers)} numbers")
    return numbers[:4]
