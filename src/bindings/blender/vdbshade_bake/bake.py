"""A bake: the program in a process of its own, between the scene that goes out and the image that comes back."""
import json
import os
import re
import shutil
import subprocess
import tempfile

import bpy

from . import materials, scene
from .layout import Layout, needs_layout
from .scene import BakeError


def program_of(context):
    addon = context.preferences.addons.get(__package__)
    given = bpy.path.abspath(addon.preferences.program) if addon is not None else ""
    found = shutil.which(given or "vdbshade")
    if found is None:
        raise BakeError("'%s': no such program; name it in the add-on's preferences" % (given or "vdbshade"))
    return found


class Bake:
    """From the scene to the image, with the program in between. begin(), poll() until it is not None, then end()."""

    def __init__(self, context):
        self.settings = context.scene.vdbshade
        self.receivers = [obj for obj in context.selected_objects if scene.is_caster(obj)]
        self.folder = None
        self.process = None
        self.layout = None  # while UVs are made
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
        self.uv_names = {obj.name: materials.lightmap_uv(obj) for obj in self.receivers}
        without = [name for name, uv_name in self.uv_names.items() if uv_name is None]
        if without:
            raise BakeError("'%s': has no UV map for a lightmap: a second one, or one named '%s'" %
                            (without[0], materials.UV_NAME))
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
        """What the program has said since the last call: whole lines."""
        with open(self.log.name, encoding="utf-8", errors="replace", newline="\n") as log:
            log.seek(self.read)
            text = log.read()
            whole = text[:text.rfind("\n") + 1]
            self.read += len(whole.encode("utf-8"))
        return [line[len("vdbshade: "):] if line.startswith("vdbshade: ") else line for line in whole.splitlines()]

    def poll(self):
        """The program's exit code once it has ended, else None; progress and warnings are kept."""
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
        self.layout.take(self.folder)
        self.warnings += self.layout.warnings
        self.layout = None
        bpy.context.view_layer.update()
        self.bake(bpy.context)
        return None

    def wait(self):
        """As poll(), once all has ended."""
        while True:
            self.process.wait()
            code = self.poll()
            if code is not None:
                return code

    last = ""

    def end(self, context, code):
        """Takes the image over. A code other than 0 is the program's error."""
        if code != 0:
            raise BakeError(self.last or "vdbshade ended with %d" % code)
        name = self.settings.image_name or "vdbshade"
        path = self.keep(os.path.join(self.folder, "baked.exr"), name)
        image = materials.load_image(path, name, self.settings)
        if not bpy.data.filepath or self.settings.pack:
            image.pack()
        materials.put_image(self.receivers, image, self.uv_names, self.settings.link)
        self.undo = None
        return image

    def keep(self, path, name):
        """The image beside the blend file, where that has been saved; else where it is, to be packed."""
        if not bpy.data.filepath:
            return path
        target = bpy.path.abspath("//" + bpy.path.clean_name(name) + ".exr")
        shutil.copyfile(path, target + ".new")
        os.replace(target + ".new", target)
        return bpy.path.relpath(target)

    def stop(self):
        """Ends the program where it runs, and takes its files away, and UVs whose bake did not come to its end."""
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
