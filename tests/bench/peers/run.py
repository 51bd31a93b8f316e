#!/usr/bin/env python3
"""Our discrete elements against LAMMPS, LIGGGHTS and YADE: the same scenes, one core each, CPU time. Prints tables for docs/validation/dem-speed.md.

All codes start from one scene file and run the same number of steps, one after the other, the whole round `--repeat` times; the least CPU time counts,
for a loaded machine can only make a run slower. Neighbour skins are tried for every code, ours too, and the best is kept. A code that is not installed
is left out with a message.
"""
import argparse
import collections
import json
import math
import os
import re
import shutil
import statistics
import subprocess
import sys

from scene_file import read_scene

here = os.path.dirname(os.path.abspath(__file__))
Result = collections.namedtuple("Result", "cpu wall report state")


def command(arguments, cores=1, **settings):
    """Runs pinned to the last `cores` cores; returns stdout and stderr."""
    available = sorted(os.sched_getaffinity(0))[-cores:]
    pinned = ["taskset", "-c", ",".join(map(str, available))] + arguments
    done = subprocess.run(pinned, capture_output=True, text=True, **settings)
    if done.returncode:
        raise SystemExit(f"{' '.join(arguments)}: exit code {done.returncode}\n{done.stdout[-2000:]}\n{done.stderr[-2000:]}")
    return done.stdout, done.stderr


class Ours:
    def __init__(self, options, scene, program, threads, skins):
        self.options, self.scene, self.threads, self.skins = options, scene, threads, skins
        self.name = "Coralsand" if threads == 1 else f"Coralsand, {threads} threads"
        self.program = os.path.join(options.bin, program)

    def version(self):
        done = subprocess.run(["git", "describe", "--always", "--tags"], cwd=here, capture_output=True, text=True)
        return done.stdout.strip() or "?"

    def run(self, skin, warm, steps):
        state = self.options.work + "/ours.txt"
        out, _ = command([self.program, "run", self.scene, state, str(warm), str(steps), str(self.threads), str(skin)], self.threads)
        report = json.loads(out)
        return Result(report["cpu"], report["wall"], report, lambda: read_scene(state)[1])


class Lammps:
    """LAMMPS, and LIGGGHTS, which came of it: an input script with variables, a data file, and a dump at the end."""

    def __init__(self, options, scene, program, name, script, skins, **choices):
        self.options, self.program, self.name, self.script, self.skins, self.choices = options, program, name, script, skins, choices
        header, rows = read_scene(scene)
        self.data = options.work + "/bed.data"
        one = lambda key: header[key][0]
        with open(self.data, "w") as out:
            out.write(f"bed\n\n{len(rows)} atoms\n1 atom types\n\n")
            for axis, letter in enumerate("xyz"):
                out.write(f"{header['lower'][axis]!r} {header['upper'][axis]!r} {letter}lo {letter}hi\n")
            out.write("\nAtoms\n\n")
            for index, (x, y, z, radius, *_) in enumerate(rows):
                out.write(f"{index + 1} 1 {2 * radius!r} {one('density')!r} {x!r} {y!r} {z!r}\n")
            out.write("\nVelocities\n\n")
            for index, velocity in enumerate(row[4:] or [0.0] * 3 for row in rows):
                out.write(f"{index + 1} {' '.join(map(repr, velocity))} 0 0 0\n")
        mass = mean_mass(header, rows)
        kn, kt, zeta, g = one("normal_stiffness"), one("tangential_stiffness"), one("damping"), header["gravity"]
        rate = lambda stiffness, m: 2 * zeta * math.sqrt(stiffness / m)  # c = rate m*, right for two spheres of the mean mass
        size = math.dist(g, (0, 0, 0))
        self.variables = dict(
            choices, data=self.data, kn=kn, kt=kt, mu=one("friction"), dt=one("time_step"), g=size, gx=g[0] / size, gy=g[1] / size, gz=g[2] / size,
            gamma=rate(kn, mass / 2), gamma_t=rate(kt, mass / 2), gamma_wall=rate(kn, mass), gamma_t_wall=rate(kt, mass),
            restitution=tsuji_restitution(2 * zeta), ratio_t=math.sqrt(kt / kn))
        for axis, letter in enumerate("xyz"):
            self.variables[letter + "lo"], self.variables[letter + "hi"] = header["lower"][axis], header["upper"][axis]

    def version(self):
        done = subprocess.run([self.program, "-h"], capture_output=True, text=True, cwd=self.options.work)
        return re.search(r"Simulator - (.*)|\(Version ([^,]*)", done.stdout).expand(r"\1\2")

    def run(self, skin, warm, steps):
        state = self.options.work + f"/{self.program}.txt"
        if os.path.exists(state):
            os.remove(state)
        arguments = [self.program, "-in", os.path.join(here, self.script), "-log", "none", "-screen", "none"]
        for key, value in dict(self.variables, skin=skin, warm=warm, steps=steps, state=state).items():
            arguments += ["-var", key, str(value)]
        _, err = command(arguments, cwd=self.options.work, env=dict(os.environ, OMP_NUM_THREADS="1"))
        stamps = [int(line.split()[0]) for line in err.splitlines() if re.fullmatch(r"\d+ \d+ \d+", line.strip())]

        def rows():
            with open(state) as lines:
                return [[float(word) for word in line.split()[1:]] for line in list(lines)[9:]]

        return Result(1e-9 * (stamps[1] - stamps[0]), None, {}, rows)


class Yade:
    def __init__(self, options, name, script, skins, **settings):
        self.options, self.name, self.script, self.skins, self.settings = options, name, script, skins, settings

    def version(self):
        done = subprocess.run(["yade", "--version"], capture_output=True, text=True)
        return (done.stdout + done.stderr).split()[-1]

    def run(self, skin, warm, steps):
        state = self.options.work + "/yade.txt"
        settings = dict(self.settings, skin=skin, warm=warm, steps=steps, state=state)
        # yade finds the shared part of the scripts by PYTHONPATH alone.
        environment = dict(os.environ, PYTHONPATH=here, PYTHONDONTWRITEBYTECODE="1", OMP_NUM_THREADS="1", PEER=json.dumps(settings))
        out, err = command(["yade", "-n", "-x", "-j1", os.path.join(here, self.script)], env=environment, cwd=self.options.work)
        found = re.search(r"^RESULT (.*)$", out, re.M)
        if not found:
            raise SystemExit(f"yade {self.script}: no result\n{out[-2000:]}\n{err[-2000:]}")
        report = json.loads(found.group(1))
        return Result(report["cpu"], report["wall"], report, lambda: read_scene(state)[1])


def mean_mass(header, rows):
    return header["density"][0] * 4 / 3 * math.pi * sum(row[3] ** 3 for row in rows) / len(rows)


def tsuji_restitution(damping):
    """The e for which LAMMPS takes c = damping sqrt(m* kn) [polynomial in the documentation of pair_style granular]."""
    factors = (1.2728, -4.2783, 11.087, -22.348, 27.467, -18.022, 4.8218)
    low, high = 0.0, 1.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        if sum(factor * middle**power for power, factor in enumerate(factors)) > damping:
            low = middle
        else:
            high = middle
    return low


def check_bed(scene, rows):
    """One yardstick for all codes: touching pairs, mean overlap [m], kinetic energy [J] and mean way from the start [m], all from the final state."""
    header, start = read_scene(scene)
    cell = 2 * max(row[3] for row in rows)
    cells = collections.defaultdict(list)
    for index, row in enumerate(rows):
        cells[tuple(int(x // cell) for x in row[:3])].append(index)
    overlaps = []
    for (a, b, c), members in cells.items():
        near = [j for da in (-1, 0, 1) for db in (-1, 0, 1) for dc in (-1, 0, 1) for j in cells.get((a + da, b + db, c + dc), ())]
        for i in members:
            p = rows[i]
            overlaps += [p[3] + rows[j][3] - math.dist(p[:3], rows[j][:3]) for j in near if j > i]
            for axis in range(3):
                overlaps += [p[3] - p[axis] + header["lower"][axis], p[3] + p[axis] - header["upper"][axis]]
    touching = [overlap for overlap in overlaps if overlap > 0]
    density = header["density"][0]
    kinetic = sum(density * 2 / 3 * math.pi * row[3] ** 3 * sum(v * v for v in row[4:7]) for row in rows)
    way = sum(math.dist(p[:3], q[:3]) for p, q in zip(rows, start)) / len(rows)
    return dict(contacts=len(touching), overlap=sum(touching) / max(1, len(touching)), kinetic=kinetic, way=way)


def compare(entries, warm, steps, repeat):
    """Least CPU time of each entry at its best skin, and the median over the rounds of its time / that of the first: the rounds go through all
    entries, so that load falls on all alike."""
    best, rounds = {}, collections.defaultdict(list)
    for entry in entries:
        part = max(1, steps[entry] // 5)
        tried = [(entry.run(skin, warm[entry] // 4, part).cpu / part, skin) for skin in entry.skins] if len(entry.skins) > 1 else [(0, entry.skins[0])]
        entry.skin = min(tried)[1]
        print(f"{entry.name}: " + ", ".join(f"skin {skin:g} m {1e6 * seconds:.1f} us/step" for seconds, skin in tried), file=sys.stderr, flush=True)
    for turn in range(repeat):
        for entry in entries:
            result = entry.run(entry.skin, warm[entry], steps[entry])
            rounds[entry].append(result.cpu / steps[entry])
            print(f"round {turn + 1}, {entry.name}: {1e6 * result.cpu / steps[entry]:.1f} us/step", file=sys.stderr, flush=True)
            if entry not in best or result.cpu < best[entry].cpu:
                best[entry] = result._replace(state=result.state() if result.state and entry.keeps_state else None)
    ratios = {entry: statistics.median(a / b for a, b in zip(rounds[entry], rounds[entries[0]])) for entry in entries}
    return best, ratios


def row(*cells):
    print("| " + " | ".join(str(cell) for cell in cells) + " |")


def installed(program):
    if shutil.which(program):
        return True
    print(f"{program} is not installed: left out (Debian: apt-get install {'lammps' if program == 'lmp' else program})", file=sys.stderr)
    return False


def bed(options, measured):
    scene = options.work + "/bed.txt"
    if not os.path.exists(scene):
        command([options.bin + "/peer_bed", "make", scene])
    if measured:
        compare_spheres(options, scene)


def flow(options):
    """The bed under way: 50 ms after gravity has turned by 60 degrees, so that contacts open and close and neighbour lists wear out."""
    scene = options.work + "/flow.txt"
    if not os.path.exists(scene):
        header, rows = read_scene(options.work + "/bed.txt")
        size, angle = math.dist(header["gravity"], (0, 0, 0)), math.radians(60)
        header["gravity"] = [size * math.sin(angle), 0.0, -size * math.cos(angle)]
        with open(scene + ".start", "w") as out:
            for key, values in header.items():
                out.write(f"# {key} {' '.join(map(repr, values))}\n")
            out.writelines(" ".join(map(repr, values)) + "\n" for values in rows)
        command([options.bin + "/peer_bed", "run", scene + ".start", scene, "25000", "1", "1"])
    compare_spheres(options, scene)


def compare_spheres(options, scene):
    header, rows = read_scene(scene)
    skins = [0.2e-4, 0.5e-4, 1e-4, 2e-4, 4e-4]
    entries = [Ours(options, scene, "peer_bed", 1, skins), Ours(options, scene, "peer_bed", 2, skins)]
    if installed("lmp"):
        entries += [Lammps(options, scene, "lmp", "LAMMPS gran/hooke/history", "bed.lammps", skins, model="hooke", newton="off"),
                    Lammps(options, scene, "lmp", "LAMMPS granular", "bed.lammps", skins, model="granular", newton="off")]
    if installed("liggghts"):
        entries += [Lammps(options, scene, "liggghts", "LIGGGHTS hooke/stiffness", "bed.liggghts", skins)]
    if installed("yade"):
        skins = [1e-4, 3e-4]  # they matter less to it, and it takes longest
        entries += [Yade(options, "YADE ViscElPhys", "bed_yade.py", skins, scene=scene, law="viscoelastic"),
                    Yade(options, "YADE CundallStrack", "bed_yade.py", skins, scene=scene, law="cundall-strack")]
    for entry in entries:
        entry.keeps_state = True
    warm = {entry: options.warm for entry in entries}
    steps = {entry: options.steps for entry in entries}
    best, ratios = compare(entries, warm, steps, options.repeat)
    gravity = ", ".join(f"{g:.3g}" for g in header["gravity"])
    print(f"\n{len(rows)} spheres, {options.steps} steps after {options.warm}, gravity ({gravity}) m/s2, least of {options.repeat} rounds\n")
    row("code", "version", "skin [mm]", "steps/s per core (CPU)", "time / ours", "median of rounds", "contacts", "mean overlap [nm]", "kinetic energy [J]",
        "mean way [um]")
    row(*["---"] * 10)
    ours = best[entries[0]]
    for entry in entries:
        result, check = best[entry], check_bed(scene, best[entry].state)
        row(entry.name, entry.version(), f"{1e3 * entry.skin:g}", f"{options.steps / result.cpu:.0f}", f"{result.cpu / ours.cpu:.2f}",
            f"{ratios[entry]:.2f}", check["contacts"], f"{1e9 * check['overlap']:.2f}", f"{check['kinetic']:.1e}", f"{1e6 * check['way']:.2f}")
    parts, two = ours.report, best[entries[1]]
    print(f"\nOurs, two threads: {options.steps / two.wall:.0f} steps/s of wall time, {ours.wall / two.wall:.2f} times one thread's")
    print(f"Ours, wall seconds: pairs {parts['seconds_pairs']:.3f}, integration {parts['seconds_integration']:.3f}, lists {parts['seconds_lists']:.3f}; "
          f"{parts['pair_tests']:.0f} listed pairs, {parts['rebuilds']} rebuilds")


def grains(options):
    scene, lattice = options.work + "/grains.txt", options.work + "/lattice.txt"
    if not os.path.exists(scene):
        command([options.bin + "/peer_grains", "make", scene, lattice])
    count = len(read_scene(scene)[1])
    skins = [1e-4, 2e-4, 5e-4]
    entries = [Ours(options, scene, "peer_grains", 1, skins), Ours(options, scene, "peer_grains", 2, skins)]
    if installed("yade"):
        entries += [Yade(options, "YADE LevelSet", "grains_yade.py", [0.0, 1e-4], scene=scene, lattice=lattice)]
    for entry in entries:
        entry.keeps_state = False
    few = lambda entry: isinstance(entry, Yade)
    warm = {entry: 20 if few(entry) else options.warm for entry in entries}
    steps = {entry: 60 if few(entry) else options.steps for entry in entries}
    best, ratios = compare(entries, warm, steps, options.repeat)
    print(f"\n{count} level-set grains, least of {options.repeat} rounds\n")
    row("code", "version", "skin [mm]", "steps", "us/step (CPU)", "us/step wall", "us per grain and step", "contacts", "mean overlap [um]",
        "us per contact and step", "cost / ours", "median of rounds")
    row(*["---"] * 12)
    cost = lambda entry: 1e6 * best[entry].cpu / steps[entry]
    per_contact = lambda entry: cost(entry) / best[entry].report["contacts"]
    for entry in entries:
        result = best[entry]
        row(entry.name, entry.version(), f"{1e3 * entry.skin:g}", steps[entry], f"{cost(entry):.1f}", f"{1e6 * result.wall / steps[entry]:.1f}",
            f"{cost(entry) / count:.2f}", f"{result.report['contacts']:.0f}", f"{1e6 * result.report['mean_overlap']:.1f}",
            f"{per_contact(entry):.2f}", f"{per_contact(entry) / per_contact(entries[0]):.1f}",
            f"{ratios[entry] * best[entries[0]].report['contacts'] / result.report['contacts']:.1f}")
    parts = best[entries[0]].report
    print(f"\nOurs, wall seconds: pairs {parts['seconds_pairs']:.3f}, integration {parts['seconds_integration']:.3f}, lists {parts['seconds_lists']:.3f}; "
          f"{parts['node_tests']:.0f} node tests a step, {parts['rebuilds']} rebuilds")


def main():
    build = os.path.join(here, "../../../build")
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--bin", default=os.path.join(build, "release/bin"), help="folder of peer_bed and peer_grains")
    parser.add_argument("--work", default=os.path.join(build, "peers"), help="folder for scenes and states; scenes that are there are used again")
    parser.add_argument("--repeat", type=int, default=3)
    parser.add_argument("--warm", type=int, default=2000, help="steps before the measured ones: friction springs start at zero in all codes")
    parser.add_argument("--steps", type=int, default=5000)
    parser.add_argument("--scenes", default="bed,flow,grains", help="bed: spheres at rest; flow: the same bed sliding; grains: level sets")
    options = parser.parse_args()
    options.bin, options.work = os.path.abspath(options.bin), os.path.abspath(options.work)
    os.makedirs(options.work, exist_ok=True)
    scenes = options.scenes.split(",")
    if "bed" in scenes or "flow" in scenes:
        bed(options, "bed" in scenes)
    if "flow" in scenes:
        flow(options)
    if "grains" in scenes:
        grains(options)


main()
