# What outputs tell of where they come from: `info` prints it, and nothing of it varies between two runs.
load helper

@test "an EXR tells version, command, method, light, voxel size and the hash of its input" {
    succeed bake box.obj -o box.exr --sun 1,2,1 --sun-angle 5 --ao 2 --size 32 --resolution 16 \
        --method adaptive --max-error 0.1 --quiet
    info_tells box.exr "vdbshade_version: 0.2.0" \
        "vdbshade_command: bake --sun 1,2,1 --sun-angle 5 --ao 2 --size 32 --resolution 16 --method adaptive --max-error 0.1 box.obj" \
        "vdbshade_shadow: adaptive, max error 0.1, sobol" \
        "vdbshade_ao: exact within 2, max error 0.1, sobol" \
        "vdbshade_light_sun: directional towards 1 2 1, 5 degrees across" \
        "vdbshade_voxel_size: 0.0625" \
        "vdbshade_input_0: sha256:$(sha256sum <box.obj | cut -d' ' -f1) box.obj"
}

# Writes OUT of a box from another folder, with other threads, zone and limits. COMMAND OUT INPUT [options]
again() {
    local command=$1 out=$2 input=$3
    shift 3
    mkdir -p elsewhere
    (cd elsewhere && TZ=Asia/Tokyo "$VDBSHADE" "$command" "$@" --resolution 16 --threads 3 --memory-limit 3GiB \
        --progress "$input" -o "../$out" 2>/dev/null)
}

@test "two runs give the same bytes: no date, no host, no path, no number of threads" {
    succeed bake --sun 1,2,1 --size 16 --resolution 16 --threads 1 box.obj -o a.exr --quiet
    succeed bake --sun 1,2,1 --size 16 --resolution 16 --threads 1 box.obj -o a.png --quiet
    succeed volume --sun 1,2,1 --resolution 16 --threads 1 box.obj -o a.vdb --quiet
    succeed voxelize --resolution 16 --threads 1 box.obj -o v.vdb --quiet
    again bake b.exr "$PWD/box.obj" --sun 1,2,1 --size 16
    again bake b.png ../box.obj --sun 1,2,1 --size 16
    again volume b.vdb ../box.obj --sun 1,2,1
    again voxelize w.vdb ./../box.obj
    cmp a.exr b.exr
    cmp a.png b.png
    cmp a.vdb b.vdb
    cmp v.vdb w.vdb
}

@test "a scene file is an input itself, and so is what it names; words that a shell would split are quoted" {
    cat >scene.json <<'JSON'
{"casters": [{"mesh": "box.obj"}], "lights": [{"name": "key", "type": "sphere",
 "position": [2, 3, 1], "radius": 0.25}], "receivers": [{"mesh": "box.obj", "output": "box.exr", "size": 16}],
 "resolution": 16}
JSON
    succeed bake scene.json --quiet
    info_tells box.exr "vdbshade_command: bake scene.json" \
        "vdbshade_light_key: sphere at 2 3 1, radius 0.25" \
        "vdbshade_input_0: sha256:$(sha256sum <scene.json | cut -d' ' -f1) scene.json" \
        "vdbshade_input_1: sha256:$(sha256sum <box.obj | cut -d' ' -f1) box.obj"
    write_box "my box.obj"
    succeed bake "my box.obj" -o box.exr --sun 1,2,1 --size 16 --resolution 16 --quiet
    info_tells box.exr "--resolution 16 'my box.obj'"
}
