#!/usr/bin/python3
"""Picture of a mesh that csct2ls --mesh wrote: from outside and cut in half.

    docs/validation/render_ply.py grain_1.ply picture.png [--size 420]

Every triangle is painted as a few points into a depth buffer, which suits meshes with triangles of about a pixel. Needs numpy and
scikit-image (Debian: python3-skimage).
"""
import argparse

import numpy as np
from skimage import io


def read_ply(path):
    """Vertices [n, 3] and triangles [m, 3] of a binary little-endian PLY of floats or doubles."""
    with open(path, "rb") as file:
        counts, kind = {}, "<f4"
        for line in iter(file.readline, b"end_header\n"):
            words = line.decode().split()
            if words[0] == "element":
                counts[words[1]] = int(words[2])
            if words[:2] == ["property", "double"]:
                kind = "<f8"
        vertices = np.frombuffer(file.read(counts["vertex"] * 3 * int(kind[2])), kind).reshape(-1, 3)
        faces = np.frombuffer(file.read(), np.dtype([("n", "u1"), ("v", "<i4", 3)]))["v"]
    return vertices.astype(float), faces


def view(vertices, faces, size, cut):
    """Grey picture [size, size] along a slanted direction; `cut` leaves out the half that is nearer."""
    a, b, c = 0.6, 0.5, 0.0
    turn = np.array([[np.cos(a), -np.sin(a), 0], [np.sin(a), np.cos(a), 0], [0, 0, 1]])
    tilt = np.array([[1, 0, 0], [0, np.sin(b), np.cos(b)], [0, -np.cos(b), np.sin(b)]])
    p = (vertices - 0.5 * (vertices.min(0) + vertices.max(0))) @ (tilt @ turn).T
    p /= np.abs(p[:, :2]).max() * 1.05
    corners = p[faces]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-30)
    light = np.array([-0.4, 0.5, 0.77])
    shade = np.where(normal[:, 2] > 0, 0.25 + 0.7 * np.abs(normal @ light), 0.12 + 0.2 * np.abs(normal @ light))
    edge = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max() * size / 2  # the longest [pixels]
    n = int(np.clip(2 * edge, 3, 24))
    weights = [(u / n, v / n, 1 - (u + v) / n) for u in range(n + 1) for v in range(n + 1 - u)]
    depth, picture = np.full(size * size, -np.inf), np.full(size * size, 1.0)
    for w in weights:
        q = np.einsum("k,nkj->nj", w, corners)
        keep = q[:, 2] < 0 if cut else slice(None)
        x, y = (((q[keep, a] * (1 if a == 0 else -1) + 1) * 0.5 * (size - 1)).round().astype(int) for a in (0, 1))
        at, z, s = y * size + x, q[keep, 2], shade[keep]
        order = np.argsort(z, kind="stable")
        last = dict(zip(at[order], order))  # the nearest of this pass at each pixel
        pixels, chosen = np.fromiter(last.keys(), int), np.fromiter(last.values(), int)
        nearer = z[chosen] > depth[pixels]
        depth[pixels[nearer]], picture[pixels[nearer]] = z[chosen][nearer], s[chosen][nearer]
    return picture.reshape(size, size)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("mesh")
    parser.add_argument("picture")
    parser.add_argument("--size", type=int, default=420)
    options = parser.parse_args()
    mesh = read_ply(options.mesh)
    both = np.hstack([view(*mesh, options.size, cut) for cut in (False, True)])
    io.imsave(options.picture, (255 * both.clip(0, 1)).astype(np.uint8), check_contrast=False)


main()
