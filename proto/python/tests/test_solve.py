"""From arrays to arrays."""

import sys
import time
from types import SimpleNamespace

import numpy as np
import pytest
from conftest import OPTICS, ribbons, small_canopy

import nestrad
from nestrad import InputError, LimitError
from nestrad.progress import Bar


@pytest.fixture(scope="module")
def found():
    light = nestrad.clear_sky("2026-06-21T10:00Z", 45.0, 3.0, ghi={"PAR": 400, "NIR": 380}, dhi={"PAR": 80, "NIR": 60})
    return nestrad.solve(small_canopy(), OPTICS, light, accuracy=2)


def test_columns_have_the_shapes_that_they_say(found):
    canopy = small_canopy()
    organs, triangles, soil = found.organs, found.triangles, found.soil
    assert found.bands == organs.bands == ("PAR", "NIR")
    assert (organs.species, organs.plant, organs.organ) == (canopy.species, canopy.plant, canopy.organ)
    assert set(organs.kind) == {"leaf"}
    for table, rows in ((organs, 20), (triangles, 240), (soil, soil.cells_x * soil.cells_y)):
        assert len(table) == rows
        for name, column in table.band("NIR").items():
            assert (column == getattr(table, name)[:, 1]).all()
            assert column.shape == (rows,)
            assert np.isfinite(column).all()
    assert soil.map_W_m2("PAR").shape == (soil.cells_y, soil.cells_x)
    assert soil.x_m.min() == pytest.approx(soil.cell_x_m / 2)
    assert soil.y_m.max() == pytest.approx(0.8 - soil.cell_y_m / 2)
    with pytest.raises(InputError, match="band: expected one of PAR, NIR, found 'UV'"):
        organs.band("UV")


def test_organs_are_the_sums_of_their_triangles(found):
    triangles, organs = found.triangles, found.organs
    power_W = triangles.absorbed_W_m2 * triangles.area_m2[:, None]
    sums_W = np.stack([np.bincount(triangles.organ_index, column) for column in power_W.T], axis=1)
    assert sums_W == pytest.approx(organs.absorbed_W, rel=1e-9)
    area_m2 = np.bincount(triangles.organ_index, triangles.area_m2)
    assert area_m2 == pytest.approx(organs.area_m2, rel=1e-9)
    corners = small_canopy().corners_m()
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert triangles.area_m2 == pytest.approx(0.5 * np.linalg.norm(cross, axis=1), rel=1e-6)


def test_the_balance_closes(found):
    for band, terms in found.balance.items():
        out_W = terms.absorbed_plants_W.value + terms.absorbed_soil_W.value + terms.escaped_up_W.value
        assert terms.incoming_W == pytest.approx({"PAR": 400, "NIR": 380}[band] * 1.5 * 0.8, rel=1e-9)
        assert abs(terms.incoming_W - out_W) < 0.02 * terms.incoming_W
        assert terms.absorbed_plants_W.value == pytest.approx(found.organs.band(band)["absorbed_W"].sum(), rel=1e-9)
        assert set(terms.materials_W) == {"leaf", "dry leaf"}
        assert 0 < terms.organ_error_percent < 2
    assert any(line.startswith("exchange") for line in found.plan)
    assert found.cost.wall_s > 0


def test_tables_become_those_of_pandas_and_xarray(found):
    pytest.importorskip("pandas")
    frame = found.organs.to_pandas()
    assert list(frame.columns[:6]) == ["species", "plant", "organ", "kind", "area_m2", "band"]
    assert len(frame) == 40
    assert frame.absorbed_W.to_numpy().reshape(20, 2).tolist() == found.organs.absorbed_W.tolist()
    frame = found.triangles.to_pandas()
    assert list(frame.columns[:7]) == ["triangle", "species", "plant", "organ", "kind", "area_m2", "band"]
    assert len(frame) == 480
    assert frame.plant.tolist() == np.repeat(ribbons()[2], 2).tolist()
    assert len(found.soil.to_pandas()) == 2 * len(found.soil)
    assert set(found.balance.to_pandas().band) == {"PAR", "NIR"}
    pytest.importorskip("xarray")
    data = found.organs.to_xarray()
    assert data.absorbed_W.dims == ("organ", "band")
    assert data.absorbed_W.attrs["units"] == "W"
    assert data.irradiance_upper_W_m2.attrs["units"] == "W m-2"
    assert data.absorbed_W.sel(band="NIR").to_numpy().tolist() == found.organs.absorbed_W[:, 1].tolist()
    assert found.triangles.to_xarray().area_m2.attrs["units"] == "m2"


def test_a_notebook_has_something_to_show(found):
    text = found._repr_html_()
    assert text.count("<table>") == 2
    assert "absorbed plants" in text
    assert "plant0" in text
    assert "20 organs" in repr(found)
    assert "absorbed_W" in repr(found.organs)
    assert "incoming" in repr(found.balance)
    assert "240 triangles" in repr(small_canopy())


def test_a_package_that_is_missing_is_named(found, monkeypatch):
    def missing(name):
        raise ImportError(name)

    monkeypatch.setattr("importlib.import_module", missing)
    with pytest.raises(nestrad.NestradError, match=r"pandas is not installed: .*pip install 'nestrad\[pandas\]'"):
        found.organs.to_pandas()


def test_the_same_input_gives_the_same_bits(canopy, sun):
    first, second = (nestrad.solve(canopy, OPTICS, sun, accuracy=2) for _ in range(2))
    assert (first.triangles.absorbed_W_m2 == second.triangles.absorbed_W_m2).all()
    other = nestrad.solve(canopy, OPTICS, sun, accuracy=2, seed=7)
    assert (first.triangles.absorbed_W_m2 != other.triangles.absorbed_W_m2).any()
    by_rays = nestrad.solve(canopy, OPTICS, sun, accuracy=2, estimator="rays")
    whole = first.organs.absorbed_W.sum(0)
    assert by_rays.organs.absorbed_W.sum(0) == pytest.approx(whole, rel=0.02)


def test_triangles_can_be_left_out(canopy, sun):
    assert nestrad.solve(canopy, OPTICS, sun, accuracy=5, triangles=False).triangles is None


def test_a_canopy_without_soil_has_no_map_of_it():
    canopy = nestrad.Canopy(np.array([[[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]]))
    found = nestrad.solve(canopy, {"PAR": 0.1}, nestrad.sun(100, elevation=90))
    assert found.soil is None
    assert found.organs.absorbed_W == pytest.approx(np.array([[45.0]]), rel=0.01)
    assert found.balance["PAR"].escaped_up_W.value > 0


def test_a_triangle_without_area_has_no_light():
    vertices = np.array([[[0.0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 0, 1], [0, 0, 1], [0, 1, 1]]])
    found = nestrad.solve(nestrad.Canopy(vertices), {"PAR": 0.1}, nestrad.sun(100, elevation=90))
    assert found.triangles.area_m2[1] == 0
    assert found.triangles.absorbed_W_m2[1] == 0
    assert any("without area" in warning or "no area" in warning for warning in found.warnings)


def test_progress_comes_to_a_function(canopy, sun):
    seen = []
    nestrad.solve(canopy, OPTICS, sun, accuracy=2, progress=seen.append)
    assert all(isinstance(now, nestrad.Progress) for now in seen)
    assert any(now.plan for now in seen)
    assert seen


@pytest.mark.parametrize("has_tqdm", [True, False])
def test_progress_is_shown_and_taken_away(capfd, monkeypatch, has_tqdm):
    if has_tqdm:
        pytest.importorskip("tqdm")
    else:
        # Python takes this for a package that is not there
        monkeypatch.setitem(sys.modules, "tqdm.auto", None)
    messages = [("", 0, 0, 2), ("plan", 0, 0, 0), *(("exchange", done, 9, 0) for done in range(10))]
    with Bar(True) as bar:
        for stage, done, total, ahead in messages:
            bar.says(SimpleNamespace(stage=stage, done=done, total=total, ahead=ahead, plan=[]))
            if has_tqdm:
                # which shows nothing before
                time.sleep(0.05)
    shown = capfd.readouterr().err
    assert shown.endswith("\r")
    assert "exchange" in shown
    if not has_tqdm:
        for text in ("2 solves before this one", "plan", "exchange 9/9"):
            assert text in shown


def test_nothing_is_shown_where_nobody_looks(canopy, sun, capfd):
    assert not sys.stderr.isatty()
    nestrad.solve(canopy, OPTICS, sun, accuracy=2)
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"accuracy": 0}, "accuracy: expected a number above 0, found 0.0"),
        ({"accuracy": "high"}, "accuracy: expected a number above 0, found str 'high'"),
        ({"diameter": "wide"}, "diameter: expected metres, 'auto' or 'inf', found 'wide'"),
        ({"diameter": -1}, "diameter: expected a number above 0"),
        ({"seed": -1}, "seed: expected a whole number"),
        ({"estimator": "dots"}, "estimator: expected 'lines' or 'rays', found 'dots'"),
        ({"budget": True}, "budget: expected a number above 0, found bool True"),
    ],
)
def test_options_that_cannot_be_are_named(canopy, sun, options, words):
    with pytest.raises(InputError, match=words):
        nestrad.solve(canopy, OPTICS, sun, **options)


def test_errors_have_the_words_of_the_master(canopy):
    # a source that points up
    with pytest.raises(InputError, match="direction"):
        nestrad.solve(canopy, OPTICS, nestrad.sources([[0, 0, 1]], [100]))
    with pytest.raises(InputError, match="band"):
        nestrad.solve(canopy, {"": {"leaf": 0.1, "dry leaf": 0.1, "soil": 0.1}}, nestrad.sky(1))
    with pytest.raises(LimitError, match="GiB"):
        nestrad.solve(canopy, OPTICS, nestrad.sky(100), memory_GiB=1e-4)


def test_arguments_of_another_type_are_named(sun):
    with pytest.raises(InputError, match=r"canopy: expected a nestrad.Canopy, found ndarray"):
        nestrad.solve(np.zeros((1, 3, 3)), OPTICS, sun)
