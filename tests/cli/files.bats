# What files of meshes say of themselves: units, materials, extensions, buffers; and what is told of those that are not read.
load helper

setup() {
    cd "$BATS_TEST_TMPDIR" || return 1
    models=$(cd "$BATS_TEST_DIRNAME/../models" && pwd)
}


@test "info tells a file's unit, and the size in metres" {
    info_tells "$models/scene.fbx" "unit: 0.01 m; bounds are in metres" "bounds: 0 2 -3 to 2 4 -1"
    info_tells "$models/scene.obj" "unit: none"
}

@test "--unit overrules, by a name or in metres" {
    shade info --unit m "$models/scene.fbx"
    [[ $output == *"bounds: 0 200 -300 to 200 400 -100"* ]] || fail "FBX in metres"
    shade info --unit in "$models/scene.obj"
    [[ $output == *"bounds: 0 0.0508 -0.0762 to 0.0508 0.1016 -0.0254"* ]] || fail "OBJ in inches"
    shade info --unit 10 "$models/scene.obj"
    [[ $output == *"bounds: 0 20 -30 to 20 40 -10"* ]] || fail "OBJ by ten"
    succeed voxelize "$models/scene.obj" -o a.vdb --unit cm --resolution 32
    info_tells a.vdb "voxel size: 0.0014667"
    refuses 2 "--unit 'yard'" -- info --unit yard "$models/scene.obj"
}

@test "blended materials cast nothing unless asked, and one line says so" {
    succeed voxelize "$models/scene.glb" -o without.vdb --resolution 32
    [[ $stderr == *"1 of 3 meshes have blended materials"*"--cast-blended"* ]] || fail "not told: $stderr"
    succeed voxelize "$models/scene.glb" -o with.vdb --resolution 32 --cast-blended
    [[ $stderr != *blended* ]] || fail "told all the same: $stderr"
    printf '{"casters": [{"mesh": "%s"}], "resolution": 32, "cast_blended": true, "unit": "cm"}' "$models/scene.glb" >a.json
    succeed voxelize a.json -o scene.vdb
    [[ $stderr != *blended* ]] || fail "the scene: $stderr"
    "$VDBSHADE" info with.vdb | grep "active voxels" >with.txt
    "$VDBSHADE" info without.vdb | grep "active voxels" >without.txt
    ! cmp -s with.txt without.txt || fail "the glass casts"
}

@test "what is not read is refused with what would help" {
    sed 's/"asset"/"extensionsRequired":["KHR_node_visibility"],"asset"/' "$models/scene.gltf" >packed.gltf
    cp "$models/scene.bin" .
    refuses 2 "KHR_node_visibility" -- info packed.gltf
    refused 2 "those nodes that are to be seen"
    cp "$models/scene.gltf" alone.gltf && rm scene.bin
    refuses 3 "scene.bin': cannot be read: No such file" -- info alone.gltf
    printf 'BLENDER-v304' >a.blend
    refuses 2 "export it as GLB" -- info a.blend
    printf 'anything' >a.x3d
    refuses 2 "GLB" -- info a.x3d
}

@test "a file with blanks in its name is read in every format" {
    for format in glb fbx dae obj ply stl; do
        cp "$models/scene.$format" "my scene.$format"
        info_tells "my scene.$format" ", 16 triangles;"
    done
}
