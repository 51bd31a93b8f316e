#!/usr/bin/python3
"""What a user of scipy and scikit-image would write for csct2ls: labels, table of grains and signed distances; and how long it takes.

    tests/bench/baseline_ct.py STACK.tif [--voxel-size 30e-6] [--bin build/release/bin] [--itk build/itk/itk_kernels] [--only NAME]

Runs the same stack through scipy, ITK where its program is built (tests/bench/itk) and Coralsand, each in a process of its own on one
thread, and prints CPU seconds, peak memory and ratios. Needs python3-scipy and python3-skimage (Debian); says so when they are absent.
The script leaves out roundness and throats, for which the libraries have no function: csct2ls computes them, and the time counts.
"""
import argparse
import json
import os
import subprocess
import sys
import tempfile
import time

try:
    import numpy as np
    from scipy import ndimage, spatial
    from skimage import io, measure
except ImportError as missing:
    sys.exit(f"baseline_ct.py: {missing.name} is absent; apt-get install python3-scipy python3-skimage")

faces = ndimage.generate_binary_structure(3, 1)
full = ndimage.generate_binary_structure(3, 3)


def signed_distance(solid):
    """Distance between voxel centres, less the half voxel to the face; negative in solid [voxels]."""
    return np.where(solid, 0.5 - ndimage.distance_transform_edt(solid), ndimage.distance_transform_edt(~solid) - 0.5).astype(np.float32)


def connected_to_border(mask):
    """Part of the mask that is connected to the border of the box through faces."""
    parts, count = ndimage.label(mask, faces)
    rim = np.concatenate([parts[i].ravel() for i in (0, -1)] + [parts[:, i].ravel() for i in (0, -1)] + [parts[:, :, i].ravel() for i in (0, -1)])
    keep = np.zeros(count + 1, bool)
    keep[rim] = True
    keep[0] = False
    return keep[parts]


def apparent_shape(solid, radius):
    """Ball closing from outside by two distance transforms, as csct2ls does [radius in voxels]."""
    outside = connected_to_border(ndimage.distance_transform_edt(~solid) >= radius + 0.5)
    return (ndimage.distance_transform_edt(~outside) > radius + 0.5) | solid


def surface(mask):
    occupancy = ndimage.gaussian_filter(mask.astype(np.float32), 0.7)
    vertices, triangles, _, _ = measure.marching_cubes(occupancy, 0.5)
    return vertices, triangles, measure.mesh_surface_area(vertices, triangles)


def enclosed_volume(vertices, triangles):
    a, b, c = (vertices[triangles[:, n]].astype(float) for n in range(3))
    return abs(np.einsum("ij,ij->i", a, np.cross(b, c)).sum()) / 6


def one_grain(solid, box, spacing):
    """Row of the table [voxels] and both distances on nodes `spacing` voxels apart."""
    parts, count = ndimage.label(solid, full)
    if count > 1:
        solid = parts == 1 + np.argmax(np.bincount(parts.ravel())[1:])
    filled = ndimage.binary_fill_holes(solid)
    diameter = (6 / np.pi * filled.sum()) ** (1 / 3)
    radius = 0.1 * diameter
    solid = np.pad(solid, int(np.ceil(radius)) + 3)
    apparent = apparent_shape(solid, radius)
    reached = connected_to_border(~solid)
    voids = apparent & ~solid
    sizes = np.bincount(ndimage.label(voids, faces)[0].ravel())[1:]
    _, _, area = surface(solid)
    vertices, triangles, apparent_area = surface(apparent)
    volume = enclosed_volume(vertices, triangles)
    hull = spatial.ConvexHull(vertices)
    corners = vertices[hull.vertices]
    axes = np.linalg.svd(corners - corners.mean(0), full_matrices=False)[2]
    edges = np.sort(np.ptp(corners @ axes.T, axis=0))[::-1]
    row = dict(voxels=int(solid.sum()), apparent=int(apparent.sum()), open=int((voids & reached).sum()), closed=int((voids & ~reached).sum()),
               void_count=int((sizes >= 8).sum()), area=area, apparent_area=apparent_area, sphericity=(36 * np.pi * volume**2) ** (1 / 3) / apparent_area,
               convexity=volume / hull.volume, elongation=edges[1] / edges[0], flatness=edges[2] / edges[1])
    pad = int(np.ceil(9 * spacing))
    grids = []
    for mask in (solid, apparent):
        d = signed_distance(np.pad(mask, pad))
        nodes = np.meshgrid(*(np.arange(0, n - 1, spacing) for n in d.shape), indexing="ij")
        grids.append(np.clip(ndimage.map_coordinates(d, nodes, order=1), -6 * spacing, 9 * spacing).astype(np.float32))
    return row, grids


def whole_script(stack, spacing, folder):
    labels = io.imread(stack)
    rows = []
    for label, box in enumerate(ndimage.find_objects(labels), 1):
        if box is None or any(s.start == 0 or s.stop == n for s, n in zip(box, labels.shape)):
            continue
        row, grids = one_grain(labels[box] == label, box, spacing)
        rows.append(dict(label=label, **row))
        np.savez(os.path.join(folder, f"grain_{label}.npz"), solid=grids[0], apparent=grids[1])
    with open(os.path.join(folder, "grains.csv"), "w") as table:
        table.write(",".join(rows[0]) + "\n" + "".join(",".join(map(str, row.values())) + "\n" for row in rows))
    return len(rows)


def task(name, stack, spacing):
    """Runs in a process of its own; prints name, CPU seconds."""
    if name == "script":
        with tempfile.TemporaryDirectory() as folder:
            start = time.process_time()
            print("grains", whole_script(stack, spacing, folder))
            print("script", time.process_time() - start)
        return
    solid = io.imread(stack) > 0
    start = time.process_time()
    if name == "signed_distance":
        signed_distance(solid)
    else:
        print("components", ndimage.label(solid, full)[1])
    print(name, time.process_time() - start)


def run(command):
    """Lines `name value` that a child prints, its CPU seconds and its peak memory [MB]."""
    with tempfile.TemporaryFile("w+") as out:
        child = subprocess.Popen(command, stdout=out, stderr=subprocess.DEVNULL, env=dict(os.environ, OMP_NUM_THREADS="1"))
        _, status, usage = os.wait4(child.pid, 0)
        child.returncode = os.waitstatus_to_exitcode(status)
        out.seek(0)
        text = out.read()
    if child.returncode != 0:
        sys.exit(f"{' '.join(command)} ended with {child.returncode}\n{text}")
    return text, usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1024


def values(text):
    return {key: float(value) for key, value in (line.split() for line in text.splitlines() if len(line.split()) == 2)}


def compare(options):
    itself = [sys.executable, os.path.abspath(__file__), options.stack, "--spacing", str(options.spacing)]
    measured = {}  # (who, what) -> seconds, MB
    for name in ("signed_distance", "labels", "script"):
        text, _, memory = run(itself + ["--only", name])
        measured["scipy", name] = values(text)[name], memory
    text, _, memory = run([os.path.join(options.bin, "ct_kernels"), options.stack])
    for name in ("signed_distance", "labels"):
        measured["coralsand", name] = values(text)[name], memory
    if os.path.exists(options.itk):
        solid = io.imread(options.stack) > 0
        with tempfile.NamedTemporaryFile(suffix=".raw") as raw:
            solid.astype(np.uint8).tofile(raw)
            raw.flush()
            text, _, memory = run([options.itk, raw.name] + [str(n) for n in solid.shape[::-1]])
        for name in ("signed_distance", "labels"):
            measured["ITK", name] = values(text)[name], memory
    else:
        print(f"ITK: {options.itk} is absent; build it as tests/bench/itk/CMakeLists.txt says")
    with tempfile.TemporaryDirectory() as folder:
        voxel = options.voxel_size
        text, seconds, memory = run([os.path.join(options.bin, "csct2ls"), options.stack, "--voxel-size", repr(voxel), "--spacing", repr(voxel * options.spacing),
                                     "--min-diameter", repr(voxel), "--threads", "1", "--json", "-o", os.path.join(folder, "g.vdb"), "--table", os.path.join(folder, "g.csv")])
        summary = json.loads(text)
        measured["coralsand", "script"] = seconds, memory
    print(f"{summary['stack_size']} voxels, {summary['grains']} grains, one thread, load {os.getloadavg()[0]:.1f}; csct2ls by stage: {summary['seconds']}\n")
    print("| task | Coralsand s | MB | scipy s | MB | ratio | ITK s | MB | ratio |\n|---|---|---|---|---|---|---|---|---|")
    for name, title in (("signed_distance", "signed distance of the stack"), ("labels", "labels of the stack (26)"), ("script", "table and distances of all grains")):
        ours, theirs, itk = measured["coralsand", name], measured["scipy", name], measured.get(("ITK", name))
        other = f"{itk[0]:.2f} | {itk[1]:.0f} | {itk[0] / ours[0]:.1f}" if itk else "- | - | -"
        print(f"| {title} | {ours[0]:.2f} | {ours[1]:.0f} | {theirs[0]:.2f} | {theirs[1]:.0f} | {theirs[0] / ours[0]:.1f} | {other} |")


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("stack")
    parser.add_argument("--voxel-size", type=float, default=30e-6, help="[m]")
    parser.add_argument("--spacing", type=float, default=2.0, help="node spacing [voxels]")
    parser.add_argument("--bin", default="build/release/bin")
    parser.add_argument("--itk", default="build/itk/itk_kernels")
    parser.add_argument("--only", choices=["signed_distance", "labels", "script"], help="run this part of the scipy side alone")
    options = parser.parse_args()
    if options.only:
        task(options.only, options.stack, options.spacing)
    else:
        compare(options)


main()
