# Whatever a file holds that cannot be used: the message names the file, the place in it, the value and the limit.
load helper

setup() {
    cd "$BATS_TEST_TMPDIR" || return 1
    write_box box.obj
    printf '0,5,0,0,1,0\n' >points.csv
}

# write_scene NAME CASTERS [MORE]: a scene of these casters, with a receiver.
write_scene() {
    printf '{"casters": [%s], "lights": [{"name": "sun", "type": "directional", "direction": [0.3, 1, 0.2]}],
        "receivers": [{"mesh": "box.obj", "size": 8, "output": "out.exr"}]%s}' "$2" "$3" >"$1"
}

# by_each INPUT CODE WORD…: every command that makes a field of its casters refuses it with the code and the words.
by_each() {
    local input=$1 code=$2
    shift 2
    refuses "$code" "$input: " "$@" -- bake "$input" --quiet -o out.exr
    refuses "$code" "$input: " "$@" -- query "$input" --points points.csv --quiet -o out.csv
    refuses "$code" "$input: " "$@" -- volume "$input" --quiet -o out.vdb
    refuses "$code" "$input: " "$@" -- render "$input" --size 8x8 --quiet -o out.png
}

@test "a voxel size out of range names the scene, and the layer" {
    local ball='{"sdf": {"shape": "sphere", "radius": 1}}'
    write_scene below.json "$ball" ', "voxel_size": 1e-13'
    refuses 2 "below.json:2:" "voxel_size: 1e-13 is out of range 1e-12 … 1e+12" -- bake below.json --quiet -o out.exr
    write_scene small.json "$ball" ', "voxel_size": 1e-12'
    by_each small.json 4 "voxel size 1e-12: " "5.36871e+08 at most"
    write_scene large.json '{"sdf": {"shape": "sphere", "radius": 1e14}}' ', "resolution": 8'
    by_each large.json 4 "voxel size 2.5e+13: " "1e-12 … 1e+12"
    write_scene far.json '{"sdf": {"shape": "sphere", "radius": 1, "translate": [1e14, 0, 0]}}' ', "resolution": 8'
    by_each far.json 4 "4e+14 voxels from the origin, 1e12 at most"
    refuses 4 "far.json: voxel size " -- voxelize far.json --quiet -o out.vdb
    write_scene layer.json "$ball, {\"sdf\": {\"shape\": \"sphere\", \"radius\": 1}, \"layer\": \"clouds\"}" \
        ', "resolution": 8, "layers": [{"name": "clouds", "voxel_size": 1e-12}]'
    by_each layer.json 4 "layer 'clouds': voxel size 1e-12: "
}

@test "a mesh too large, too small or too far for distances is named, whether it gets voxels or not" {
    local size
    for size in 1e-30 1e30; do
        printf "v 0 0 0\nv $size 0 0\nv 0 $size 0\nvt 0 0\nvt 1 0\nvt 1 1\nf 1/1 2/2 3/3\n" >huge.obj
        refuses 4 "huge.obj: " "; scale the scene" -- bake huge.obj --sun 0,1,0 --size 8 --quiet -o out.exr
        refuses 4 "huge.obj: voxel size " -- bake huge.obj --sun 0,1,0 --size 8 --method cone --quiet -o out.exr
        refuses 4 "huge.obj: voxel size " -- voxelize huge.obj --quiet -o out.vdb
    done
    shade query box.obj --caster huge.obj --sun 0,1,0 --points points.csv --quiet -o out.csv # of 1e30
    refused 4 "box.obj: " "; scale the scene"
    write_scene far.json '{"mesh": "box.obj", "transform": {"translate": [1e14, 0, 0]}}'
    by_each far.json 4 "from the origin"
}

@test "an UV that is not finite names the file, the mesh and the vertex" {
    { printf 'ply\nformat binary_little_endian 1.0\nelement vertex 3\n'
      printf 'property float %s\n' x y z s t
      printf 'element face 1\nproperty list uchar int vertex_indices\nend_header\n'
      printf '\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0'
      printf '\0\0\200\77\0\0\0\0\0\0\0\0\0\0\300\177\0\0\0\0'
      printf '\0\0\0\0\0\0\200\77\0\0\0\0\0\0\0\0\0\0\200\77'
      printf '\3\0\0\0\0\1\0\0\0\2\0\0\0'; } >nan.ply
    refuses 2 "nan.ply: mesh 0: vertex 1: UV (nan, 0) is not finite" -- bake nan.ply --sun 0,1,0 --size 8 --quiet -o out.exr
}

@test "what has no outline or no surface names the scene or the image" {
    local font=/usr/share/fonts/truetype/dejavu/DejaVuSans.ttf
    write_scene blank.json "{\"text\": \"  \", \"font\": \"$font\", \"height\": 1, \"thickness\": 1}" ', "resolution": 8'
    by_each blank.json 2 "has no outline: nothing in it is solid"
    write_scene nothing.json '{"sdf": {"op": "subtraction", "of": [{"shape": "sphere", "radius": 1},
        {"shape": "sphere", "radius": 2}]}}' ', "resolution": 8'
    by_each nothing.json 2 "no surface"
}

@test "a file that a flat scene's caster names and that is not there is told with the scene" {
    printf '{"region": [-1, -1, 1, 1], "casters": [{"mask": "none.png", "size": 1}],
        "lights": [{"name": "a", "type": "disc", "position": [0, 0]}]}' >plane.json
    refuses 3 "plane.json: casters[0]: none.png: " -- flat plane.json --quiet -o out.exr
}

@test "a lightmap without the light's channel is named" {
    "$VDBSHADE" bake box.obj "${SMALL[@]}" --quiet --pack R=shadow.sun -o grey.png
    shade render box.obj --sun 0.3,1,0.2 --size 8x8 --resolution 12 --lightmap grey.png --quiet -o out.png
    refused 2 "grey.png: lightmap 0: no channel shadow.sun"
}

@test "an output that a scene names is told with the scene" {
    printf '{"casters": [{"mesh": "box.obj"}], "receivers": [{"mesh": "box.obj", "output": "bake.xyz"}],
        "lights": [{"name": "a", "type": "directional", "direction": [0, 1, 0]}]}' >scene.json
    refuses 2 "scene.json: receivers[0]: output bake.xyz: ending 'xyz'" -- bake scene.json --size 8 --quiet
}

@test "a file that a scene names and that cannot be read is told with the scene, and why, however long its name is" {
    local name
    for name in none.obj "$(printf 'x%.0s' {1..300})" "$(printf 'x%.0s' {1..70000})"; do
        printf '{"casters": [{"mesh": "%s"}], "receivers": [{"mesh": "box.obj", "output": "out.exr"}],
            "lights": [{"name": "a", "type": "directional", "direction": [0, 1, 0]}]}' "$name" >scene.json
        for command in "bake scene.json -o out.exr" "voxelize scene.json -o out.vdb"; do
            # shellcheck disable=SC2086 # words of a command
            shade $command --quiet
            [[ $name != none.obj ]] || refused 3 "scene.json: none.obj: No such file or directory"
            [[ $name == none.obj ]] || refused 3 "scene.json: xxx" "xxx: File name too long"
        done
    done
}
