"""CaribuScene."""

from __future__ import annotations

from collections.abc import Mapping
from math import hypot
from pathlib import Path
from typing import Any

import numpy as np

from ..arrays import Floats, number
from ..errors import InputError
from . import files
from .functions import default_light, diameter_of, ground_of, pattern_of
from .materials import Materials
from .shapes import triangles_by_id
from .solving import Pattern, Scene, all_orders, areas, first_order, no_sensors

_UNITS_M = {
    "mm": 1e-3,
    "cm": 1e-2,
    "dm": 0.1,
    "m": 1.0,
    "dam": 10.0,
    "hm": 100.0,
    "km": 1000.0,
}
_COLUMNS = ("Eabs", "Ei", "area")
_FACES = ("Ei_inf", "Ei_sup")


class CaribuScene:
    """A scene with its light and its optics, as CARIBU has it.

    Args:
        scene: {id: [triangle, ...]}, a triangle being three (x, y, z); the path of a .can file; a PlantGL scene; an MTG
            with the property geometry; or a triangle set.
        light: [(energy per m2 of a horizontal plane, (x, y, z))] with the direction of travel, or the path of a
            .light file.
        pattern: (x0, y0, x1, y1), ((x0, y0), (x1, y1)) or the path of a .8 file: where the scene repeats.
        opt: {band: material}, {band: {id: material}} or a list of .opt files.
        soil_reflectance: {band: reflectance}; 0.15 by default.
        soil_mesh: 1 adds a soil of two triangles; None or -1 adds none.
        z_soil: the height of the soil; by default the lowest point of the scene.
        scene_unit: of lengths in scene and pattern: mm, cm, dm, m, dam, hm or km.
        debug, filecache: no effect.
    """

    default_material = (0.06, 0.07)
    default_soil_reflectance = 0.15
    default_light = default_light
    default_band = "default_band"
    units = _UNITS_M

    def __init__(
        self,
        scene: Any = None,
        light: Any = None,
        pattern: Any = None,
        opt: Any = None,
        soil_reflectance: Mapping[str, float] | None = None,
        soil_mesh: int | None = None,
        z_soil: float | None = None,
        scene_unit: str = "m",
        debug: bool = False,
        filecache: bool = True,
    ) -> None:
        if scene_unit not in _UNITS_M:
            raise InputError(f"scene_unit: expected one of {', '.join(_UNITS_M)}, found {scene_unit!r}")
        self.scene_unit = scene_unit
        self.conv_unit = _UNITS_M[scene_unit]
        self.scene: dict[Any, Floats] | None = None
        if scene is not None:
            is_path = isinstance(scene, (str, Path))
            self.scene = dict(files.can(scene)) if is_path else triangles_by_id(scene)
        self.light: list[Any] = [default_light]
        if light is not None:
            self.setLight(light)
        self.pattern: Pattern | None = None
        if pattern is not None:
            is_path = isinstance(pattern, (str, Path))
            self.pattern = pattern_of(files.pattern(pattern) if is_path else pattern)
        self.material: dict[str, dict[Any, Any]] | None = None
        self.soil_reflectance: dict[str, float] = {}
        self._set_optics(opt, soil_reflectance)
        self.z_soil = z_soil
        self.soil: list[Any] | None = None
        self.soil_raw: dict[str, Any] = {}
        self.soil_aggregated: dict[str, Any] = {}
        if soil_mesh not in (None, -1):
            self._add_soil(soil_mesh)

    def _set_optics(self, opt: Any, soil_reflectance: Mapping[str, float] | None) -> None:
        ids = [] if self.scene is None else list(self.scene)
        if soil_reflectance is not None and not isinstance(soil_reflectance, Mapping):
            raise InputError(f"soil_reflectance: expected a dict by band, found {soil_reflectance!r}")
        if isinstance(opt, (list, tuple)) and all(isinstance(path, (str, Path)) for path in opt):
            self.material = {}
            for path in opt:
                band = Path(path).name.partition(".")[0]
                read = files.opt(path)
                self.material[band] = {key: files.material(path, str(key), read) for key in ids}
                self.soil_reflectance[band] = read[0]
            return
        if opt is None:
            bands = [self.default_band] if soil_reflectance is None else list(soil_reflectance)
            opt = dict.fromkeys(bands, self.default_material)
        if not isinstance(opt, Mapping) or not opt:
            raise InputError(
                f"opt: expected {{band: material}}, {{band: {{id: material}}}} or a list of .opt files, found {opt!r}"
            )
        if self.scene is not None:
            self.material = {
                band: dict(given) if isinstance(given, Mapping) else dict.fromkeys(ids, given)
                for band, given in opt.items()
            }
        if soil_reflectance is None:
            soil_reflectance = dict.fromkeys(opt, self.default_soil_reflectance)
        if set(soil_reflectance) != set(opt):
            raise InputError(
                f"soil_reflectance: expected a value for each of {', '.join(opt)}, found {soil_reflectance!r}"
            )
        self.soil_reflectance = dict(soil_reflectance)

    def _add_soil(self, soil_mesh: int | None) -> None:
        if soil_mesh != 1:
            raise InputError(f"soil_mesh: expected None, -1 or 1, found {soil_mesh!r}")
        if self.pattern is None:
            raise InputError("soil_mesh: expected a pattern, which is where the soil is")
        z = self._lowest() if self.z_soil is None else number("z_soil", self.z_soil)
        x0, y0, x1, y1 = self.pattern
        a, b, c, d = (x0, y0, z), (x1, y0, z), (x1, y1, z), (x0, y1, z)
        self.soil = [[a, b, c], [a, c, d]]

    def _lowest(self) -> float:
        return 0.0 if self.scene is None else self.bbox()[0][2]

    def setLight(self, light: Any) -> None:  # CARIBU's name
        """Another light: a list of (energy, (x, y, z)), or the path of a .light file."""
        if isinstance(light, (str, Path)):
            self.light = list(files.light(light))
        elif isinstance(light, list) and light and isinstance(light[0], tuple):
            self.light = light
        else:
            raise InputError(f"light: expected [(energy, (x, y, z)), ...] or a path, found {light!r}")

    def bbox(self) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
        """Two opposite corners of the box around the scene, in its unit."""
        points = np.concatenate(list(self._triangles().values())).reshape(-1, 3)
        (x0, y0, z0), (x1, y1, z1) = points.min(0).tolist(), points.max(0).tolist()
        return (x0, y0, z0), (x1, y1, z1)

    def triangle_areas(self, convert: bool = True) -> Floats:
        """The area of each triangle: m2, or in the unit of the scene."""
        found = areas(np.concatenate(list(self._triangles().values())))
        return found * self.conv_unit**2 if convert else found

    def auto_screen(self, screen_resolution: float) -> int:
        """The pixels of a diagonal of the scene, which CARIBU takes as the size of its screen."""
        low, high = self.bbox()
        diagonal = hypot(*(b - a for a, b in zip(low, high)))
        return max(2, int(diagonal / (screen_resolution * self.conv_unit)))

    def plot(self, *_: Any, **__: Any) -> None:
        """Not there: `nestrad report` draws canopies."""
        raise NotImplementedError("plot: nestrad draws canopies with `nestrad report`")

    def getIncidentEnergy(self) -> tuple[float, float, float | None]:  # CARIBU's name
        """Energy per m2 of a horizontal plane, per m2 across the beams, and on the whole pattern."""
        horizontal = float(sum(energy for energy, _ in self.light))
        across = 0.0
        for energy, (x, y, z) in self.light:
            across += energy * hypot(x, y, z) / abs(z) if energy else 0.0
        return horizontal, across, self._on_pattern(horizontal)

    def getSoilEnergy(self) -> tuple[float, float | None]:  # CARIBU's name
        """Energy per m2 of soil, and on the whole pattern, of the first band."""
        if self.soil is None or not self.soil_aggregated:
            raise InputError("getSoilEnergy: expected a scene with soil_mesh=1 that was run")
        per_m2 = next(iter(self.soil_aggregated.values()))["Ei"]
        return per_m2, self._on_pattern(per_m2)

    def _on_pattern(self, per_m2: float) -> float | None:
        if self.pattern is None:
            return None
        x0, y0, x1, y1 = self.pattern
        return per_m2 * (x1 - x0) * (y1 - y0) * self.conv_unit**2

    def _triangles(self) -> dict[Any, Floats]:
        if self.scene is None:
            raise InputError("scene: expected one, found None")
        return self.scene

    def run(
        self,
        direct: bool = True,
        infinite: bool = False,
        d_sphere: float = 0.5,
        layers: int = 10,
        height: float | None = None,
        screen_size: int = 1536,
        screen_resolution: float | None = None,
        sensors: Any = None,
        split_face: bool = False,
        simplify: bool = False,
    ) -> tuple[dict[str, Any], dict[str, Any]]:
        """Lights the scene.

        Args:
            direct: light straight from the sources alone; False: scattered light too.
            infinite: the scene repeats on its pattern without end.
            d_sphere: for scattered light in an infinite scene: the sphere within which it is exchanged on the true
                geometry, m.
            layers, height, screen_size, screen_resolution: no effect.
            sensors: None.
            split_face: Ei_sup and Ei_inf too.
            simplify: without the level of bands where there is one band.

        Returns:
            raw and aggregated: {band: {"Eabs", "Ei", "area": {id: values}}}, a list for each triangle or one value for
            all triangles of an id; energies per m2, areas in m2.
        """
        no_sensors(sensors)
        if self.scene is None:
            return {}, {}
        if infinite and self.pattern is None:
            raise InputError("infinite: expected a pattern for an infinite scene")
        scene, ids = self._as_solved(infinite)
        if direct:
            found = first_order(scene)
        elif infinite:
            z = None if self.z_soil is None else self.z_soil * self.conv_unit
            ground = None
            if self.soil is None:
                ground = ground_of(scene, self.soil_reflectance, self.soil_reflectance, z)
            found = all_orders(scene, diameter_of(d_sphere), ground)
        else:
            found = all_orders(scene, "inf", None)
        raw, aggregated = self._by_id(found, ids, (*_COLUMNS, *(_FACES if split_face else ())))
        if simplify and len(raw) == 1:
            (raw,), (aggregated,) = raw.values(), aggregated.values()
        return raw, aggregated

    def _as_solved(self, infinite: bool) -> tuple[Scene, list[tuple[Any, int]]]:
        """The scene in metres, and its ids with their numbers of triangles; the soil comes last, without one."""
        parts = self._triangles()
        ids = [(key, len(triangles)) for key, triangles in parts.items()]
        meshes = list(parts.values())
        if self.soil is not None:
            ids.append((None, len(self.soil)))
            meshes.append(np.array(self.soil, np.float64))
        of_bands = {}
        for band, materials in (self.material or {}).items():
            missing = [key for key, _ in ids if key is not None and key not in materials]
            if missing:
                raise InputError(f"opt[{band!r}]: expected a material for {missing[0]!r}")
            of_soil = (self.soil_reflectance[band],)
            of_bands[band] = [of_soil if key is None else materials[key] for key, count in ids for _ in range(count)]
        triangles = self.conv_unit * np.concatenate(meshes)
        groups = np.repeat(np.arange(len(ids)), [count for _, count in ids])
        is_soil = np.repeat([key is None for key, _ in ids], [count for _, count in ids])
        pattern = None
        if infinite and self.pattern is not None:
            x0, y0, x1, y1 = (self.conv_unit * value for value in self.pattern)
            pattern = x0, y0, x1, y1
        materials_of = Materials(of_bands, len(triangles))
        return Scene(triangles, materials_of, self.light, pattern, groups, is_soil), ids

    def _by_id(
        self, found: dict[str, dict[str, list[Any]]], ids: list[tuple[Any, int]], columns: tuple[str, ...]
    ) -> tuple[dict[str, Any], dict[str, Any]]:
        raw: dict[str, Any] = {}
        aggregated: dict[str, Any] = {}
        self.soil_raw, self.soil_aggregated = {}, {}
        ends = np.cumsum([count for _, count in ids]).tolist()
        spans = {key: (end - count, end) for (key, count), end in zip(ids, ends)}
        try:
            order = sorted(key for key in spans if key is not None)
        except TypeError:
            order = [key for key in spans if key is not None]
        for band, values in found.items():
            of_id = {name: {key: values[name][first:end] for key, (first, end) in spans.items()} for name in columns}
            mean = {
                name: {key: _together(name, of_id[name][key], of_id["area"][key]) for key in spans} for name in columns
            }
            raw[band] = {name: {key: of_id[name][key] for key in order} for name in columns}
            aggregated[band] = {name: {key: mean[name][key] for key in order} for name in columns}
            if self.soil is not None:
                self.soil_raw[band] = {name: of_id[name][None] for name in columns}
                self.soil_aggregated[band] = {name: mean[name][None] for name in columns}
        return raw, aggregated


def _together(name: str, values: list[float], area: list[float]) -> float:
    """Areas add up; the rest is the mean by area. Null triangles do not count."""
    total = sum(area)
    if name == "area":
        return total
    if total == 0:
        return float("nan")
    return sum(v * a for v, a in zip(values, area) if a > 0) / total
