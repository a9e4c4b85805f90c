# Shows the light of a lit glTF (docs/lit.md) in Godot 3.2: set it as the custom script of the .gltf in the Import dock.
tool
extends EditorScenePostImport

const CODE = """
shader_type spatial;
render_mode unshaded;
uniform vec4 base : hint_color;
uniform sampler2D base_map : hint_albedo;
uniform sampler2D ao : hint_white;
uniform sampler2D light; // linear
uniform float intensity;
void fragment() {
    ALBEDO = base.rgb * texture(base_map, UV).rgb * texture(light, UV2).rgb * intensity * texture(ao, UV2).r;
}
"""

var shader = Shader.new()
var gltf

func post_import(scene):
    shader.code = CODE
    var file = File.new()
    file.open(get_source_file(), File.READ)
    gltf = JSON.parse(file.get_as_text()).result
    show_light(scene)
    return scene

func show_light(node):
    for i in node.mesh.get_surface_count() if node is MeshInstance else 0:
        var old = node.mesh.surface_get_material(i)
        for material in gltf.materials:
            var light = material.get("extensions", {}).get("MOZ_lightmap")
            if light and old and old.resource_name == material.get("name"):
                var lit = ShaderMaterial.new()
                lit.shader = shader
                lit.set_shader_param("base", old.albedo_color)
                lit.set_shader_param("base_map", old.albedo_texture)
                lit.set_shader_param("ao", load_texture(material.get("occlusionTexture")))
                lit.set_shader_param("light", load_texture(light))
                lit.set_shader_param("intensity", light.get("intensity", 1) / PI)
                node.mesh.surface_set_material(i, lit)
    for child in node.get_children():
        show_light(child)

func load_texture(info):
    if info:
        return load(get_source_folder().plus_file(gltf.images[gltf.textures[info.index].source].uri.percent_decode()))
