# --lights: the lights that a glTF has, in place of those that the command line or a scene names, or with them.
load helper

# A floor of 4 × 4 and a plate over it.
# write_lit FILE NODES LIGHTS: with nodes that carry lights.
write_lit() {
    local count numbers
    count=$(grep -o '"light":' <<<"$2" | wc -l)
    numbers=$(seq -s, 0 $((count + 1)))
    cat >"$1" <<GLTF
{"asset": {"version": "2.0"}, "scenes": [{"nodes": [$numbers]}],
 "nodes": [{"name": "floor", "mesh": 0}, {"name": "plate", "mesh": 1}, $2],
 "extensions": {"KHR_lights_punctual": {"lights": [$3]}},
 "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "indices": 2}]},
            {"primitives": [{"attributes": {"POSITION": 3}, "indices": 2}]}],
 "accessors": [{"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"},
               {"bufferView": 1, "componentType": 5126, "count": 4, "type": "VEC2"},
               {"bufferView": 2, "componentType": 5123, "count": 6, "type": "SCALAR"},
               {"bufferView": 3, "componentType": 5126, "count": 4, "type": "VEC3"}],
 "bufferViews": [{"buffer": 0, "byteLength": 48}, {"buffer": 0, "byteOffset": 48, "byteLength": 32},
                 {"buffer": 0, "byteOffset": 80, "byteLength": 12},
                 {"buffer": 0, "byteOffset": 92, "byteLength": 48}],
 "buffers": [{"byteLength": 140, "uri": "data:;base64,AAAAwAAAAAAAAADAAAAAQAAAAAAAAADAAAAAQAAAAAAAAABAAAAAwAAAAAAAAABAAAAAAAAAAAAAAIA/AAAAAAAAgD8AAIA/AAAAAAAAgD8AAAIAAQAAAAMAAgAAAAC/AACAPwAAAL8AAAA/AACAPwAAAL8AAAA/AACAPwAAAD8AAAC/AACAPwAAAD8="}]}
GLTF
}

# A node that carries light $1 and looks straight down; $2: more of it.
down() {
    printf '{"matrix": [1,0,0,0, 0,0,-1,0, 0,1,0,0, %s,1], "name": "%s", "extensions": {"KHR_lights_punctual": {"light": %d}}}' \
        "$3" "$2" "$1"
}

SUN='{"type": "directional", "intensity": 3}'
LAMP='{"type": "point", "color": [1, 0.5, 0], "intensity": 8, "range": 9}'
SPOT='{"type": "spot", "spot": {"innerConeAngle": 0.1, "outerConeAngle": 0.5}}'

@test "a file's sun casts as the same sun of the command line" {
    write_lit lit.gltf "$(down 0 sun 0,7,0)" "$SUN"
    shade bake lit.gltf --lights lit.gltf --sun-angle 9 --receive floor --size 48 -o file.exr
    done_well
    shade bake lit.gltf --sun 0,1,0 --sun-angle 9 --receive floor --size 48 -o line.exr
    done_well
    same_values file.exr line.exr || fail "not the same values"
    shade info file.exr
    [[ $output == *"vdbshade_light_sun: directional towards 0 1 0, 9 degrees across, color 3 3 3"* ]] || fail "$output"
}

@test "suns, points and spots are channels by their nodes' names, and in what the output tells" {
    write_lit lit.gltf "$(down 0 'Key light' 0,7,0), $(down 1 lamp 1,3,0), $(down 2 'Key light' 0,4,0)" "$SUN,$LAMP,$SPOT"
    shade bake lit.gltf --lights lit.gltf --light-radius 0.25 --receive floor --size 16 -o out.exr
    done_well
    shade info out.exr
    for line in "channel 'shadow.Key_light'" "channel 'shadow.lamp'" "channel 'shadow.Key_light_2'" \
        'vdbshade_light_lamp: sphere at 1 3 0, radius 0.25, color 8 4 0, inverse square' \
        'vdbshade_light_Key_light_2: spot at 0 4 0 towards 0 -1 0, radius 0.25'; do
        [[ $output == *"$line"* ]] || fail "no '$line' in $output"
    done
}

@test "info tells the lights of a file" {
    write_lit lit.gltf "$(down 0 'Key light' 0,7,0), $(down 1 lamp 1,3,0)" "$SUN,$LAMP"
    shade info lit.gltf
    done_well
    for line in "light 'Key_light': directional towards 0 1 0" "light 'lamp': sphere at 1 3 0, radius 0, color 8 4 0"; do
        [[ $output == *"$line"* ]] || fail "no '$line'"
    done
    shade info lit.gltf --unit cm
    [[ $output == *"light 'lamp': sphere at 0.01 0.03 0"* ]] || fail 'not in centimetres'
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
    shade bake scene.json --lights other.gltf
    done_well
    shade info out.exr
    [[ $output == *"shadow.lamp"* && $output == *"shadow.sky"* && $output == *"other.gltf"* ]] || fail "$output"
    sed -i 's/"name": "sky"/"name": "lamp"/' scene.json
    shade bake scene.json --lights other.gltf
    refused 2 "--lights 'other.gltf'" "'lamp'" "of the scene's file"
}

@test "a file without lights, one that is not there and sizes without lights are refused" {
    write_box box.obj
    shade bake box.obj --lights box.obj -o out.exr
    refused 2 "--lights 'box.obj': has no lights"
    shade bake box.obj --lights none.glb -o out.exr
    refused 3 none.glb 'No such file'
    shade bake box.obj --sun 0,1,0 --light-radius 1 -o out.exr
    refused 2 '--light-radius: there is no --lights'
    write_lit lit.gltf "$(down 0 lamp 0,3,0)" '{"type": "point", "intensity": -1}'
    shade bake box.obj --lights lit.gltf -o out.exr
    refused 2 lit.gltf 'lights[0]' 'intensity' '-1'
    write_lit lit.gltf "$(down 0 lamp 0,3,0)" "$LAMP"
    shade bake box.obj --lights lit.gltf -o lit.gltf
    refused 2 'the output is the file of --lights'
}
