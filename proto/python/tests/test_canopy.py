"""Arrays are checked where they enter."""

import numpy as np
import pytest

import nestrad
from nestrad import InputError
from nestrad.optics import bands

POINTS = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]])
FACES = np.array([[0, 1, 2], [1, 3, 2]])


def test_indexed_meshes_and_corners_are_the_same_canopy():
    indexed = nestrad.Canopy(POINTS, FACES)
    corners = nestrad.Canopy(POINTS[FACES])
    assert len(indexed) == len(corners) == 2
    assert (indexed.corners_m() == corners.corners_m()).all()
    assert indexed.corners_m(1, 2).shape == (1, 3, 3)


def test_arrays_of_the_right_type_are_not_copied():
    vertices = np.zeros((5, 3, 3))
    vertices[:, 1, 0] = vertices[:, 2, 1] = 1
    assert np.shares_memory(nestrad.Canopy(vertices).vertices_m, vertices)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"vertices": POINTS}, r"triangles: expected \(n, 3\) numbers of vertices, .*found none, .*shape \(4, 3\)"),
        ({"vertices": POINTS.T, "triangles": FACES}, r"vertices: expected shape \(v, 3\), found \(3, 4\)"),
        ({"vertices": POINTS, "triangles": FACES.T}, r"triangles: expected shape \(n, 3\), found \(3, 2\)"),
        (
            {"vertices": POINTS, "triangles": FACES + 1},
            r"triangles\[1, 1\]: expected the number of one of 4 vertices, 0 to 3, found 4",
        ),
        ({"vertices": POINTS, "triangles": FACES * 1.0}, "triangles: expected whole numbers .*float64"),
        ({"vertices": [[0, 0], [1]], "triangles": FACES}, "vertices: expected numbers .*several lengths"),
        ({"vertices": [["a", "b", "c"]], "triangles": FACES}, "vertices: expected numbers"),
        ({"vertices": POINTS * np.nan, "triangles": FACES}, r"vertices\[0, 0\]: expected a finite number, found nan"),
        ({"vertices": np.zeros((0, 3, 3))}, "triangles: expected 1 to .*, found 0"),
        ({"vertices": POINTS, "triangles": FACES, "organ": [1]}, r"organ: expected shape \(2,\), found \(1,\)"),
        ({"vertices": POINTS, "triangles": FACES, "organ": [1.5, 2]}, "organ: expected text or whole numbers"),
        (
            {"vertices": POINTS, "triangles": FACES, "organ": [None, "a"]},
            "organ: expected text or whole numbers, found NoneType",
        ),
        (
            {"vertices": POINTS, "triangles": FACES, "kind": "twig"},
            "kind of leaf: expected leaf, stem, soil, structure, found 'twig'",
        ),
        (
            {"vertices": POINTS, "triangles": FACES, "kind": {"bark": "stem"}},
            r"kind: expected materials of the canopy \(leaf\), found 'bark'",
        ),
        (
            {"vertices": POINTS, "triangles": FACES, "pattern": (0, 0, 1)},
            r"pattern: expected shape \(4,\), found \(3,\)",
        ),
        ({"vertices": POINTS, "triangles": FACES, "pattern": (0, 0, -1, 1)}, "pattern: expected .*min below max"),
        ({"vertices": POINTS, "triangles": FACES, "soil_z": "low"}, "soil_z: expected a number, found str 'low'"),
    ],
)
def test_messages_name_the_argument_and_the_shape(arguments, words):
    with pytest.raises(InputError, match=words):
        nestrad.Canopy(**arguments)


def test_species_plant_and_organ_together_name_an_organ():
    vertices = np.repeat(POINTS[FACES[:1]], 5, 0)
    canopy = nestrad.Canopy(
        vertices,
        species=["maize", "maize", "bean", "bean", "maize"],
        plant=[2, 2, 2, 2, 1],
        organ=["b", "a", "b", "b", "b"],
    )
    names = list(zip(canopy.species, canopy.plant, canopy.organ))
    assert names == [("maize", "2", "b"), ("maize", "2", "a"), ("bean", "2", "b"), ("maize", "1", "b")]
    assert canopy.organ_of_triangle.tolist() == [0, 1, 2, 2, 3]


def test_materials_are_leaves_but_for_those_with_the_name_of_a_kind():
    vertices = np.repeat(POINTS[FACES[:1]], 4, 0)
    canopy = nestrad.Canopy(
        vertices, organ=[1, 1, 2, 3], material=["blade", "stem", "stem", "panel"], kind={"panel": "structure"}
    )
    assert [m.kind for m in canopy.materials] == ["leaf", "stem", "structure"]
    assert canopy.organ_kinds() == ["mixed", "stem", "structure"]


def test_optics_have_many_forms():
    canopy = nestrad.Canopy(POINTS, FACES, material=["blade", "stem"], soil_z=0.0)
    faces = {"upper": {"rho": 0.1, "tau": 0.2}, "lower": {"rho": 0.3}}
    found = bands(
        {
            "A": {"blade": (0.1, 0.2), "stem": 0.3, "soil": 0.15},
            "B": {"blade": (0.1, 0.2, 0.3, 0.4), "stem": {"rho": 0.3}, "soil": (0.2,)},
            "C": {"blade": faces, "stem": [0.3, 0], "soil": 0},
            "D": {"rho": 0.4, "tau": 0.1, "stem": 0.2, "soil": 1},
        },
        canopy,
    )
    stem = [0.3, 0, 0.3, 0]
    assert [band.name for band in found] == list("ABCD")
    assert [band.soil_albedo for band in found] == [0.15, 0.2, 0, 1]
    assert found[0].materials.tolist() == [[0.1, 0.2, 0.1, 0.2], stem]
    assert found[1].materials.tolist() == [[0.1, 0.2, 0.3, 0.4], stem]
    assert found[2].materials.tolist() == [[0.1, 0.2, 0.3, 0], stem]
    assert found[3].materials.tolist() == [[0.4, 0.1, 0.4, 0.1], [0.2, 0, 0.2, 0]]


@pytest.mark.parametrize(
    ("optics", "words"),
    [
        ({}, "optics: expected a dict with at least one band"),
        ({"A": {"leaf": 0.1}}, r"optics\['A'\]: expected the albedo of the soil plane"),
        ({"A": {"soil": 0.1}}, r"optics\['A'\]: expected the optics of material 'leaf'"),
        (
            {"A": {"leaf": 0.1, "laef": 0.1, "soil": 0.1}},
            r"optics\['A'\]: expected materials of the canopy \(leaf\) and soil, found 'laef'",
        ),
        (
            {"A": {"leaf": (0.6, 0.5), "soil": 0.1}},
            r"optics\['A'\]\['leaf'\]: expected rho and tau of 0 or more .* found rho 0.6 and tau 0.5",
        ),
        ({"A": {"leaf": (1, 2, 3), "soil": 0.1}}, r"optics\['A'\]\['leaf'\]: expected rho, \(rho, tau\)"),
        ({"A": {"leaf": "green", "soil": 0.1}}, r"optics\['A'\]\['leaf'\]: expected rho"),
    ],
)
def test_optics_that_cannot_be_are_named(optics, words):
    canopy = nestrad.Canopy(POINTS, FACES, soil_z=0.0)
    with pytest.raises(InputError, match=words):
        bands(optics, canopy)
