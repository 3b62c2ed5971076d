"""Draws a solved scene: every triangle and the soil, coloured by light, one panel a band.

    python3 canopy.py SCENE.can OUT_DIR PICTURE.png

SCENE.can is in metres; OUT_DIR is what `nestrad solve` wrote as CSV. Needs numpy, matplotlib and pillow.
maize.png was made with

    nestrad generate maize --rows 2x6 --out fig
    nestrad solve fig/scene.toml --out fig/out
    python3 canopy.py fig/maize.can fig/out maize.png
"""

import csv
import sys

import matplotlib
import numpy as np
from PIL import Image

matplotlib.use("Agg")
import matplotlib.pyplot as plt
from matplotlib import ticker
from matplotlib.colors import PowerNorm

WIDTH, HEIGHT = 1480, 1760  # of a panel as it is rendered; it is shown at half of that
AZIMUTH, ELEVATION = np.radians(-58.0), np.radians(14.0)
DISTANCE_M = 9.0


def read_can(path):
    triangles, organs = [], []
    with open(path) as lines:
        for line in lines:
            words = line.split()
            if not words or words[0] != "p":
                continue
            label = words[2]
            corners = np.array(words[4:], dtype=float).reshape(-1, 3)
            for k in range(1, len(corners) - 1):
                triangles.append(corners[[0, k, k + 1]])
                organs.append(int(label[1:9]))
    return np.array(triangles), np.array(organs)


def read_column(path, column, key):
    """Values of a column by band, in the order of the rows."""
    values = {}
    with open(path) as file:
        for row in csv.DictReader(file):
            values.setdefault(row["band"], []).append([float(row[k]) for k in (*key, column)])
    return {band: np.array(rows) for band, rows in values.items()}


class Camera:
    """Perspective, from DISTANCE_M away, upright; all of `points` fits the picture."""

    def __init__(self, points):
        forward = -np.array(
            [
                np.cos(ELEVATION) * np.cos(AZIMUTH),
                np.cos(ELEVATION) * np.sin(AZIMUTH),
                np.sin(ELEVATION),
            ]
        )
        right = np.cross(forward, [0, 0, 1])
        right /= np.linalg.norm(right)
        self.axes = np.array([right, -np.cross(right, forward), forward])
        self.eye = 0.5 * (points.min(0) + points.max(0)) - DISTANCE_M * forward
        self.scale, self.shift = 1.0, np.zeros(2)
        seen = self.project(points)[:, :2]
        size = np.array([WIDTH, HEIGHT])
        self.scale = 0.97 * (size / (seen.max(0) - seen.min(0))).min()
        self.shift = 0.5 * (size - self.scale * (seen.max(0) + seen.min(0)))

    def project(self, points):
        """Pixel x, pixel y, depth."""
        p = (points - self.eye) @ self.axes.T
        screen = self.shift + self.scale * p[..., :2] / p[..., 2:]
        return np.concatenate([screen, p[..., 2:]], -1)


def draw(camera, triangles, ids, depth, picture):
    """Depth buffer; `picture` gets the id of the nearest triangle in each pixel."""
    screen = camera.project(triangles)
    low = np.maximum(np.floor(screen[..., :2].min(1)), 0).astype(int)
    high = np.minimum(np.ceil(screen[..., :2].max(1)), [WIDTH - 1, HEIGHT - 1]).astype(int)
    for (a, b, c), (x0, y0), (x1, y1), number in zip(screen, low, high, ids):
        area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
        if x1 < x0 or y1 < y0 or area == 0.0:
            continue
        x = np.arange(x0, x1 + 1)[None, :] + 0.5
        y = np.arange(y0, y1 + 1)[:, None] + 0.5
        u = ((x - a[0]) * (c[1] - a[1]) - (y - a[1]) * (c[0] - a[0])) / area
        v = ((b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0])) / area
        z = a[2] + u * (b[2] - a[2]) + v * (c[2] - a[2])
        window = (slice(y0, y1 + 1), slice(x0, x1 + 1))
        nearer = (u >= 0) & (v >= 0) & (u + v <= 1) & (z < depth[window])
        depth[window] = np.where(nearer, z, depth[window])
        picture[window] = np.where(nearer, number, picture[window])


def soil_triangles(cells, size, z):
    """Two triangles a cell of the soil map."""
    corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * 0.5 * size
    quads = np.concatenate(
        [cells[:, None, :] + corners, np.full((len(cells), 4, 1), z)], axis=2
    )
    return np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])


def outlines(depth, organ):
    """How dark the border of what stands in front is, 0 to 1."""
    edge = np.zeros(depth.shape)
    for axis in (0, 1):
        for step in (-2, 2):
            behind = np.clip((np.roll(depth, step, axis) - depth) / 0.25, 0.0, 1.0)
            other = np.roll(organ, step, axis) != organ
            edge = np.maximum(edge, np.where(other, behind, 0.0))
    return edge


def main(can, out, target):
    triangles, organ = read_can(can)
    absorbed = read_column(f"{out}/triangles.csv", "absorbed_W_m2", ())
    soil = read_column(f"{out}/soil.csv", "irradiance_W_m2", ("x_m", "y_m", "cell_x_m", "cell_y_m"))
    cells = next(iter(soil.values()))
    ground = soil_triangles(cells[:, :2], cells[0, 2:4], 0.0)

    camera = Camera(np.concatenate([triangles, ground]).reshape(-1, 3))
    # what is empty is taken to be at ten times the distance of the scene
    depth = np.full((HEIGHT, WIDTH), 10.0 * DISTANCE_M)
    nearest = np.full((HEIGHT, WIDTH), -1)
    # the soil first: it lies below everything that is drawn after it
    draw(camera, ground, len(triangles) + np.arange(len(ground)) % len(cells), depth, nearest)
    draw(camera, triangles, np.arange(len(triangles)), depth, nearest)

    of_pixel = np.append(organ, -np.ones(len(cells), dtype=int))[nearest]
    edge = np.where(nearest < len(triangles), outlines(depth, of_pixel), 0.0)
    plt.rcParams.update({"font.family": "DejaVu Sans", "font.size": 10})
    figure, axes = plt.subplots(1, len(absorbed), figsize=(10.4, 5.6), layout="constrained")
    for panel, (band, values) in zip(np.atleast_1d(axes), absorbed.items()):
        leaf = values[:, 0]
        norm = PowerNorm(0.55, 0.0, np.quantile(leaf, 0.995), clip=True)
        colours = matplotlib.colormaps["viridis"](norm(leaf))
        light = soil[band][:, 4]
        brown = matplotlib.colormaps["copper"](0.2 + 0.6 * np.sqrt(light / light.max()))
        palette = np.concatenate([colours, brown, [[1.0, 1.0, 1.0, 1.0]]])[:, :3]
        image = palette[nearest] * (1.0 - 0.45 * edge[..., None])
        # four rendered pixels make one: smooth edges
        image = image.reshape(HEIGHT // 2, 2, WIDTH // 2, 2, 3).mean((1, 3))
        panel.imshow(image, interpolation="lanczos")
        panel.set_axis_off()
        bar = figure.colorbar(
            matplotlib.cm.ScalarMappable(norm, "viridis"), ax=panel, shrink=0.5, pad=0.0, aspect=28
        )
        bar.locator = ticker.MaxNLocator(4)
        bar.set_label(f"{band} absorbed, W per m² of leaf")
        bar.outline.set_visible(False)
    figure.savefig(target, dpi=125, facecolor="white")
    # a palette of 256 colours is a third of the bytes
    Image.open(target).convert("RGB").quantize(256, dither=Image.Dither.NONE).save(target, optimize=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
