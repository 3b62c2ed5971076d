"""The tables of a finished solve, as they come from a master."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np

from . import protocol, wire
from .arrays import Floats
from .canopy import Canopy
from .errors import MasterError
from .tables import OrganTable, SoilTable, TriangleTable, empty_organs, empty_triangles

#: gives the slices of a table, by the name of the table
Fetch = Callable[[str], Iterator[memoryview]]

_IN_SLICE = {name: protocol.number("ResultSlice", name) for name in ("organs", "triangles", "soil", "summary")}
_ITEM = (
    "irradiance_upper_W_m2",
    "irradiance_lower_W_m2",
    "absorbed_W",
    "absorbed_direct_W",
    "absorbed_se_W",
)
_ITEM_LISTS = {protocol.number("ItemLight", name): name for name in _ITEM}
_TRIANGLE_LISTS = {protocol.number("TriangleLight", "area_m2"): "area_m2"}
_TRIANGLE_LIGHT = protocol.number("TriangleLight", "light")
_TRIANGLE_FIRST = protocol.number("TriangleLight", "first")
_SOIL = ("irradiance_W_m2", "irradiance_se_W_m2")
_SOIL_LISTS = {protocol.number("SoilLight", name): name for name in _SOIL}
_MOST_CELLS = 1 << 24


def organs(fetch: Fetch, canopy: Canopy, bands: Sequence[str]) -> OrganTable:
    """The light of organs."""
    table = empty_organs(canopy, bands)
    at = 0
    for content in _contents(fetch, "organs"):
        part = protocol.message("OrganLight").FromString(content.tobytes())
        area_m2 = np.array(part.area_m2)
        end = _fits("organs", part.first, at, len(area_m2), len(table.area_m2))
        table.area_m2[at:end] = area_m2
        for name in _ITEM:
            getattr(table, name)[at:end] = _rows(getattr(part.light, name), bands)
        table.absorbed_bias_W[at:end] = _rows(part.absorbed_bias_W, bands)
        if part.sunlit_area_m2:
            table.sunlit_area_m2[at:end] = part.sunlit_area_m2
            table.sunlit_area_se_m2[at:end] = part.sunlit_area_se_m2
        at = end
    _complete("organs", at, len(table.area_m2))
    return table


def triangles(fetch: Fetch, canopy: Canopy, bands: Sequence[str]) -> TriangleTable:
    """The light of triangles, per m2."""
    table = empty_triangles(canopy, bands)
    # what comes in W goes out per m2
    columns = [getattr(table, name) for name in TriangleTable.per_band]
    at = 0
    for content in _contents(fetch, "triangles"):
        first, area_m2, light = _triangle_slice(content)
        end = _fits("triangles", first, at, len(area_m2), len(canopy))
        table.area_m2[at:end] = area_m2
        for name, column in zip(_ITEM, columns):
            column[at:end] = light[name].reshape(-1, len(bands))
        at = end
    _complete("triangles", at, len(canopy))
    without = table.area_m2 == 0.0
    per_m2 = np.where(without, 1.0, table.area_m2)[:, None]
    for name, column in zip(_ITEM, columns):
        if not name.endswith("_W_m2"):
            column /= per_m2
        if without.any():
            column[without] = 0.0
    return table


def _triangle_slice(content: memoryview) -> tuple[int, Floats, dict[str, Floats]]:
    first, area_m2, light = 0, np.empty(0), dict[str, Floats]()
    for number, field, inner in wire.fields(content):
        if number == _TRIANGLE_LIGHT and inner is not None:
            _, light = wire.split(inner, _ITEM_LISTS, protocol.message("ItemLight"))
        elif number in _TRIANGLE_LISTS and inner is not None:
            area_m2 = np.frombuffer(inner, "<f8")
        elif number == _TRIANGLE_FIRST:
            first = protocol.message("TriangleLight").FromString(field.tobytes()).first
    return first, area_m2, light


def soil(fetch: Fetch, bands: Sequence[str]) -> SoilTable | None:
    """The irradiance of the soil plane, if there is one."""
    table = None
    at = 0
    for content in _contents(fetch, "soil"):
        part, lists = wire.split(content, _SOIL_LISTS, protocol.SoilLight)
        if table is None:
            table = _empty_soil(part, bands)
        count = len(lists["irradiance_W_m2"]) // len(bands)
        end = _fits("soil", part.first, at, count, len(table.x_m))
        for name in _SOIL:
            getattr(table, name)[at:end] = lists[name].reshape(-1, len(bands))
        at = end
    if table is not None:
        _complete("soil", at, len(table.x_m))
    return table


def _empty_soil(part: Any, bands: Sequence[str]) -> SoilTable:
    cells = part.cells_x * part.cells_y
    if not 0 < cells <= _MOST_CELLS:
        raise MasterError(f"the master sent a map of {part.cells_x} x {part.cells_y} cells of soil")
    number = np.arange(cells)
    return SoilTable(
        tuple(bands),
        part.cells_x,
        part.cells_y,
        part.cell_x_m,
        part.cell_y_m,
        part.min_x_m + (number % part.cells_x + 0.5) * part.cell_x_m,
        part.min_y_m + (number // part.cells_x + 0.5) * part.cell_y_m,
        *(np.zeros((cells, len(bands))) for _ in _SOIL),
    )


def summary(fetch: Fetch) -> Any:
    """Balance, errors, plan and cost: a SolveSummary."""
    for content in _contents(fetch, "summary"):
        return protocol.SolveSummary.FromString(content.tobytes())
    raise MasterError("the master sent no summary")


def _contents(fetch: Fetch, table: str) -> Iterator[memoryview]:
    """What is in the slices of a table."""
    wanted = _IN_SLICE[table]
    for data in fetch(table):
        for number, _, content in wire.fields(data):
            if number != wanted or content is None:
                raise MasterError(f"the master sent another table than {table}")
            yield content


def _rows(values: Any, bands: Sequence[str]) -> Floats:
    return np.array(values, np.float64).reshape(-1, len(bands))


def _fits(table: str, first: int, at: int, count: int, rows: int) -> int:
    if first != at or at + count > rows:
        raise MasterError(f"the master sent {table} that do not fit the canopy")
    return at + count


def _complete(table: str, at: int, rows: int) -> None:
    if at != rows:
        raise MasterError(f"the master sent {at} of {rows} rows of {table}")
