"""Which UVs an object's lightmap has, and the image that comes back into the materials."""
import bpy

UV_NAME = "Lightmap"  # of the UV map that is made where an object has none for lightmaps
IMAGE_NODE = "vdbshade image"
UV_NODE = "vdbshade UV"
MIX_NODE = "vdbshade mix"


def lightmap_uv(obj):
    """The UV map that holds an object's lightmap: one of the name that this makes, or the second; else None."""
    layers = obj.data.uv_layers
    if UV_NAME in layers:
        return UV_NAME
    return layers[1].name if len(layers) > 1 else None


def load_image(path, name, settings):
    """The file as an image of the blend file, taking the place of the last one of that name."""
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


def node_of(tree, kind, name, location):
    node = tree.nodes.get(name)
    if node is None or node.bl_idname != kind:
        node = tree.nodes.new(kind)
        node.name = node.label = name
        node.location = location
    return node


def put_nodes(material, image, uv_name, how):
    """Image and UV map into a material's nodes; linked as `how` says, as often as wanted to the same end."""
    material.use_nodes = True
    tree = material.node_tree
    output = tree.get_output_node("ALL")
    place = output.location if output is not None else (0.0, 0.0)
    picture = node_of(tree, "ShaderNodeTexImage", IMAGE_NODE, (place[0] - 700.0, place[1] - 400.0))
    uv = node_of(tree, "ShaderNodeUVMap", UV_NODE, (place[0] - 900.0, place[1] - 400.0))
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
    known = tree.nodes.get(MIX_NODE)
    if known is not None:
        return  # linked before
    mix = node_of(tree, "ShaderNodeMixRGB", MIX_NODE, (shader.location[0] - 250.0, shader.location[1] - 150.0))
    mix.blend_type = "MULTIPLY"
    mix.inputs["Fac"].default_value = 1.0
    if base.is_linked:
        tree.links.new(base.links[0].from_socket, mix.inputs["Color1"])
    else:
        mix.inputs["Color1"].default_value = base.default_value[:]
    tree.links.new(picture.outputs["Color"], mix.inputs["Color2"])
    if how == "MULTIPLY":
        tree.links.new(mix.outputs["Color"], base)
    else:  # EMISSION: as bright as baked, without lights
        glow = shader.inputs.get("Emission Color") or shader.inputs["Emission"]
        tree.links.new(mix.outputs["Color"], glow)
        shader.inputs["Emission Strength"].default_value = 1.0
        for link in list(base.links):
            tree.links.remove(link)
        base.default_value = (0.0, 0.0, 0.0, 1.0)


def put_image(objects, image, uv_names, how):
    """The image into all materials of objects; one that other objects have, too, is copied before it looks otherwise."""
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
            put_nodes(material, image, uv_name, how)
