# Provenance in outputs: `info` prints it, and it is the same in every run.
load helper

@test "an EXR records version, command, method, light, voxel size and the hash of its input" {
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

@test "two runs give the same bytes: no date, no host, no path, no number of threads" {
    local command out options
    mkdir elsewhere
    while read -r command out options; do
        # shellcheck disable=SC2086 # words
        succeed $command $options --resolution 16 --threads 1 box.obj -o $out --quiet
        # shellcheck disable=SC2086
        (cd elsewhere && TZ=Asia/Tokyo "$VDBSHADE" $command $options --resolution 16 --threads 3 --memory-limit 3GiB --progress \
            ./../box.obj -o $out 2>/dev/null)
        cmp $out elsewhere/$out
    done <<'LIST'
bake a.exr --sun 1,2,1 --size 16
bake a.png --sun 1,2,1 --size 16
volume a.vdb --sun 1,2,1
voxelize v.vdb
LIST
}

@test "a scene and the files that it names are inputs, and the recorded command quotes blanks" {
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
