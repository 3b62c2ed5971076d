"""The numbers are those of the command line, digit for digit: its tables have nine of them."""

from __future__ import annotations

import subprocess
from pathlib import Path

import numpy as np
import pytest
from conftest import OPTICS, PATTERN_M, SUN, small_canopy

import nestrad
from nestrad import program

parquet = pytest.importorskip("pyarrow.parquet", reason="reads the command line's tables")

SKY = {"PAR": 60.0, "NIR": 40.0}
BANDS = ("PAR", "NIR")


def write_scene(folder: Path, canopy: nestrad.Canopy, light: str) -> Path:
    """The same scene as files. The species is the name of the file."""
    with (folder / "crop.obj").open("w") as out:
        rows = zip(canopy.corners_m().tolist(), canopy.organ_of_triangle, canopy.material_of_triangle)
        for number, (triangle, organ, material) in enumerate(rows):
            out.write(f"o {canopy.plant[organ]}\ng {canopy.organ[organ]}\n")
            out.write(f"usemtl {canopy.materials[material].name}\n")
            for corner in triangle:
                out.write("v " + " ".join(map(repr, corner)) + "\n")
            out.write("f " + " ".join(str(3 * number + k) for k in (1, 2, 3)) + "\n")
    text = [f'scene = "crop.obj"\npattern = {list(PATTERN_M)}\nsoil = 0.0\n']
    for band in BANDS:
        text.append(f'[[bands]]\nname = "{band}"\nsoil_albedo = {OPTICS[band]["soil"]}\n')
        for material in canopy.materials:
            four = [*OPTICS[band][material.name]] * 2
            text.append(
                f'[bands.materials."{material.name}"]\n'
                f"upper = {{ rho = {four[0]}, tau = {four[1]} }}\n"
                f"lower = {{ rho = {four[2]}, tau = {four[3]} }}\n"
            )
    path = folder / "scene.toml"
    path.write_text("".join(text) + light)
    return path


def of_command_line(scene: Path, *options: str) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray], str]:
    """The tables of organs and triangles of `nestrad solve`, and what it said."""
    out = scene.parent / "out"
    command = [str(program.find()), "solve", str(scene), "--out", str(out), "--format", "parquet", *options]
    ran = subprocess.run(command, capture_output=True, text=True, check=False)
    assert ran.returncode == 0, ran.stderr
    organs, triangles = (
        {name: column.to_numpy() for name, column in zip(table.column_names, table.columns)}
        for table in (parquet.read_table(out / f"{name}.parquet") for name in ("organs", "triangles"))
    )
    return organs, triangles, ran.stderr


def nine_digits(values: np.ndarray) -> list[float]:
    return [float(f"{value:.8e}") for value in values.ravel()]


@pytest.mark.parametrize("accuracy", [None, 1.0])
def test_the_numbers_are_those_of_the_command_line(tmp_path, accuracy):
    canopy = small_canopy()
    light = "[light.files]\n"
    for band in BANDS:
        name = f"{band}.light"
        (tmp_path / name).write_text(" ".join(map(repr, (SUN[1][band], *SUN[0]))) + "\n")
        light += f'{band} = "{name}"\n'
    options = () if accuracy is None else ("--accuracy", str(accuracy))
    organs, triangles, _ = of_command_line(write_scene(tmp_path, canopy, light), *options)
    found = nestrad.solve(canopy, OPTICS, nestrad.sun(SUN[1], direction=SUN[0]), accuracy=accuracy)
    for theirs, ours, columns in (
        (organs, found.organs, nestrad.OrganTable.per_band),
        (triangles, found.triangles, nestrad.TriangleTable.per_band),
    ):
        for name in columns:
            assert theirs[name].tolist() == nine_digits(getattr(ours, name)), name
        assert theirs["area_m2"].tolist() == nine_digits(np.repeat(ours.area_m2, 2))
    for name in ("sunlit_area_m2", "shaded_area_m2", "sunlit_area_se_m2"):
        assert organs[name].tolist() == nine_digits(np.repeat(getattr(found.organs, name), 2)), name
    for frame, theirs in ((found.organs.to_pandas(), organs), (found.triangles.to_pandas(), triangles)):
        assert list(frame.columns) == list(theirs)
        for name in ("species", "plant", "organ", "kind", "band"):
            assert frame[name].tolist() == theirs[name].tolist(), name


def test_a_sky_of_the_command_line_is_the_same_sky(tmp_path):
    light = '[light.sky]\nkind = "uniform_overcast"\nirradiance_W_m2 = { PAR = 60.0, NIR = 40.0 }\n'
    organs, _, _ = of_command_line(write_scene(tmp_path, small_canopy(), light), "--accuracy", "4")
    found = nestrad.solve(small_canopy(), OPTICS, nestrad.sky(SKY), accuracy=4)
    assert organs["absorbed_W"].tolist() == nine_digits(found.organs.absorbed_W)


def test_the_sun_of_the_command_line_stands_in_the_same_place(tmp_path):
    whole, diffuse = {"PAR": 400.0, "NIR": 380.0}, 0.25
    for time in ("2026-06-21T10:00:00Z", "2031-12-21T14:30:00Z"):
        light = (
            '[light.sky]\nkind = "clear"\nirradiance_W_m2 = { PAR = 400.0, NIR = 380.0 }\n'
            f"time_utc = {time}\nlatitude_deg = 45.0\nlongitude_deg = 3.0\ndiffuse_fraction = {diffuse}\n"
        )
        organs, _, said = of_command_line(write_scene(tmp_path, small_canopy(), light), "--accuracy", "4")
        sun = nestrad.sun_position(time, 45.0, 3.0)
        assert f"{sun.elevation_deg:.2f} degrees above the horizon, azimuth {sun.azimuth_deg:.2f} degrees" in said
        dhi = {band: diffuse * value for band, value in whole.items()}
        found = nestrad.solve(
            small_canopy(), OPTICS, nestrad.clear_sky(time, 45.0, 3.0, ghi=whole, dhi=dhi), accuracy=4
        )
        # a last bit of the sun's place may differ, and with it a pixel at an edge
        assert found.organs.absorbed_W.ravel() == pytest.approx(organs["absorbed_W"], rel=1e-3)
        assert found.organs.absorbed_W.sum() == pytest.approx(organs["absorbed_W"].sum(), rel=1e-6)
