"""The settled bed in YADE. settings["law"]: viscoelastic (springs and dashpots, as ours) or cundall-strack (springs; non-viscous damping)."""
from yade_scene import *

header, rows = read_scene(settings["scene"])
if settings["law"] == "viscoelastic":
    # YADE's dashpots belong to the material: one constant for all pairs, that of two spheres of the mean mass.
    # Of two bodies in series it takes half of what it is given, whatever its documentation says.
    material = ViscElMat(density=header["density"][0], frictionAngle=math.atan(header["friction"][0]), kn=2 * header["normal_stiffness"][0],
                         ks=2 * header["tangential_stiffness"][0], cn=2 * settings["cn"], cs=2 * settings["cs"])
    physics, law, damping = Ip2_ViscElMat_ViscElMat_ViscElPhys(), Law2_ScGeom_ViscElPhys_Basic(), 0
else:
    material, physics = linear_law(header, header["normal_stiffness"][0])
    law, damping = Law2_ScGeom_FrictPhys_CundallStrack(), header["damping"][0]
O.materials.append(material)
add_box(header, material)
spheres = [O.bodies.append(utils.sphere(row[:3], row[3], material=material)) for row in rows]
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
