"""Bakes shadows and ambient occlusion of the selected objects by vdbshade, and puts the image into their materials.
Imports glTF files with their baked light.

An add-on for Blender 3.4 and later (docs/lit.md). Its panel is in the sidebar of
the 3D view, tab "vdbshade". The program does the work in a process of its own: Blender can be used meanwhile, and Esc
ends the bake. Objects that are hidden from renders cast nothing."""

bl_info = {
    "name": "vdbshade bake",
    "author": "vdbshade",
    "version": (0, 2, 0),
    "blender": (3, 4, 0),
    "location": "3D View > Sidebar > vdbshade",
    "description": "Soft shadows and ambient occlusion from signed distance fields and triangles",
    "category": "Render",
}

import bpy
import bpy_extras

from .bake import Bake
from .lit import import_light
from .scene import BakeError, is_caster

ERRORS = (BakeError, OSError, RuntimeError)


class VDBSHADE_OT_bake(bpy.types.Operator):
    """Bake shadow and ambient occlusion of the selected objects into an image of their lightmap UVs"""
    bl_idname = "vdbshade.bake"
    bl_label = "Bake"
    bl_options = {"REGISTER", "UNDO"}

    def fail(self, error):
        self.bake.stop()
        self.report({"ERROR"}, str(error))
        return {"CANCELLED"}

    def finish(self, context, code):
        try:
            image = self.bake.end(context, code)
        except ERRORS as error:
            return self.fail(error)
        for warning in self.bake.warnings:
            self.report({"WARNING"}, warning)
        self.bake.stop()
        self.report({"INFO"}, "'%s' is in the materials of %d objects" % (image.name, len(self.bake.receivers)))
        return {"FINISHED"}

    def start(self, context):
        self.bake = Bake(context)
        self.bake.begin(context)

    def execute(self, context):
        try:
            self.start(context)
            code = self.bake.wait()
        except ERRORS as error:
            return self.fail(error)
        return self.finish(context, code)

    def invoke(self, context, event):
        try:
            self.start(context)
        except ERRORS as error:
            return self.fail(error)
        manager = context.window_manager
        self.timer = manager.event_timer_add(0.1, window=context.window)
        manager.progress_begin(0.0, 1.0)
        manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        if event.type == "ESC":
            self.leave(context)
            self.bake.stop()
            self.report({"INFO"}, "the bake was cancelled")
            return {"CANCELLED"}
        if event.type != "TIMER":
            return {"PASS_THROUGH"}
        try:
            code = self.bake.poll()
        except ERRORS as error:
            self.leave(context)
            return self.fail(error)
        context.window_manager.progress_update(self.bake.progress[0])
        context.workspace.status_text_set("vdbshade: %s   Esc: cancel" % self.bake.progress[1])
        if code is None:
            return {"RUNNING_MODAL"}
        self.leave(context)
        return self.finish(context, code)

    def cancel(self, context):
        self.leave(context)
        self.bake.stop()

    def leave(self, context):
        context.window_manager.event_timer_remove(self.timer)
        context.window_manager.progress_end()
        if context.workspace is not None:
            context.workspace.status_text_set(None)


class VDBSHADE_OT_import_light(bpy.types.Operator, bpy_extras.io_utils.ImportHelper):
    """Import a glTF or GLB that vdbshade has lit, and show its baked light"""
    bl_idname = "vdbshade.import_light"
    bl_label = "Import baked light"
    bl_options = {"REGISTER", "UNDO"}
    filter_glob: bpy.props.StringProperty(default="*.glb;*.gltf", options={"HIDDEN"})

    def execute(self, context):
        try:
            shown = import_light(self.filepath)
        except ERRORS as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        self.report({"INFO" if shown else "WARNING"}, "%d materials show their baked light%s" % (
            shown, "" if shown else ": none has MOZ_lightmap; bake with lights"))
        return {"FINISHED"}


# --- settings and panel


class VdbshadeSettings(bpy.types.PropertyGroup):
    what: bpy.props.EnumProperty(name="Bake", default="LIGHT", items=(
        ("LIGHT", "Light", "The sun's light by shadow and angle, plus ambient light times ambient occlusion"),
        ("BOTH", "Shadow × AO", "The sun's shadow times ambient occlusion: shadows are black"),
        ("SHADOW", "Shadow", "The share of the sun that is seen: 1 lit, 0 dark"),
        ("AO", "Ambient occlusion", "The share of the hemisphere that is open")))
    sun: bpy.props.PointerProperty(
        name="Sun", type=bpy.types.Object, description="Its direction and angle; none: the scene's first sun",
        poll=lambda self, obj: obj.type == "LIGHT" and obj.data.type == "SUN")
    ambient: bpy.props.FloatProperty(name="Ambient", default=0.25, min=0.0, soft_max=1.0,
                                     description="Light from all around, of which a sun's full light is 1")
    ao_distance: bpy.props.FloatProperty(name="AO distance", default=1.0, min=1e-4, soft_max=100.0, subtype="DISTANCE",
                                         description="How far ambient occlusion looks")
    size: bpy.props.IntProperty(name="Size", default=1024, min=16, max=16384, description="Texels along each side")
    padding: bpy.props.IntProperty(name="Padding", default=4, min=0, max=256, description="Texels around each chart")
    max_error: bpy.props.FloatProperty(name="Error", default=0.02, min=0.001, max=0.2, precision=3,
                                       description="Root mean square error that is allowed: less takes longer")
    unwrap: bpy.props.EnumProperty(name="UVs", default="AUTO", items=(
        ("AUTO", "Where needed", "Make lightmap UVs where an object has none, or shares its mesh with another"),
        ("ALWAYS", "Make anew", "Make lightmap UVs for all objects"),
        ("NEVER", "As they are", "Objects without lightmap UVs are refused")))
    link: bpy.props.EnumProperty(name="Materials", default="MULTIPLY", items=(
        ("NONE", "Image node", "Add the image, not linked"),
        ("MULTIPLY", "Multiply", "Multiply the base colour by it"),
        ("EMISSION", "Unlit", "Show base colour times image without any light")))
    image_name: bpy.props.StringProperty(name="Image", default="vdbshade")
    pack: bpy.props.BoolProperty(name="Pack", default=False, description="Keep the image in the blend file")


class VDBSHADE_PT_panel(bpy.types.Panel):
    bl_label = "vdbshade"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "vdbshade"

    def draw(self, context):
        settings, layout = context.scene.vdbshade, self.layout
        layout.use_property_split = True
        layout.prop(settings, "what")
        if settings.what != "AO":
            layout.prop(settings, "sun")
        if settings.what != "SHADOW":
            layout.prop(settings, "ao_distance")
        if settings.what == "LIGHT":
            layout.prop(settings, "ambient")
        for name in ("size", "padding", "max_error", "unwrap", "link", "image_name", "pack"):
            layout.prop(settings, name)
        layout.operator("vdbshade.bake", text="Bake %d objects" % sum(map(is_caster, context.selected_objects)))
        layout.operator("vdbshade.import_light")


class VdbshadePreferences(bpy.types.AddonPreferences):
    bl_idname = __name__
    program: bpy.props.StringProperty(name="Program", subtype="FILE_PATH",
                                      description="vdbshade; empty: the one on the path")

    def draw(self, context):
        self.layout.prop(self, "program")


CLASSES = (VdbshadeSettings, VDBSHADE_OT_bake, VDBSHADE_OT_import_light, VDBSHADE_PT_panel, VdbshadePreferences)


def register():
    for cls in CLASSES:
        bpy.utils.register_class(cls)
    bpy.types.Scene.vdbshade = bpy.props.PointerProperty(type=VdbshadeSettings)


def unregister():
    del bpy.types.Scene.vdbshade
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)


if __name__ == "__main__":
    register()
