# Small files that ask for much memory are refused before it is taken; tools/memory-bombs has 200 and more.
load helper

# within MB ARGUMENT…: the program on one thread, where the system refuses it more data than that.
within() {
    local most=$1
    shift
    run --separate-stderr bash -c 'ulimit -d "$1"; shift; exec "$@"' bash $((most * 1000)) "$VDBSHADE" "$@" --threads 1
}

@test "a reader holds an image's pixels against the limit before it reads them" {
    write_box box.obj
    "$VDBSHADE" bake box.obj --sun 1,2,1 --size 1024 --resolution 8 --method hard --bits 8 --quiet -o large.png
    shade info large.png --memory-limit 10M
    refused 4 "large.png: about 17 MB are needed, over the memory limit of 10 MB" # and not the 34 of a copy beside them
}

@test "the level sets of a scene's casters count together, with the casters" {
    local ball='{"sdf": {"shape": "sphere", "radius": 1}}'
    { printf '{"resolution": 16, "casters": [%s' "$ball"; yes ", $ball" | head -n 400; printf ']}'; } >many.json
    within 250 voxelize many.json --memory-limit 100MiB --quiet -o out.vdb
    refused 4 "many.json: level sets of the casters: " "over the memory limit of 105 MB"
}

@test "a solid's inside counts before it is filled" {
    printf '{"casters": [{"sdf": {"shape": "sphere", "radius": 1}}], "voxel_size": 1e-6}' >fine.json
    within 250 voxelize fine.json --memory-limit 100MiB --quiet -o out.vdb
    refused 4 "fine.json: voxel size 1e-06" "over the memory limit of 105 MB"
}
