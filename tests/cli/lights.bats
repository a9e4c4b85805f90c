# --lights: lights of glTF files, beside the sun and a scene's lights.
load helper

# write_lit FILE NODES LIGHTS: a floor of 4 × 4 and a plate over it, with nodes that carry lights.
write_lit() {
    write_gltf "$1" <<GLTF
{"nodes": [{"name": "floor", "mesh": 0}, {"name": "plate", "mesh": 1}, $2],
 "extensions": {"KHR_lights_punctual": {"lights": [$3]}},
 "meshes": [{"primitives": [{"plate": [-2, 0, -2, 2, 2]}]}, {"primitives": [{"plate": [-0.5, 1, -0.5, 0.5, 0.5]}]}]}
GLTF
}

# A node with light $1 that points straight down; $2: more members.
down() {
    printf '{"matrix": [1,0,0,0, 0,0,-1,0, 0,1,0,0, %s,1], "name": "%s", "extensions": {"KHR_lights_punctual": {"light": %d}}}' \
        "$3" "$2" "$1"
}

SUN='{"type": "directional", "intensity": 3}'
LAMP='{"type": "point", "color": [1, 0.5, 0], "intensity": 8, "range": 9}'
SPOT='{"type": "spot", "spot": {"innerConeAngle": 0.1, "outerConeAngle": 0.5}}'

@test "a file's sun casts as the same --sun" {
    write_lit lit.gltf "$(down 0 sun 0,7,0)" "$SUN"
    succeed bake lit.gltf --lights lit.gltf --sun-angle 9 --receive floor --size 48 -o file.exr
    succeed bake lit.gltf --sun 0,1,0 --sun-angle 9 --receive floor --size 48 -o line.exr
    same file.exr line.exr
    info_tells file.exr "vdbshade_light_sun: directional towards 0 1 0, 9 degrees across, color 3 3 3"
}

@test "info prints the lights of a file" {
    write_lit lit.gltf "$(down 0 'Key light' 0,7,0), $(down 1 lamp 1,3,0)" "$SUN,$LAMP"
    info_tells lit.gltf "light 'Key_light': directional towards 0 1 0" "light 'lamp': sphere at 1 3 0, radius 0, color 8 4 0"
    succeed_printing "light 'lamp': sphere at 0.01 0.03 0" -- info lit.gltf --unit cm
    shade info "$ASSETS/thin.glb"
    [[ $output != *"light '"* ]] || fail 'a light'
}

@test "lights of a file go with a scene's own, and are an input of the output" {
    write_lit lit.gltf "$(down 0 lamp 0,3,0)" "$LAMP"
    cat >scene.json <<'JSON'
{"casters": [{"mesh": "lit.gltf"}], "receivers": [{"mesh": "lit.gltf", "objects": ["floor"], "size": 16, "output": "out.exr"}],
 "lights": [{"name": "sky", "type": "directional", "direction": [0, 1, 0], "angle_deg": 3}]}
JSON
    write_lit other.gltf "$(down 0 lamp 0,3,0)" "$LAMP"
    succeed bake scene.json --lights other.gltf
    info_tells out.exr shadow.lamp shadow.sky other.gltf
    sed -i 's/"name": "sky"/"name": "lamp"/' scene.json
    refuses 2 "--lights 'other.gltf'" "'lamp'" "of the scene's file" -- bake scene.json --lights other.gltf
}

@test "a file without lights, one that is not there and sizes without lights are refused" {
    refuse_each bake box.obj <<'LIST'
2 "--lights 'box.obj': has no lights" | --lights box.obj -o out.exr
3 none.glb 'No such file' | --lights none.glb -o out.exr
2 '--light-radius: needs --lights FILE' | --sun 0,1,0 --light-radius 1 -o out.exr
LIST
    write_lit lit.gltf "$(down 0 lamp 0,3,0)" '{"type": "point", "intensity": -1}'
    refuses 2 lit.gltf 'lights[0]' 'intensity' '-1' -- bake box.obj --lights lit.gltf -o out.exr
    write_lit lit.gltf "$(down 0 lamp 0,3,0)" "$LAMP"
    refuses 2 'the output is also an input' -- bake box.obj --lights lit.gltf -o lit.gltf
}

# write_scene FILE LIGHTS [MORE]: a scene of lit.gltf with its floor as receiver.
write_scene() {
    printf '{"casters": [{"mesh": "lit.gltf"}], "lights": [%s], %s
        "receivers": [{"mesh": "lit.gltf", "objects": "floor", "size": 32, "output": "scene.exr"}]}\n' "$2" "${3:-}" >"$1"
}

@test "render, query, volume and trade take the lights of a file" {
    write_lit lit.gltf "$(down 0 lamp 1,3,0)" "$LAMP"
    printf '0 0.1 0\n-1.9 0.1 -1.9\n' >points.xyz
    succeed query lit.gltf --lights file --light-radius 0.1 --points points.xyz -o answers.csv --answers-only
    [ "$(cat answers.csv)" = $'shadow.lamp\n0\n1' ] || fail "$(cat answers.csv)"
    succeed volume lit.gltf --lights lit.gltf --box -1,0.1,-1,1,0.3,1 --box-voxel-size 0.1 -o out.vdb
    info_tells out.vdb shadow.lamp
    succeed render lit.gltf --lights lit.gltf --size 48x32 -o lamp.png
    shade render lit.gltf --sun 0,1,0 --size 48x32 -o sun.png
    ! cmp -s lamp.png sun.png || fail 'the picture of another light'
    write_scene scene.json ''
    succeed trade scene.json --lights lit.gltf --size 16 --resolutions 16 --truth-rays 16 --budget 0.001 -o out.html --csv out.csv
    grep -q '^shadow,' out.csv || fail 'no shadow'
}

@test "--unit moves the lights of a file with the meshes" {
    write_lit lit.gltf "$(down 0 lamp 1,3,0)" "$LAMP"
    write_scene scene.json '{"name": "sky", "type": "directional", "direction": [0, 1, 0]}'
    succeed bake scene.json --lights lit.gltf --unit cm
    info_tells scene.exr 'vdbshade_light_lamp: sphere at 0.01 0.03 0,'
}

@test "a scene is no file of lights, and no output replaces one" {
    write_lit lit.gltf "$(down 0 lamp 1,3,0)" "$LAMP"
    write_scene scene.json '{"name": "sky", "type": "directional", "direction": [0, 1, 0]}'
    refuses 2 "--lights 'file': scene.json is a scene" -- bake scene.json --lights file
    cp lit.gltf lights.gltf
    refuses 2 'lights.gltf: the output is also an input' -- bake scene.json --lights lights.gltf -o lights.gltf
}
