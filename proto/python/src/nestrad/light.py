"""Light above a canopy: parallel sources and a sky, which can be added.

An irradiance is that of a horizontal plane above the canopy, W m-2: one number that every band gets, or a dict by band.
A direction is the direction of travel, downwards; x is east, y is north.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from . import arrays
from .errors import InputError
from .solar import SunPosition, up

Irradiance = float | Mapping[str, float]

SKIES = ("uniform", "moon_spencer", "clear", "cie-1 to cie-15", "perez")
CLEARNESS = (1.0, 12.01)
BRIGHTNESS = (0.01, 0.6)


@dataclass(frozen=True)
class Sources:
    """Parallel sources: (n, 3) directions of travel, and for each band (or for all, under None) n irradiances."""

    directions: arrays.Floats
    irradiance_W_m2: Mapping[str | None, arrays.Floats]

    def of_bands(self, bands: Sequence[str]) -> arrays.Floats:
        """Irradiances, (n, bands)."""
        columns = [of_band(self.irradiance_W_m2, band) for band in bands]
        return np.stack(columns, axis=1)


@dataclass(frozen=True)
class Sky:
    """A distribution of radiance over the sky, and its irradiance by band (or for all, under None)."""

    kind: str
    irradiance_W_m2: Mapping[str | None, float]
    towards_sun: tuple[float, float, float] | None = None
    clearness: float | None = None
    brightness: float | None = None

    def of_bands(self, bands: Sequence[str]) -> list[float]:
        """One irradiance per band."""
        return [of_band(self.irradiance_W_m2, band) for band in bands]


@dataclass(frozen=True)
class Light:
    """Sources and at most one sky. Lights are added with `+`."""

    sources: tuple[Sources, ...] = ()
    sky: Sky | None = None
    #: it has irradiances over all wavelengths, and nothing says what each band gets: one band alone gets it all
    broadband: bool = False

    def __add__(self, other: Light) -> Light:
        if not isinstance(other, Light):
            return NotImplemented
        if self.sky is not None and other.sky is not None:
            raise InputError("light: expected at most one sky in a sum, found two")
        return Light(
            self.sources + other.sources,
            self.sky or other.sky,
            self.broadband or other.broadband,
        )

    def __radd__(self, other: object) -> Light:
        # sum([...]) begins with 0
        return self if other == 0 else NotImplemented


def one_light(light: Light | Iterable[Light]) -> Light:
    """A light, or the sum of several."""
    if isinstance(light, Light):
        return light
    expected = "light: expected a light such as nestrad.sun(...), or a list of such lights"
    if isinstance(light, (str, bytes)) or not isinstance(light, Iterable):
        raise InputError(f"{expected}, found {light!r}")
    total = Light()
    for part in light:
        if not isinstance(part, Light):
            raise InputError(f"{expected}, found {part!r} in it")
        total = total + part
    return total


def one_source(travel: Any, irradiances: Mapping[str | None, float]) -> Sources:
    """A single parallel source."""
    columns = {band: np.array([value]) for band, value in irradiances.items()}
    return Sources(np.asarray(travel, np.float64).reshape(1, 3), columns)


def sources(directions: Any, irradiance: Any) -> Light:
    """A list of parallel sources.

    Args:
        directions: (n, 3) directions of travel, downwards, of any length.
        irradiance: of a horizontal plane above the canopy, W m-2: (n,) for all bands alike, or {band: (n,)}.
    """
    rows = arrays.floats("directions", directions, ("n", 3))
    given = irradiance if isinstance(irradiance, Mapping) else {None: irradiance}
    columns: dict[str | None, arrays.Floats] = {
        band: _not_negative(_place("irradiance", band), values, (len(rows),)) for band, values in given.items()
    }
    return Light((Sources(rows, columns),))


def sun(
    irradiance: Irradiance,
    *,
    direction: Sequence[float] | None = None,
    elevation: float | None = None,
    azimuth: float = 180.0,
    time: Any = None,
    latitude: float | None = None,
    longitude: float | None = None,
) -> Light:
    """The sun, or another parallel source. Say where it stands in one of three ways.

    Args:
        irradiance: direct light on a horizontal plane above the canopy, W m-2: a number, or a dict by band.
        direction: direction of travel (x, y, z), downwards.
        elevation: above the horizon, degrees; with `azimuth`, from north clockwise (east 90, south 180).
        time: with `latitude` and `longitude` in degrees; UTC where it has no offset.

    Raises:
        InputError: none or several of the three are given, or the sun is not above the horizon.
    """
    ways = [direction is not None, elevation is not None, time is not None]
    if sum(ways) != 1:
        raise InputError("sun: expected one of direction, elevation (and azimuth), or time, latitude and longitude")
    if direction is not None:
        travel = arrays.floats("direction", direction, (3,))
    elif elevation is not None:
        given = arrays.number("elevation", elevation, "degrees from 0.0058 to 90")
        if not 0.0058 <= given <= 90:
            raise InputError(f"elevation: expected degrees from 0.0058 to 90, found {given}")
        position = SunPosition(given, arrays.number("azimuth", azimuth, "degrees"))
        travel = -np.array(position.towards)
    else:
        if latitude is None or longitude is None:
            raise InputError("sun: expected latitude and longitude, in degrees, with a time")
        travel = -np.array(up(time, latitude, longitude).towards)
    return Light((one_source(travel, by_band("irradiance", irradiance)),))


def sky(
    irradiance: Irradiance,
    kind: str = "uniform",
    *,
    towards_sun: SunPosition | Sequence[float] | None = None,
    clearness: float | None = None,
    brightness: float | None = None,
) -> Light:
    """A sky without its sun. The master computes as many directions of it as the accuracy asks for.

    Args:
        irradiance: diffuse light on a horizontal plane above the canopy, W m-2: a number, or a dict by band.
        kind: "uniform"; "moon_spencer", the standard overcast sky; "clear", which is "cie-12"; "cie-1" to "cie-15", the
            types of the CIE standard general sky; or "perez", the all-weather sky of Perez, Seals & Michalsky 1993.
        towards_sun: for clear, CIE and Perez skies: `sun_position(...)`, or a vector that points to the sun.
        clearness: for Perez: epsilon, 1 to 12.01.
        brightness: for Perez: Delta, 0.01 to 0.6.
    """
    number = cie_type(kind)
    if number is None and kind not in SKIES:
        raise InputError(f"kind: expected {', '.join(SKIES)}, found {kind!r}")
    vector = None
    if number is not None or kind in ("clear", "perez"):
        if towards_sun is None:
            raise InputError(f"towards_sun: expected where the sun stands for a sky of kind {kind!r}")
        if isinstance(towards_sun, SunPosition):
            vector = towards_sun.lifted().towards
        else:
            x, y, z = arrays.floats("towards_sun", towards_sun, (3,)).tolist()
            vector = (x, y, z)
    elif towards_sun is not None:
        raise InputError(f"towards_sun: a sky of kind {kind!r} has no sun in it")
    if kind == "perez":
        clearness = _within("clearness", clearness, CLEARNESS)
        brightness = _within("brightness", brightness, BRIGHTNESS)
    elif clearness is not None or brightness is not None:
        raise InputError("clearness and brightness: expected for a sky of kind 'perez' only")
    return Light((), Sky(kind, by_band("irradiance", irradiance), vector, clearness, brightness))


def of_band(by_band: Mapping[str | None, Any], band: str) -> Any:
    """What a band gets."""
    if None in by_band:
        return by_band[None]
    if band not in by_band:
        raise InputError(f"irradiance: expected a value for band {band!r}, found {', '.join(map(repr, by_band))}")
    return by_band[band]


def by_band(name: str, given: Irradiance) -> dict[str | None, float]:
    """An irradiance as a dict; that of all bands stands under None."""
    values = given if isinstance(given, Mapping) else {None: given}
    if not values:
        raise InputError(f"{name}: expected a number, or a dict by band, found an empty dict")
    found: dict[str | None, float] = {}
    for band, value in values.items():
        place = _place(name, band)
        found[band] = arrays.number(place, value, "W m-2, 0 or more")
        if found[band] < 0:
            raise InputError(f"{place}: expected W m-2, 0 or more, found {value}")
    return found


def _place(name: str, band: str | None) -> str:
    return name if band is None else f"{name}[{band!r}]"


def _not_negative(place: str, given: Any, shape: tuple[int, ...]) -> arrays.Floats:
    values = arrays.floats(place, given, shape)
    if values.size and values.min() < 0:
        raise InputError(f"{place}: expected W m-2, 0 or more, found {values.min()}")
    return values


def _within(name: str, given: float | None, bounds: tuple[float, float]) -> float:
    expected = f"a number from {bounds[0]} to {bounds[1]}"
    value = arrays.number(name, given, expected)
    if not bounds[0] <= value <= bounds[1]:
        raise InputError(f"{name}: expected {expected}, found {value}")
    return value


def cie_type(kind: str) -> int | None:
    """The number of a CIE sky, 1 to 15; None for another kind. A clear sky has its own message."""
    names = {f"cie-{number}": number for number in range(1, 16)}
    return names.get(kind)
