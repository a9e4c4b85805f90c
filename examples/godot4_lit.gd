# Shows the light of a lit glTF (docs/lit.md) in Godot 4: set it as the import script of the .gltf.
@tool
extends EditorScenePostImport

const CODE := """
shader_type spatial;
render_mode unshaded;
uniform vec4 base : source_color;
uniform sampler2D base_map : source_color, hint_default_white;
uniform sampler2D ao : hint_default_white;
uniform sampler2D light : repeat_disable; // linear
uniform float intensity;
void fragment() {
    ALBEDO = base.rgb * texture(base_map, UV).rgb * texture(light, UV2).rgb * intensity * texture(ao, UV2).r;
}
"""

func _post_import(scene: Node) -> Object:
    var shader := Shader.new()
    shader.code = CODE
    var gltf: Dictionary = JSON.parse_string(FileAccess.get_file_as_string(get_source_file()))
    for node in scene.find_children("*", "ImporterMeshInstance3D") + scene.find_children("*", "MeshInstance3D"):
        for i in node.mesh.get_surface_count():
            var old: BaseMaterial3D = node.mesh.surface_get_material(i) if node.mesh is ArrayMesh else node.mesh.get_surface_material(i)
            for material in gltf.materials:
                var light = material.get("extensions", {}).get("MOZ_lightmap")
                if light == null or old == null or old.resource_name != material.get("name"):
                    continue
                var lit := ShaderMaterial.new()
                lit.shader = shader
                lit.set_shader_parameter("base", old.albedo_color)
                lit.set_shader_parameter("base_map", old.albedo_texture)
                lit.set_shader_parameter("ao", load_texture(gltf, material.get("occlusionTexture")))
                lit.set_shader_parameter("light", load_texture(gltf, light))
                lit.set_shader_parameter("intensity", light.get("intensity", 1.0) / PI)
                if node.mesh is ArrayMesh:
                    node.mesh.surface_set_material(i, lit)
                else:
                    node.mesh.set_surface_material(i, lit)
    return scene

func load_texture(gltf: Dictionary, info) -> Texture2D:
    if info == null:
        return null
    return load(get_source_file().get_base_dir().path_join(gltf.images[gltf.textures[info.index].source].uri.uri_decode()))
