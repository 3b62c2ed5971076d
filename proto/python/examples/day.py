"""A crop model's day: the light of every organ, hour by hour, as a table on stdout.

python day.py > day.csv
"""

import sys

import numpy as np

import nestrad

PATTERN_M = (0.0, 0.0, 1.5, 0.8)
OPTICS = {
    "PAR": {"leaf": (0.09, 0.05), "soil": 0.15},
    "NIR": {"leaf": (0.45, 0.44), "soil": 0.25},
}


def plants() -> nestrad.Canopy:
    """Two rows of plants with arching leaves, as a growth model might give them."""
    rng = np.random.default_rng(1)
    along = np.linspace(0.0, 1.0, 7)
    vertices, triangles, plant, organ = [], [], [], []
    for number in range(10):
        foot = np.array([0.375 + 0.75 * (number % 2), 0.16 * (number // 2) + 0.08, 0.02])
        for leaf in range(8):
            length, azimuth = 0.6 * np.sin(np.pi * (leaf + 2) / 12), np.pi * leaf + rng.normal(0.0, 0.4)
            out = np.array([np.cos(azimuth), np.sin(azimuth), 0.0])
            middle = foot + np.outer(length * along, out)
            middle[:, 2] += 0.08 * (leaf + 1) + length * (1.2 * along - along**2)
            half = np.outer(0.025 * np.sin(np.pi * (0.15 + 0.8 * along)), [-out[1], out[0], 0.0])
            left = 14 * len(vertices) + np.arange(6)
            vertices.append(np.concatenate([middle - half, middle + half]))
            triangles += [(i, i + 7, i + 8) for i in left] + [(i, i + 8, i + 1) for i in left]
            plant += [number] * 12
            organ += [leaf] * 12
    points, faces = np.concatenate(vertices), np.array(triangles)
    return nestrad.Canopy(points, faces, plant=plant, organ=organ, pattern=PATTERN_M, soil_z=0.0)


def main() -> None:
    """Lights the canopy at ten hours of a clear day."""
    canopy = plants()
    print("hour,plant,organ,band,absorbed_W")
    with nestrad.Session() as session:
        resident = session.canopy(canopy, OPTICS)
        for hour in range(6, 16):
            whole = 900.0 * np.sin(np.pi * (hour - 4) / 16)
            light = nestrad.clear_sky(
                f"2026-06-21T{hour:02d}:00Z",
                latitude=45.0,
                longitude=3.0,
                ghi=whole,
                dhi=0.15 * whole,
                band_fraction={"PAR": 0.48, "NIR": 0.52},
            )
            organs = resident.light(light, accuracy=2).organs
            for number, powers in enumerate(organs.absorbed_W.tolist()):
                for band, power in zip(organs.bands, powers):
                    print(f"{hour},{organs.plant[number]},{organs.organ[number]},{band},{power!r}")
            print(f"{hour}:00 UTC: {organs.absorbed_W.sum(0)} W", file=sys.stderr)


if __name__ == "__main__":
    main()
