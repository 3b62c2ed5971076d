"""What tests share: a real master, and a small canopy."""

from __future__ import annotations

import os

import numpy as np
import pytest

import nestrad
from nestrad import program

PATTERN_M = (0.0, 0.0, 1.5, 0.8)
OPTICS = {
    "PAR": {"leaf": (0.09, 0.05, 0.11, 0.05), "dry leaf": (0.25, 0.1), "soil": 0.15},
    "NIR": {"leaf": (0.44, 0.45, 0.46, 0.44), "dry leaf": (0.5, 0.3), "soil": 0.25},
}
SUN = ((0.6, 0.3, -0.7), {"PAR": 250.0, "NIR": 240.0})


@pytest.fixture(scope="session", autouse=True)
def _program():
    """All tests need the program; what the environment says of tokens is not for them."""
    os.environ.pop("NESTRAD_TOKEN", None)
    program.find()


def ribbons(plants: int = 4) -> tuple[np.ndarray, np.ndarray, list[str], list[str], list[str]]:
    """Plants with arching leaves: vertices, triangles, and a plant, an organ and a material for each triangle."""
    rng = np.random.default_rng(1)
    vertices, triangles, plant, organ, material = [], [], [], [], []
    along = np.linspace(0.0, 1.0, 7)
    for number in range(plants):
        foot = np.array([0.375 + 0.75 * (number % 2), 0.16 * (number // 2) + 0.08, 0.02])
        for leaf in range(5):
            length, width = 0.5 * np.sin(np.pi * (leaf + 2) / 8), 0.04 + 0.02 * rng.random()
            azimuth = np.pi * leaf + rng.normal(0.0, 0.4)
            out = np.array([np.cos(azimuth), np.sin(azimuth), 0.0])
            middle = foot + np.outer(length * along, out)
            middle[:, 2] += 0.08 * (leaf + 1) + length * (1.2 * along - along**2)
            half = np.outer(0.5 * width * np.sin(np.pi * (0.15 + 0.8 * along)), [-out[1], out[0], 0.0])
            first = sum(map(len, vertices))
            vertices.append(np.concatenate([middle - half, middle + half]))
            left = first + np.arange(6)
            right = left + 7
            faces = np.concatenate([np.stack([left, right, right + 1], 1), np.stack([left, right + 1, left + 1], 1)])
            triangles.append(faces)
            plant += [f"plant{number}"] * len(faces)
            organ += [f"leaf{leaf}"] * len(faces)
            material += ["dry leaf" if leaf == 0 else "leaf"] * len(faces)
    return np.concatenate(vertices), np.concatenate(triangles), plant, organ, material


def small_canopy(plants: int = 4) -> nestrad.Canopy:
    vertices, triangles, plant, organ, material = ribbons(plants)
    return nestrad.Canopy(
        vertices,
        triangles,
        plant=plant,
        organ=organ,
        material=material,
        species="crop",
        pattern=PATTERN_M,
        soil_z=0.0,
    )


@pytest.fixture
def canopy() -> nestrad.Canopy:
    return small_canopy()


@pytest.fixture
def sun() -> nestrad.Light:
    return nestrad.sun(SUN[1], direction=SUN[0])
