# SPDX-License-Identifier: GPL-3.0-or-later
"""The head in the scene: its anchors, its fit, its keyed shapes."""
import hashlib
import json
import os
import pathlib
import tempfile

import bpy
import numpy

from . import programs
from .programs import Problem

# What retarget pick asks for, and where that is.
ANCHORS = (
    ("LIP_CORNER_R", "Right corner of the mouth", "The head's own right"),
    ("LIP_CORNER_L", "Left corner of the mouth", ""),
    ("LIP_UP_MID", "Upper lip, middle", "Of its outer edge"),
    ("LIP_LO_MID", "Lower lip, middle", "Of its outer edge"),
    ("NOSE_TIP", "Tip of the nose", ""),
    ("CHIN_LOW", "The chin, where its front turns under", ""),
    ("CANTHUS_OUT_R", "Right eye, outer corner", ""),
    ("CANTHUS_OUT_L", "Left eye, outer corner", ""),
    ("EYE_IN_R", "Right eye, inner corner", ""),
    ("EYE_IN_L", "Left eye, inner corner", ""),
)
PREFIX = "MP_"
SHAPE = "speech_"
FIT_KEY = "mouthpiece_fit"  # on the object: the hash of the mesh and anchors that its face was fitted to


def anchor_of(head, name):
    """The empty that marks an anchor, or None."""
    for child in head.children:
        if child.type == "EMPTY" and child.get("mouthpiece_anchor") == name:
            return child
    return None


def set_anchor(head, name, location):
    """Puts an anchor at a place in the head's own space: an empty, which undo, save and the mouse know."""
    empty = anchor_of(head, name)
    if empty is None:
        empty = bpy.data.objects.new(PREFIX + name, None)
        empty["mouthpiece_anchor"] = name
        empty.empty_display_type = "SPHERE"
        users = head.users_collection or (bpy.context.scene.collection,)
        users[0].objects.link(empty)
        empty.parent = head
    empty.empty_display_size = 0.01 * max(head.dimensions) / max(1e-9, max(abs(s) for s in head.matrix_world.to_scale()))
    empty.matrix_parent_inverse.identity()
    empty.location = location
    return empty


def places_of(head):
    """{name: place} of the anchors that are there, in the head's own space."""
    found = {}
    for name, _, _ in ANCHORS:
        empty = anchor_of(head, name)
        if empty is not None:
            found[name] = list((empty.matrix_parent_inverse @ empty.matrix_basis).translation)
    return found


def find_anchors(head, preferences):
    """Puts the anchors where `retarget anchors` sees a face on the resting mesh; those that are there move."""
    with tempfile.TemporaryDirectory(prefix="mouthpiece_") as folder:
        mesh, found = pathlib.Path(folder) / "head.obj", pathlib.Path(folder) / "head.anchors.json"
        write_obj(head, mesh)
        programs.run("retarget", ["anchors", mesh, "--out", found, "--quiet"], preferences.folder)
        places = json.loads(found.read_text(encoding="utf-8"))["markers"]
    for name, place in places.items():
        set_anchor(head, name, place)
    return len(places)


def base_of(head):
    """Vertices of the resting mesh, whatever its modifiers and keys do."""
    keys = head.data.shape_keys
    source = keys.reference_key.data if keys else head.data.vertices
    places = numpy.empty(3 * len(source), dtype=numpy.float32)
    source.foreach_get("co", places)
    return places.reshape(-1, 3)


def write_obj(head, path):
    """The resting mesh in its own space and order; materials are its parts."""
    lines = [f"v {x:.9g} {y:.9g} {z:.9g}" for x, y, z in base_of(head)]
    names = [slot.material.name if slot.material else f"part_{i}" for i, slot in enumerate(head.material_slots)] or ["skin"]
    by_material = {}
    for polygon in head.data.polygons:
        by_material.setdefault(min(polygon.material_index, len(names) - 1), []).append(polygon)
    for index in sorted(by_material):
        lines.append("usemtl " + names[index].replace(" ", "_"))
        for polygon in by_material[index]:
            lines.append("f " + " ".join(str(v + 1) for v in polygon.vertices))
    pathlib.Path(path).write_text("\n".join(lines) + "\n", encoding="utf-8")


def fit_hash(head):
    digest = hashlib.sha256(base_of(head).tobytes())
    digest.update(json.dumps(places_of(head), sort_keys=True).encode())
    return digest.hexdigest()[:20]


def fit_folder(head):
    """Where a head's fit lies: with Blender's own files, found again by what it was made of."""
    root = pathlib.Path(bpy.utils.user_resource("DATAFILES", path="mouthpiece", create=True))
    folder = root / fit_hash(head)
    folder.mkdir(parents=True, exist_ok=True)
    return folder


def fit(head, preferences):
    """Fits the head, unless this very head with these anchors is fitted. Returns the .face file."""
    places = places_of(head)
    missing = [what for name, what, _ in ANCHORS if name not in places]
    if len(places) < 8 or any(name not in places for name, _, _ in ANCHORS[:4]):
        raise Problem("These anchors are missing: " + ", ".join(missing))
    folder = fit_folder(head)
    face = folder / "head.face"
    if not face.exists():
        write_obj(head, folder / "head.obj")
        (folder / "head.anchors.json").write_text(json.dumps({"markers": places}), encoding="utf-8")
        corpus = preferences.corpus or programs.sample_corpus(preferences.folder)
        arguments = ["fit", "--mesh", folder / "head.obj", "--anchors", folder / "head.anchors.json", "--corpus", corpus,
                     "--out", face, "--quiet"]
        try:
            programs.run("retarget", arguments + (["--even-if-faulty"] if preferences.take_faulty else []), preferences.folder)
        except Problem:
            # With faults it is written, and still told by the exit status.
            if not (preferences.take_faulty and face.exists()):
                raise
    head[FIT_KEY] = folder.name
    return face


def remove_speech(head):
    """Takes away what an earlier line has left: keys called speech_00 and so on, and their curves."""
    keys = head.data.shape_keys
    if not keys:
        return
    action = keys.animation_data.action if keys.animation_data else None
    if action:
        for curve in [c for c in curves_of(action, keys) if f'["{SHAPE}' in c.data_path]:
            curves_of(action, keys).remove(curve)
    for block in [b for b in keys.key_blocks if b.name.startswith(SHAPE)]:
        head.shape_key_remove(block)


def curves_of(action, keys):
    """The curves of an action: on itself up to Blender 4.3, in a channel bag of its slot after that."""
    if hasattr(action, "fcurves"):
        return action.fcurves
    slot = keys.animation_data.action_slot or action.slots.new("KEY", keys.name)
    keys.animation_data.action_slot = slot
    layer = action.layers[0] if action.layers else action.layers.new("speech")
    strip = layer.strips[0] if layer.strips else layer.strips.new(type="KEYFRAME")
    return strip.channelbag(slot, ensure=True).fcurves


def read_fbx(path):
    """What synth's FBX holds: resting vertices, the shapes' moves, their weights frame by frame."""
    before = set(bpy.data.objects), set(bpy.data.actions), set(bpy.data.meshes), set(bpy.data.materials)
    scene = bpy.context.scene
    kept = scene.frame_start, scene.frame_end, scene.render.fps, scene.render.fps_base, scene.frame_current
    selected = [thing for thing in bpy.context.selected_objects]
    active = bpy.context.view_layer.objects.active
    if active and active.mode != "OBJECT":
        bpy.ops.object.mode_set(mode="OBJECT")
    # The keys come out one a frame, at the scene's rate.
    bpy.ops.import_scene.fbx(filepath=str(path), anim_offset=0)
    made = [thing for thing in bpy.data.objects if thing not in before[0]]
    mesh = next(thing for thing in made if thing.type == "MESH")
    keys = mesh.data.shape_keys
    base = base_of(mesh).copy()
    blocks, weights = [], []
    curves = {c.data_path.split('"')[1]: c for c in curves_of(keys.animation_data.action, keys)}
    for block in keys.key_blocks[1:]:
        places = numpy.empty(3 * len(block.data), dtype=numpy.float32)
        block.data.foreach_get("co", places)
        blocks.append(places.reshape(-1, 3) - base)
        points = numpy.empty(2 * len(curves[block.name].keyframe_points), dtype=numpy.float32)
        curves[block.name].keyframe_points.foreach_get("co", points)
        weights.append(points.reshape(-1, 2))
    for thing in made:
        bpy.data.objects.remove(thing, do_unlink=True)
    for kind, known in ((bpy.data.actions, before[1]), (bpy.data.meshes, before[2]), (bpy.data.materials, before[3])):
        for thing in [t for t in kind if t not in known]:
            kind.remove(thing)
    scene.frame_start, scene.frame_end, scene.render.fps, scene.render.fps_base = kept[:4]
    scene.frame_set(kept[4])
    for thing in selected:
        thing.select_set(True)
    bpy.context.view_layer.objects.active = active
    return base, blocks, weights


def to_head(base, places):
    """The 3 x 3 matrix that takes moves in the FBX's space to the head's: both show the same vertices."""
    if base.shape != places.shape:
        raise Problem(f"the head has {len(places)} vertices, its fit {len(base)}: fit it again")
    a, b = base - base.mean(axis=0), places - places.mean(axis=0)
    matrix, *_ = numpy.linalg.lstsq(a.astype(numpy.float64), b.astype(numpy.float64), rcond=None)
    off = numpy.abs(a @ matrix - b).max()
    if off > 1e-3 * numpy.abs(b).max():
        raise Problem("the head has changed since its fit: fit it again")
    return matrix


def key_shapes(head, fbx, first_frame):
    """Puts synth's shapes and keys on the head, beside what it has. Returns (shapes, frames)."""
    base, moves, weights = read_fbx(fbx)
    matrix = to_head(base, base_of(head))
    remove_speech(head)
    if head.data.shape_keys is None:
        head.shape_key_add(name="Basis", from_mix=False)
    keys = head.data.shape_keys
    places = base_of(head)
    if keys.animation_data is None:
        keys.animation_data_create()
    if keys.animation_data.action is None:
        keys.animation_data.action = bpy.data.actions.new(head.name + " speech")
    curves = curves_of(keys.animation_data.action, keys)
    for number, (move, points) in enumerate(zip(moves, weights)):
        block = head.shape_key_add(name=f"{SHAPE}{number:02}", from_mix=False)
        block.data.foreach_set("co", (places + move @ matrix).astype(numpy.float32).ravel())
        curve = curves.new(data_path=f'key_blocks["{block.name}"].value')
        points = points.copy()
        points[:, 0] += first_frame - points[0, 0]
        curve.keyframe_points.add(len(points))
        curve.keyframe_points.foreach_set("co", points.ravel())
        for point in curve.keyframe_points:
            point.interpolation = "LINEAR"
        curve.update()
    head.data.update()
    return len(moves), len(weights[0]) if weights else 0


def add_sound(wav, first_frame, name):
    """The line's sound in the sequencer, packed into the file."""
    scene = bpy.context.scene
    editor = scene.sequence_editor_create()
    strips = editor.strips if hasattr(editor, "strips") else editor.sequences
    for old in [strip for strip in strips if strip.name.startswith(name)]:
        strips.remove(old)
    channel = 1 + max([strip.channel for strip in strips], default=0)
    strip = strips.new_sound(name, str(wav), channel, first_frame)
    strip.sound.pack()
    scene.use_audio_scrub = True


def speak(head, preferences, text="", recording="", transcript=""):
    """The head speaks a line from the present frame on. Returns (shapes, frames)."""
    face = fit(head, preferences)
    folder = fit_folder(head)
    scene = bpy.context.scene
    rate = scene.render.fps / scene.render.fps_base
    if not 24 <= rate <= 240:
        raise Problem(f"the scene runs at {rate:g} frames a second; expected 24 to 240")
    fbx, wav = folder / "line.fbx", folder / "line.wav"
    arguments = ["--face", face, "--fps", f"{rate:.6g}", "-o", fbx, "-o", wav, "--quiet"]
    if recording:
        arguments += ["--audio", bpy.path.abspath(recording)]
        arguments += ["--transcript", transcript] if transcript.strip() else []
    elif text.strip():
        arguments += ["--text", text]
    else:
        raise Problem("There is nothing to say: type a line or choose a recording")
    if preferences.voice and not recording:
        arguments += ["--voice", preferences.voice]
    if preferences.corpus:
        arguments += ["--corpus", preferences.corpus]
    programs.run("synth", arguments, preferences.folder)
    first = scene.frame_current
    shapes, frames = key_shapes(head, fbx, first)
    add_sound(wav, first, f"Speech {head.name}")
    scene.frame_end = max(scene.frame_end, first + frames)
    for file in (fbx, wav):
        os.remove(file)
    return shapes, frames
