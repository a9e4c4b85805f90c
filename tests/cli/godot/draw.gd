# Godot 3 draws what a camera sees that looks down at a floor of 4 × 4 from below its roof: lit.gltf, and then the floor with
# shaders that use mask.png and probes.png.
extends SceneTree

func _initialize():
    var lit = load("res://lit.gltf").instance()
    root.add_child(lit)
    var camera = Camera.new()
    camera.projection = Camera.PROJECTION_ORTHOGONAL
    camera.size = 4
    camera.near = 0.01
    camera.transform = Transform(Basis(Vector3(1, 0, 0), -PI / 2), Vector3(0, 0.5, 0))
    root.add_child(camera)
    camera.current = true
    var world = root.world
    world.environment = Environment.new() # without ambient light
    world.environment.background_mode = Environment.BG_COLOR
    world.environment.ambient_light_energy = 0
    yield(draw("lit"), "completed")
    var sun = DirectionalLight.new()
    sun.rotation.x = -PI / 2
    root.add_child(sun)
    var material = ShaderMaterial.new()
    material.set_shader_param("mask", load("res://mask.png"))
    material.set_shader_param("probes", load("res://probes.png"))
    material.set_shader_param("box_min", Vector3(-2, 0, -2))
    material.set_shader_param("box_max", Vector3(2, 0.0625, 2))
    lit.get_node("floor").material_override = material
    for name in ["mask", "probes"]:
        var file = File.new()
        file.open("res://" + name + ".shader.txt", File.READ)
        material.shader = Shader.new()
        material.shader.code = file.get_as_text()
        yield(draw(name), "completed")
    quit()

func draw(name):
    for _frame in 3:
        yield(self, "idle_frame")
    var picture = root.get_texture().get_data()
    picture.flip_y()
    picture.save_png("res://" + name + ".drawn.png")
