"""CARIBU's functions for lists of triangles. Lengths are those of the scene, in one unit."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ..arrays import Floats, floats
from ..errors import InputError
from ..session import Diameter
from .materials import Materials
from .solving import Columns, Ground, Pattern, Scene, all_orders, first_order, no_sensors

Lights = Sequence[Any]

_BAND = "band"
default_light = (1, (0, 0, -1))


def raycasting(
    triangles: Any,
    materials: Sequence[Any],
    lights: Lights = (default_light,),
    domain: Sequence[float] | None = None,
    screen_size: int = 1536,
    sensors: Any = None,
    debug: bool = False,
    canfile: Any = None,
    optfile: Any = None,
) -> Columns:
    """Light that comes straight from the sources.

    Args:
        triangles: a list of triangles, each of three (x, y, z).
        materials: a tuple for each triangle: (rho,), (rho, tau) or (rho_sup, tau_sup, rho_inf, tau_inf).
        lights: a list of (energy per m2 of a horizontal plane, direction of travel).
        domain: (x0, y0, x1, y1) on which the scene repeats without end; None: it stands alone.
        screen_size, debug, canfile, optfile: no effect.
        sensors: None.

    Returns:
        Lists with a value for each triangle: index, label, area, Eabs, Ei, Ei_sup, Ei_inf; energies per m2.
    """
    return x_raycasting(triangles, {_BAND: materials}, lights, domain, sensors=sensors)[_BAND]


def x_raycasting(
    triangles: Any,
    x_materials: Mapping[str, Sequence[Any]],
    lights: Lights = (default_light,),
    domain: Sequence[float] | None = None,
    screen_size: int = 1536,
    sensors: Any = None,
    debug: bool = False,
    canfile: Any = None,
    optfile: Any = None,
) -> dict[str, Columns]:
    """The same for several bands: `x_materials` is a dict of lists by band, and so is what comes back."""
    no_sensors(sensors)
    pattern = None if domain is None else pattern_of(domain)
    return first_order(_scene(triangles, x_materials, lights, pattern))


def radiosity(
    triangles: Any,
    materials: Sequence[Any],
    lights: Lights = (default_light,),
    screen_size: int = 1536,
    sensors: Any = None,
    debug: bool = False,
) -> Columns:
    """All light of a scene that stands alone, scattered light included, on the true geometry. See `raycasting`; it
    takes two triangles or more."""
    return x_radiosity(triangles, {_BAND: materials}, lights, sensors=sensors)[_BAND]


def x_radiosity(
    triangles: Any,
    x_materials: Mapping[str, Sequence[Any]],
    lights: Lights = (default_light,),
    screen_size: int = 1536,
    sensors: Any = None,
    debug: bool = False,
) -> dict[str, Columns]:
    """The same for several bands."""
    no_sensors(sensors)
    if len(triangles) < 2:
        raise InputError(f"triangles: expected at least two for radiosity, found {len(triangles)}")
    return all_orders(_scene(triangles, x_materials, lights, None), "inf", None)


def mixed_radiosity(
    triangles: Any,
    materials: Sequence[Any],
    lights: Lights,
    domain: Sequence[float],
    soil_reflectance: float,
    diameter: float,
    layers: int,
    height: float,
    screen_size: int = 1536,
    sensors: Any = None,
    debug: bool = False,
) -> Columns:
    """All light of a scene that repeats without end over soil.

    Args:
        triangles, materials, lights, domain: as in `raycasting`.
        soil_reflectance: of the ground, a plane at z = 0, or at the lowest point of a scene that reaches below.
        diameter: of the sphere within which light is exchanged on the true geometry; 0: everywhere.
        layers, height, screen_size, debug: no effect.
        sensors: None.
    """
    by_band = {_BAND: soil_reflectance}
    found = x_mixed_radiosity(triangles, {_BAND: materials}, lights, domain, by_band, diameter, layers, height, sensors)
    return found[_BAND]


def x_mixed_radiosity(
    triangles: Any,
    materials: Mapping[str, Sequence[Any]],
    lights: Lights,
    domain: Sequence[float],
    soil_reflectance: Mapping[str, float],
    diameter: float,
    layers: int,
    height: float,
    sensors: Any = None,
    screen_size: int = 1536,
    debug: bool = False,
) -> dict[str, Columns]:
    """The same for several bands: `materials` and `soil_reflectance` are dicts by band."""
    no_sensors(sensors)
    scene = _scene(triangles, materials, lights, pattern_of(domain))
    return all_orders(scene, diameter_of(diameter), ground_of(scene, materials, soil_reflectance))


def pattern_of(domain: Sequence[float]) -> Pattern:
    """The rectangle of two corners, in any order: (x0, y0, x1, y1) or ((x0, y0), (x1, y1))."""
    x0, y0, x1, y1 = floats("domain", np.ravel(np.asarray(domain, object)).astype(float), (4,)).tolist()
    return min(x0, x1), min(y0, y1), max(x0, x1), max(y0, y1)


def diameter_of(given: float) -> Diameter:
    """The sphere of a solve. 0 is CARIBU's layers alone, for which nestrad takes the true geometry."""
    if not given >= 0:
        raise InputError(f"diameter: expected 0 or more, found {given!r}")
    return float(given) if given > 0 else "auto"


def ground_of(
    scene: Scene, bands: Mapping[str, Any], reflectance: Mapping[str, float], z: float | None = None
) -> Ground:
    """The soil plane below a scene that repeats."""
    for band in bands:
        if band not in reflectance:
            raise InputError(f"soil_reflectance: expected a value for band {band!r}")
    lowest = float(scene.triangles[:, :, 2].min())
    return Ground(min(0.0, lowest) if z is None else z, dict(reflectance))


def _scene(triangles: Any, materials: Mapping[str, Sequence[Any]], lights: Lights, pattern: Pattern | None) -> Scene:
    corners: Floats = floats("triangles", triangles, ("n", 3, 3))
    return Scene(corners, Materials(dict(materials), len(corners)), lights, pattern)
