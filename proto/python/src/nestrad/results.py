"""What comes of a solve."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any, NamedTuple

from . import page
from .tables import OrganTable, SoilTable, TriangleTable, package

if TYPE_CHECKING:
    import pandas as pd


class Quantity(NamedTuple):
    """A value and one standard error of it, in one unit."""

    value: float
    se: float


@dataclass(frozen=True)
class BandBalance:
    """Where the energy of a band goes, W per pattern, or per canopy where there is none."""

    #: what the sources bring
    incoming_W: float
    #: absorbed by leaves and stems
    absorbed_plants_W: Quantity
    absorbed_leaves_W: Quantity
    absorbed_stems_W: Quantity
    absorbed_structures_W: Quantity
    absorbed_soil_W: Quantity
    #: leaves to the sky
    escaped_up_W: Quantity
    #: leaves into the void where there is no soil
    escaped_down_W: Quantity
    #: what the others do not account for
    closure_W: Quantity
    #: absorbed, by material
    materials_W: Mapping[str, Quantity]
    #: one standard error of the absorbed power per area of organs, rms, percent of the mean; None: nothing is absorbed
    organ_error_percent: float | None


class Balance(Mapping[str, BandBalance]):
    """The energy balance of every band, by its name."""

    def __init__(self, bands: Mapping[str, BandBalance]) -> None:
        self._bands = dict(bands)

    def __getitem__(self, band: str) -> BandBalance:
        return self._bands[band]

    def __iter__(self) -> Iterator[str]:
        return iter(self._bands)

    def __len__(self) -> int:
        return len(self._bands)

    def rows(self) -> Iterator[tuple[str, str, float, float]]:
        """Band, term, W, and one standard error in W."""
        for band, balance in self._bands.items():
            yield band, "incoming", balance.incoming_W, 0.0
            for item in fields(balance):
                term = getattr(balance, item.name)
                if isinstance(term, Quantity):
                    yield band, item.name.removesuffix("_W"), term.value, term.se

    def to_pandas(self) -> pd.DataFrame:
        """One line per band and term. Needs pandas."""
        columns = ["band", "term", "power_W", "power_se_W"]
        frame: pd.DataFrame = package("pandas").DataFrame(list(self.rows()), columns=columns)
        return frame

    def __repr__(self) -> str:
        return "\n".join(f"{b:8} {t:20} {v:12.5g} W +- {s:.2g}" for b, t, v, s in self.rows())

    def _repr_html_(self) -> str:
        return page.balance(list(self), self.rows())


@dataclass(frozen=True)
class Cost:
    """What a solve took."""

    wall_s: float
    #: processor seconds of all threads of the master
    cpu_s: float
    #: seconds of each stage
    stages_s: Mapping[str, float]


@dataclass(frozen=True, repr=False)
class CanopyLight:
    """The light of a canopy: tables of organs, triangles and soil, the energy balance, and what is odd.

    Attributes:
        organs: one row per organ.
        triangles: one row per triangle; None where it was not asked for.
        soil: one row per cell of the soil plane; None where there is none.
        balance: the energy balance of every band. Look at it first.
        warnings: what is odd about the scene or the solve, a sentence each.
        plan: what was computed and why, a line each.
        cost: the time that it took.
    """

    organs: OrganTable
    triangles: TriangleTable | None
    soil: SoilTable | None
    balance: Balance
    warnings: tuple[str, ...]
    plan: tuple[str, ...]
    cost: Cost

    @property
    def bands(self) -> tuple[str, ...]:
        """The names of the bands."""
        return self.organs.bands

    def __repr__(self) -> str:
        shares = []
        for band, terms in self.balance.items():
            part = terms.absorbed_plants_W.value / terms.incoming_W if terms.incoming_W else 0.0
            shares.append(f"{band} {100 * part:.1f} % absorbed by plants")
        more = f", {len(self.warnings)} warnings" if self.warnings else ""
        return f"<nestrad.CanopyLight: {len(self.organs)} organs; {', '.join(shares)}{more}>"

    def _repr_html_(self) -> str:
        return page.light(self.balance._repr_html_(), self.organs, self.warnings)


def balance_of(summary: Any) -> Balance:
    """The balance in a summary of the master."""

    def quantity(sent: Any) -> Quantity:
        return Quantity(sent.value, sent.se)

    def band(sent: Any) -> BandBalance:
        terms = {
            item.name: quantity(getattr(sent, item.name)) for item in fields(BandBalance) if item.type == "Quantity"
        }
        error = sent.organ_error_percent if sent.HasField("organ_error_percent") else None
        materials = {m.name: quantity(m.absorbed_W) for m in sent.materials}
        return BandBalance(incoming_W=sent.incoming_W, materials_W=materials, organ_error_percent=error, **terms)

    return Balance({sent.band: band(sent) for sent in summary.bands})
