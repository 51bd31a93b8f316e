"""What the YADE scripts share: the scene, its box and material, and the measurement. Settings come as JSON in the variable PEER."""
import json
import math
import os
import time

from scene_file import read_scene
from yade import *

settings = json.loads(os.environ["PEER"])


def add_box(header, material):
    for axis in range(3):
        for face, sense in (("lower", 1), ("upper", -1)):
            O.bodies.append(utils.wall(header[face][axis], axis=axis, sense=sense, material=material))


def linear_law(header, normal_stiffness):
    """Springs and friction with history, without dashpot: the law that YADE has for level sets."""
    angle = math.atan(header["friction"][0])
    material = FrictMat(density=header["density"][0], frictionAngle=angle, young=1, poisson=0.5)
    ratio = header["tangential_stiffness"][0] / header["normal_stiffness"][0]
    return material, Ip2_FrictMat_FrictMat_FrictPhys(kn=MatchMaker(algo="val", val=normal_stiffness),
                                                     ks=MatchMaker(algo="val", val=ratio * normal_stiffness))


def measure():
    """CPU and wall seconds of the steps that count, and the touching pairs with their overlap at the end."""
    O.run(settings["warm"], True)
    cpu, wall = time.process_time(), time.perf_counter()
    O.run(settings["steps"], True)
    cpu, wall = time.process_time() - cpu, time.perf_counter() - wall
    overlaps = [i.geom.penetrationDepth for i in O.interactions if i.isReal and i.geom.penetrationDepth > 0]
    print("RESULT " + json.dumps({"steps": settings["steps"], "cpu": cpu, "wall": wall, "contacts": len(overlaps),
                                  "mean_overlap": sum(overlaps) / max(1, len(overlaps)), "kinetic_energy": utils.kineticEnergy(),
                                  "pairs": len([1 for i in O.interactions])}))
