"""The settled bed in YADE. settings["law"]: viscoelastic (springs and dashpots, as ours) or cundall-strack (springs; non-viscous damping)."""
from yade_scene import *

header, rows = read_scene(settings["scene"])
if settings["law"] == "viscoelastic":
    # Dashpots belong to the bodies: two in series, c1 c2/(c1 + c2), and springs likewise (half of what the documentation says). These are right for
    # two equal spheres, and for a mean sphere on a wall; ours and the sequence part by up to 41 % where masses differ much.
    stiffness = {key: header[key][0] for key in ("normal_stiffness", "tangential_stiffness")}

    def viscoelastic(mass, factor):
        constant = lambda key: factor * header["damping"][0] * math.sqrt(mass * stiffness[key])
        return ViscElMat(density=header["density"][0], frictionAngle=math.atan(header["friction"][0]), kn=2 * stiffness["normal_stiffness"],
                         ks=2 * stiffness["tangential_stiffness"], cn=constant("normal_stiffness"), cs=constant("tangential_stiffness"))

    mass = lambda row: header["density"][0] * 4 / 3 * math.pi * row[3]**3
    material = viscoelastic(sum(map(mass, rows)) / len(rows), 1 / (0.5 - 0.125**0.5))
    materials = [viscoelastic(mass(row), 8**0.5) for row in rows]
    physics, law, damping = Ip2_ViscElMat_ViscElMat_ViscElPhys(), Law2_ScGeom_ViscElPhys_Basic(), 0
else:
    material, physics = linear_law(header, header["normal_stiffness"][0])
    law, damping = Law2_ScGeom_FrictPhys_CundallStrack(), header["damping"][0]
    materials = [material] * len(rows)
add_box(header, material)
spheres = [O.bodies.append(utils.sphere(row[:3], row[3], material=each)) for row, each in zip(rows, materials)]
for index, row in zip(spheres, rows):
    O.bodies[index].state.vel = row[4:7] or Vector3.Zero
O.engines = [
    ForceResetter(),
    InsertionSortCollider([Bo1_Sphere_Aabb(), Bo1_Wall_Aabb()], verletDist=settings["skin"]),
    InteractionLoop([Ig2_Sphere_Sphere_ScGeom(), Ig2_Wall_Sphere_ScGeom()], [physics], [law]),
    NewtonIntegrator(damping=damping, gravity=header["gravity"]),
]
O.dt = header["time_step"][0]
measure()
with open(settings["state"], "w") as out:
    for index in spheres:
        body = O.bodies[index]
        out.write(" ".join(repr(float(x)) for x in (*body.state.pos, body.shape.radius, *body.state.vel)) + "\n")
os._exit(0)
