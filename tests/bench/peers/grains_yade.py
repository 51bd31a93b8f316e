"""The compressed level-set grains in YADE: the same distances on the same spacing, as many surface nodes on the same spiral."""
from yade_scene import *

header, rows = read_scene(settings["scene"])
lattice, lines = read_scene(settings["lattice"])
size = [int(n) for n in lattice["size"]]
grid = RegularGrid(min=lattice["origin"], nGP=size, spacing=lattice["spacing"][0])
distances = [lines[i * size[1]:(i + 1) * size[1]] for i in range(size[0])]
material, physics = linear_law(header, header["secant_stiffness"][0])
O.materials.append(material)
add_box(header, material)
template = levelSetBody(grid=grid, distField=distances, nSurfNodes=int(header["nodes"][0]), nodesPath=2, material=material)
for row in rows:
    body = Body()
    body.shape = template.shape  # one for all, as ours: 50 copies would only be slower
    body.material = material
    body.aspherical = True
    body.state.pos, body.state.ori = row[:3], Quaternion(*row[3:7])
    body.state.mass, body.state.inertia = template.state.mass, template.state.inertia
    O.bodies.append(body)
O.engines = [
    ForceResetter(),
    InsertionSortCollider([Bo1_LevelSet_Aabb(), Bo1_Wall_Aabb()], verletDist=settings["skin"]),
    InteractionLoop([Ig2_LevelSet_LevelSet_ScGeom(), Ig2_Wall_LevelSet_ScGeom()], [physics],
                    [Law2_ScGeom_FrictPhys_CundallStrack(sphericalBodies=False)]),
    NewtonIntegrator(damping=header["damping"][0], gravity=header["gravity"]),
]
O.dt = header["time_step"][0]
print("nodes", len(template.shape.surfNodes), "mass", template.state.mass)
measure()
os._exit(0)
