"""Sun and sky together, from time, place and measured irradiances."""

from __future__ import annotations

from collections.abc import Mapping
from math import acos, degrees
from typing import Any

from . import arrays
from .errors import InputError
from .light import BRIGHTNESS, CLEARNESS, Irradiance, Light, Sky, Sources, by_band, one_source
from .solar import SunPosition, air_mass, extraterrestrial_W_m2, sun_position, up

_ByBand = Mapping["str | None", float]


def clear_sky(
    time: Any,
    latitude: float,
    longitude: float,
    *,
    ghi: Irradiance,
    dhi: Irradiance,
    band_fraction: Mapping[str, float] | None = None,
) -> Light:
    """The sun and a clear sky (type 12 of the CIE standard general sky) at a time and place.

    Args:
        time: text as "2026-06-21T10:00Z", or a datetime; UTC without an offset.
        latitude: degrees, north positive.
        longitude: degrees, east positive.
        ghi: global irradiance of a horizontal plane, W m-2: a dict by band; or one number over all wavelengths, with
            `band_fraction` (or with one band alone, which then gets it all).
        dhi: the diffuse part of it, in the same form.
        band_fraction: which part of ghi and dhi each band gets, such as {"PAR": 0.48, "NIR": 0.52}.

    Raises:
        InputError: the sun is not above the horizon, dhi is above ghi, or ghi and dhi do not go together.
    """
    position = up(time, latitude, longitude)
    direct, diffuse, broadband = _parts(ghi, dhi, band_fraction)
    return _sun_and_sky(position, direct, Sky("clear", diffuse, position.towards), broadband)


def perez_sky(
    time: Any,
    latitude: float,
    longitude: float,
    *,
    ghi: float,
    dhi: float,
    band_fraction: Mapping[str, float] | None = None,
) -> Light:
    """The sun and the all-weather sky of Perez, Seals & Michalsky 1993, shaped by measured irradiances.

    Args:
        time: text as "2026-06-21T10:00Z", or a datetime; UTC without an offset. At dusk, where ghi and dhi are equal,
            the sun may stand below the horizon.
        latitude: degrees, north positive.
        longitude: degrees, east positive.
        ghi: global irradiance of a horizontal plane over all wavelengths, W m-2.
        dhi: the diffuse part of it, W m-2.
        band_fraction: which part of both each band gets; it may be left out with one band alone.

    Raises:
        InputError: there is direct light and no sun above the horizon, or dhi is above ghi.
    """
    whole_W_m2, diffuse_W_m2 = (
        arrays.number(name, value, "W m-2 over all wavelengths") for name, value in (("ghi", ghi), ("dhi", dhi))
    )
    direct, diffuse, broadband = _parts(whole_W_m2, diffuse_W_m2, band_fraction)
    shines = whole_W_m2 > diffuse_W_m2
    position = up(time, latitude, longitude) if shines else sun_position(time, latitude, longitude)
    towards = position.lifted().towards
    clearness, brightness = _of_irradiance(
        towards[2], max(diffuse_W_m2, 1e-6), whole_W_m2 - diffuse_W_m2, extraterrestrial_W_m2(time)
    )
    sky = Sky("perez", diffuse, towards, clearness, brightness)
    return _sun_and_sky(position, direct, sky, broadband)


def _of_irradiance(sine: float, diffuse_W_m2: float, direct_W_m2: float, outside_W_m2: float) -> tuple[float, float]:
    """Clearness and brightness, equations 1 and 2 of the paper, brought into the ranges that it was fitted in."""
    zenith = acos(min(max(sine, 0.0), 1.0))
    kappa = 1.041 * zenith**3
    whole_W_m2 = diffuse_W_m2 + direct_W_m2 / sine
    clearness = (whole_W_m2 / diffuse_W_m2 + kappa) / (1.0 + kappa)
    brightness = diffuse_W_m2 * air_mass(degrees(zenith)) / outside_W_m2
    return (
        min(max(clearness, CLEARNESS[0]), CLEARNESS[1]),
        min(max(brightness, BRIGHTNESS[0]), BRIGHTNESS[1]),
    )


def _sun_and_sky(position: SunPosition, direct: _ByBand, sky: Sky, broadband: bool) -> Light:
    """Without the sun where no band has direct light, without the sky where none has diffuse light."""
    sources: tuple[Sources, ...] = ()
    if any(value > 0 for value in direct.values()):
        sources = (one_source([-axis for axis in position.towards], direct),)
    shines = any(value > 0 for value in sky.irradiance_W_m2.values())
    return Light(sources, sky if shines else None, broadband)


def _parts(
    ghi: Irradiance, dhi: Irradiance, band_fraction: Mapping[str, float] | None
) -> tuple[_ByBand, _ByBand, bool]:
    """Direct and diffuse irradiance by band, and whether they are over all wavelengths."""
    whole, diffuse = by_band("ghi", ghi), by_band("dhi", dhi)
    if set(whole) != set(diffuse):
        raise InputError(f"dhi: expected the same form as ghi, found {dhi!r} where ghi is {ghi!r}")
    for band, value in diffuse.items():
        if value > whole[band]:
            place = "dhi" if band is None else f"dhi[{band!r}]"
            raise InputError(f"{place}: expected at most ghi, {whole[band]} W m-2, found {value}")
    direct = {band: value - diffuse[band] for band, value in whole.items()}
    if band_fraction is None:
        return direct, diffuse, None in whole
    if None not in whole:
        raise InputError("band_fraction: expected one number each for ghi and dhi, found dicts")
    for band, part in band_fraction.items():
        if not 0 < arrays.number(f"band_fraction[{band!r}]", part) <= 1:
            raise InputError(f"band_fraction[{band!r}]: expected above 0 to 1, found {part}")
    return (
        {band: part * direct[None] for band, part in band_fraction.items()},
        {band: part * diffuse[None] for band, part in band_fraction.items()},
        False,
    )
