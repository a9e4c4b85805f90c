"""Imports a glTF or GLB with its baked light (MOZ_lightmap), which Blender's importer ignores."""
import math
import sys

import bpy


class LightImporter:
    """Hooks of Blender's glTF importer. It imports each lightmap as the emission of its material."""
    shown = 0  # materials

    def gather_import_material_before_hook(self, gltf_material, vertex_color, gltf):
        from io_scene_gltf2.io.com.gltf2_io import TextureInfo
        extensions = gltf_material.extensions or {}
        light = extensions.get("MOZ_lightmap")
        if light is not None:
            extensions.pop("KHR_materials_emissive_strength", None)
            gltf_material.emissive_texture = TextureInfo.from_dict(light)
            gltf_material.emissive_factor = [light.get("intensity", 1.0) / math.pi] * 3

    def gather_import_material_after_hook(self, gltf_material, vertex_color, material, gltf):
        if "MOZ_lightmap" in (gltf_material.extensions or {}):
            LightImporter.shown += show_light(material.node_tree)


def multiply(tree, target, sockets):
    """Links the product of sockets to `target`. A socket that is an unlinked input stands for its colour."""
    product = None
    for i, socket in enumerate(sockets):
        if product is None:
            product = socket
            continue
        mix = tree.nodes.new("ShaderNodeMixRGB")
        mix.blend_type = "MULTIPLY"
        mix.location = (target.node.location[0] - 250.0, target.node.location[1] - 200.0 * i)
        mix.inputs["Fac"].default_value = 1.0
        for name, factor in (("Color1", product), ("Color2", socket)):
            if factor.is_output:
                tree.links.new(factor, mix.inputs[name])
            else:
                mix.inputs[name].default_value = factor.default_value[:]
        product = mix.outputs["Color"]
    tree.links.new(product, target)


def show_light(tree):
    """Makes the emission of an imported material base colour × lightmap × AO, without any other light. Returns whether
    it has a lightmap."""
    shader = next((node for node in tree.nodes if node.bl_idname == "ShaderNodeBsdfPrincipled"), None)
    glow = shader and (shader.inputs.get("Emission Color") or shader.inputs["Emission"])
    if not glow or not glow.is_linked:
        return False
    light, base = glow.links[0].from_socket, shader.inputs["Base Color"]
    light.node.image.colorspace_settings.name = "Non-Color"
    factors = [base.links[0].from_socket if base.is_linked else base, light]
    factors += [node.inputs["Occlusion"].links[0].from_socket for node in tree.nodes
                if node.bl_idname == "ShaderNodeGroup" and "Occlusion" in node.inputs and node.inputs["Occlusion"].is_linked]
    multiply(tree, glow, factors)
    for link in list(base.links):
        tree.links.remove(link)
    base.default_value = (0.0, 0.0, 0.0, 1.0)
    (shader.inputs.get("Specular IOR Level") or shader.inputs["Specular"]).default_value = 0.0
    return True


def import_light(path):
    """Imports a file. Returns the number of materials that show light."""
    module, LightImporter.shown = sys.modules[__package__], 0
    module.glTF2ImportUserExtension = LightImporter
    try:
        # By default the importer of Blender 3.4 looks for flat faces, which fails with NumPy 1.24.
        bpy.ops.import_scene.gltf(filepath=path, import_shading="SMOOTH")
    finally:
        del module.glTF2ImportUserExtension
    return LightImporter.shown
