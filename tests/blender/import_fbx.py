"""Blender opens our FBX: every vertex of frames throughout the line must be where the point cache has it, and Blender's own
reader of PC2 and MDD must put them there."""
import struct
import sys

import bpy

fbx, cache, mdd = sys.argv[sys.argv.index("--") + 1:]
with open(cache, "rb") as file:
    data = file.read()
vertices, _, _, frames = struct.unpack("<iffi", data[16:32])
positions = memoryview(data[32:]).cast("f")

bpy.ops.object.select_all(action="SELECT")
bpy.ops.object.delete()
bpy.ops.import_scene.fbx(filepath=fbx)
meshes = [thing for thing in bpy.context.scene.objects if thing.type == "MESH"]
assert len(meshes) == 1, [thing.name for thing in meshes]
head = meshes[0]
assert len(head.data.vertices) == vertices, (len(head.data.vertices), vertices)
assert len(head.data.materials) >= 2, "the parts' materials"
assert all(triangle.loop_total == 3 for triangle in head.data.polygons)
keys = head.data.shape_keys
assert keys and len(keys.key_blocks) > 5, "no blend shapes"
curves = keys.animation_data.action.fcurves
assert len(curves) == len(keys.key_blocks) - 1, "a curve for each shape"
rate = bpy.context.scene.render.fps / bpy.context.scene.render.fps_base

# The cache has the mesh's unit; the scale follows from the resting head.
span = max(v.co.y for v in head.data.vertices) - min(v.co.y for v in head.data.vertices)
first = [positions[3 * i + 1] for i in range(vertices)]
scale = span / (max(first) - min(first))
scale = 10 ** round(__import__("math").log10(scale))

base = [v.co.copy() for v in keys.key_blocks[0].data]
blocks = keys.key_blocks[1:]
moves = [[(a.co - b) for a, b in zip(block.data, base)] for block in blocks]
by_name = {}
for curve in curves:
    by_name[curve.data_path.split('"')[1]] = curve
worst = 0.0
checked = range(0, frames, max(1, frames // 12))
start = min(curve.keyframe_points[0].co.x for curve in curves)
for frame in checked:
    weights = [by_name[block.name].evaluate(start + frame) for block in blocks]
    for i in range(0, vertices, 7):
        place = base[i].copy()
        for weight, move in zip(weights, moves):
            if weight:
                place += weight * move[i]
        at = 3 * (frame * vertices + i)
        worst = max(worst, max(abs(place[axis] - scale * positions[at + axis]) for axis in range(3)))
unit_mm = 1000 * head.matrix_world.to_scale()[0]
print(f"{vertices} vertices, {len(blocks)} shapes, {frames} frames at {rate:g}: at most {worst * unit_mm:.3f} mm off")
assert worst * unit_mm < 0.15, "the shapes keep every vertex within 0.09 mm"
assert abs(rate - 60) < 1e-3 or abs(curves[0].keyframe_points[-1].co.x - start - (frames - 1)) < 1, rate

# The caches on the same mesh, by Blender's modifier.
for file, kind in ((cache, "PC2"), (mdd, "MDD")):
    head.shape_key_clear()
    reader = head.modifiers.new(kind, "MESH_CACHE")
    reader.cache_format, reader.filepath, reader.interpolation = kind, file, "NONE"
    off = 0.0
    for frame in checked:
        bpy.context.scene.frame_set(frame)
        shown = head.evaluated_get(bpy.context.evaluated_depsgraph_get()).data.vertices
        for i in range(0, vertices, 7):
            at = 3 * (frame * vertices + i)
            off = max(off, max(abs(shown[i].co[axis] - positions[at + axis]) for axis in range(3)))
    head.modifiers.remove(reader)
    print(f"{kind}: at most {off} off")
    assert off == 0, kind
