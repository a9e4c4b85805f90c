# Small files that need much memory are refused before it is allocated.
load helper

# within MB ARGUMENT…: runs the program on one thread, with a limit on its data.
within() {
    local most=$1
    shift
    unless_sanitized "its shadow memory does not fit"
    limited "-d $((most * 1000))" "$@" --threads 1
}

@test "a reader checks an image's size against the limit before it reads pixels" {
    "$VDBSHADE" bake box.obj --sun 1,2,1 --size 1024 --resolution 8 --method hard --bits 8 --quiet -o large.png
    # and not the 34 of a copy beside them
    refuses 4 "large.png: about 17 MB are needed, over the memory limit of 10 MB" -- info large.png --memory-limit 10M
}

@test "the level sets of a scene's casters count together, with the casters" {
    local ball='{"sdf": {"shape": "sphere", "radius": 1}}'
    { printf '{"resolution": 16, "casters": [%s' "$ball"; yes ", $ball" | head -n 400; printf ']}'; } >many.json
    within 250 voxelize many.json --memory-limit 100MiB --quiet -o out.vdb
    refused 4 "many.json: level sets of the casters: " "over the memory limit of 105 MB"
}

@test "the limit counts a solid's inside before it is filled" {
    printf '{"casters": [{"sdf": {"shape": "sphere", "radius": 1}}], "voxel_size": 1e-6}' >fine.json
    within 250 voxelize fine.json --memory-limit 100MiB --quiet -o out.vdb
    refused 4 "fine.json: voxel size 1e-06" "over the memory limit of 105 MB"
}

@test "fields of a scene's layers count together, and outlines of a plane's casters" {
    local one='{"sdf": {"shape": "sphere", "radius": 1}, "layer": "l%d"}' i casters= layers=
    for i in {1..20}; do
        casters+=$(printf "$one, " "$i")
        layers+=$(printf '{"name": "l%d"}, ' "$i")
    done
    printf '{"casters": [%s], "layers": [%s], "resolution": 128, "method": "cone", "lights": [{"name": "sun", "type": "directional",
        "direction": [0, 1, 0]}]}' "${casters%, }" "${layers%, }" >layers.json
    printf '0,5,0,0,1,0\n' >points.csv
    within 1000 query layers.json --points points.csv --memory-limit 40MiB --quiet -o out.csv
    refused 4 "layers.json: layer 'l" "over the memory limit of 42 MB"
    { printf '{"region": [-1, -1, 1, 1], "size": 8, "lights": [{"name": "a", "type": "disc", "position": [0, 0]}], "casters": ['
      yes '{"shape": "box", "half_size": [1, 1]},' | head -n 12800
      printf '{"shape": "box", "half_size": [1, 1]}]}'; } >boxes.json
    within 1000 flat boxes.json --memory-limit 20MiB --quiet -o out.exr
    refused 4 "boxes.json: casters[" ": about 21 MB are needed, over the memory limit of 21 MB"
}

# far_cubes N: cubes so far from each other that each has inner nodes of its own in a level set's tree.
far_cubes() {
    local i corner
    for ((i = 0; i < $1; ++i)); do
        for corner in '0 0 0' '4 0 0' '0 4 0' '4 4 0' '0 0 4' '4 0 4' '0 4 4' '4 4 4'; do
            echo "v $((i * 5000 + ${corner%% *})) ${corner#* }"
        done
    done
    for ((i = 0; i < $1; ++i)); do
        for corner in '1 3 4 2' '5 6 8 7' '1 2 6 5' '3 7 8 4' '1 5 7 3' '2 4 8 6'; do
            printf 'f'
            printf ' %d' $(for k in $corner; do echo $((8 * i + k)); done)
            echo
        done
    done
}

@test "the limit counts the inner nodes of far leaves" {
    far_cubes 60 >far.obj
    "$VDBSHADE" voxelize far.obj --voxel-size 1 --quiet -o far.vdb 2>/dev/null
    printf '0,5,0,0,1,0\n' >points.csv
    within 200 query far.vdb --voxel-size 2 --sun 0,1,0 --points points.csv --memory-limit 100MiB --quiet -o out.csv
    refused 4 "far.vdb: " "(about 4.24e+06 voxels)" "over the memory limit of 105 MB" # those of the file, before any copy
}

@test "the limit holds for a picture together with its scene" {
    within 300 render box.obj --sun 1,2,1 --size 16384 --memory-limit 100MiB -o out.png
    refused 4 "out.png: about 12885 MB are needed, over the memory limit of 105 MB"
    within 500 render box.obj --sun 1,2,1 --size 64 --resolution 256 --memory-limit 160MiB --quiet -o out.png
    done_well
    within 500 render box.obj --sun 1,2,1 --size 1664 --resolution 256 --memory-limit 160MiB -o out.png
    refused 4 "over the memory limit of 168 MB"
}

@test "a case's scene is held against the limit before it is parsed" {
    mkdir -p cases
    printf '{"cases": [{"scene": "a.json", "output": "b.exr"}]}' >cases/regress.json
    { printf '{"casters": [{}'; yes ', {}' | head -n 3000000 | tr -d '\n'; printf ']}'; } >cases/a.json
    within 164 regress cases --memory-limit 100MiB # 64 for itself
    [ "$status" -eq 4 ] || fail "expected 4"
    says "cases/a.json: " "over the memory limit of 105 MB"
}
