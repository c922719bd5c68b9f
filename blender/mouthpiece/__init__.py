# SPDX-License-Identifier: GPL-3.0-or-later
"""Mouthpiece in Blender: click ten places on a head, type or load a line, and it speaks."""
import bpy
from bpy.props import BoolProperty, EnumProperty, FloatVectorProperty, StringProperty
from bpy_extras import view3d_utils

from . import heads, programs

bl_info = {
    "name": "Mouthpiece",
    "author": "The Mouthpiece authors",
    "version": (0, 2, 0),
    "blender": (3, 4, 0),
    "location": "3D view, sidebar, Mouthpiece",
    "description": "Type or load a line and the head in the scene speaks it",
    "category": "Animation",
}


class Preferences(bpy.types.AddonPreferences):
    bl_idname = __package__
    folder: StringProperty(name="Programs", subtype="DIR_PATH", description="Folder of synth and retarget; empty: the PATH")
    corpus: StringProperty(name="Corpus", subtype="FILE_PATH", description="Whose movements; empty: the sample corpus")
    voice: StringProperty(name="Voice", description="Of typed lines, as synth --voice; empty: the usual one")
    take_faulty: BoolProperty(name="Take a fit with faults", description="Speak although the fit says what is wrong")

    def draw(self, _context):
        for name in ("folder", "corpus", "voice", "take_faulty"):
            self.layout.prop(self, name)
        try:
            self.layout.label(text=f"synth: {programs.find('synth', self.folder)}")
        except programs.Problem as problem:
            self.layout.label(text=str(problem), icon="ERROR")


class Defaults:
    """What a run without preferences (a script) works with."""
    folder = corpus = voice = ""
    take_faulty = False


def preferences_of(context):
    addon = context.preferences.addons.get(__package__)
    return addon.preferences if addon and addon.preferences else Defaults


def head_of(context):
    """The mesh that is active, or whose anchor is."""
    thing = context.active_object
    if thing and thing.type == "EMPTY" and "mouthpiece_anchor" in thing:
        thing = thing.parent
    return thing if thing and thing.type == "MESH" else None


class HeadOperator:
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        return head_of(context) is not None

    def told(self, work):
        """Runs `work`; a problem is told, nothing is left half done."""
        try:
            self.report({"INFO"}, work())
            return {"FINISHED"}
        except programs.Problem as problem:
            self.report({"ERROR"}, str(problem))
            return {"CANCELLED"}


class SetAnchor(HeadOperator, bpy.types.Operator):
    """Puts an anchor at a place in the head's own space"""
    bl_idname = "mouthpiece.set_anchor"
    bl_label = "Set anchor"
    name: EnumProperty(items=heads.ANCHORS)
    location: FloatVectorProperty(subtype="XYZ")

    def execute(self, context):
        heads.set_anchor(head_of(context), self.name, self.location)
        return {"FINISHED"}


class FindAnchors(HeadOperator, bpy.types.Operator):
    """Finds the ten places by looking at the head; drag those that are not right"""
    bl_idname = "mouthpiece.find_anchors"
    bl_label = "Find anchors"

    def execute(self, context):
        def work():
            return f"{heads.find_anchors(head_of(context), preferences_of(context))} anchors are found"
        return self.told(work)


class PickAnchors(HeadOperator, bpy.types.Operator):
    """Click the ten places, one after the other; right click or Escape ends, Backspace goes back"""
    bl_idname = "mouthpiece.pick_anchors"
    bl_label = "Pick anchors"
    first: StringProperty(options={"SKIP_SAVE"})

    def invoke(self, context, _event):
        if context.area is None or context.area.type != "VIEW_3D":
            self.report({"ERROR"}, "Anchors are picked in a 3D view")
            return {"CANCELLED"}
        self.head = head_of(context)
        names = [name for name, _, _ in heads.ANCHORS]
        missing = [i for i, name in enumerate(names) if heads.anchor_of(self.head, name) is None]
        self.at = names.index(self.first) if self.first else (missing[0] if missing else 0)
        self.alone = bool(self.first)
        self.tell(context)
        context.window_manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def tell(self, context):
        _, what, where = heads.ANCHORS[self.at]
        context.area.header_text_set(f"Click: {what}{' (' + where + ')' if where else ''}   Esc: end   Backspace: back")

    def done(self, context, result):
        context.area.header_text_set(None)
        return {result}

    def modal(self, context, event):
        if event.type in {"RIGHTMOUSE", "ESC"} and event.value == "PRESS":
            return self.done(context, "FINISHED")
        if event.type == "BACK_SPACE" and event.value == "PRESS":
            self.at = max(0, self.at - 1)
            self.tell(context)
            return {"RUNNING_MODAL"}
        if event.type == "LEFTMOUSE" and event.value == "PRESS":
            region, view = context.region, context.region_data
            at = event.mouse_region_x, event.mouse_region_y
            origin = view3d_utils.region_2d_to_origin_3d(region, view, at)
            direction = view3d_utils.region_2d_to_vector_3d(region, view, at)
            place = place_under(self.head, origin, direction)
            if place is None:
                return {"PASS_THROUGH"}
            heads.set_anchor(self.head, heads.ANCHORS[self.at][0], place)
            self.at += 1
            if self.alone or self.at == len(heads.ANCHORS):
                return self.done(context, "FINISHED")
            self.tell(context)
            return {"RUNNING_MODAL"}
        return {"PASS_THROUGH"}


def place_under(head, origin, direction):
    """Where a ray of the world meets the head first, in the head's own space; None where it does not."""
    inverse = head.matrix_world.inverted()
    hit, place, _, _ = head.ray_cast(inverse @ origin, inverse.to_3x3() @ direction)
    return place if hit else None


class Fit(HeadOperator, bpy.types.Operator):
    """Finds out how the head's skin follows markers; takes seconds"""
    bl_idname = "mouthpiece.fit"
    bl_label = "Fit"

    def execute(self, context):
        def work():
            heads.fit(head_of(context), preferences_of(context))
            return "The head is fitted"
        return self.told(work)


class Speak(HeadOperator, bpy.types.Operator):
    """Makes the head speak from the present frame on: keyed shapes beside its own, and the sound"""
    bl_idname = "mouthpiece.speak"
    bl_label = "Speak"
    text: StringProperty(options={"SKIP_SAVE"})
    recording: StringProperty(options={"SKIP_SAVE"}, subtype="FILE_PATH")
    transcript: StringProperty(options={"SKIP_SAVE"})

    def execute(self, context):
        scene = context.scene.mouthpiece
        given = self.text or self.recording
        def work():
            shapes, frames = heads.speak(
                head_of(context), preferences_of(context), self.text if given else scene.text,
                self.recording if given else scene.recording, self.transcript if given else scene.transcript)
            return f"{frames} frames, {shapes} shapes"
        return self.told(work)


class Silence(HeadOperator, bpy.types.Operator):
    """Takes the speech away again"""
    bl_idname = "mouthpiece.silence"
    bl_label = "Remove speech"

    def execute(self, context):
        heads.remove_speech(head_of(context))
        return {"FINISHED"}


class Settings(bpy.types.PropertyGroup):
    text: StringProperty(name="Line", description="What is to be spoken")
    recording: StringProperty(name="Recording", subtype="FILE_PATH", description="Spoken instead of a line")
    transcript: StringProperty(name="Its words", description="What the recording says; empty: it is recognised")


class Panel(bpy.types.Panel):
    bl_idname = "VIEW3D_PT_mouthpiece"
    bl_label = "Mouthpiece"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Mouthpiece"

    def draw(self, context):
        layout, head = self.layout, head_of(context)
        if head is None:
            layout.label(text="Select the mesh of a head")
            return
        try:
            programs.find("synth", preferences_of(context).folder)
        except programs.Problem:
            layout.label(text="The program synth is not found", icon="ERROR")
            layout.label(text="See the add-on's preferences")
            return
        there = heads.places_of(head)
        layout.operator("mouthpiece.find_anchors")
        layout.operator("mouthpiece.pick_anchors", text=f"Pick anchors ({len(there)} of {len(heads.ANCHORS)})")
        column = layout.column(align=True)
        for name, what, _ in heads.ANCHORS:
            column.operator("mouthpiece.pick_anchors", text=what,
                            icon="CHECKMARK" if name in there else "BLANK1").first = name
        layout.operator("mouthpiece.fit")
        settings = context.scene.mouthpiece
        layout.prop(settings, "text")
        layout.prop(settings, "recording")
        if settings.recording:
            layout.prop(settings, "transcript")
        layout.operator("mouthpiece.speak")
        layout.operator("mouthpiece.silence")


CLASSES = (Preferences, Settings, SetAnchor, FindAnchors, PickAnchors, Fit, Speak, Silence, Panel)


def register():
    for each in CLASSES:
        bpy.utils.register_class(each)
    bpy.types.Scene.mouthpiece = bpy.props.PointerProperty(type=Settings)


def unregister():
    del bpy.types.Scene.mouthpiece
    for each in reversed(CLASSES):
        bpy.utils.unregister_class(each)
