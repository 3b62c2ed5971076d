"""What a solve of many triangles costs beside the solve: `python tests/overhead.py [TRIANGLES]`.

Processor time of this process and of the master, and the most memory of this process beside the arrays.
"""

from __future__ import annotations

import os
import sys
import time

import numpy as np

import nestrad


def leaves(count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Quads of 2 triangles in 100 organs a plant: vertices, triangles, and the organ of each triangle."""
    rng = np.random.default_rng(1)
    quads = count // 2
    side = (quads / 3e4) ** 0.5
    centre = rng.random((quads, 3)) * [side, side, 1.0]
    tangent = rng.normal(size=(quads, 3))
    tangent /= np.linalg.norm(tangent, axis=1)[:, None]
    across = np.cross(tangent, rng.normal(size=(quads, 3)))
    across /= np.linalg.norm(across, axis=1)[:, None]
    corners = [centre + 5e-3 * (a * tangent + b * across) for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    vertices = np.stack(corners, axis=1).reshape(-1, 3)
    vertices[:, 2] += 0.01
    first = 4 * np.arange(quads)[:, None]
    triangles = np.concatenate([first + corner for corner in ([0, 1, 2], [0, 2, 3])], axis=1).reshape(-1, 3)
    return vertices, triangles, np.arange(2 * quads) // 200


def master_cpu_s(process: int) -> float:
    with open(f"/proc/{process}/stat") as stat:
        fields = stat.read().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def resident_bytes(what: str) -> int:
    """What this process holds now (VmRSS), or held at most since it was last asked to forget (VmHWM)."""
    with open("/proc/self/status") as status:
        (line,) = (line for line in status if line.startswith(what))
    return 1024 * int(line.split()[1])


def forget_peak() -> None:
    with open("/proc/self/clear_refs", "w") as clear:
        clear.write("5")


def main() -> None:
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 1_000_000
    vertices, triangles, organ = leaves(count)
    side = float(vertices[:, :2].max()) + 0.01
    optics = {"PAR": {"leaf": (0.09, 0.05), "soil": 0.15}, "NIR": {"leaf": (0.45, 0.45), "soil": 0.25}}
    with nestrad.Session(threads=1) as session:
        master = session._own.process_id
        warm = nestrad.Canopy(vertices[:4000], triangles[:1000], pattern=(0, 0, side, side), soil_z=0.0)
        session.solve(warm, optics, nestrad.sky(100), accuracy=20)
        forget_peak()
        before, own, others = resident_bytes("VmRSS"), time.process_time(), master_cpu_s(master)
        begun = time.monotonic()
        canopy = nestrad.Canopy(vertices, triangles, organ=organ, pattern=(0, 0, side, side), soil_z=0.0)
        found = session.solve(canopy, optics, nestrad.sun(300, elevation=50) + nestrad.sky(100), progress=False)
        wall_s = time.monotonic() - begun
        own, others = time.process_time() - own, master_cpu_s(master) - others
    taken = resident_bytes("VmHWM") - before
    given = sum(array.nbytes for array in (vertices, triangles, organ))
    got = sum(
        value.nbytes
        for table in (found.organs, found.triangles, found.soil)
        for value in vars(table).values()
        if isinstance(value, np.ndarray)
    )
    print(f"{len(canopy)} triangles, {len(found.organs)} organs: {wall_s:.2f} s")
    print(f"solve: {found.cost.wall_s:.2f} s, {found.cost.cpu_s:.2f} CPU s")
    outside_s = own + others - found.cost.cpu_s
    print(
        f"outside: Python {own:.2f} CPU s, master {others - found.cost.cpu_s:.2f} CPU s: "
        f"{100 * outside_s / found.cost.cpu_s:.1f} % of the solve"
    )
    print(
        f"arrays: {given / 1e6:.0f} MB given, {got / 1e6:.0f} MB of results; "
        f"beside those given at most {taken / 1e6:.0f} MB"
    )


if __name__ == "__main__":
    main()
