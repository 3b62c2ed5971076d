"""What CARIBU's own tests assert of its functions. Values there are rounded to whole numbers.

Light straight from the sources is met within 0.5 of 100, scattered light within 1; where CARIBU's layers are no true
geometry, the tolerance says so.
"""

from __future__ import annotations

from math import isnan, sqrt

import pytest

from nestrad.caribu import (
    mixed_radiosity,
    radiosity,
    raycasting,
    x_mixed_radiosity,
    x_radiosity,
    x_raycasting,
)

ZENITH = [(100, (0, 0, -1))]
ROOT = sqrt(2)
LEAF = (0.06, 0.04)


def at(z: float, flipped: bool = False) -> list[tuple[float, float, float]]:
    corners = [(0.0, 0.0, z), (ROOT, 0.0, z), (0.0, ROOT, z)]
    return corners[::-1] if flipped else corners


def near(expected, tolerance=0.5):
    return pytest.approx(expected, abs=tolerance)


@pytest.mark.parametrize(
    ("material", "flipped", "ei", "eabs"),
    [
        (LEAF, False, 100, 90),
        (LEAF, True, 100, 90),
        ((0.1,), False, 100, 90),
        # CARIBU answers -1 for the faces of these
        ((0.05, 0.05), False, 100, 90),
        ((0.05, 0.01, 0.01, 0.05), False, 100, 94),
        ((0.5, 0), False, 100, 50),
        ((1, 0), False, 100, 0),
        ((0.1, 0, 0.2, 0), False, 100, 90),
        ((0.1, 0, 0.2, 0), True, 100, 80),
        # which CARIBU refuses
        ((0, 0), False, 100, 100),
        ((0,), True, 100, 100),
    ],
)
def test_a_triangle_under_the_zenith(material, flipped, ei, eabs):
    found = raycasting([at(0, flipped)], [material], ZENITH)
    upper, lower = (0, ei) if flipped else (ei, 0)
    assert found["Ei"] == near([ei])
    assert found["Eabs"] == near([eabs])
    assert found["Ei_sup"] == near([upper])
    assert found["Ei_inf"] == near([lower])
    assert found["area"] == pytest.approx([1.0])
    assert found["index"] == [0]
    assert len(found["label"]) == 1


def test_of_two_triangles_in_one_place_the_first_is_lit():
    for call in (raycasting, radiosity):
        found = call([at(0), at(0)], [LEAF] * 2, ZENITH)
        assert found["Ei"][0] == near(100)
        # what passes through the first one comes to the second
        assert found["Ei"][1] == near(0 if call is raycasting else 4, 0.6)


def test_triangles_side_by_side_are_both_lit():
    other = [(x + 5, y, z) for x, y, z in at(0)]
    for call in (raycasting, radiosity):
        assert call([at(0), other], [LEAF] * 2, ZENITH)["Ei"] == near([100, 100], 0.5 if call is raycasting else 1)


def test_the_upper_of_two_shades_the_lower():
    pair = [at(1e-5), at(0)]
    direct = raycasting(pair, [LEAF] * 2, ZENITH)
    assert direct["Ei"] == near([100, 0])
    assert direct["Eabs"] == near([90, 0])
    whole = radiosity(pair, [LEAF] * 2, ZENITH)
    assert whole["Ei"] == near([100, 4], 1)
    assert whole["Eabs"] == near([90, 3.6], 1)


@pytest.mark.parametrize("flipped", [(False, False), (True, False), (False, True), (True, True)])
def test_leaves_that_let_light_through(flipped):
    upper, lower = flipped
    found = radiosity([at(1e-5, upper), at(0, lower)], [(0.1, 0.2)] * 2, ZENITH)
    assert found["Ei"] == near([102, 20], 1)
    assert found["Eabs"] == near([71, 14], 1)
    above, below = [100, 20], [2, 0]
    sup = [b if turned else a for a, b, turned in zip(above, below, flipped)]
    inf = [a if turned else b for a, b, turned in zip(above, below, flipped)]
    assert found["Ei_sup"] == near(sup, 1)
    assert found["Ei_inf"] == near(inf, 1)


def test_an_opaque_leaf_below_one_that_lets_light_through():
    found = radiosity([at(1e-5), at(0)], [(0.1, 0.2), (0.1,)], ZENITH)
    assert found["Ei"] == near([102, 20], 1)


def test_the_corner_of_a_cube():
    o, x, y, z = (0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)
    faces = [[o, y, x], [o, x, z], [o, z, y], [x, y, z]]
    found = raycasting(faces, [(0.1,)] * 4, ZENITH)
    assert found["area"] == pytest.approx([0.5, 0.5, 0.5, 0.866], abs=1e-3)
    assert found["Ei"][:3] == near([0, 0, 0])
    assert found["Ei_sup"][3] == near(57.6)
    assert found["Eabs"][3] == near(51.84)


STACK = [at(0.25), at(0.25 + 1e-5), at(0.75), at(0.75 + 1e-5)]


def test_a_stack_of_four():
    found = radiosity(STACK, [LEAF] * 4, ZENITH)
    assert found["Ei"] == near([0, 0.1, 4, 100], 1)


@pytest.mark.parametrize(
    ("domain", "diameter", "caribu", "tolerance"),
    [
        # the layers of CARIBU know nothing of the shadow on the soil: its 20 of the lowest is 8 below a true leaf
        ((0, 0, ROOT, ROOT), 0, [4, 4, 4, 103], 7),
        ((0, 0, ROOT, ROOT), 0.1, [3, 2, 7, 101], 4),
        ((-10, -10, 10, 10), 0, [20, 20, 20, 120], 20),
        ((-10, -10, 10, 10), 0.1, [20, 1, 24, 101], 13),
    ],
)
def test_a_stack_of_four_without_end(domain, diameter, caribu, tolerance):
    found = mixed_radiosity(STACK, [LEAF] * 4, ZENITH, domain, 0.2, diameter, 2, 1)
    assert found["Ei"] == near(caribu, tolerance)
    # as in a scene of its own, but for what the soil and the neighbours send
    alone = radiosity(STACK, [LEAF] * 4, ZENITH)
    for ours, least in zip(found["Ei"], alone["Ei"]):
        assert ours > least - 1


@pytest.mark.parametrize(
    "domain",
    [(-2, -2, 2, 2), (-2, -2, 0, 2), (2, -2, 4, 2), (12, -2, 14, 2), (12, 12, 14, 14), (0.3, 0.3, 2.3, 2.3)],
)
def test_a_triangle_anywhere_on_the_domain(domain):
    found = raycasting([[(0, 1, 0), (0, 0, 0), (1, 0, 0)]], [LEAF], ZENITH, domain)
    assert found["area"] == pytest.approx([0.5])
    assert found["Ei_sup"] == near([100])
    assert found["Ei_inf"] == near([0])


def test_a_null_triangle_leaves_the_others_alone():
    null = [(0, 0, 2), (0, 0, 2), (1, 0, 2)]
    scene, materials = [null, at(0), at(-1)], [LEAF] * 3
    for found in (
        raycasting(scene, materials, ZENITH),
        raycasting(scene, materials, ZENITH, (-4, -4, 4, 4)),
        radiosity(scene, materials, ZENITH),
        mixed_radiosity(scene, materials, ZENITH, (-4, -4, 4, 4), 0.2, 1, 2, 1),
    ):
        assert found["area"] == pytest.approx([0, 1, 1])
        assert isnan(found["Ei"][0])
        # over the soil of an infinite scene, which sends 20 % back
        assert 99 < found["Ei"][1] < 120


@pytest.mark.parametrize(
    ("triangle", "direction"),
    [
        ([(0, 0, 0), (1, 0, 0), (0, 0, 1)], (0, 0, -1)),
        (at(0), (1, 0, 0)),
    ],
)
@pytest.mark.filterwarnings("ignore:lights.0. is horizontal")
def test_light_along_a_triangle_does_not_meet_it(triangle, direction):
    assert raycasting([triangle], [LEAF], [(100, direction)])["Ei"] == near([0])


def test_bands():
    materials = {"par": [(0.1,)] * 2, "nir": [(0.2,)] * 2}
    other = [(x + 5, y, z) for x, y, z in at(0)]
    scene = [at(0), other]
    domain = (-10, -10, 10, 10)
    soil = {"par": 0.0, "nir": 0.0}
    for found in (
        x_raycasting(scene, materials, ZENITH),
        x_radiosity(scene, materials, ZENITH),
        x_mixed_radiosity(scene, materials, ZENITH, domain, soil, 1, 2, 1),
    ):
        assert list(found) == ["par", "nir"]
        assert found["par"]["Eabs"] == near([90, 90], 1)
        assert found["nir"]["Eabs"] == near([80, 80], 1)
        assert set(found["par"]) == {"index", "label", "area", "Eabs", "Ei", "Ei_sup", "Ei_inf"}


def test_energies_pass_through_in_any_unit():
    for energy in (1e-6, 1.0, 2e6):
        found = raycasting([at(0)], [LEAF], [(energy, (0, 0, -1))])
        assert found["Ei"] == pytest.approx([energy], rel=5e-3)
    default = raycasting([at(0)], [LEAF])
    assert default["Ei"] == pytest.approx([1.0], rel=5e-3)
    dark = radiosity([at(0), at(1)], [LEAF] * 2, [(0, (0, 0, -1))])
    assert dark["Eabs"] == [0, 0]


def test_first_order_and_all_orders_agree_for_what_scatters_nothing():
    scene, materials = [at(0.5), at(0)], [(0, 0)] * 2
    lights = [(60, (0, 0, -1)), (40, (0.5, 0.2, -1))]
    first, whole = raycasting(scene, materials, lights), radiosity(scene, materials, lights)
    assert first["Eabs"] == near(whole["Eabs"], 1)


def test_errors_name_the_argument():
    with pytest.raises(ValueError, match="materials: expected one for each of 1 triangles, found 2"):
        raycasting([at(0)], [LEAF] * 2)
    with pytest.raises(ValueError, match="triangles: expected at least two for radiosity, found 1"):
        radiosity([at(0)], [LEAF])
    with pytest.raises(ValueError, match=r"materials of band 'band': expected \(rho,\)"):
        raycasting([at(0)], [(1, 2, 3)])
    with pytest.raises(ValueError, match="expected rho and tau of 0 or more with a sum of at most 1"):
        raycasting([at(0)], [(0.7, 0.7)])
    with pytest.raises(ValueError, match=r"lights\[0\]: expected a direction that points down"):
        raycasting([at(0)], [LEAF], [(1, (0, 0, 1))])
    with pytest.raises(ValueError, match=r"lights\[0\]: expected \(energy, \(x, y, z\)\)"):
        raycasting([at(0)], [LEAF], [(1, 2)])
    with pytest.raises(ValueError, match=r"domain: expected shape \(4,\)"):
        raycasting([at(0)], [LEAF], ZENITH, (0, 0, 1))
    with pytest.raises(NotImplementedError, match="sensors"):
        raycasting([at(0)], [LEAF], sensors=[at(1)])
