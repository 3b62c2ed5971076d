"""Sun, skies and sums of them."""

from datetime import datetime, timedelta, timezone

import numpy as np
import pytest

import nestrad
from nestrad import InputError, protocol, upload
from nestrad.light import one_light
from nestrad.optics import bands

CANOPY = nestrad.Canopy(np.eye(3).reshape(1, 3, 3))


def header(light, optics=None):
    given = bands(optics or {"PAR": 0.1, "NIR": 0.2}, CANOPY)
    data = upload.header(CANOPY, given, one_light(light), "known")
    return protocol.SceneSlice.FromString(data).header


def test_the_published_example_of_the_sun_is_met():
    # table A5.1 of Reda & Andreas: zenith 50.11162, azimuth 194.34024, for 820 hPa and 11 degrees Celsius; at the
    # standard atmosphere refraction is 0.0036 degrees more
    found = nestrad.sun_position("2003-10-17T19:30:30Z", 39.742476, -105.1786)
    assert found.azimuth_deg == pytest.approx(194.34024, abs=3e-4)
    assert found.elevation_deg == pytest.approx(90 - 50.11162 + 0.0036, abs=4e-4)


def test_a_time_has_many_forms():
    utc = datetime(2026, 6, 21, 10, tzinfo=timezone.utc)
    times = [
        "2026-06-21T10:00Z",
        "2026-06-21 10:00:00",
        "2026-06-21T12:00+02:00",
        utc,
        utc.replace(tzinfo=None),
        utc.astimezone(timezone(timedelta(hours=5))),
        np.datetime64("2026-06-21T10:00"),
    ]
    found = {nestrad.sun_position(time, 45.0, 3.0) for time in times}
    assert len(found) == 1
    for bad in ("noon", "2026-06-21", 7, None, "2026-13-01T00:00Z"):
        with pytest.raises(InputError, match="time: expected a date and time"):
            nestrad.sun_position(bad, 45.0, 3.0)
    with pytest.raises(InputError, match="latitude: expected degrees from -90 to 90, found 91"):
        nestrad.sun_position(utc, 91, 0)
    with pytest.raises(InputError, match="year from 1961"):
        nestrad.sun_position("1903-01-01T00:00Z", 45, 0)


def test_a_list_of_sources_keeps_its_order():
    directions = [[0, 0, -1], [0.5, 0, -1]]
    light = nestrad.sources(directions, {"PAR": [1, 2], "NIR": [3, 4]})
    light += nestrad.sun({"PAR": 5, "NIR": 6}, elevation=30, azimuth=90)
    sent = header(light)
    assert [list(source.irradiance_W_m2) for source in sent.sources] == [[1, 3], [2, 4], [5, 6]]
    # the sun in the east: its light travels to the west
    last = sent.sources[2]
    assert last.direction_x == pytest.approx(-np.cos(np.pi / 6))
    assert last.direction_z == pytest.approx(-0.5)
    assert not sent.HasField("sky")


def test_lights_add_up():
    total = sum([nestrad.sun(100, elevation=40), nestrad.sky(50)])
    assert header(total) == header([nestrad.sun(100, elevation=40), nestrad.sky(50)])
    assert list(header(total).sky.irradiance_W_m2) == [50, 50]
    with pytest.raises(InputError, match="light: expected at most one sky in a sum, found two"):
        nestrad.sky(1) + nestrad.sky(2)
    with pytest.raises(InputError, match="light: expected a light"):
        one_light([nestrad.sky(1), 3])
    with pytest.raises(InputError, match="light: expected a light"):
        one_light("sun")


def test_every_sky_has_its_message():
    sun = nestrad.sun_position("2026-06-21T10:00Z", 45, 3)
    names = {
        "uniform": "uniform",
        "moon_spencer": "moon_spencer",
        "clear": "cie_clear",
        "cie-12": "cie",
        "cie-7": "cie",
    }
    for kind, name in names.items():
        towards = None if kind in ("uniform", "moon_spencer") else sun
        sky = header(nestrad.sky(10, kind, towards_sun=towards)).sky
        assert sky.WhichOneof("radiance") == name
        assert sky.diffuse_fraction == 1
    assert header(nestrad.sky(10, "cie-7", towards_sun=sun)).sky.cie.type == 7
    perez = header(nestrad.sky(10, "perez", towards_sun=(0, 0, 1), clearness=2, brightness=0.2)).sky.perez
    assert (perez.clearness, perez.brightness, perez.towards_sun.z) == (2, 0.2, 1)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: nestrad.sky(1, "blue"), "kind: expected uniform, .*found 'blue'"),
        (lambda: nestrad.sky(1, "clear"), "towards_sun: expected where the sun stands"),
        (lambda: nestrad.sky(1, towards_sun=(0, 0, 1)), "towards_sun: a sky of kind 'uniform' has no sun"),
        (lambda: nestrad.sky(-1), "irradiance: expected W m-2, 0 or more, found -1"),
        (lambda: nestrad.sky({}), "irradiance: expected a number, or a dict by band"),
        (lambda: nestrad.sky(1, "perez", towards_sun=(0, 0, 1)), "clearness: expected a number from 1.0 to 12.01"),
        (lambda: nestrad.sky(1, clearness=2.0), "clearness and brightness: expected for a sky of kind 'perez' only"),
        (lambda: nestrad.sun(1), "sun: expected one of direction, elevation"),
        (lambda: nestrad.sun(1, elevation=-3), "elevation: expected degrees from 0.0058 to 90, found -3"),
        (lambda: nestrad.sun(1, direction=(0, 1)), r"direction: expected shape \(3,\), found \(2,\)"),
        (lambda: nestrad.sun(1, time="2026-06-21T10:00Z"), "sun: expected latitude and longitude"),
        (
            lambda: nestrad.sun({"PAR": "much"}, elevation=3),
            r"irradiance\['PAR'\]: expected W m-2, 0 or more, found str",
        ),
        (lambda: nestrad.sources([[0, 0, -1]], [1, 2]), r"irradiance: expected shape \(1,\), found \(2,\)"),
        (lambda: nestrad.sources([[0, 0, -1]], [-1]), "irradiance: expected W m-2, 0 or more, found -1"),
        (lambda: nestrad.clear_sky("2026-06-21T00:00Z", 45, 3, ghi=1, dhi=1), "time: expected a time with the sun up"),
        (
            lambda: nestrad.clear_sky("2026-06-21T10:00Z", 45, 3, ghi=1, dhi=2),
            "dhi: expected at most ghi, 1.0 W m-2, found 2",
        ),
        (
            lambda: nestrad.clear_sky("2026-06-21T10:00Z", 45, 3, ghi={"A": 1}, dhi=1),
            "dhi: expected the same form as ghi",
        ),
        (
            lambda: nestrad.clear_sky("2026-06-21T10:00Z", 45, 3, ghi=2, dhi=1, band_fraction={"A": 2}),
            r"band_fraction\['A'\]: expected above 0 to 1, found 2",
        ),
    ],
)
def test_lights_that_cannot_be_are_named(make, words):
    with pytest.raises(InputError, match=words):
        make()


def test_what_a_band_gets_is_never_guessed():
    light = nestrad.clear_sky("2026-06-21T10:00Z", 45, 3, ghi=800, dhi=100)
    with pytest.raises(InputError, match="light: expected what each of PAR, NIR gets of ghi and dhi"):
        header(light)
    assert list(header(light, {"all": 0.1}).sky.irradiance_W_m2) == [100]
    parts = {"PAR": 0.5, "NIR": 0.25}
    light = nestrad.clear_sky("2026-06-21T10:00Z", 45, 3, ghi=800, dhi=100, band_fraction=parts)
    sent = header(light)
    assert list(sent.sky.irradiance_W_m2) == [50, 25]
    assert list(sent.sources[0].irradiance_W_m2) == [350, 175]
    with pytest.raises(InputError, match="irradiance: expected a value for band 'NIR', found 'PAR'"):
        header(nestrad.sun({"PAR": 1}, elevation=50))


def test_the_sky_of_perez_follows_from_irradiances():
    sent = header(
        nestrad.perez_sky("2026-06-21T10:00Z", 45, 3, ghi=800, dhi=100, band_fraction={"PAR": 0.5, "NIR": 0.5})
    )
    assert sent.sky.perez.clearness == pytest.approx(8.01, abs=0.01)
    assert sent.sky.perez.brightness == pytest.approx(100 * 1.17 / 1317, rel=0.02)
    # at dusk there is a sky without a sun
    dusk = header(nestrad.perez_sky("2026-06-21T20:00Z", 45, 3, ghi=3, dhi=3), {"all": 0.1})
    assert len(dusk.sources) == 0
    assert dusk.sky.perez.towards_sun.z > 0
    with pytest.raises(InputError, match="the sun up"):
        nestrad.perez_sky("2026-06-21T23:00Z", 45, 3, ghi=5, dhi=3)
