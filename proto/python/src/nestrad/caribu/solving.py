"""CARIBU's three ways to light, as solves of nestrad."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from math import hypot
from typing import Any

import numpy as np

from ..arrays import Floats
from ..canopy import Canopy
from ..errors import InputError
from ..light import Light, sources
from ..session import Diameter, Session
from ..tables import TriangleTable
from .materials import Materials

Pattern = tuple[float, float, float, float]
Columns = dict[str, list[Any]]

# the least sine of the elevation of a source
_LEAST_SINE = 1e-4
_BLACK = "black"
# finer than the default, as light straight from the sources costs little
_FIRST_ORDER_PERCENT = 0.3


@dataclass(frozen=True)
class Ground:
    """A soil plane, and its reflectance in each band."""

    z: float
    reflectance: dict[str, float]


@dataclass(frozen=True)
class Scene:
    """Triangles in metres, what they are made of, and the light above them."""

    triangles: Floats
    materials: Materials
    lights: Sequence[Any]
    pattern: Pattern | None = None
    #: a label for each triangle; errors are kept small for all triangles of a label together
    groups: Any = None
    #: True for triangles of soil
    is_soil: Any = None

    def canopy(self, ground: Ground | None, materials: Any = None) -> Canopy:
        """The canopy of a solve.

        Of triangles in one place CARIBU lights the first. nestrad lights the one of the last organ by name, and there
        the last triangle: so triangles stand in reverse order, and organs are numbered downwards.
        """
        soil = np.zeros(len(self.triangles), bool) if self.is_soil is None else self.is_soil
        names = self.materials.of_triangle if materials is None else materials
        numbers = 2 * names.astype(np.int64) + soil
        kinds = {str(number): "soil" for number in np.unique(numbers[soil]).tolist()}
        groups = np.arange(len(self.triangles)) if self.groups is None else self.groups
        return Canopy(
            self.triangles[::-1],
            organ=(groups.max() - groups)[::-1],
            material=numbers[::-1],
            kind={str(number): "leaf" for number in np.unique(numbers).tolist()} | kinds,
            pattern=self.pattern,
            soil_z=None if ground is None else ground.z,
        )


def no_sensors(sensors: Any) -> None:
    """Refuses sensors."""
    if sensors is not None:
        raise NotImplementedError("sensors: nestrad has no virtual sensors yet, expected None")


def first_order(scene: Scene) -> dict[str, Columns]:
    """The light that comes straight from the sources.

    It does not depend on what leaves are made of. So the scene is lit once with black leaves, which scatter nothing,
    and each band takes its part of what falls on the faces.
    """
    light = _light(scene.lights)
    if light is None:
        return _columns(scene, dict.fromkeys(scene.materials.bands))
    canopy = scene.canopy(None, materials=np.zeros(len(scene.triangles), np.uint32))
    with Session() as session:
        found = session.solve(canopy, {_BLACK: 0.0}, light, accuracy=_FIRST_ORDER_PERCENT).triangles
    return _columns(scene, dict.fromkeys(scene.materials.bands, (found, 0)))


def all_orders(scene: Scene, diameter: Diameter, ground: Ground | None) -> dict[str, Columns]:
    """All light, scattered light included. Beyond a diameter the multilayer model replaces the geometry."""
    light = _light(scene.lights)
    bands = scene.materials.bands
    if light is None:
        return _columns(scene, dict.fromkeys(bands))
    canopy = scene.canopy(ground)
    optics = {}
    for band in bands:
        values = scene.materials.values[band]
        optics[band] = {m.name: values[int(m.name) // 2] for m in canopy.materials}
        if ground is not None:
            optics[band]["soil"] = (ground.reflectance[band],)
    with Session() as session:
        found = session.solve(canopy, optics, light, diameter=diameter).triangles
    return _columns(scene, {band: (found, number) for number, band in enumerate(bands)})


def _light(lights: Sequence[Any]) -> Light | None:
    """CARIBU's list of (energy, (x, y, z)); None where there is no light."""
    directions, energies = [], []
    for number, light in enumerate(lights):
        try:
            energy, (x, y, z) = light
            energy, x, y, z = float(energy), float(x), float(y), float(z)
        except (TypeError, ValueError):
            raise InputError(f"lights[{number}]: expected (energy, (x, y, z)), found {light!r}") from None
        length = hypot(x, y, z)
        if not (energy >= 0 and length > 0):
            raise InputError(f"lights[{number}]: expected an energy of 0 or more and a direction, found {light!r}")
        if abs(z) < _LEAST_SINE * length:
            # no light of it passes through a horizontal plane
            warnings.warn(f"lights[{number}] is horizontal and brings no light", stacklevel=4)
        elif z > 0:
            raise InputError(f"lights[{number}]: expected a direction that points down, found {light!r}")
        elif energy > 0:
            directions.append((x, y, z))
            energies.append(energy)
    return sources(directions, energies) if directions else None


def _columns(scene: Scene, found: dict[str, tuple[TriangleTable | None, int] | None]) -> dict[str, Columns]:
    of_materials = scene.materials.labels()
    labels = [of_materials[number] for number in scene.materials.of_triangle.tolist()]
    area = areas(scene.triangles)
    result = {}
    for band in scene.materials.bands:
        table, number = found[band] or (None, 0)
        if table is None:
            upper = lower = np.zeros(len(area))
        else:
            upper = table.irradiance_upper_W_m2[::-1, number]
            lower = table.irradiance_lower_W_m2[::-1, number]
        optics = scene.materials.of_triangles(band)
        absorbed = upper * (1 - optics[:, 0] - optics[:, 1]) + lower * (1 - optics[:, 2] - optics[:, 3])
        null = area == 0
        columns = {"Eabs": absorbed, "Ei": upper + lower, "Ei_sup": upper, "Ei_inf": lower}
        # nothing can be said of what has no area
        of_band = {name: np.where(null, np.nan, column).tolist() for name, column in columns.items()}
        result[band] = {
            "index": list(range(len(area))),
            "label": list(labels),
            "area": area.tolist(),
            **of_band,
        }
    return result


def areas(triangles: Floats) -> Floats:
    """One-sided areas."""
    edges = triangles[:, 1:] - triangles[:, :1]
    area: Floats = 0.5 * np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1)
    return area
