"""CaribuScene, as pipelines call it."""

from __future__ import annotations

import sys
import types
from math import isnan

import pytest

from nestrad.caribu import CaribuScene

LOWER, UPPER = [(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 0, 1e-5), (1, 0, 1e-5), (0, 1, 1e-5)]
OTHER = [(1, 0, 0), (1, 1, 0), (0, 1, 0)]
SCENE = {"lower": [LOWER, OTHER], "upper": [UPPER]}
DOMAIN = (0, 0, 1, 1)


def near(expected, tolerance=0.01):
    return pytest.approx(expected, abs=tolerance)


def test_defaults():
    scene = CaribuScene()
    assert scene.scene is None
    assert scene.light == [(1, (0, 0, -1))]
    assert scene.pattern is None
    assert scene.material is None
    assert scene.soil_reflectance == {"default_band": 0.15}
    assert scene.run() == ({}, {})
    scene = CaribuScene(SCENE, pattern=((0, 0), (1, 1)), opt={"par": (0.3,)})
    assert scene.material == {"par": {"lower": (0.3,), "upper": (0.3,)}}
    assert scene.pattern == (0, 0, 1, 1)
    assert scene.bbox() == ((0, 0, 0), (1, 1, 1e-5))
    assert scene.triangle_areas().tolist() == [0.5, 0.5, 0.5]
    assert scene.auto_screen(0.01) == 141
    scene = CaribuScene(SCENE, soil_reflectance={"par": 0})
    assert scene.material["par"]["lower"] == (0.06, 0.07)


@pytest.mark.parametrize("ids", [("lower", "upper"), (0, 1)])
def test_raw_and_aggregated(ids):
    lower, upper = ids
    scene = CaribuScene({lower: [LOWER, OTHER], upper: [UPPER]}, pattern=DOMAIN)
    raw, aggregated = scene.run(direct=True, infinite=False, simplify=True)
    assert list(raw) == list(aggregated) == ["Eabs", "Ei", "area"]
    assert aggregated["area"] == {lower: near(1), upper: near(0.5)}
    assert aggregated["Ei"] == {lower: near(0.5), upper: near(1)}
    assert raw["Ei"] == {lower: [near(0), near(1)], upper: [near(1)]}
    assert aggregated["Eabs"][upper] == near(0.87)
    by_band, _ = scene.run(split_face=True)
    assert set(by_band) == {"default_band"}
    assert set(by_band["default_band"]) == {"Eabs", "Ei", "area", "Ei_sup", "Ei_inf"}


def test_a_null_triangle_does_not_count():
    null = [(1, 0, 0), (1, 0, 0), (0, 1, 0)]
    raw, aggregated = CaribuScene({"lower": [LOWER, null], "upper": [UPPER]}).run(simplify=True)
    assert aggregated["area"]["lower"] == near(0.5)
    assert aggregated["Ei"]["lower"] == near(0)
    assert isnan(raw["Ei"]["lower"][1])


def test_soil():
    scene = CaribuScene(SCENE, pattern=DOMAIN, soil_mesh=1)
    _, aggregated = scene.run(simplify=True)
    assert set(aggregated["Ei"]) == {"lower", "upper"}
    assert len(scene.soil) == len(scene.soil_raw["default_band"]["Ei"]) == 2
    soil = scene.soil_aggregated["default_band"]
    assert soil["area"] == near(1)
    assert scene.getSoilEnergy() == (soil["Ei"], soil["Ei"])
    # half a pattern of leaf above a soil
    scene = CaribuScene({0: [[(x, y, 0.5) for x, y, _ in LOWER]]}, pattern=DOMAIN, soil_mesh=1, z_soil=0)
    scene.run(infinite=True)
    assert scene.soil_aggregated["default_band"]["Ei"] == near(0.5)
    assert scene.soil_aggregated["default_band"]["Eabs"] == near(0.5 * 0.85)
    scene.run(direct=False, infinite=True)
    assert scene.soil_aggregated["default_band"]["Ei"] == near(0.55, 0.05)


def test_the_three_ways_have_equal_forms():
    optics = {"par": {"lower": (0.1,), "upper": (0.1,)}, "nir": {"lower": (0.5,), "upper": (0.5,)}}
    scene = CaribuScene(SCENE, pattern=DOMAIN, opt=optics)
    for ways in ({}, {"infinite": True}, {"direct": False}, {"direct": False, "infinite": True}):
        raw, aggregated = scene.run(**ways)
        assert list(raw) == list(aggregated) == ["par", "nir"]
        assert [len(raw["par"]["Eabs"][key]) for key in ("lower", "upper")] == [2, 1]
        assert raw["par"]["Eabs"]["upper"][0] == near(0.9, 0.02)
        assert raw["nir"]["Eabs"]["upper"][0] == near(0.5, 0.02)
        # one band is not simplified away where there are two
        assert list(scene.run(simplify=True, **ways)[0]) == ["par", "nir"]


def test_results_are_per_m2_whatever_the_unit():
    cm = {key: [[tuple(100 * x for x in p) for p in t] for t in triangles] for key, triangles in SCENE.items()}
    scene = CaribuScene(cm, pattern=(0, 0, 100, 100), scene_unit="cm", light=[(500, (0, 0, -1))])
    raw, _ = scene.run(simplify=True)
    assert sum(raw["area"]["lower"]) == near(1)
    assert raw["Ei"]["upper"] == [near(500, 2)]
    assert scene.triangle_areas().sum() == near(1.5)
    assert scene.triangle_areas(convert=False).sum() == near(1.5e4)
    assert scene.getIncidentEnergy() == (500, 500, near(500))


def test_incident_energy():
    scene = CaribuScene(light=[(100, (0, 0, -1)), (50, (0, 1, -1))])
    assert scene.getIncidentEnergy() == (150, pytest.approx(100 + 50 * 2**0.5), None)


def test_files(tmp_path):
    names = {
        "leaf.can": "# a leaf and a stem\np 1 100001001000 3 0 0 1 1 0 1 0 1 1\n"
        "p 2 100001000000 7 4 0 0 0 1 0 0 1 1 0 0 1 0\n",
        "par.opt": "n 1\ns d 0.2\ne d 0.13 d 0.06 0.07 d 0.06 0.07\n",
        "sky.light": "60 0 0 -1\n40 0.1 0 -1\n",
        "a.8": "-1 -1\n2 2\n",
    }
    for name, text in names.items():
        (tmp_path / name).write_text(text)
    scene = CaribuScene(
        str(tmp_path / "leaf.can"),
        str(tmp_path / "sky.light"),
        str(tmp_path / "a.8"),
        [str(tmp_path / "par.opt")],
    )
    leaf, stem = "100001001000", "100001000000"
    assert {key: len(triangles) for key, triangles in scene.scene.items()} == {leaf: 1, stem: 2}
    assert scene.material == {"par": {leaf: (0.06, 0.07, 0.06, 0.07), stem: (0.13,)}}
    assert scene.soil_reflectance == {"par": 0.2}
    assert scene.pattern == (-1, -1, 2, 2)
    _, aggregated = scene.run(infinite=True, simplify=True)
    assert aggregated["Ei"][leaf] == near(100, 1)
    (tmp_path / "bad.can").write_text("p 1 1 3 0 0\n")
    with pytest.raises(ValueError, match=r"bad.can:1: expected a polygon"):
        CaribuScene(str(tmp_path / "bad.can"))
    with pytest.raises(ValueError, match=r"no\.can: expected a file"):
        CaribuScene(str(tmp_path / "no.can"))


class TriangleSet:
    """As PlantGL has it."""

    pointList = ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0))
    indexList = ((0, 1, 2), (0, 2, 3))


class QuadSet(TriangleSet):
    indexList = ((0, 1, 2, 3),)


class Shape:
    def __init__(self, geometry):
        self.geometry = geometry


class Sphere:
    """Not made of triangles before PlantGL has looked at it."""

    def apply(self, tesselator):
        tesselator.result = TriangleSet()


def test_scenes_of_plantgl_and_mtgs_are_known_by_their_methods(monkeypatch):
    class Plantgl:
        def todict(self):
            return {4: [Shape(TriangleSet()), Shape(QuadSet())], 7: [Shape(TriangleSet())]}

    class Mtg:
        def property(self, name):
            assert name == "geometry"
            return {3: TriangleSet(), 5: [Shape(QuadSet())]}

    assert {key: t.shape for key, t in CaribuScene(Plantgl()).scene.items()} == {4: (4, 3, 3), 7: (2, 3, 3)}
    assert {key: t.shape for key, t in CaribuScene(Mtg()).scene.items()} == {3: (2, 3, 3), 5: (2, 3, 3)}
    _, aggregated = CaribuScene(Mtg()).run(simplify=True)
    assert set(aggregated["Eabs"]) == {3, 5}
    with pytest.raises(ValueError, match="expected triangles, or PlantGL"):
        CaribuScene({1: Sphere()})
    for name in ("openalea", "openalea.plantgl", "openalea.plantgl.all"):
        monkeypatch.setitem(sys.modules, name, types.ModuleType(name))
    sys.modules["openalea.plantgl.all"].Tesselator = type("Tesselator", (), {})
    assert CaribuScene({1: Sphere()}).scene[1].shape == (2, 3, 3)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"scene": 3}, "scene: expected a dict"),
        ({"scene": {}}, "scene: expected at least one triangle"),
        ({"scene": SCENE, "scene_unit": "ft"}, "scene_unit: expected one of"),
        ({"scene": SCENE, "opt": (0.1, 0.1)}, "opt: expected"),
        ({"scene": SCENE, "soil_reflectance": 0.2}, "soil_reflectance: expected a dict by band"),
        (
            {"scene": SCENE, "opt": {"a": (0.1,)}, "soil_reflectance": {"b": 1}},
            "soil_reflectance: expected a value for each of a",
        ),
        ({"scene": SCENE, "soil_mesh": 1}, "soil_mesh: expected a pattern"),
        ({"scene": SCENE, "soil_mesh": 2, "pattern": DOMAIN}, "soil_mesh: expected None, -1 or 1, found 2"),
        ({"scene": SCENE, "light": 3}, "light: expected"),
        ({"scene": {"a": [[(0, 0), (1, 1), (2, 2)]]}}, r"scene\['a'\]: expected shape \(n, 3, 3\), found \(1, 3, 2\)"),
    ],
)
def test_what_cannot_be_is_named(arguments, words):
    with pytest.raises(ValueError, match=words):
        CaribuScene(**arguments)


def test_runs_that_cannot_be_are_named():
    scene = CaribuScene(SCENE)
    with pytest.raises(ValueError, match="infinite: expected a pattern"):
        scene.run(infinite=True)
    with pytest.raises(ValueError, match="getSoilEnergy: expected a scene with soil_mesh=1"):
        scene.getSoilEnergy()
    with pytest.raises(NotImplementedError, match="sensors"):
        scene.run(sensors={"a": [LOWER]})
    with pytest.raises(NotImplementedError, match="plot"):
        scene.plot()
    with pytest.raises(ValueError, match=r"opt\['a'\]: expected a material for 'upper'"):
        CaribuScene(SCENE, opt={"a": {"lower": (0.1,)}}).run()
