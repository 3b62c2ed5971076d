"""Results as a notebook shows them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape

from .tables import OrganTable

_MOST_ROWS = 8


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A table; what is in it is text."""
    cells = "".join(f"<th>{escape(name)}</th>" for name in head)
    lines = [f"<tr>{cells}</tr>"]
    lines += ("<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in row) + "</tr>" for row in rows)
    return f"<table>{''.join(lines)}</table>"


def balance(bands: Sequence[str], terms: Iterable[tuple[str, str, float, float]]) -> str:
    """The energy balance: a row per term, a column per band. The terms are band, term, W, and one standard error."""
    of_band: dict[str, dict[str, str]] = {}
    for band, term, value, se in terms:
        text = f"{value:.5g}" + (f" ± {se:.2g}" if se else "")
        of_band.setdefault(term.replace("_", " "), {})[band] = text
    head = ["W", *bands]
    return table(head, ([term, *(row[band] for band in bands)] for term, row in of_band.items()))


def light(balance_table: str, organs: OrganTable, warnings: Iterable[str]) -> str:
    """The balance, the first organs, and what is odd."""
    head = ["species", "plant", "organ", "area m2", *(f"{band} absorbed W" for band in organs.bands)]
    rows = []
    for i in range(min(len(organs), _MOST_ROWS)):
        names = [organs.species[i], organs.plant[i], organs.organ[i]]
        powers = [f"{value:.5g}" for value in organs.absorbed_W[i].tolist()]
        rows.append([*names, f"{organs.area_m2[i]:.4g}", *powers])
    more = len(organs) - len(rows)
    notes = [f"and {more} more organs"] if more else []
    notes += [f"warning: {warning}" for warning in warnings]
    text = "".join(f"<p>{escape(note)}</p>" for note in notes)
    return balance_table + table(head, rows) + text
