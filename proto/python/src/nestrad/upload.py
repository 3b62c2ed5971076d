"""A scene as the slices that a master takes."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from . import protocol, wire
from .canopy import Canopy
from .errors import InputError
from .light import Light, Sky, cie_type
from .optics import Band

# about half a MiB each
_TRIANGLES = 6000
_ORGAN_BYTES = 400_000

_IN_SLICE = {name: protocol.number("SceneSlice", name) for name in ("header", "triangles")}
_IN_TRIANGLES = {name: protocol.number("TriangleSlice", name) for name in ("first", "vertices_m", "organ", "material")}


def header(canopy: Canopy, bands: Sequence[Band], light: Light, geometry_id: str | None) -> bytes:
    """The first slice: optics and light, for a geometry that the master holds, or one that follows."""
    message = protocol.SceneHeader()
    if geometry_id is not None:
        message.geometry_id = geometry_id
    else:
        _describe(canopy, message.new_geometry)
    for band in bands:
        materials = [
            {"rho_upper": a, "tau_upper": b, "rho_lower": c, "tau_lower": d} for a, b, c, d in band.materials.tolist()
        ]
        message.bands.add(name=band.name, soil_albedo=band.soil_albedo, materials=materials)
    _light(message, [band.name for band in bands], light)
    return wire.block(_IN_SLICE["header"], message.SerializeToString())


def slices(canopy: Canopy) -> Iterator[bytes]:
    """The slices after a header with a new geometry: organs, then triangles."""
    yield from _organs(canopy)
    for first in range(0, len(canopy), _TRIANGLES):
        end = min(first + _TRIANGLES, len(canopy))
        yield wire.block(
            _IN_SLICE["triangles"],
            wire.whole(_IN_TRIANGLES["first"], first),
            wire.doubles(_IN_TRIANGLES["vertices_m"], canopy.corners_m(first, end)),
            wire.uint32s(_IN_TRIANGLES["organ"], canopy.organ_of_triangle[first:end]),
            wire.uint32s(_IN_TRIANGLES["material"], canopy.material_of_triangle[first:end]),
        )


def _describe(canopy: Canopy, geometry: Any) -> None:
    geometry.triangles = len(canopy)
    geometry.organs = len(canopy.organ)
    for material in canopy.materials:
        kind = protocol.value("SceneMaterial.Kind", f"KIND_{material.kind.upper()}")
        geometry.materials.add(name=material.name, kind=kind, solid=material.solid)
    if canopy.pattern_m is not None:
        pattern = geometry.pattern
        pattern.min_x_m, pattern.min_y_m, pattern.max_x_m, pattern.max_y_m = canopy.pattern_m
    if canopy.soil_z_m is not None:
        geometry.soil_z_m = canopy.soil_z_m


def _light(message: Any, bands: Sequence[str], light: Light) -> None:
    if light.broadband and len(bands) > 1:
        raise InputError(
            f"light: expected what each of {', '.join(bands)} gets of ghi and dhi: a dict by band, or band_fraction"
        )
    for sources in light.sources:
        irradiances = sources.of_bands(bands).tolist()
        for (x, y, z), irradiance in zip(sources.directions.tolist(), irradiances):
            message.sources.add(direction_x=x, direction_y=y, direction_z=z, irradiance_W_m2=irradiance)
    if light.sky is not None:
        _sky(message.sky, light.sky)
        message.sky.irradiance_W_m2.extend(light.sky.of_bands(bands))
        message.sky.diffuse_fraction = 1.0


def _sky(message: Any, sky: Sky) -> None:
    number = cie_type(sky.kind)
    name = "cie" if number else {"clear": "cie_clear"}.get(sky.kind, sky.kind)
    radiance = getattr(message, name)
    radiance.SetInParent()
    if number:
        radiance.type = number
    if sky.towards_sun is not None:
        towards = radiance.towards_sun
        towards.x, towards.y, towards.z = sky.towards_sun
    if sky.kind == "perez":
        radiance.clearness, radiance.brightness = sky.clearness, sky.brightness


def _organs(canopy: Canopy) -> Iterator[bytes]:
    first, count = 0, len(canopy.organ)
    while first < count:
        end, size = first, 0
        while end < count and size < _ORGAN_BYTES:
            texts = (canopy.organ[end], canopy.plant[end], canopy.species[end])
            size += sum(4 * len(text) + 4 for text in texts)
            end += 1
        part = protocol.OrganSlice(
            first=first,
            id=canopy.organ[first:end],
            plant=canopy.plant[first:end],
            species=canopy.species[first:end],
        )
        yield protocol.SceneSlice(organs=part).SerializeToString()
        first = end
