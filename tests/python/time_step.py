"""A crop model's time steps: the canopy of today under the sun of two hours, in two bands.

    python time_step.py --master 127.0.0.1:7410 --out absorbed.csv

The geometry is uploaded once. With --files DIR the same scenes are written as files for `nestrad solve`,
which gives the same numbers.
"""

import argparse
import csv
import os
import signal
import sys
import threading
from pathlib import Path

import grpc
import numpy as np
from nestrad_client import LEAF, Band, Geometry, Master, Sources

PATTERN_M = (0.0, 0.0, 1.5, 0.8)
SOIL_Z_M = 0.0
SPECIES = "crop"
MATERIALS = [("leaf", LEAF), ("dry leaf", LEAF)]
BANDS = [
    Band("PAR", np.array([[0.09, 0.05, 0.11, 0.05], [0.25, 0.1, 0.25, 0.1]]), soil_albedo=0.15),
    Band("NIR", np.array([[0.44, 0.45, 0.46, 0.44], [0.5, 0.3, 0.5, 0.3]]), soil_albedo=0.25),
]
SUNS = [  # direction of travel, irradiance in PAR and NIR
    ([0.6, 0.3, -0.7], [250.0, 240.0]),
    ([0.1, 0.1, -1.0], [400.0, 380.0]),
]
SKY_W_M2 = [60.0, 40.0]


def canopy(day=30, seed=1):
    """Two rows of plants with arching leaves, as a growth model might give them."""
    rng = np.random.default_rng(seed)
    vertices, organ, material, organs = [], [], [], []
    along = np.linspace(0.0, 1.0, 7)
    for plant in range(10):
        foot = np.array([0.375 + 0.75 * (plant % 2), 0.16 * (plant // 2) + 0.08, 0.02])
        for leaf in range(3 + day // 6):
            length, width = 0.6 * np.sin(np.pi * (leaf + 2) / 12), 0.04 + 0.02 * rng.random()
            azimuth = np.pi * leaf + rng.normal(0.0, 0.4)
            out = np.array([np.cos(azimuth), np.sin(azimuth), 0.0])
            side = np.array([-out[1], out[0], 0.0])
            height = 0.08 * (leaf + 1) + length * (1.2 * along - along**2)
            middle = foot + np.outer(length * along, out)
            middle[:, 2] += height
            half = np.outer(0.5 * width * np.sin(np.pi * (0.15 + 0.8 * along)), side)
            left, right = middle - half, middle + half
            ribbon = [[left[:-1], right[:-1], right[1:]], [left[:-1], right[1:], left[1:]]]
            triangles = np.concatenate([np.stack(three, axis=1) for three in ribbon])
            vertices.append(triangles)
            organ += [len(organs)] * len(triangles)
            material += [int(leaf == 0)] * len(triangles)
            organs.append((f"plant{plant}", f"plant{plant}.leaf{leaf}"))
    return Geometry(
        np.concatenate(vertices),
        np.array(organ),
        np.array(material),
        organs,
        MATERIALS,
        PATTERN_M,
        SOIL_Z_M,
        [SPECIES] * len(organs),
    )


def light(hour):
    """The sun of that hour, and a sky of nine directions."""
    azimuth = np.arange(8) * np.pi / 4
    sky = np.stack([np.cos(azimuth), np.sin(azimuth), np.full(8, -1.0)], axis=1)
    direction, irradiance = SUNS[hour]
    directions = np.concatenate([[direction], [[0.0, 0.0, -1.0]], sky])
    parts = np.outer(np.full(9, 1 / 9), SKY_W_M2)
    return Sources(directions, np.concatenate([[irradiance], parts]))


def write_files(folder, geometry, hours):
    """The same scenes as files: SPECIES.obj, and a scene file an hour."""
    folder.mkdir(parents=True, exist_ok=True)
    with open(folder / f"{SPECIES}.obj", "w") as out:
        for number, (triangle, organ, material) in enumerate(
            zip(geometry.vertices_m, geometry.organ, geometry.material)
        ):
            plant, name = geometry.organs[organ]
            out.write(f"o {plant}\ng {name}\nusemtl {geometry.materials[material][0]}\n")
            for x, y, z in triangle.tolist():
                out.write(f"v {x!r} {y!r} {z!r}\n")
            out.write("f " + " ".join(str(3 * number + k) for k in (1, 2, 3)) + "\n")
    for hour in hours:
        sources = light(hour)
        text = [f'scene = "{SPECIES}.obj"\npattern = {list(PATTERN_M)}\nsoil = {SOIL_Z_M}\n']
        text.append("[light.files]\n")
        for b, band in enumerate(BANDS):
            name = f"{band.name}-{hour}.light"
            text.append(f'{band.name} = "{name}"\n')
            with open(folder / name, "w") as out:
                for direction, irradiance in zip(sources.direction, sources.irradiance_W_m2):
                    numbers = [irradiance[b], *direction]
                    out.write(" ".join(repr(float(x)) for x in numbers) + "\n")
        for band in BANDS:
            text.append(f'[[bands]]\nname = "{band.name}"\nsoil_albedo = {band.soil_albedo}\n')
            for (name, _), (a, b, c, d) in zip(MATERIALS, band.optics.tolist()):
                text.append(f'[bands.materials."{name}"]\n')
                text.append(f"upper = {{ rho = {a}, tau = {b} }}\n")
                text.append(f"lower = {{ rho = {c}, tau = {d} }}\n")
        (folder / f"scene-{hour}.toml").write_text("".join(text))


INTERRUPTED = threading.Event()


def interrupt(*_):
    """Python drops an interrupt that comes while gRPC is in a callback: `say` looks again."""
    INTERRUPTED.set()
    raise KeyboardInterrupt


def say(now):
    """Progress on stderr."""
    if INTERRUPTED.is_set():
        raise KeyboardInterrupt
    for line in now.plan:
        print(f"  {line}", file=sys.stderr)
    if now.stage:
        print(f"  {now.stage} {now.done}/{now.total}", file=sys.stderr, flush=True)


def steps(master, geometry, hours, accuracy):
    """Absorbed light of every organ, hour by hour."""
    geometry_id = None
    for hour in hours:
        if geometry_id is None:
            scene = master.upload(geometry, BANDS, light(hour))
            geometry_id = scene.geometry_id
        else:
            scene = master.relight(geometry_id, BANDS, light(hour))
        for warning in scene.warnings:
            print(f"warning: {warning}", file=sys.stderr)
        solve_id = master.solve(scene.scene_id, progress=say, accuracy_percent=accuracy)
        for band in master.summary(solve_id).bands:
            share = band.absorbed_plants_W.value / band.incoming_W
            print(f"hour {hour}: plants absorb {100 * share:.2f} % of {band.band}")
        yield hour, master.organs(solve_id)


def arguments():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--master", required=True, metavar="HOST:PORT")
    parser.add_argument("--ca", type=Path, help="certificate authority of the master, PEM")
    parser.add_argument("--accuracy", type=float, default=1.0, metavar="PERCENT", help="target error")
    parser.add_argument("--out", type=Path, required=True, metavar="FILE")
    parser.add_argument("--files", type=Path, metavar="DIR")
    return parser.parse_args()


def main():
    args = arguments()
    geometry, hours = canopy(), range(len(SUNS))
    if args.files:
        write_files(args.files, geometry, hours)
    ca = args.ca.read_bytes() if args.ca else None
    rows = []
    with Master(args.master, token=os.environ.get("NESTRAD_TOKEN"), ca=ca) as master:
        for hour, light_of in steps(master, geometry, hours, args.accuracy):
            names = zip(light_of.species, light_of.plant, light_of.organ)
            for name, absorbed_W in zip(names, light_of.absorbed_W.tolist()):
                for band, value in zip(light_of.bands, absorbed_W):
                    rows.append((hour, *name, band, repr(value)))
    with open(args.out, "w", newline="") as out:
        table = csv.writer(out, lineterminator="\n")
        table.writerow(("hour", "species", "plant", "organ", "band", "absorbed_W"))
        table.writerows(rows)


if __name__ == "__main__":
    signal.signal(signal.SIGINT, interrupt)
    try:
        main()
    except KeyboardInterrupt:
        sys.exit("cancelled")
    except (grpc.RpcError, RuntimeError) as error:
        details = error.details() if isinstance(error, grpc.RpcError) else error
        sys.exit(f"error: {details}")
