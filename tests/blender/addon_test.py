"""The add-on on a head that has a material, a rig and a shape of its own: addon_test.py ADDONS HEAD.obj ANCHORS.json BIN"""
import json
import os
import sys
import tempfile

import bpy
import numpy

addons, obj, anchors, programs_folder = sys.argv[sys.argv.index("--") + 1:]
sys.path.insert(0, addons)
import mouthpiece  # noqa: E402
from mouthpiece import heads  # noqa: E402

mouthpiece.register()
places = json.load(open(anchors, encoding="utf-8"))["markers"]


def refused(operator, expected, **given):
    try:
        operator(**given)
    except RuntimeError as error:
        assert expected in str(error), f"expected '{expected}' in: {error}"
        return
    raise AssertionError(f"not refused: {expected}")


# A head in the scene, as a user has it.
bpy.ops.object.select_all(action="SELECT")
bpy.ops.object.delete()
vertices, faces, parts, part = [], [], [], None
for line in open(obj, encoding="utf-8", errors="replace"):
    words = line.split()
    if words[:1] == ["v"]:
        vertices.append([float(w) for w in words[1:4]])
    elif words[:1] in (["usemtl"], ["g"], ["o"]) and len(words) > 1:
        part = words[1]
    elif words[:1] == ["f"]:
        faces.append([int(w.split("/")[0]) - 1 for w in words[1:]])
        parts.append(part or "skin")
mesh = bpy.data.meshes.new("head")
mesh.from_pydata(vertices, [], faces)
head = bpy.data.objects.new("Ann", mesh)
bpy.context.scene.collection.objects.link(head)
names = sorted(set(parts))
for name in names:
    mesh.materials.append(bpy.data.materials.new(name))
for polygon, name in zip(mesh.polygons, parts):
    polygon.material_index = names.index(name)
head.rotation_euler = (1.5708, 0, 0.3)  # Y up in its own space, turned in the scene
head.location = (2, 1, 0)
head.scale = (0.1, 0.1, 0.1)
rig = bpy.data.objects.new("rig", bpy.data.armatures.new("rig"))
bpy.context.scene.collection.objects.link(rig)
head.modifiers.new("rig", "ARMATURE").object = rig
head.shape_key_add(name="Basis")
smile = head.shape_key_add(name="Smile")
smile.data[0].co.x += 0.5
smile.value = 0.25
smile.keyframe_insert("value", frame=1)
bpy.context.view_layer.objects.active = head
head.select_set(True)
bpy.context.view_layer.update()

# What is missing is told.
path = os.environ["PATH"]
os.environ["PATH"] = "/nowhere"
for name, place in places.items():
    assert bpy.ops.mouthpiece.set_anchor(name=name, location=place) == {"FINISHED"}
refused(bpy.ops.mouthpiece.fit, "not installed")
os.environ["PATH"] = programs_folder + os.pathsep + path

# They are found where they were clicked, but for the chin, whose lowest point is a matter of taste.
assert bpy.ops.mouthpiece.find_anchors() == {"FINISHED"}
eyes = numpy.linalg.norm(numpy.subtract(places["CANTHUS_OUT_L"], places["CANTHUS_OUT_R"]))
for name, place in heads.places_of(head).items():
    off = numpy.linalg.norm(numpy.subtract(place, places[name]))
    assert off < (0.25 if name == "CHIN_LOW" else 0.07) * eyes, (name, off / eyes)
for name, place in places.items():
    bpy.ops.mouthpiece.set_anchor(name=name, location=place)
assert len(heads.places_of(head)) == len(places) == 10
nose = heads.anchor_of(head, "NOSE_TIP")
assert (nose.matrix_world.translation - head.matrix_world @ nose.location).length < 1e-4, "an anchor stands on the head"
bpy.data.objects.remove(heads.anchor_of(head, "LIP_UP_MID"))
refused(bpy.ops.mouthpiece.fit, "Upper lip, middle")
bpy.ops.mouthpiece.set_anchor(name="LIP_UP_MID", location=places["LIP_UP_MID"])
refused(bpy.ops.mouthpiece.speak, "nothing to say")

# A ray through the nose meets it: what a click does.
tip = head.matrix_world @ nose.location
front = head.matrix_world.to_3x3() @ __import__("mathutils").Vector((0, 0, 1))
hit = mouthpiece.place_under(head, tip + 5 * front, -front)
assert hit is not None and (hit - nose.location).length < 0.05 * max(v.co.y for v in mesh.vertices), hit

# It is fitted and speaks, and keeps what it had.
scene = bpy.context.scene
scene.render.fps = 30
scene.frame_set(11)
mouthpiece.Defaults.take_faulty = True  # this head's own faults are retarget's matter
assert bpy.ops.mouthpiece.fit() == {"FINISHED"}
before = heads.base_of(head).copy()
meshes, materials = len(bpy.data.meshes), len(bpy.data.materials)
assert bpy.ops.mouthpiece.speak(text="my map, mama") == {"FINISHED"}
keys = mesh.shape_keys


def speech():
    return [block for block in head.data.shape_keys.key_blocks if block.name.startswith("speech_")]


def mouth(frame):
    """Moves of all vertices in a frame, as the shapes mix."""
    scene.frame_set(frame)
    base = heads.base_of(head)
    total = numpy.zeros_like(base)
    for block in speech():
        moved = numpy.empty(base.size, dtype=numpy.float32)
        block.data.foreach_get("co", moved)
        total += block.value * (moved.reshape(-1, 3) - base)
    return total


assert len(speech()) > 5
assert numpy.array_equal(before, heads.base_of(head)), "the head at rest has changed"
assert "Smile" in keys.key_blocks and keys.animation_data.action.fcurves.find('key_blocks["Smile"].value'), "its own shape"
assert [m.name for m in mesh.materials] == names and head.modifiers["rig"].object == rig
curve = keys.animation_data.action.fcurves.find('key_blocks["speech_00"].value')
first, last = curve.keyframe_points[0].co.x, curve.keyframe_points[-1].co.x
assert first == 11 and 20 < last < 80, (first, last)
assert scene.frame_current == 11 and scene.render.fps == 30 and meshes == len(bpy.data.meshes), "the import has left something"
assert materials == len(bpy.data.materials)
lower, upper = numpy.array(places["LIP_LO_MID"]), numpy.array(places["LIP_UP_MID"])
chin = int(numpy.argmin(numpy.linalg.norm(before - numpy.array(places["LIP_LO_MID"]), axis=1)))
paths = numpy.array([mouth(frame)[chin] for frame in range(int(first), int(last) + 1)])
width = numpy.linalg.norm(numpy.array(places["LIP_CORNER_L"]) - numpy.array(places["LIP_CORNER_R"]))
travel = numpy.ptp(paths, axis=0)
print(f"{len(speech())} shapes, {len(paths)} frames; the lower lip travels {travel / width} mouths")
assert 0.1 < travel[1] / width < 1.0, "up and down"
assert travel[0] < 0.5 * travel[1], "not aside"
strips = scene.sequence_editor.sequences
assert len(strips) == 1 and strips[0].frame_start == 11 and strips[0].sound.packed_file, "the sound"

# Another line takes the place of the first.
scene.frame_set(5)
assert bpy.ops.mouthpiece.speak(text="now") == {"FINISHED"}
curve = keys.animation_data.action.fcurves.find('key_blocks["speech_00"].value')
assert curve.keyframe_points[0].co.x == 5
assert len(strips) == 1 and len(speech()) == len({block.name for block in speech()})
assert len([c for c in keys.animation_data.action.fcurves if "speech_" in c.data_path]) == len(speech())

# A recording, its words known.
with tempfile.TemporaryDirectory() as folder:
    wav = os.path.join(folder, "line.wav")
    with open(wav, "wb") as file:
        file.write(strips[0].sound.packed_file.data)
    assert bpy.ops.mouthpiece.speak(recording=wav, transcript="now") == {"FINISHED"}

    # Saved and opened again it is all there, and it goes on.
    count = len(speech())
    blend = os.path.join(folder, "ann.blend")
    bpy.ops.wm.save_as_mainfile(filepath=blend)
    bpy.ops.wm.read_homefile(use_empty=True)
    bpy.ops.wm.open_mainfile(filepath=blend)
    head = bpy.data.objects["Ann"]
    mesh, scene = head.data, bpy.context.scene
    assert len(speech()) == count and len(heads.places_of(head)) == 10
    assert scene.sequence_editor.sequences[0].sound.packed_file
    bpy.context.view_layer.objects.active = head
    scene.frame_set(5)
    assert bpy.ops.mouthpiece.speak(text="mama") == {"FINISHED"}
    assert len(speech()) > 5

    # Undone it is what it was.
    mouthpiece.heads.remove_speech(head)
    bpy.ops.ed.undo_push(message="before")
    assert bpy.ops.mouthpiece.speak(text="mama") == {"FINISHED"}
    bpy.ops.ed.undo_push(message="after")
    assert len(speech()) > 5
    bpy.ops.ed.undo()
    head = bpy.data.objects["Ann"]
    assert not speech(), "undo"
    bpy.ops.ed.redo()
    head = bpy.data.objects["Ann"]
    assert len(speech()) > 5, "redo"

# And silent again.
bpy.context.view_layer.objects.active = head
assert bpy.ops.mouthpiece.silence() == {"FINISHED"} and not speech()
mouthpiece.unregister()
print("the add-on works")
