"""Where the sun stands, from time and place: the Solar Position Algorithm, as the command line has it.

Reda & Andreas 2003, Solar Energy 76:577-589, good to 0.0003 degrees, with standard refraction at sea level (1013.25
hPa, 15 degrees Celsius), because light arrives along the refracted ray.
"""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime, timezone
from importlib import resources
from math import acos, asin, atan, atan2, cos, degrees, radians, sin, tan
from typing import Any

from . import arrays
from .errors import InputError

#: the sine of the least elevation (0.0057 degrees) of a sun that shines on a canopy
LEAST_SINE = 1e-4

_NUTATION = (
    (297.85036, 445267.11148, -0.0019142, 1.0 / 189474.0),
    (357.52772, 35999.05034, -0.0001603, -1.0 / 300000.0),
    (134.96298, 477198.867398, 0.0086972, 1.0 / 56250.0),
    (93.27191, 483202.017538, -0.0036825, 1.0 / 327270.0),
    (125.04452, -1934.136261, 0.0020708, 1.0 / 450000.0),
)
_OBLIQUITY = (84381.448, -4680.93, -1.55, 1999.25, -51.38, -249.67, -39.05, 7.12, 27.87, 5.79, 2.45)
_EARTH_FLATTENING = 0.99664719
_REFRACTION_CUTOFF_DEG = -0.83337
# the difference of Terrestrial Time and UT1, seconds: first year, year that the polynomial counts from, coefficients.
# Espenak & Meeus, and from 2015 on a fit to IERS observations
_DELTA_T_S = (
    (1961.0, 1975.0, (45.45, 1.067, -1.0 / 260.0, -1.0 / 718.0)),
    (1986.0, 2000.0, (63.86, 0.3345, -0.060374, 0.0017275, 0.000651814, 0.00002373599)),
    (2005.0, 2005.0, (64.69, 0.2930)),
    (
        2015.0,
        2015.0,
        (67.62, 0.2930, 0.08753166427153103, -0.020049795884351372, 0.0009758496126416308),
    ),
    (2026.5, 2026.5, (69.14, 0.28805287963416737, 0.0057380400318460655)),
)
_LAST_YEAR = 2999


@dataclass(frozen=True)
class SunPosition:
    """The sun, by day or night."""

    #: above the horizon, degrees; below 0 by night
    elevation_deg: float
    #: from north, clockwise (east is 90), degrees
    azimuth_deg: float

    @property
    def towards(self) -> tuple[float, float, float]:
        """Unit vector towards the sun: x east, y north, z up."""
        elevation, azimuth = radians(self.elevation_deg), radians(self.azimuth_deg)
        return cos(elevation) * sin(azimuth), cos(elevation) * cos(azimuth), sin(elevation)

    @property
    def is_up(self) -> bool:
        """Whether it is high enough above the horizon to shine on a canopy."""
        return self.towards[2] >= LEAST_SINE

    def lifted(self) -> SunPosition:
        """The same sun, lifted to the horizon where it stands below: what a sky at dusk is shaped by."""
        return self if self.is_up else SunPosition(degrees(asin(2 * LEAST_SINE)), self.azimuth_deg)


def utc(time: Any) -> datetime:
    """A moment in UTC. `time` is text as 2026-06-21T10:00Z or 2026-06-21T12:00+02:00, a datetime, a pandas Timestamp
    or a numpy datetime64; without an offset it is UTC."""
    expected = 'expected a date and time such as "2026-06-21T10:00Z" or a datetime'
    if isinstance(time, str):
        text = time.strip()
        if text[-1:] in ("Z", "z"):
            text = text[:-1] + "+00:00"
        try:
            moment = datetime.fromisoformat(text)
        except ValueError:
            raise InputError(f"time: {expected}, found {time!r}") from None
        if len(text) < len("2026-06-21T10:00"):
            raise InputError(f"time: {expected}, found {time!r}")
    elif isinstance(time, datetime):
        moment = time
    else:
        try:
            found = time.astype("datetime64[us]").item()
        except (AttributeError, TypeError, ValueError):
            found = None
        if not isinstance(found, datetime):
            raise InputError(f"time: {expected}, found {time!r}")
        moment = found
    if moment.tzinfo is None:
        return moment.replace(tzinfo=timezone.utc)
    return moment.astimezone(timezone.utc)


def sun_position(time: Any, latitude: float, longitude: float) -> SunPosition:
    """Where the sun stands.

    Args:
        time: text as "2026-06-21T10:00Z" or with an offset, a datetime, or a numpy datetime64; UTC without an offset.
        latitude: degrees, north positive, -90 to 90.
        longitude: degrees, east positive, -180 to 180.

    Raises:
        InputError: not a time from 1961 to 2999, or not a place.
    """
    moment = utc(time)
    if not 1961 <= moment.year <= _LAST_YEAR:
        raise InputError(f"time: expected a year from 1961 to {_LAST_YEAR}, found {moment.year}")
    latitude = arrays.number("latitude", latitude, "degrees from -90 to 90")
    longitude = arrays.number("longitude", longitude, "degrees from -180 to 180")
    if abs(latitude) > 90:
        raise InputError(f"latitude: expected degrees from -90 to 90, found {latitude}")
    if abs(longitude) > 180:
        raise InputError(f"longitude: expected degrees from -180 to 180, found {longitude}")
    sky = _GeocentricSun(moment)
    return sky.seen_from(latitude, longitude)


def up(time: Any, latitude: float, longitude: float) -> SunPosition:
    """The sun that stands above the horizon; by night an error that says where and when."""
    sun = sun_position(time, latitude, longitude)
    if not sun.is_up:
        raise InputError(
            f"time: expected a time with the sun up, found {utc(time).isoformat()} at latitude {latitude}, "
            f"longitude {longitude}: its elevation is {sun.elevation_deg:.4f} degrees"
        )
    return sun


class _GeocentricSun:
    """The sun as seen from the centre of the Earth at a moment: sections 3.1 to 3.8 of the report."""

    def __init__(self, moment: datetime) -> None:
        day = _julian_day(moment)
        delta_t_s = _delta_t_s(moment.year + (moment.month - 0.5) / 12.0)
        century = (day - 2451545.0) / 36525.0
        ephemeris_century = (day + delta_t_s / 86400.0 - 2451545.0) / 36525.0
        t = ephemeris_century / 10.0
        terms = _terms()
        longitude_deg = degrees(_series(terms["L"], t))
        latitude_deg = -degrees(_series(terms["B"], t))
        self.radius_au = _series(terms["R"], t)
        arguments = [_polynomial(coefficients, ephemeris_century) for coefficients in _NUTATION]
        in_longitude = in_obliquity = 0.0
        for *multiples, a, b, c, d in terms["N"]:
            angle = radians(sum(x * y for x, y in zip(arguments, multiples)))
            in_longitude += (a + b * ephemeris_century) * sin(angle)
            in_obliquity += (c + d * ephemeris_century) * cos(angle)
        in_longitude /= 36_000_000.0
        obliquity_deg = _polynomial(_OBLIQUITY, t / 10.0) / 3600.0 + in_obliquity / 36_000_000.0
        aberration_deg = -20.4898 / (3600.0 * self.radius_au)
        apparent = radians(longitude_deg + 180.0 + in_longitude + aberration_deg)
        obliquity, latitude = radians(obliquity_deg), radians(latitude_deg)
        self.ascension_deg = degrees(
            atan2(sin(apparent) * cos(obliquity) - tan(latitude) * sin(obliquity), cos(apparent))
        )
        self.declination = asin(sin(latitude) * cos(obliquity) + cos(latitude) * sin(obliquity) * sin(apparent))
        mean_deg = (
            280.46061837
            + 360.98564736629 * (day - 2451545.0)
            + century * century * (0.000387933 - century / 38710000.0)
        ) % 360.0
        self.sidereal_deg = mean_deg + in_longitude * cos(obliquity)

    def seen_from(self, latitude_deg: float, longitude_deg: float) -> SunPosition:
        """Sections 3.9 to 3.14: from a place at sea level."""
        hour_deg = (self.sidereal_deg + longitude_deg - self.ascension_deg) % 360.0
        hour, phi = radians(hour_deg), radians(latitude_deg)
        parallax = sin(radians(8.794 / (3600.0 * self.radius_au)))
        u = atan(_EARTH_FLATTENING * tan(phi))
        x, y = cos(u), _EARTH_FLATTENING * sin(u)
        across = cos(self.declination) - x * parallax * cos(hour)
        shift = atan2(-x * parallax * sin(hour), across)
        declination = atan2((sin(self.declination) - y * parallax) * cos(shift), across)
        hour -= shift
        sine = sin(phi) * sin(declination) + cos(phi) * cos(declination) * cos(hour)
        zenith_deg = degrees(acos(min(max(sine, -1.0), 1.0)))
        azimuth_deg = (180.0 + degrees(atan2(sin(hour), cos(hour) * sin(phi) - tan(declination) * cos(phi)))) % 360.0
        elevation_deg = 90.0 - zenith_deg
        if elevation_deg > _REFRACTION_CUTOFF_DEG:
            at = radians(elevation_deg + 10.3 / (elevation_deg + 5.11))
            elevation_deg += (1013.25 / 1010.0) * (283.0 / 288.0) * 1.02 / (60.0 * tan(at))
        return SunPosition(elevation_deg, azimuth_deg)


def _julian_day(moment: datetime) -> float:
    seconds = moment.second + 1e-6 * moment.microsecond
    part = (moment.hour + (moment.minute + seconds / 60.0) / 60.0) / 24.0
    # the day of 1970-01-01 is 2440587.5
    days = moment.toordinal() - datetime(1970, 1, 1).toordinal()
    return days + part + 2440587.5


def _delta_t_s(year: float) -> float:
    _, origin, coefficients = [row for row in _DELTA_T_S if year >= row[0]][-1]
    return _polynomial(coefficients, year - origin)


def _polynomial(coefficients: tuple[float, ...] | list[float], x: float) -> float:
    value = 0.0
    for coefficient in reversed(coefficients):
        value = value * x + coefficient
    return value


def _series(terms: list[tuple[float, ...]], t: float) -> float:
    sums = [0.0] * 6
    for power, a, b, c in terms:
        sums[int(power)] += a * cos(b + c * t)
    return _polynomial(sums, t) / 1e8


_READ: dict[str, list[tuple[float, ...]]] = {}


def _terms() -> dict[str, list[tuple[float, ...]]]:
    if not _READ:
        text = resources.files(__package__).joinpath("solar_terms.txt").read_text("ascii")
        for line in text.splitlines():
            if not line.startswith("#"):
                name, *values = line.split()
                _READ.setdefault(name, []).append(tuple(map(float, values)))
    return _READ


def extraterrestrial_W_m2(time: Any) -> float:
    """Irradiance across the beam outside the atmosphere, W m-2: Spencer 1971, with 1361 W m-2 at the mean distance."""
    angle = radians(360.0 * (utc(time).timetuple().tm_yday - 1) / 365.0)
    return 1361.0 * (
        1.000110 + 0.034221 * cos(angle) + 0.001280 * sin(angle) + 0.000719 * cos(2 * angle) + 0.000077 * sin(2 * angle)
    )


def air_mass(zenith_deg: float) -> float:
    """Relative optical air mass: Kasten & Young 1989."""
    zenith_deg = min(max(zenith_deg, 0.0), 90.0)
    of_horizon: float = 0.50572 * (96.07995 - zenith_deg) ** -1.6364
    return 1.0 / (cos(radians(zenith_deg)) + of_horizon)
