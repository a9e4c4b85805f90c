# Bad and hostile input: an exit code by kind, one line with file, place, value and limit, and the old output stays. Code 3 is for
# files that cannot be read, 2 for bad contents, 4 for limits.
load helper

prepare() {
    old_output out.exr
    printf '0,5,0,0,1,0\n' >points.csv
}

bake() {
    shade bake "$1" -o out.exr "${SMALL[@]}" "${@:2}"
}

# refuse_input CODE INPUT WORD …: a bake of the INPUT ends with CODE, says its name and the WORDs, and leaves the old output.
refuse_input() {
    bake "$2"
    refused "$1" "${@:2}"
    untouched out.exr
}

@test "a mesh, scene or other file that is not there, a folder and an empty file are refused with code 3" {
    local ending
    refuse_input 3 none.obj
    refuse_input 3 none.json
    for ending in obj vdb exr json; do
        refuses 3 "none.$ending" -- info "none.$ending"
    done
    refuses 3 none.obj -- bake box.obj -o out.exr "${SMALL[@]}" --caster none.obj
    refuses 3 none.glb 'cannot be opened' -- bake none.glb
    mkdir folder.obj
    refuse_input 3 folder.obj
    : >empty.obj
    refuse_input 3 empty.obj
}

@test "a mesh without triangles, without area, without UVs or without that UV set is refused" {
    printf 'v 0 0 0\nv 1 0 0\nv 0 1 0\n' >points.obj
    refuse_input 2 points.obj
    printf 'v 0 0 0\nv 1 0 0\nvt 0 0\nvt 1 0\nf 1/1 2/2 1/1\n' >line.obj
    refuse_input 2 line.obj
    sed -E '/^vt/d; s,/[0-9]*,,g' box.obj >bare.obj
    refuse_input 2 bare.obj 'no UVs'
    refuses 2 box.obj 'UV set 3' -- bake box.obj -o out.exr "${SMALL[@]}" --uv-set 3
    untouched out.exr
}

@test "a voxel size, or a lightmap for its format, that passes the memory limit is refused" {
    refuses 4 -- bake box.obj -o out.exr --ao 1 --size 32 --voxel-size 0.0001 --memory-limit 64MiB
    refuses 4 -- bake box.obj -o out.exr --ao 1 --size 32 --voxel-size 1e-12
    shade bake box.obj -o out.exr --ao 1 --size 32 --voxel-size 1e-300
    [ "$status" -eq 4 ] || [ "$status" -eq 2 ] || fail "expected a limit"
    untouched out.exr
    refuses 4 "out.webp: writing 8192 × 8192 texels takes" "write .exr" -- bake box.obj -o out.webp --ao 1 --size 8192 --resolution 24 --memory-limit 20M
    [ ! -e out.webp ]
}

@test "files cut short, or of another kind than their name says, end with 3" {
    local one
    for one in exr png tif jpg; do
        "$VDBSHADE" bake box.obj "${SMALL[@]}" --quiet -o "whole.$one" 2>/dev/null
    done
    "$VDBSHADE" voxelize box.obj --resolution 16 --quiet -o whole.vdb
    for one in glb stl ply fbx; do
        cp "$MODELS/scene.$one" "whole.$one"
    done
    for one in exr png tif jpg vdb glb stl ply fbx; do
        head -c $(($(stat -c %s "whole.$one") / 3)) "whole.$one" >"cut.$one"
        printf 'nothing of the kind' >"other.$one"
        : >"empty.$one"
        refuses 3 "cut.$one: " -- info "cut.$one"
        refuses 3 "other.$one: " -- info "other.$one"
        refuses 3 "empty.$one: " -- info "empty.$one"
    done
    refuses 3 cut.exr -- compare whole.exr cut.exr
    refuse_input 3 cut.glb
    for one in cut other; do
        write_bake vdb.json "{\"vdb\": \"$one.vdb\"}"
        refuses 3 $one.vdb -- bake vdb.json
    done
    untouched out.exr
}

@test "readable files with bad values end with 2 and the place" {
    printf 'v 0 0 0\nv 1 0\n' >bad.obj
    printf '{"casters": 1}' >bad.json
    printf 'a,b,c\n0,0,0\n' >bad.csv
    refuse_each <<'LIST'
2 "bad.obj: line 2" | info bad.obj
2 "bad.json:1:" | info bad.json
2 "bad.csv: the header names no column x" | query box.obj --points bad.csv --sun 0,1,0 --sun-angle 5 --resolution 16 -o -
LIST
}

# The content of a file may need a hundred times the file's size in memory. It is refused before it takes that.
@test "a scene of a million empty objects is refused within the memory limit, by every command that reads one" {
    { printf '[{}'; yes ',{}' | head -n 1000000 | tr -d '\n'; printf ']'; } >bomb.json
    local command
    for command in "info bomb.json" "bake bomb.json --sun 0,1,0" "voxelize bomb.json -o out.vdb" "flat bomb.json -o out.exr"; do
        refuses 4 'bomb.json: about ' 'MB are needed, over the memory limit of 105 MB' -- $command --memory-limit 100MiB
    done
}

@test "the limit of compare counts both images" {
    succeed bake box.obj --sun 1,2,1 --size 512 --resolution 8 --method hard -o one.exr --quiet
    refuses 4 'one.exr: about 16 MB are needed, over the memory limit of 12 MB' -- compare one.exr one.exr --memory-limit 12M
    succeed compare one.exr one.exr --memory-limit 18M
    succeed info one.exr --memory-limit 11M
    refuses 4 'one.exr: about ' 'over the memory limit of 5 MB' -- info one.exr --memory-limit 5M
}

@test "--sandbox off reads the same without a child" {
    "$VDBSHADE" voxelize box.obj -o box.vdb --quiet --resolution 16
    succeed info box.vdb
    local there=$output
    succeed info box.vdb --sandbox off
    [ "$output" = "$there" ] || fail "it is not the same"
    # where no child can be had, nothing is read but with --sandbox off
    if [ "$(id -u)" -ne 0 ]; then
        (ulimit -u 1 && ! "$VDBSHADE" info box.vdb)
        (ulimit -u 1 && "$VDBSHADE" info box.vdb --sandbox off)
    fi
}

@test "the reader's argument alone does nothing" {
    run --separate-stderr "$VDBSHADE" --vdbshade-reader </dev/null
    [ "$status" -ne 0 ] || fail "expected a failure"
    [ -z "$output" ] || fail "expected no output"
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
    write_bake below.json "$ball" '"voxel_size": 1e-13'
    refuses 2 "below.json:2:" "voxel_size: 1e-13 is out of range 1e-12 … 1e+12" -- bake below.json --quiet -o out.exr
    write_bake small.json "$ball" '"voxel_size": 1e-12'
    by_each small.json 4 "voxel size 1e-12: " "5.36871e+08 at most"
    write_bake large.json '{"sdf": {"shape": "sphere", "radius": 1e14}}' '"resolution": 8'
    by_each large.json 4 "voxel size 2.5e+13: " "1e-12 … 1e+12"
    write_bake far.json '{"sdf": {"shape": "sphere", "radius": 1, "translate": [1e14, 0, 0]}}' '"resolution": 8'
    by_each far.json 4 "4e+14 voxels from the origin, 1e12 at most"
    refuses 4 "far.json: voxel size " -- voxelize far.json --quiet -o out.vdb
    write_bake layer.json "$ball, {\"sdf\": {\"shape\": \"sphere\", \"radius\": 1}, \"layer\": \"clouds\"}" \
        '"resolution": 8, "layers": [{"name": "clouds", "voxel_size": 1e-12}]'
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
    write_bake far.json '{"mesh": "box.obj", "transform": {"translate": [1e14, 0, 0]}}'
    by_each far.json 4 "from the origin"
}

@test "the error of an empty outline or surface names the scene or the image" {
    write_bake blank.json "{\"text\": \"  \", \"font\": \"$FONT\", \"height\": 1, \"thickness\": 1}" '"resolution": 8'
    by_each blank.json 2 "has no outline: nothing in it is solid"
    write_bake nothing.json '{"sdf": {"op": "subtraction", "of": [{"shape": "sphere", "radius": 1},
        {"shape": "sphere", "radius": 2}]}}' '"resolution": 8'
    by_each nothing.json 2 "no surface"
}

@test "errors of files that a scene names name the scene, too" {
    printf '{"region": [-1, -1, 1, 1], "casters": [{"mask": "none.png", "size": 1}],
        "lights": [{"name": "a", "type": "disc", "position": [0, 0]}]}' >plane.json
    refuses 3 "plane.json: casters[0]: none.png: " -- flat plane.json --quiet -o out.exr
    write_bake scene.json '{"mesh": "none.obj"}'
    refuses 3 "scene.json: none.obj: No such file or directory" -- voxelize scene.json --quiet -o out.vdb
    write_scene scene.json box.obj
    sed -i 's/out.exr/bake.xyz/' scene.json
    refuses 2 "scene.json: receivers[0]: output bake.xyz: ending 'xyz'" -- bake scene.json --size 8 --quiet
    "$VDBSHADE" bake box.obj --ao 1 --size 8 --quiet -o ao.exr
    shade render box.obj --sun 0.3,1,0.2 --size 8x8 --resolution 12 --lightmap ao.exr --quiet -o out.png
    refused 2 "ao.exr: lightmap 0: no channel shadow.sun"
}
