"""blender --background --python import_glb.py -- FACE.glb [EXPECTED.json]

Imports the GLB as a user does, plays it and compares the vertices with where they must be: as EXPECTED.json says (the
animation before it was compressed; within 0.1 mm) or else as glTF's own arithmetic gives (within 0.01 mm).
"""
import json
import struct
import sys

import bpy
import numpy

TENTH_OF_MM = 1e-4
ROUNDING_M = 1e-5


class Glb:
    """Positions of a GLB's first mesh by the glTF specification alone."""

    def __init__(self, path):
        with open(path, "rb") as stream:
            data = stream.read()
        json_bytes = struct.unpack_from("<I", data, 12)[0]
        self.root = json.loads(data[20:20 + json_bytes])
        self.bin = data[28 + json_bytes:]
        self.primitives = self.root["meshes"][0]["primitives"]
        sampler = self.root["animations"][0]["samplers"][0]
        self.times = self.accessor(sampler["input"])[:, 0]
        self.weights = self.accessor(sampler["output"]).reshape(len(self.times), -1)

    def numbers(self, view, component, count, width):
        kind = {5123: "<u2", 5125: "<u4", 5126: "<f4"}[component]
        offset = self.root["bufferViews"][view].get("byteOffset", 0)
        return numpy.frombuffer(self.bin, kind, count * width, offset).reshape(count, width)

    def accessor(self, index):
        accessor = self.root["accessors"][index]
        width = {"SCALAR": 1, "VEC3": 3}[accessor["type"]]
        values = numpy.zeros((accessor["count"], width))
        if "bufferView" in accessor:
            values[:] = self.numbers(accessor["bufferView"], accessor["componentType"], accessor["count"], width)
        if "sparse" in accessor:
            sparse = accessor["sparse"]
            places = self.numbers(sparse["indices"]["bufferView"], sparse["indices"]["componentType"], sparse["count"], 1)
            values[places[:, 0]] = self.numbers(sparse["values"]["bufferView"], accessor["componentType"], sparse["count"], width)
        return values

    def positions(self, frame):
        parts = []
        for primitive in self.primitives:
            part = self.accessor(primitive["attributes"]["POSITION"])
            for weight, target in zip(self.weights[frame], primitive["targets"]):
                part = part + weight * self.accessor(target["POSITION"])
            parts.append(part)
        return numpy.concatenate(parts)


def check(condition, message):
    if not condition:
        print("FAILED:", message)
        sys.exit(1)


def imported_face(path, fps):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.context.scene.render.fps = round(fps)
    bpy.context.scene.render.fps_base = round(fps) / fps
    # Smooth shading: the other choice fails in Debian 12, whose Blender 3.4 asks its numpy 1.24 for the `numpy.bool` it lost.
    bpy.ops.import_scene.gltf(filepath=path, import_shading="SMOOTH")
    # The importer adds a mesh of its own where there are bones: how they are drawn.
    meshes = [item for item in bpy.context.scene.objects if item.type == "MESH" and item.data.shape_keys]
    check(len(meshes) == 1, f"{len(meshes)} meshes; expected 1")
    return meshes[0]


def shown_positions(face, frame, fps, first):
    """World positions at `frame`, turned back from Blender's Z up to glTF's Y up."""
    scene = bpy.context.scene
    at = first + frame
    scene.frame_set(int(at), subframe=at - int(at))
    evaluated = face.evaluated_get(bpy.context.evaluated_depsgraph_get())
    mesh = evaluated.to_mesh()
    local = numpy.empty(3 * len(mesh.vertices))
    mesh.vertices.foreach_get("co", local)
    evaluated.to_mesh_clear()
    matrix = numpy.array(evaluated.matrix_world)
    world = local.reshape(-1, 3) @ matrix[:3, :3].T + matrix[:3, 3]
    return numpy.stack([world[:, 0], world[:, 2], -world[:, 1]], axis=1)


def main():
    arguments = sys.argv[sys.argv.index("--") + 1:]
    glb = Glb(arguments[0])
    fps = (len(glb.times) - 1) / float(glb.times[-1])
    if len(arguments) > 1:
        with open(arguments[1], encoding="utf-8") as stream:
            expected = json.load(stream)
        fps = expected["fps"]
        frames = {item["frame"]: numpy.array(item["positions_m"]).reshape(-1, 3) for item in expected["frames"]}
        allowed = TENTH_OF_MM
    else:
        picked = sorted({0, len(glb.times) // 3, len(glb.times) // 2, len(glb.times) - 1})
        frames = {frame: glb.positions(frame) for frame in picked}
        allowed = ROUNDING_M

    face = imported_face(arguments[0], fps)
    keys = face.data.shape_keys.key_blocks
    names = glb.root["meshes"][0]["extras"]["targetNames"]
    check([key.name for key in keys][1:] == names, f"shape keys {[key.name for key in keys]}")
    action = face.data.shape_keys.animation_data.action or face.data.shape_keys.animation_data.nla_tracks[0].strips[0].action
    first = min(point.co[0] for point in action.fcurves[0].keyframe_points)

    largest = 0.0
    moved = 0.0
    for frame, wanted in frames.items():
        shown = shown_positions(face, frame, fps, first)
        check(len(shown) == len(wanted), f"{len(shown)} vertices; expected {len(wanted)}")
        largest = max(largest, float(numpy.linalg.norm(shown - wanted, axis=1).max()))
        moved = max(moved, float(numpy.linalg.norm(wanted - frames[0], axis=1).max()))
    print(f"{len(names)} shape keys, {len(frames)} frames: vertices move by up to {1000 * moved:.1f} mm, "
          f"largest error {1000 * largest:.4f} mm")
    check(moved > 1e-3, "the face does not move")
    check(largest <= allowed, f"largest error {1000 * largest:.4f} mm; allowed {1000 * allowed:.4f} mm")


main()
