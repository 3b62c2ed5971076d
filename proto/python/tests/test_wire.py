"""Bytes that are made by hand are those that protobuf makes."""

import numpy as np
import pytest

from nestrad import protocol, upload, wire
from nestrad.canopy import Canopy


@pytest.mark.parametrize("value", [0, 1, 127, 128, 300, 2**32 - 1, 2**63])
def test_a_varint_is_read_as_it_was_written(value):
    message = protocol.message("TriangleSlice").FromString(wire.whole(1, value))
    assert message.first == value


def test_lists_are_those_of_protobuf():
    rng = np.random.default_rng(3)
    # numbers of every length
    whole = np.concatenate([[0, 1, 127, 128, 2**32 - 1], rng.integers(0, 2 ** rng.integers(1, 33, 500))])
    whole = whole.astype(np.uint32)
    real = rng.normal(size=(200, 3, 3))
    data = wire.uint32s(3, whole) + wire.doubles(2, real)
    message = protocol.message("TriangleSlice").FromString(data)
    assert list(message.organ) == whole.tolist()
    assert list(message.vertices_m) == real.ravel().tolist()


def test_a_message_is_split_into_its_lists_and_the_rest():
    sent = protocol.SoilLight(first=7, bands=["PAR"], cell_x_m=0.5, cells_x=300, irradiance_W_m2=[1.5, 2.5])
    lists = {protocol.number("SoilLight", "irradiance_W_m2"): "irradiance_W_m2"}
    rest, found = wire.split(memoryview(sent.SerializeToString()), lists, protocol.SoilLight)
    assert found["irradiance_W_m2"].tolist() == [1.5, 2.5]
    assert (rest.first, rest.cell_x_m, rest.cells_x, list(rest.bands)) == (7, 0.5, 300, ["PAR"])


@pytest.mark.parametrize("data", [b"\x80", b"\x0a\x05ab", b"\x09\x00", b"\x0b", b"\xff" * 11])
def test_what_is_cut_off_is_an_error(data):
    with pytest.raises(ValueError, match=r"cut off|too long|of kind"):
        list(wire.fields(memoryview(data)))


def test_slices_follow_one_another_without_a_gap():
    rng = np.random.default_rng(4)
    count = 20_000
    canopy = Canopy(rng.random((count, 3, 3)), organ=np.arange(count), material=np.arange(count) % 200)
    organs, vertices, materials = [], [], []
    for data in upload.slices(canopy):
        assert len(data) < 1 << 20
        part = protocol.SceneSlice.FromString(data)
        if part.HasField("organs"):
            assert part.organs.first == len(organs)
            organs += part.organs.id
        else:
            assert part.triangles.first == len(materials)
            vertices += part.triangles.vertices_m
            materials += part.triangles.material
    assert organs == canopy.organ
    assert vertices == canopy.corners_m().ravel().tolist()
    assert materials == canopy.material_of_triangle.tolist()
