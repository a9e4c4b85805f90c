"""A bake: writes the scene, runs the program in its own process, and puts the image into the materials."""
import json
import os
import re
import shutil
import subprocess
import tempfile

import bpy

from . import scene
from .layout import Layout, UV_NAME, lightmap_uv, needs_layout
from .scene import BakeError

IMAGE_NODE, UV_NODE, MIX_NODE = "vdbshade image", "vdbshade UV", "vdbshade mix"


def program_of(context):
    addon = context.preferences.addons.get(__package__)
    given = bpy.path.abspath(addon.preferences.program) if addon is not None else ""
    found = shutil.which(given or "vdbshade")
    if found is None:
        raise BakeError("'%s': no such program; name it in the add-on's preferences" % (given or "vdbshade"))
    return found


class Bake:
    """Call begin(), poll() until it returns a code, then end()."""

    def __init__(self, context):
        self.settings = context.scene.vdbshade
        self.receivers = [obj for obj in context.selected_objects if scene.is_caster(obj)]
        self.folder = None
        self.process = None
        self.layout = None  # not None while UVs are made
        self.undo = None
        self.progress = (0.0, "")
        self.warnings = []

    def begin(self, context):
        if not self.receivers:
            raise BakeError("select the mesh objects that are to be baked; they must not be hidden from renders")
        self.program, how = program_of(context), self.settings.unwrap
        self.folder = tempfile.mkdtemp(prefix="vdbshade-")
        if not needs_layout(self.receivers, how):
            self.bake(context)
            return
        self.layout = self.undo = Layout(context, self.receivers, how)
        parted = self.layout.part()
        if parted:
            self.warnings.append("%d objects have a mesh of their own now, as each has its place in the lightmap: %s" %
                                 (len(parted), ", ".join(parted[:3]) + (" …" if len(parted) > 3 else "")))
        context.view_layer.update()
        self.start(self.layout.command(self.program, self.folder, self.settings, context.evaluated_depsgraph_get()))

    def bake(self, context):
        """The second step, once all receivers have UVs."""
        self.uv_names = {obj.name: lightmap_uv(obj) for obj in self.receivers}
        without = [name for name, uv_name in self.uv_names.items() if uv_name is None]
        if without:
            raise BakeError("'%s': has no UV map for a lightmap: a second one, or one named '%s'" %
                            (without[0], UV_NAME))
        casters = [obj for obj in context.scene.objects if scene.is_caster(obj)]
        depsgraph = context.evaluated_depsgraph_get()
        there = set(scene.write_glb(os.path.join(self.folder, "scene.glb"), casters, depsgraph, self.uv_names,
                                    instances=True))
        receivers = [obj.name for obj in self.receivers if obj.name in there]
        if not receivers:
            raise BakeError("no selected object has a face")
        made = scene.scene_of(self.settings, context.scene, receivers, "baked.exr")
        with open(os.path.join(self.folder, "scene.json"), "w", encoding="utf-8") as out:
            json.dump(made, out)
        self.start([self.program, "bake", "scene.json", "--progress", "--max-error", "%g" % self.settings.max_error])

    def start(self, command):
        self.log_close()
        self.log = open(os.path.join(self.folder, command[1] + ".txt"), "w+", encoding="utf-8", errors="replace")
        self.process = subprocess.Popen(command, cwd=self.folder, stdin=subprocess.DEVNULL, stdout=self.log,
                                        stderr=subprocess.STDOUT)
        self.read = 0

    def lines(self):
        """The whole lines that the program has printed since the last call."""
        with open(self.log.name, encoding="utf-8", errors="replace", newline="\n") as log:
            log.seek(self.read)
            text = log.read()
            whole = text[:text.rfind("\n") + 1]
            self.read += len(whole.encode("utf-8"))
        return [line[len("vdbshade: "):] if line.startswith("vdbshade: ") else line for line in whole.splitlines()]

    def poll(self):
        """Updates progress and warnings. Returns the program's exit code once it has ended, else None."""
        code = self.process.poll()
        for line in self.lines():
            found = re.search(r"^(\S+) .*?(\d+) %", line)
            if line.startswith("warning: "):
                self.warnings.append(line[len("warning: "):])
            elif found:
                self.progress = (int(found.group(2)) / 100.0, line)
            else:
                self.last = line
        if code != 0 or self.layout is None:
            return code
        self.layout.read(self.folder)
        self.warnings += self.layout.warnings
        self.layout = None
        bpy.context.view_layer.update()
        self.bake(bpy.context)
        return None

    def wait(self):
        """Polls until the program has ended."""
        while True:
            self.process.wait()
            code = self.poll()
            if code is not None:
                return code

    last = ""

    def end(self, context, code):
        """Puts the image into the materials. A code other than 0 is the program's error."""
        if code != 0:
            raise BakeError(self.last or "vdbshade ended with %d" % code)
        name = self.settings.image_name or "vdbshade"
        path = self.keep(os.path.join(self.folder, "baked.exr"), name)
        image = load_image(path, name, self.settings)
        if not bpy.data.filepath or self.settings.pack:
            image.pack()
        set_image(self.receivers, image, self.uv_names, self.settings.link)
        self.undo = None
        return image

    def keep(self, path, name):
        """Copies the image beside the blend file. If that was never saved, the image stays, and is packed later."""
        if not bpy.data.filepath:
            return path
        target = bpy.path.abspath("//" + bpy.path.clean_name(name) + ".exr")
        shutil.copyfile(path, target + ".new")
        os.replace(target + ".new", target)
        return bpy.path.relpath(target)

    def stop(self):
        """Ends the program, removes its files, and removes the new UVs of an unfinished bake."""
        if self.process is not None and self.process.poll() is None:
            self.process.terminate()
            try:
                self.process.wait(5.0)
            except subprocess.TimeoutExpired:
                self.process.kill()
                self.process.wait()
        if self.undo is not None:
            self.undo.revert()
            self.undo = None
        if self.folder is not None:
            self.log_close()
            shutil.rmtree(self.folder, ignore_errors=True)
            self.folder = None

    def log_close(self):
        if getattr(self, "log", None) is not None:
            self.log.close()


# --- the image in materials


def load_image(path, name, settings):
    """Loads the file as an image of the blend file, in place of the last one of that name."""
    image = bpy.data.images.get(name)
    if image is None or image.source != "FILE":
        image = bpy.data.images.load(path)
        image.name = name
    else:
        if image.packed_file is not None:
            image.unpack(method="REMOVE")
        image.filepath = path
        image.reload()
    names = {item.identifier for item in image.colorspace_settings.bl_rna.properties["name"].enum_items}
    wanted = ("Linear Rec.709", "Linear") if settings.what == "LIGHT" else ("Non-Color",)
    for space in wanted:
        if space in names:
            image.colorspace_settings.name = space
            break
    image.alpha_mode = "CHANNEL_PACKED"
    return image


def find_node(tree, kind, name, location):
    node = tree.nodes.get(name)
    if node is None or node.bl_idname != kind:
        node = tree.nodes.new(kind)
        node.name = node.label = name
        node.location = location
    return node


def set_nodes(material, image, uv_name, how):
    """Adds image and UV map to a material's nodes, and links them by `how`. Repeating it changes nothing."""
    material.use_nodes = True
    tree = material.node_tree
    output = tree.get_output_node("ALL")
    place = output.location if output is not None else (0.0, 0.0)
    picture = find_node(tree, "ShaderNodeTexImage", IMAGE_NODE, (place[0] - 700.0, place[1] - 400.0))
    uv = find_node(tree, "ShaderNodeUVMap", UV_NODE, (place[0] - 900.0, place[1] - 400.0))
    picture.image = image
    uv.uv_map = uv_name
    tree.links.new(uv.outputs["UV"], picture.inputs["Vector"])
    shader = next((node for node in tree.nodes if node.bl_idname == "ShaderNodeBsdfPrincipled"), None)
    if how == "NONE" or shader is None:
        for node in tree.nodes:
            node.select = node == picture
        tree.nodes.active = picture
        return
    base = shader.inputs["Base Color"]
    if tree.nodes.get(MIX_NODE) is not None:
        return  # linked before
    mix = find_node(tree, "ShaderNodeMixRGB", MIX_NODE, (shader.location[0] - 250.0, shader.location[1] - 150.0))
    mix.blend_type = "MULTIPLY"
    mix.inputs["Fac"].default_value = 1.0
    if base.is_linked:
        tree.links.new(base.links[0].from_socket, mix.inputs["Color1"])
    else:
        mix.inputs["Color1"].default_value = base.default_value[:]
    tree.links.new(picture.outputs["Color"], mix.inputs["Color2"])
    if how == "MULTIPLY":
        tree.links.new(mix.outputs["Color"], base)
    else:  # EMISSION: as bright as baked, even without lights
        glow = shader.inputs.get("Emission Color") or shader.inputs["Emission"]
        tree.links.new(mix.outputs["Color"], glow)
        shader.inputs["Emission Strength"].default_value = 1.0
        for link in list(base.links):
            tree.links.remove(link)
        base.default_value = (0.0, 0.0, 0.0, 1.0)


def set_image(objects, image, uv_names, how):
    """Adds the image to all materials of objects. A material of other objects is copied before it changes."""
    ours = {obj.name for obj in objects}
    copies = {}
    for obj in objects:
        if not obj.material_slots:
            obj.data.materials.append(bpy.data.materials.new(obj.name))
        for slot in obj.material_slots:
            material = slot.material
            if material is None:
                material = slot.material = bpy.data.materials.new(obj.name)
            uv_name = uv_names[obj.name]
            shared = any(material.name in other.material_slots and
                         (other.name not in ours and how != "NONE" or uv_names.get(other.name, uv_name) != uv_name)
                         for other in bpy.data.objects if other.type == "MESH")
            if shared:
                key = (material.name, uv_name)
                if key not in copies:
                    copies[key] = material.copy()
                material = slot.material = copies[key]
            set_nodes(material, image, uv_name, how)
