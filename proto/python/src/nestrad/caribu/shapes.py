"""Scenes of other packages as triangles: dicts of lists, PlantGL scenes, MTGs, triangle sets. By their methods alone,
so that none of these packages has to be there."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ..arrays import Floats, floats
from ..errors import InputError

_EXPECTED = (
    "expected a dict {id: [triangle, ...]}, the path of a .can file, a PlantGL scene, an MTG with the property "
    "geometry, or a triangle set"
)


def triangles_by_id(scene: Any) -> dict[Any, Floats]:
    """The triangles of each primitive, (n, 3, 3), in the unit of the scene."""
    if isinstance(scene, Mapping):
        found = {key: _triangles(f"scene[{key!r}]", value) for key, value in scene.items()}
    elif hasattr(scene, "property"):
        geometry = scene.property("geometry")
        found = {key: _triangles(f"geometry of vertex {key!r}", value) for key, value in geometry.items()}
    elif hasattr(scene, "todict"):
        found = {}
        for key, shapes in scene.todict().items():
            parts = [_triangles(f"shape {key!r}", shape) for shape in shapes]
            found[key] = np.concatenate(parts) if parts else np.empty((0, 3, 3))
    elif hasattr(scene, "keys") and hasattr(scene, "__getitem__"):
        keys = list(scene.keys())
        found = {key: _triangles(f"scene[{key!r}]", scene[key]) for key in keys}
    else:
        raise InputError(f"scene: {_EXPECTED}, found {type(scene).__name__}")
    if not any(len(triangles) for triangles in found.values()):
        raise InputError("scene: expected at least one triangle, found none")
    return found


def _triangles(place: str, value: Any) -> Floats:
    if isinstance(value, (list, tuple, np.ndarray)):
        if len(value) and not isinstance(value[0], (list, tuple, np.ndarray)):
            return np.concatenate([_triangles(place, shape) for shape in value])
        return floats(place, value, ("n", 3, 3)) if len(value) else np.empty((0, 3, 3))
    geometry = getattr(value, "geometry", value)
    if not hasattr(geometry, "indexList"):
        geometry = _tesselated(place, geometry)
    return _of_faces(place, geometry)


def _of_faces(place: str, geometry: Any) -> Floats:
    """Faces of three corners or more, as fans."""
    points = floats(place, [(p[0], p[1], p[2]) for p in geometry.pointList], ("v", 3))
    corners = [
        (face[0], face[k], face[k + 1])
        for face in (list(index) for index in geometry.indexList)
        for k in range(1, len(face) - 1)
    ]
    return points[np.array(corners, np.int64).reshape(-1, 3)]


def _tesselated(place: str, geometry: Any) -> Any:
    """A smooth shape as triangles, which PlantGL makes."""
    try:
        from openalea.plantgl.all import Tesselator
    except ImportError:
        raise InputError(
            f"{place}: expected triangles, or PlantGL to make them of a {type(geometry).__name__}"
        ) from None
    tesselator = Tesselator()
    geometry.apply(tesselator)
    return tesselator.result
