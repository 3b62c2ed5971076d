"""CARIBU's tuples of materials, as reflectance and transmittance of both faces."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ..arrays import Floats
from ..errors import InputError

Material = tuple[float, ...]

_FORMS = "(rho,), (rho, tau) or (rho_sup, tau_sup, rho_inf, tau_inf)"


def four(place: str, material: Any) -> Material:
    """rho and tau of the upper face, rho and tau of the lower face."""
    try:
        values = tuple(float(value) for value in material)
    except (TypeError, ValueError):
        values = ()
    if len(values) not in (1, 2, 4):
        raise InputError(f"{place}: expected {_FORMS}, found {material!r}")
    if len(values) == 1:
        values = (values[0], 0.0)
    if len(values) == 2:
        values = values * 2
    for rho, tau in (values[:2], values[2:]):
        if not (rho >= 0 and tau >= 0 and rho + tau <= 1 + 1e-12):
            raise InputError(f"{place}: expected rho and tau of 0 or more with a sum of at most 1, found {material!r}")
    return values


class Materials:
    """The materials of all triangles in all bands.

    Args:
        x_materials: for each band a list with a tuple for each triangle.
        count: the number of triangles.
    """

    def __init__(self, x_materials: Mapping[str, Sequence[Any]], count: int) -> None:
        for band, given in x_materials.items():
            if len(given) != count:
                raise InputError(
                    f"materials: expected one for each of {count} triangles, found {len(given)} in band {band!r}"
                )
        if not x_materials:
            raise InputError("materials: expected at least one band, found none")
        self.bands = list(x_materials)
        known: dict[tuple[Any, ...], int] = {}
        together = zip(*x_materials.values())
        #: the number of the material of each triangle
        self.of_triangle = np.array(
            [known.setdefault(tuple(map(tuple, material)), len(known)) for material in together], np.uint32
        )
        #: for each band the four values of each material
        self.values: dict[str, list[Material]] = {
            band: [four(f"materials of band {band!r}", material[number]) for material in known]
            for number, band in enumerate(self.bands)
        }

    def of_triangles(self, band: str) -> Floats:
        """The four values of each triangle, (n, 4)."""
        return np.array(self.values[band], np.float64).reshape(-1, 4)[self.of_triangle]

    def labels(self) -> list[str]:
        """The label of each material as CAN files have it: the material counts as species, and leaf 0 is opaque."""
        found = []
        for number, of_bands in enumerate(zip(*self.values.values()), 1):
            leaf = int(any(upper or lower for _, upper, _, lower in of_bands))
            found.append(f"{number}00001{leaf:03d}000")
        return found
