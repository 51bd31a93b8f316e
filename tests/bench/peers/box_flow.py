#!/usr/bin/env python3
"""Our flow step against OpenFOAM's pimpleFoam: the same box with the same fixed bed of spheres, the same cells, one core each. Prints tables for docs/validation/flow-speed.md.

OpenFOAM meshes the whole box and holds the velocity at zero in the cells whose centres lie in a sphere: what direct forcing does to a grid. Two scenes: at `--fine` cells
a few steps for the time they take, at `--coarse` cells so long that the pressure drops can be compared. Steps that count come after the first ones. Debian: apt-get install openfoam hdf5-tools
"""
import argparse
import math
import os
import random
import re
import shutil
import statistics
import subprocess
import sys
import textwrap
import time

size, diameter, count, margin = (60e-3, 60e-3, 64e-3), 14.6e-3, 50, 2e-3  # m; the bed stays `margin` away from inlet and outlet
speed, viscosity, density = 0.1, 1e-5, 1000.0  # Reynolds number of a sphere 146: the flow becomes steady, so that drops compare


def bed(seed):
    """Centres of spheres at random places, overlapping by a twentieth at most: without, the last would find no place."""
    draw, centres = random.Random(seed), []
    while len(centres) < count:
        low = (0.3 * diameter, 0.3 * diameter, margin + diameter / 2)
        centre = tuple(draw.uniform(a, length - a) for a, length in zip(low, size))
        if all(math.dist(centre, other) > 0.95 * diameter for other in centres):
            centres.append(centre)
    return centres


def write(path, text):
    os.makedirs(os.path.dirname(path), exist_ok=True)
    with open(path, "w") as out:
        out.write(textwrap.dedent(text))


def run(arguments, folder, **settings):
    """On the last core; returns stdout, and CPU seconds a second of wall time."""
    core = str(max(os.sched_getaffinity(0)))
    before, start = os.times(), time.monotonic()
    done = subprocess.run(["taskset", "-c", core] + arguments, cwd=folder, capture_output=True, text=True, **settings)
    if done.returncode:
        raise SystemExit(f"{' '.join(arguments)}: exit code {done.returncode}\n{done.stdout[-2000:]}\n{done.stderr[-2000:]}")
    after = os.times()
    cpu = after.children_user + after.children_system - before.children_user - before.children_system
    return done.stdout, cpu / (time.monotonic() - start)


class Ours:
    def __init__(self, program, folder, centres, cells, precision):
        self.program, self.folder = program, folder
        faces = "".join(f'"{axis}{side}" = {{ type = "slip" }}\n' for axis in "xy" for side in "-+")
        bodies = "".join(f'[[body]]\nshape = {{ type = "sphere", diameter = {diameter} }}\nposition = {list(centre)}\nmotion = "fixed"\n' for centre in centres)
        self.text = (f'[domain]\nsize = {list(size)}\ncell = {size[0] / cells!r}\n[boundary]\n{faces}'
                     f'"z+" = {{ type = "inlet", velocity = [0, 0, {-speed}] }}\n"z-" = {{ type = "outlet", pressure = 0 }}\n'
                     f'[fluid]\ndensity = {density}\nkinematic_viscosity = {viscosity}\nprecision = "{precision}"\n[gravity]\nvector = [0, 0, 0]\n{bodies}')

    def run(self, duration, interval):
        shutil.rmtree(self.folder, ignore_errors=True)
        write(self.folder + "/case.toml", self.text + f"[time]\nduration = {duration}\n[output]\ninterval = {interval}\n")
        _, self.cpu_share = run([self.program, self.folder, "--threads", "1"], None)

    def series(self, path):
        out, _ = run(["h5dump", "-d", path, "-y", "-w", "0", self.folder + "/results.h5"], None)
        values = re.search(r"DATA \{(.*?)\}", out, re.S).group(1)
        return [float(word) for word in values.replace(",", " ").split()]

    def step(self):
        """Mean time step [s], and CPU seconds of a step without reading, writing and setting up."""
        steps = self.series("/performance/flow_steps")[0]
        return self.series("/series/time")[-1] / steps, self.cpu_share * self.series("/performance/seconds_flow")[0] / steps

    def drops(self):
        """(time, pressure drop [Pa]) of the outputs."""
        return list(zip(self.series("/series/time"), self.series("/series/pressure_drop")))


class OpenFoam:
    def __init__(self, folder, centres, cells):
        self.folder = folder
        self.environment = dict(os.environ, WM_PROJECT_DIR="/usr/share/openfoam", OMP_NUM_THREADS="1")
        shutil.rmtree(folder, ignore_errors=True)
        self.header = "FoamFile {{ version 2.0; format ascii; class {0}; object {1}; }}\n"
        x, y, z = size
        across, along = cells, round(cells * z / x)
        self.write("system/blockMeshDict", f"""
            vertices ((0 0 0) ({x} 0 0) ({x} {y} 0) (0 {y} 0) (0 0 {z}) ({x} 0 {z}) ({x} {y} {z}) (0 {y} {z}));
            blocks (hex (0 1 2 3 4 5 6 7) ({across} {across} {along}) simpleGrading (1 1 1));
            edges ();
            boundary (
              inlet {{ type patch; faces ((4 5 6 7)); }}
              outlet {{ type patch; faces ((0 3 2 1)); }}
              sides {{ type patch; faces ((0 4 7 3) (1 2 6 5) (0 1 5 4) (3 7 6 2)); }}
            );""")
        self.write("system/topoSetDict", "actions (\n" + "".join(
            f"{{ name solid; type cellSet; action {'new' if k == 0 else 'add'}; source sphereToCell; origin ({c[0]} {c[1]} {c[2]}); radius {diameter / 2}; }}\n"
            for k, c in enumerate(centres)) + "{ name solid; type cellZoneSet; action new; source setToCellZone; set solid; }\n);\n")
        self.write("constant/transportProperties", f"transportModel Newtonian; nu {viscosity};")
        self.write("constant/turbulenceProperties", "simulationType laminar;")
        self.write("constant/fvOptions", """
            solid { type vectorFixedValueConstraint; active yes; selectionMode cellZone; cellZone solid; fieldValues { U (0 0 0); } }""")
        self.write("0/U", f"""
            dimensions [0 1 -1 0 0 0 0]; internalField uniform (0 0 0);
            boundaryField {{ inlet {{ type fixedValue; value uniform (0 0 {-speed}); }} outlet {{ type zeroGradient; }} sides {{ type slip; }} }}""", "volVectorField")
        self.write("0/p", """
            dimensions [0 2 -2 0 0 0 0]; internalField uniform 0;
            boundaryField { inlet { type zeroGradient; } outlet { type fixedValue; value uniform 0; } sides { type zeroGradient; } }""", "volScalarField")
        self.write("system/fvSchemes", """
            ddtSchemes { default Euler; } gradSchemes { default Gauss linear; } divSchemes { default none; div(phi,U) Gauss linearUpwind grad(U);
            div((nuEff*dev2(T(grad(U))))) Gauss linear; } laplacianSchemes { default Gauss linear orthogonal; } interpolationSchemes { default linear; }
            snGradSchemes { default orthogonal; }""")
        self.write("system/fvSolution", """
            solvers {
              p { solver GAMG; smoother GaussSeidel; agglomerator faceAreaPair; tolerance 1e-6; relTol 0; }
              pFinal { $p; }
              U { solver smoothSolver; smoother symGaussSeidel; tolerance 1e-6; relTol 0.01; maxIter 20; }
              UFinal { $U; }
            }
            PIMPLE { momentumPredictor yes; nOuterCorrectors 1; nCorrectors 2; nNonOrthogonalCorrectors 0; }""")
        self.control(1, 1)
        for tool in ("blockMesh", "topoSet"):
            run([tool], folder, env=self.environment)

    def write(self, path, text, kind="dictionary"):
        write(os.path.join(self.folder, path), self.header.format(kind, os.path.basename(path)) + textwrap.dedent(text))

    def control(self, duration, step):
        mean = "{ type surfaceFieldValue; libs (fieldFunctionObjects); fields (p); operation areaAverage; regionType patch; name inlet; writeFields no; writeControl timeStep; }"
        self.write("system/controlDict", f"""
            application pimpleFoam; startFrom startTime; startTime 0; stopAt endTime; endTime {duration!r}; deltaT {step!r}; writeControl timeStep; writeInterval 1000000;
            adjustTimeStep no; writeFormat ascii; functions {{ inlet {mean} }}""")

    def run(self, duration, step):
        """CPU seconds of the steps after the first, and (time, pressure drop [Pa]) of the steps."""
        shutil.rmtree(self.folder + "/postProcessing", ignore_errors=True)
        self.control(duration, step)
        out, _ = run(["pimpleFoam"], self.folder, env=self.environment)
        stamps = [float(stamp) for stamp in re.findall(r"^ExecutionTime = ([0-9.]+) s", out, re.M)]
        with open(self.folder + "/postProcessing/inlet/0/surfaceFieldValue.dat") as lines:
            drops = [(float(t), density * float(p)) for t, p in (line.split() for line in lines if not line.startswith("#"))]
        return [b - a for a, b in zip(stamps, stamps[1:])], drops


def late_mean(drops):
    """Over the last fifth of the time."""
    late = [drop for at, drop in drops if at > 0.8 * drops[-1][0]]
    return statistics.fmean(late)


def row(*cells):
    print("| " + " | ".join(str(cell) for cell in cells) + " |", flush=True)


def main():
    root = os.path.join(os.path.dirname(os.path.abspath(__file__)), "../../..")
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--bin", default=os.path.join(root, "build/release/bin"), help="folder of suffuse")
    parser.add_argument("--work", default=os.path.join(root, "build/peers/box"), help="folder for the cases of both codes")
    parser.add_argument("--coarse", type=int, default=60, help="cells across where pressure drops are compared")
    parser.add_argument("--fine", type=int, default=120, help="cells across where steps are timed; a finer run of ours is the reference of the drops")
    parser.add_argument("--duration", type=float, default=0.2, help="of the comparison of drops [s]")
    parser.add_argument("--step", type=float, default=1e-3, help="of pimpleFoam there; a quarter of it on the fine cells [s]")
    parser.add_argument("--steps", type=int, default=8, help="of pimpleFoam on the fine cells; the first three do not count")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    if not shutil.which("h5dump"):
        raise SystemExit("h5dump is not installed: it reads our results (Debian: apt-get install hdf5-tools)")
    work, program = os.path.abspath(options.work), os.path.join(os.path.abspath(options.bin), "suffuse")
    centres = bed(options.seed)
    print(f"{count} fixed spheres of {1e3 * diameter:g} mm, seed {options.seed}, {speed} m/s, one core each\n")
    row("code", "cells across", "time step [us]", "ms a step (CPU)", "over ours in double", "in single", "CPU s for a second of flow", "pressure drop [Pa]", "off ours on fine cells")
    row(*["---"] * 9)
    ours = {}
    for cells in (options.fine, options.coarse):
        for precision in ("double", "single"):
            run_of_ours = ours[cells, precision] = Ours(program, f"{work}/ours-{cells}-{precision}", centres, cells, precision)
            run_of_ours.run(options.duration, options.duration / 50)
    reference = late_mean(ours[options.fine, "double"].drops())

    def report(name, cells, step, seconds, drop):
        off = "" if drop is None else f"{100 * (drop / reference - 1):+.1f} %"
        ratios = (f"{seconds / ours[cells, precision].step()[1]:.3g}" for precision in ("double", "single"))
        row(name, cells, f"{1e6 * step:.0f}", f"{1e3 * seconds:.1f}", *ratios, f"{seconds / step:.0f}",
            "" if drop is None else f"{drop:.1f}", off)

    for (cells, precision), run_of_ours in ours.items():
        report(f"Coralsand, {precision}", cells, *run_of_ours.step(), late_mean(run_of_ours.drops()))
    if not shutil.which("pimpleFoam"):
        print("pimpleFoam is not installed: left out (Debian: apt-get install openfoam)", file=sys.stderr)
        return
    for cells in (options.fine, options.coarse):
        step, duration = (options.step, options.duration) if cells == options.coarse else (options.step / 4, options.steps * options.step / 4)
        seconds, drops = OpenFoam(f"{work}/openfoam-{cells}", centres, cells).run(duration, step)
        report("pimpleFoam", cells, step, statistics.fmean(seconds[2:]), late_mean(drops) if cells == options.coarse else None)


main()
