"""A canopy: triangles, the organs and plants that they belong to, and what they are made of."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from . import arrays
from .errors import InputError

KINDS = ("leaf", "stem", "soil", "structure")
_MOST_TRIANGLES = 1 << 32


@dataclass(frozen=True)
class Material:
    """What triangles are made of. Its reflectance and transmittance stand in the optics of a solve."""

    name: str
    #: where the light that it absorbs is counted: leaf, stem, soil or structure
    kind: str
    #: whether it is the skin of something solid and opaque; None: true of a stem, false of all else
    solid: bool | None = None


class Canopy:
    """Triangles in metres, z up, with the organs and plants that they belong to. There is no light in it.

    Arrays of the right type are not copied: do not change them while the canopy is in use.

    Args:
        vertices: (v, 3) points in metres, or (n, 3, 3): the three corners of n triangles.
        triangles: (n, 3) whole numbers from 0 to v - 1, three vertices each. Left out for (n, 3, 3) vertices. The upper
            face of a triangle is the one from which its vertices are seen in counter-clockwise order.
        organ: the organ of each triangle, (n,) text or whole numbers, or one for all. Results are given for organs.
        plant: the plant of each triangle, (n,), or one for all.
        species: the species of each triangle, (n,), or one for all. Species, plant and organ together identify an
            organ.
        material: the material of each triangle, (n,), or one for all. `optics` has the values for each material.
        kind: what materials are: "leaf", "stem", "soil" or "structure" (a panel, a pot), one for all or a dict by
            material. Without it, a material that is called stem, soil or structure is that, and all others are leaves.
        solid: whether a material is the skin of something solid and opaque, a dict by material. Without it a stem is.
        pattern: (min x, min y, max x, max y) of the rectangle on which the canopy repeats without end, metres. None:
            the canopy stands alone.
        soil_z: the height of the soil plane, metres. None: there is no soil, and light escapes downwards.

    Raises:
        InputError: an array has another shape or type than expected, or numbers that are not finite.
    """

    def __init__(
        self,
        vertices: Any,
        triangles: Any = None,
        *,
        organ: Any = "canopy",
        plant: Any = "plant",
        species: Any = "",
        material: Any = "leaf",
        kind: str | Mapping[str, str] | None = None,
        solid: Mapping[str, bool] | None = None,
        pattern: Sequence[float] | None = None,
        soil_z: float | None = None,
    ) -> None:
        if triangles is None:
            shape = np.shape(vertices)
            if len(shape) == 2:
                raise InputError(
                    "triangles: expected (n, 3) numbers of vertices, or vertices of shape (n, 3, 3), "
                    f"found none, and vertices of shape {arrays.shape_text(shape)}"
                )
            corners = arrays.floats("vertices", vertices, ("n", 3, 3))
            self.vertices_m = corners.reshape(-1, 3)
            self.triangles = None
            count = len(corners)
        else:
            self.vertices_m = arrays.floats("vertices", vertices, ("v", 3))
            self.triangles = arrays.indices("triangles", triangles, ("n", 3), len(self.vertices_m), "vertices")
            count = len(self.triangles)
        if not 0 < count < _MOST_TRIANGLES:
            raise InputError(f"triangles: expected 1 to 4294967295, found {count}")
        self._count = count
        self._name_organs(species, plant, organ)
        self.material_of_triangle, names = arrays.labels("material", material, count, "triangles")
        self.materials = _materials(names, kind, solid or {})
        self.pattern_m = None if pattern is None else _pattern(pattern)
        self.soil_z_m = None if soil_z is None else arrays.number("soil_z", soil_z)

    def _name_organs(self, species: Any, plant: Any, organ: Any) -> None:
        count = self._count
        of_species, species_names = arrays.labels("species", species, count, "triangles")
        of_plant, plant_names = arrays.labels("plant", plant, count, "triangles")
        of_organ, organ_names = arrays.labels("organ", organ, count, "triangles")
        if len(species_names) == 1 and len(plant_names) == 1:
            self.organ_of_triangle = of_organ
            firsts = np.arange(len(organ_names))
            codes = np.stack([0 * firsts, 0 * firsts, firsts])
        else:
            together = of_species.astype(np.uint64) * np.uint64(len(plant_names)) + of_plant
            together = together * np.uint64(len(organ_names)) + of_organ
            self.organ_of_triangle, _ = arrays.labels("organ", together, count, "triangles")
            _, first = np.unique(self.organ_of_triangle, return_index=True)
            codes = np.stack([of_species[first], of_plant[first], of_organ[first]])
        #: one text per organ: its species, its plant, and how it is called there
        self.species = [species_names[code] for code in codes[0].tolist()]
        self.plant = [plant_names[code] for code in codes[1].tolist()]
        self.organ = [organ_names[code] for code in codes[2].tolist()]

    def __len__(self) -> int:
        """The number of triangles."""
        return self._count

    def corners_m(self, first: int = 0, end: int | None = None) -> arrays.Floats:
        """The corners of the triangles from `first` to `end`, (n, 3, 3), metres."""
        end = self._count if end is None else end
        if self.triangles is None:
            return self.vertices_m[3 * first : 3 * end].reshape(-1, 3, 3)
        return self.vertices_m[self.triangles[first:end]]

    def organ_kinds(self) -> list[str]:
        """The kind of each organ: leaf, stem, soil or structure, or mixed where its triangles are of several."""
        kind_of_material = np.array([KINDS.index(m.kind) for m in self.materials])
        kind = kind_of_material[self.material_of_triangle]
        least = np.full(len(self.organ), len(KINDS))
        most = np.full(len(self.organ), -1)
        np.minimum.at(least, self.organ_of_triangle, kind)
        np.maximum.at(most, self.organ_of_triangle, kind)
        return [KINDS[a] if a == b else "mixed" for a, b in zip(least.tolist(), most.tolist())]

    def __repr__(self) -> str:
        names = ", ".join(material.name for material in self.materials[:6])
        more = ", ..." if len(self.materials) > 6 else ""
        pattern = f", pattern {self.pattern_m} m" if self.pattern_m else ""
        soil = f", soil at {self.soil_z_m} m" if self.soil_z_m is not None else ""
        return (
            f"<nestrad.Canopy: {self._count} triangles, {len(self.organ)} organs, "
            f"materials {names}{more}{pattern}{soil}>"
        )


def _materials(
    names: list[str], kind: str | Mapping[str, str] | None, solid: Mapping[str, bool]
) -> tuple[Material, ...]:
    if isinstance(kind, str):
        kind = dict.fromkeys(names, kind)
    kinds = {name: name if name in KINDS else "leaf" for name in names} | dict(kind or {})
    for argument, given in (("kind", kinds), ("solid", solid)):
        for name in given:
            if name not in names:
                raise InputError(f"{argument}: expected materials of the canopy ({', '.join(names)}), found {name!r}")
    for name, of_name in kinds.items():
        if of_name not in KINDS:
            raise InputError(f"kind of {name}: expected {', '.join(KINDS)}, found {of_name!r}")
    return tuple(Material(name, kinds[name], solid.get(name)) for name in names)


def _pattern(given: Sequence[float]) -> tuple[float, float, float, float]:
    x0, y0, x1, y1 = arrays.floats("pattern", given, (4,)).tolist()
    if not (x0 < x1 and y0 < y1):
        raise InputError(f"pattern: expected (min x, min y, max x, max y) with min below max, found {(x0, y0, x1, y1)}")
    return x0, y0, x1, y1
