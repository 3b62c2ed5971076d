"""Reflectance and transmittance of materials, band by band."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from . import arrays
from .canopy import Canopy
from .errors import InputError

#: what a user gives: a band's name, then for each material its values, and for the soil plane its albedo
Optics = Mapping[str, Any]

_FACE = ("rho", "tau")
_WHOLE = ("rho", "tau", "upper", "lower")
_FORMS = (
    "rho, (rho, tau), (rho_upper, tau_upper, rho_lower, tau_lower), "
    '{"rho": ..., "tau": ...} or {"upper": {...}, "lower": {...}}'
)
SOIL = "soil"


@dataclass(frozen=True)
class Band:
    """A wavelength band."""

    name: str
    #: (materials, 4): rho and tau of the upper face, rho and tau of the lower face
    materials: arrays.Floats
    soil_albedo: float


def bands(optics: Optics, canopy: Canopy) -> list[Band]:
    """The bands of `optics` for the materials of a canopy."""
    if not isinstance(optics, Mapping) or not optics:
        raise InputError(
            f'optics: expected a dict with at least one band, such as {{"PAR": {{...}}}}, found {optics!r}'
        )
    return [_band(str(name), given, canopy) for name, given in optics.items()]


def _band(name: str, given: Any, canopy: Canopy) -> Band:
    place = f"optics[{name!r}]"
    names = [material.name for material in canopy.materials]
    if not isinstance(given, Mapping):
        given = dict.fromkeys(names, given)
    elif any(key in given for key in _WHOLE):
        of_all = {key: value for key, value in given.items() if key in _WHOLE}
        given = {key: value for key, value in given.items() if key not in _WHOLE}
        given = dict.fromkeys(names, of_all) | given
    for key in given:
        if key not in names and key != SOIL:
            raise InputError(
                f"{place}: expected materials of the canopy ({', '.join(names)}) and {SOIL}, found {key!r}"
            )
    if canopy.soil_z_m is not None and SOIL not in given:
        raise InputError(f"{place}: expected the albedo of the soil plane, {{{SOIL!r}: 0.2}}")
    rows = []
    for material in names:
        if material not in given:
            raise InputError(f"{place}: expected the optics of material {material!r}")
        rows.append(_four(f"{place}[{material!r}]", given[material]))
    albedo = 0.0
    if canopy.soil_z_m is not None:
        albedo = _four(f"{place}[{SOIL!r}]", given[SOIL])[0]
    return Band(name, np.array(rows), albedo)


def _four(place: str, given: Any) -> list[float]:
    if isinstance(given, Mapping):
        if set(given) == {"upper", "lower"}:
            return [*_face(f"{place}.upper", given["upper"]), *_face(f"{place}.lower", given["lower"])]
        return 2 * _face(place, given)
    values = np.atleast_1d(np.asarray(given, dtype=object))
    if values.shape not in ((1,), (2,), (4,)):
        raise InputError(f"{place}: expected {_FORMS}, found {given!r}")
    four = [arrays.number(place, value, _FORMS) for value in values]
    four = [four[0], 0.0] if len(four) == 1 else four
    return _checked(place, four if len(four) == 4 else 2 * four)


def _face(place: str, given: Any) -> list[float]:
    if not isinstance(given, Mapping) or not given or not set(given) <= set(_FACE):
        raise InputError(f"{place}: expected {_FORMS}, found {given!r}")
    return _checked(place, [arrays.number(f"{place}.{key}", given.get(key, 0.0)) for key in _FACE])


def _checked(place: str, values: list[float]) -> list[float]:
    for rho, tau in zip(values[::2], values[1::2]):
        if not (rho >= 0 and tau >= 0 and rho + tau <= 1):
            raise InputError(
                f"{place}: expected rho and tau of 0 or more with rho + tau of at most 1, found rho {rho} and tau {tau}"
            )
    return values
