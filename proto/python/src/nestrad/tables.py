"""Tables of light: one row per organ, triangle or soil cell; columns with a value per band are (rows, bands)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
import numpy.typing as npt

from .arrays import Floats
from .canopy import Canopy
from .errors import InputError, NestradError

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr


Names = npt.NDArray[np.object_]


class Table:
    """What all tables can do."""

    bands: tuple[str, ...]
    _rows_are = "row"
    _labels: tuple[str, ...] = ()
    _per_row: tuple[str, ...] = ()
    #: the same, behind the columns of bands
    _sunlit: tuple[str, ...] = ()
    #: the names of the columns with a value per band
    per_band: ClassVar[tuple[str, ...]] = ()

    def __len__(self) -> int:
        """The number of rows."""
        return len(getattr(self, self.per_band[0]))

    def band(self, name: str) -> dict[str, Floats]:
        """The columns of one band, (rows,) each."""
        number = _band(self.bands, name)
        return {column: getattr(self, column)[:, number] for column in self.per_band}

    def to_pandas(self) -> pd.DataFrame:
        """One line per row and band. Needs pandas."""
        pandas = package("pandas")
        count = len(self.bands)
        columns: dict[str, Any] = {}
        if self._rows_are not in self._labels:
            columns[self._rows_are] = np.repeat(np.arange(len(self)), count)
        for name in (*self._labels, *self._per_row):
            columns[name] = np.repeat(np.asarray(getattr(self, name)), count)
        columns["band"] = np.tile(np.array(self.bands), len(self))
        for name in self.per_band:
            columns[name] = getattr(self, name).reshape(-1)
        for name in self._sunlit:
            columns[name] = np.repeat(getattr(self, name), count)
        frame: pd.DataFrame = pandas.DataFrame(columns)
        return frame

    def to_xarray(self) -> xr.Dataset:
        """A data set with the dimensions row and band, and units as attributes. Needs xarray."""
        xarray = package("xarray")
        rows = self._rows_are
        data: dict[str, Any] = {name: ((rows, "band"), getattr(self, name)) for name in self.per_band}
        data |= {name: ((rows,), getattr(self, name)) for name in (*self._per_row, *self._sunlit)}
        labels = {name: ((rows,), getattr(self, name)) for name in self._labels if name != rows}
        own = getattr(self, rows) if rows in self._labels else np.arange(len(self))
        found: xr.Dataset = xarray.Dataset(data, {rows: (rows, own), "band": list(self.bands), **labels})
        for name, variable in found.variables.items():
            unit = _unit(str(name))
            if unit:
                variable.attrs["units"] = unit
        return found

    def __repr__(self) -> str:
        columns = ", ".join((*self._labels, *self._per_row, *self.per_band, *self._sunlit))
        return f"<{type(self).__name__}: {len(self)} rows, bands {', '.join(self.bands)}; {columns}>"


@dataclass(repr=False)
class OrganTable(Table):
    """Light of organs. Irradiances are means over the face, per m2 of one-sided area; absorbed counts both faces."""

    bands: tuple[str, ...]
    species: list[str]
    plant: list[str]
    organ: list[str]
    #: leaf, stem, soil or structure; mixed for an organ of several
    kind: list[str]
    #: (n,), one-sided
    area_m2: Floats
    #: (n, bands), as all that follow
    irradiance_upper_W_m2: Floats
    irradiance_lower_W_m2: Floats
    absorbed_W: Floats
    #: the part that came straight from the sources
    absorbed_direct_W: Floats
    #: one standard error, of sampling
    absorbed_se_W: Floats
    #: the error that comes in addition: by elements, by directions of a sky, by the far field
    absorbed_bias_W: Floats
    #: (n,), one-sided area that the sun reaches on either side: the source, not of a sky, with the most light
    #: perpendicular to itself; NaN without one
    sunlit_area_m2: Floats
    #: (n,), one standard error of it
    sunlit_area_se_m2: Floats

    _rows_are = "organ"
    _labels = ("species", "plant", "organ", "kind")
    _per_row = ("area_m2",)
    _sunlit = ("sunlit_area_m2", "shaded_area_m2", "sunlit_area_se_m2")
    per_band: ClassVar[tuple[str, ...]] = (
        "irradiance_upper_W_m2",
        "irradiance_lower_W_m2",
        "absorbed_W",
        "absorbed_direct_W",
        "absorbed_se_W",
        "absorbed_bias_W",
    )

    @property
    def shaded_area_m2(self) -> Floats:
        """(n,), the area that the sun does not reach; NaN without a sun."""
        return np.maximum(self.area_m2 - self.sunlit_area_m2, 0.0)


@dataclass(repr=False)
class TriangleTable(Table):
    """Light of triangles, in the order of the input. Powers are per m2 of one-sided area; a triangle without area has
    none."""

    bands: tuple[str, ...]
    #: whose triangles they are
    canopy: Canopy
    #: (n,), one-sided
    area_m2: Floats
    #: (n, bands), as all that follow
    irradiance_upper_W_m2: Floats
    irradiance_lower_W_m2: Floats
    #: of both faces
    absorbed_W_m2: Floats
    #: the part that came straight from the sources
    absorbed_direct_W_m2: Floats
    #: one standard error, of sampling
    absorbed_se_W_m2: Floats

    _rows_are = "triangle"
    _labels = ("species", "plant", "organ", "kind")
    _per_row = ("area_m2",)
    per_band: ClassVar[tuple[str, ...]] = (
        "irradiance_upper_W_m2",
        "irradiance_lower_W_m2",
        "absorbed_W_m2",
        "absorbed_direct_W_m2",
        "absorbed_se_W_m2",
    )

    @property
    def organ_index(self) -> npt.NDArray[np.uint32]:
        """(n,), the number of the organ of each triangle: its row in the table of organs."""
        return self.canopy.organ_of_triangle

    @property
    def species(self) -> Names:
        """(n,), the species of each triangle."""
        return np.array(self.canopy.species, object)[self.organ_index]

    @property
    def plant(self) -> Names:
        """(n,), the plant of each triangle."""
        return np.array(self.canopy.plant, object)[self.organ_index]

    @property
    def organ(self) -> Names:
        """(n,), the organ of each triangle."""
        return np.array(self.canopy.organ, object)[self.organ_index]

    @property
    def kind(self) -> Names:
        """(n,), leaf, stem, soil or structure."""
        kinds = [material.kind for material in self.canopy.materials]
        return np.array(kinds, object)[self.canopy.material_of_triangle]


@dataclass(repr=False)
class SoilTable(Table):
    """Irradiance of the cells of the soil plane; cell (ix, iy) is row iy * cells_x + ix."""

    bands: tuple[str, ...]
    cells_x: int
    cells_y: int
    #: the extent of a cell
    cell_x_m: float
    cell_y_m: float
    #: (n,), the centre of each cell
    x_m: Floats
    y_m: Floats
    #: (n, bands)
    irradiance_W_m2: Floats
    #: one standard error
    irradiance_se_W_m2: Floats

    _rows_are = "cell"
    _per_row = ("x_m", "y_m")
    per_band: ClassVar[tuple[str, ...]] = ("irradiance_W_m2", "irradiance_se_W_m2")

    def map_W_m2(self, band: str) -> Floats:
        """The irradiance of a band as a map, (cells_y, cells_x)."""
        column = self.irradiance_W_m2[:, _band(self.bands, band)]
        return column.reshape(self.cells_y, self.cells_x)


def empty_organs(canopy: Canopy, bands: Sequence[str]) -> OrganTable:
    """A table to be filled."""
    rows, shape = len(canopy.organ), (len(canopy.organ), len(bands))
    columns = (np.zeros(shape) for _ in OrganTable.per_band)
    names = (canopy.species, canopy.plant, canopy.organ, canopy.organ_kinds())
    sunlit = (np.full(rows, np.nan) for _ in range(2))
    return OrganTable(tuple(bands), *names, np.zeros(rows), *columns, *sunlit)


def empty_triangles(canopy: Canopy, bands: Sequence[str]) -> TriangleTable:
    """A table to be filled."""
    shape = (len(canopy), len(bands))
    columns = (np.zeros(shape) for _ in TriangleTable.per_band)
    return TriangleTable(tuple(bands), canopy, np.zeros(len(canopy)), *columns)


def _band(bands: Sequence[str], name: str) -> int:
    if name not in bands:
        raise InputError(f"band: expected one of {', '.join(bands)}, found {name!r}")
    return list(bands).index(name)


def _unit(column: str) -> str:
    for ending, unit in (("_W_m2", "W m-2"), ("_W", "W"), ("_m2", "m2"), ("_m", "m")):
        if column.endswith(ending):
            return unit
    return ""


def package(name: str) -> Any:
    """A package that a call needs, and that is not always installed."""
    import importlib

    try:
        return importlib.import_module(name)
    except ImportError:
        raise NestradError(
            f"{name} is not installed: expected it for this call; pip install 'nestrad[{name}]'"
        ) from None
