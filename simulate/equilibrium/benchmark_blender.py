# SPDX-License-Identifier: Apache-2.0
"""Drapes a 20 cm patch of N x N points over a 9 cm sphere with Blender's cloth for some seconds.

Run as: blender --background --python static_benchmark_blender.py -- POINTS SECONDS
Prints one line: drape-peer FASTEST_MM_PER_S MEAN_STRAIN_PERCENT LOWEST_MM
"""
import sys

import bpy

points, seconds = int(sys.argv[-2]), float(sys.argv[-1])
side_m, radius_m, per_second = 0.2, 0.045, 25

bpy.ops.object.select_all(action="SELECT")
bpy.ops.object.delete()
bpy.ops.mesh.primitive_uv_sphere_add(segments=32, ring_count=16, radius=radius_m)
sphere = bpy.context.object
sphere.modifiers.new("Collision", "COLLISION")
sphere.collision.thickness_outer = 0.001
sphere.collision.cloth_friction = 40
bpy.ops.mesh.primitive_grid_add(
    x_subdivisions=points - 1, y_subdivisions=points - 1, size=side_m,
    location=(0.005, -0.004, radius_m + 0.003))
cloth = bpy.context.object
settings = cloth.modifiers.new("Cloth", "CLOTH").settings
settings.quality = 5  # stiffness and mass as it comes: its values have no units
cloth.modifiers["Cloth"].collision_settings.distance_min = 0.001

scene = bpy.context.scene
scene.render.fps = per_second
frames = round(seconds * per_second) + 1
scene.frame_end = frames
cloth.modifiers["Cloth"].point_cache.frame_end = frames


def places():
    mesh = cloth.evaluated_get(bpy.context.evaluated_depsgraph_get()).to_mesh()
    return [cloth.matrix_world @ vertex.co for vertex in mesh.vertices]


before = now = None
for frame in range(1, frames + 1):
    scene.frame_set(frame)
    if frame >= frames - 1:
        before, now = now, places()
fastest = max((a - b).length for a, b in zip(before, now)) * per_second
strains = []
for edge in cloth.data.edges:
    a, b = edge.vertices
    rest = (cloth.data.vertices[a].co - cloth.data.vertices[b].co).length
    strains.append(abs((now[a] - now[b]).length / rest - 1))
lowest = min(p.z for p in now)
print(f"drape-peer {fastest * 1e3:.6g} {100 * sum(strains) / len(strains):.6g} {lowest * 1e3:.6g}")
