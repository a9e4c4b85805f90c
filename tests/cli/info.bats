# info: contents and problems of files, as text and as JSON; units and blended materials.
load helper

@test "info lists the contents of a mesh, a level set and a scene" {
    # an area of 6 fills two thirds of 1024 × 1024 texels
    info_tells box.obj "bounds: 0 0 0 to 1 1 1" "suggested: --ao 0.144 --texels-per-unit 341 --size 1024x1024" "triangles: 12" "UV sets: 1" "bounds: 0 0 0 to 1 1 1"
    [[ $output != *problem* ]] || fail "a problem"
    succeed info "$ASSETS/cloister.glb"
    [[ $output != *"other charts"* && $output != *"leave the UV square"* ]] || fail "UVs"
    succeed voxelize box.obj -o box.vdb --voxel-size 0.05 --name hull --quiet
    info_tells box.vdb "grid 'hull'" "class: level set" "voxel size: 0.05 0.05 0.05" "bounds: 0 0 -0.05 to 1.05 1.05 1.05" "suggested: --ao 0.154  # a twelfth"
    [[ $output != *problem* ]] || fail "a problem"
    info_tells "$ASSETS/seeds.json" "caster 0: sdf" "light 'sun'" "receiver 0: "
}

@test "an open mesh, degenerate triangles and overlapping UVs are problems" {
    { sed -e '$d' -e 's/^vt 0.35 0.02/vt 0.05 0.02/' box.obj && echo 'f 1/1 1/1 2/2'; } >bad.obj
    succeed_printing "problem: 3 open edges" "problem: 1 triangles of zero area" "lie over other charts" -- info bad.obj
}

@test "control characters of file names and of names within files stay out of the terminal" {
    refuses 3 'none?[31m?.obj' -- info $'none\033[31m\n.obj'
    local name=$'b\033[31mox\302\233'
    write_box "$name.obj"
    printf '{"casters": [{"mesh": "b\\u001b[31mox\\u009b.obj"}], "voxel_size": 0.2,
        "lights": [{"name": "sun", "type": "directional", "direction": [0, 1, 0]}]}' >scene.json
    succeed_printing 'b?[31mox??.obj' -- info scene.json
    mkdir -p cases
    printf '{"cases": [{"scene": "none.json", "command": "volume", "output": "a\\u001b[31m.vdb", "name": "c\\u001b[31m"}]}' >cases/regress.json
    ends 3 regress cases
    prints 'c?[31m: failed' 'a?[31m.vdb: the bake ended'
}

@test "info prints a file's unit and its size in metres, and --unit overrides it" {
    info_tells "$MODELS/scene.fbx" "unit: 0.01 m; bounds are in metres" "bounds: 0 2 -3 to 2 4 -1"
    info_tells "$MODELS/scene.obj" "unit: none"
    succeed_printing "bounds: 0 200 -300 to 200 400 -100" -- info --unit m "$MODELS/scene.fbx"
    succeed_printing "bounds: 0 0.0508 -0.0762 to 0.0508 0.1016 -0.0254" -- info --unit in "$MODELS/scene.obj"
    succeed_printing "bounds: 0 20 -30 to 20 40 -10" -- info --unit 10 "$MODELS/scene.obj"
    succeed voxelize "$MODELS/scene.obj" -o a.vdb --unit cm --resolution 32
    info_tells a.vdb "voxel size: 0.0014667"
    refuses 2 "--unit 'yard'" -- info --unit yard "$MODELS/scene.obj"
}

@test "blended materials cast nothing unless asked, and one line says so" {
    succeed_saying "1 of 3 meshes have blended materials" "--cast-blended" -- voxelize "$MODELS/scene.glb" -o without.vdb --resolution 32
    succeed voxelize "$MODELS/scene.glb" -o with.vdb --resolution 32 --cast-blended
    [[ $stderr != *blended* ]] || fail "told all the same: $stderr"
    printf '{"casters": [{"mesh": "%s"}], "resolution": 32, "cast_blended": true}' "$MODELS/scene.glb" >a.json
    succeed voxelize a.json -o scene.vdb
    [[ $stderr != *blended* ]] || fail "the scene: $stderr"
    differ with.vdb without.vdb
    same with.vdb scene.vdb
}

# json_has FILE EXPRESSION …: what info --json prints of the file; each Python expression on root, the object, is true.
json_has() {
    succeed info "$1" --json
    python3 -c 'import json, sys
root = json.load(sys.stdin)
sys.exit("\n".join(one for one in sys.argv[1:] if not eval(one)) or 0)' "${@:2}" <<<"$output" || fail "not so"
}

@test "--json prints the same facts as an object, and an error as ever" {
    "$VDBSHADE" bake box.obj "${SMALL[@]}" --quiet -o box.exr
    "$VDBSHADE" voxelize box.obj -o box.vdb --voxel-size 0.05 --quiet
    json_has box.obj 'root["suggested"] == {"ao": 0.144, "texels_per_unit": 341, "size": [1024, 1024]}' 'root["triangles"] == 12' 'root["meshes"][0]["name"] == "box"' 'root["meshes"][0]["bounds"] == [[0, 0, 0], [1, 1, 1]]'
    json_has box.exr 'root["size"] == [32, 32]' 'root["channels"][-1]["name"] == "shadow.sun"' '"vdbshade_version" in root["attributes"]'
    json_has box.vdb 'root["grids"][0]["class"] == "level set"' '"box.obj" in root["grids"][0]["attributes"]["vdbshade_input_0"]'
    json_has "$ASSETS/seeds.json" 'root["casters"][0]["type"] == "sdf"' 'root["receivers"][0]["size"] == [512, 512]'
    refuses 3 none.obj -- info none.obj --json
}

@test "bakes take the suggested options, and --ao auto the suggested distance, in scenes too" {
    write_bake ball.json '{"sdf": {"shape": "sphere", "radius": 2}}' '"ao": {"distance": "auto"}' '"plane": {"size": [6, 3]}, "size": 16'
    sed 's|"plane".*"size": 16|"heightfield": "'"$ASSETS"'/terrain.png", "extent": [10, 10], "height": 2|; s/ball/hills/' ball.json >hills.json
    info_tells ball.json "bounds: -3 -2 -2 to 3 2 2" "suggested: --ao 0.687 --texels-per-unit 197" "ao: auto, within 0.687"
    info_tells hills.json "bounds: -5 -2 -5 to 5 2 5" "--ao 1.2"
    # shellcheck disable=SC2046 # words
    succeed bake box.obj $("$VDBSHADE" info box.obj --size 64 | sed -n 's/^suggested: \(.*\)#.*/\1/p') -o lit.glb
    succeed_saying "AO within 0.144: a twelfth of the diagonal" -- bake box.obj --ao auto --size 64 -o auto.exr
    succeed bake box.obj --ao 0.144 --size 64 -o same.exr --quiet
    same auto.exr same.exr
    succeed_saying "AO within 0.687" -- bake ball.json
}

@test "a file with blanks in its name is read in every format" {
    for format in glb fbx dae obj ply stl; do
        cp "$MODELS/scene.$format" "my scene.$format"
        info_tells "my scene.$format" ", 16 triangles;"
    done
}
