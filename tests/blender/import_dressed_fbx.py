"""Blender shows the picture of a head that came as GLB on the skin of our FBX, and on nothing else."""
import sys

import bpy

fbx = sys.argv[sys.argv.index("--") + 1]
bpy.ops.object.select_all(action="SELECT")
bpy.ops.object.delete()
bpy.ops.import_scene.fbx(filepath=fbx)
head = next(thing for thing in bpy.context.scene.objects if thing.type == "MESH")
assert head.data.uv_layers, "no texture coordinates"
shown = [[node.image for node in material.node_tree.nodes if node.type == "TEX_IMAGE"] for material in head.data.materials]
assert [len(images) for images in shown] == [1] + [0] * (len(shown) - 1), shown
image = shown[0][0]
links = [(link.from_node.type, link.to_socket.name) for link in head.data.materials[0].node_tree.links]
assert ("TEX_IMAGE", "Base Color") in links, links
assert image.packed_file and tuple(image.size) == (2, 2), (image.packed_file, tuple(image.size))
first = [round(255 * value) for value in image.pixels[:3]]
assert first == [192, 144, 112], first
print(f"{image.name}, {image.size[0]} x {image.size[1]}, on {head.data.materials[0].name}")
