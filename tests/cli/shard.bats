# `bake --shard I/N` and `merge`: parts that are baked by themselves come to the bits of one bake.
load helper

setup() {
    cd "$BATS_TEST_TMPDIR" || return 1
    ln -s "$ASSETS/terrain.png" "$ASSETS/cloister.glb" .
}

CLOISTER=(cloister.glb --sun -0.5,0.8,-0.6 --sun-angle 10 --ao 2 --size 128)

# Bakes all parts, or those that are named.
parts() { # OUT N "I …" INPUT [options]
    local out=$1 n=$2 which=${3:-$(seq "$2")} i
    shift 3
    for i in $which; do
        "$VDBSHADE" bake "$@" -o "$out" --shard "$i/$n" --quiet
    done
}

# Whether the parts come to what one bake does, which is in one/.
merged() { # OUT N INPUT [options]
    local out=$1 n=$2
    shift 2
    parts "$out" "$n" "" "$@"
    "$VDBSHADE" merge "$out" --quiet "${MERGE[@]}"
    cmp "one/$out" "$out" || fail "$n parts of $* are not one bake"
    rm -- "$out" *.part
}

# The last rows and the statistics of a part, without its checksum.
values() { # OUT
    tail -c 50008 "$1.2-of-3.part" | head -c 50000
}

one() { # OUT INPUT [options]
    local out=$1
    shift
    mkdir -p one
    "$VDBSHADE" bake "$@" -o "one/$out" --quiet
}

@test "2, 3, 7 and 64 parts of a lightmap are one bake, byte by byte" {
    one out.exr "${CLOISTER[@]}"
    for n in 2 3 7 64; do
        merged out.exr "$n" "${CLOISTER[@]}"
    done
    no_leftovers
}

@test "what crosses parts is as in one bake: seams, padding, shared rays, what is filled, every channel" {
    local options=(--irradiance --bent-normals world --sky y --invalid-channel --error --tint quadratic)
    one out.exr "${CLOISTER[@]}" "${options[@]}" --padding auto
    merged out.exr 3 "${CLOISTER[@]}" "${options[@]}" --padding auto
    one out.png "${CLOISTER[@]}" --seams fix --padding auto
    merged out.png 3 "${CLOISTER[@]}" --seams fix --padding auto
    one out.exr "${CLOISTER[@]}" --padding 70 --supersample 2 --method adaptive --ao-method adaptive --resolution 48
    merged out.exr 3 "${CLOISTER[@]}" --padding 70 --supersample 2 --method adaptive --ao-method adaptive --resolution 48
    one out.exr "${CLOISTER[@]}" --method cone --ao-method cones --ao-spacing 8 --padding 0 --resolution 48
    merged out.exr 3 "${CLOISTER[@]}" --method cone --ao-method cones --ao-spacing 8 --padding 0 --resolution 48
}

@test "so are an asset with its light in it, a terrain, objects of their own, and a scene of several lightmaps" {
    one out.glb "${CLOISTER[@]}"
    merged out.glb 3 "${CLOISTER[@]}"
    printf '%s' '{"casters": [{"heightfield": "terrain.png", "size": [10, 10], "height": 2, "direct": true}],
        "lights": [{"name": "sun", "type": "directional", "direction": [-1, 0.5, -0.3], "angle_deg": 5}], "ao": {"distance": 2},
        "receivers": [{"heightfield": "terrain.png", "extent": [10, 10], "height": 2, "size": 64, "output": "out.exr"}]}' >terrain.json
    one out.exr terrain.json
    for n in 2 3 7 64; do
        merged out.exr "$n" terrain.json
    done
    printf '%s' '{"casters": [{"mesh": "cloister.glb"}], "resolution": 48, "ao": {"distance": 2}, "receivers": [
        {"mesh": "cloister.glb", "size": 64, "output": "a.exr"}, {"mesh": "cloister.glb", "size": 96, "output": "b.png"}]}' >two.json
    "$VDBSHADE" bake two.json --quiet
    mkdir one2 objects
    mv a.exr b.png one2
    for i in 1 2 3 4 5; do "$VDBSHADE" bake two.json --shard $i/5 --quiet; done
    "$VDBSHADE" merge a.exr --quiet
    cmp one2/a.exr a.exr
    cmp one2/b.png b.png
    "$VDBSHADE" bake "${CLOISTER[@]}" --size 64 --per-object -o one2/ --quiet
    for i in 1 2 3; do "$VDBSHADE" bake "${CLOISTER[@]}" --size 64 --per-object -o objects/ --shard $i/3 --quiet; done
    "$VDBSHADE" merge objects --quiet
    rm one2/a.exr one2/b.png
    diff -r one2 objects
}

@test "2, 3, 7 and 64 parts of a volume are one, of a band, of free space, and with and without what is inside" {
    local volume=(box.obj --sun -0.5,0.8,-0.6 --resolution 16) n i
    write_box box.obj
    volume() { # N OPTIONS …
        n=$1
        shift
        "$VDBSHADE" volume "${volume[@]}" "$@" -o one.vdb --quiet --stats one.json
        for i in $(seq "$n"); do
            "$VDBSHADE" volume "${volume[@]}" "$@" -o out.vdb --shard "$i/$n" --quiet
        done
        "$VDBSHADE" merge out.vdb --quiet --stats out.json
        cmp one.vdb out.vdb || fail "$n parts of $*"
        diff <(grep -E '"(voxels|inside_voxels|tiles|marches|rays)"' one.json) <(grep -E '"(voxels|inside_voxels|tiles|marches|rays)"' out.json)
        rm out.vdb out.vdb.*
    }
    volume 2 --ao 1
    volume 3 --box -2,-1,-2,3,2,3 --error --method adaptive
    volume 7 --inside off
    volume 64 --box -1,-1,-1,2,2,2 --ao 1
    # parts of a lightmap and of a volume know each other
    parts out.png 1 "" box.obj "${SMALL[@]}"
    "$VDBSHADE" volume box.obj --sun 1,1,1 --resolution 24 -o b.vdb --shard 1/2 --quiet
    shade merge b.vdb
    refused 3 "b.vdb: a part is missing: 2 of 2"
    cp out.png.1-of-1.part b.vdb.2-of-2.part
    shade merge b.vdb
    refused 2 "b.vdb.2-of-2.part: is a part of a bake, not of a volume"
    "$VDBSHADE" volume box.obj --sun 1,1,1 --resolution 24 --inside off -o b.vdb --shard 2/2 --quiet
    shade merge b.vdb
    refused 2 "b.vdb.2-of-2.part: is of other inputs or options: its vdbshade_command is"
    "$VDBSHADE" volume box.obj --sun 1,1,1 --resolution 24 -o b.vdb --shard 2/2 --quiet
    printf x | dd of=b.vdb.2-of-2.part bs=1 seek=3000 conv=notrunc status=none
    shade merge b.vdb
    refused 2 "b.vdb.2-of-2.part: damaged"
    [ ! -e b.vdb ]
}

@test "a part is the same whoever bakes it, with however many threads and bands, and goes on where it was ended" {
    parts a.exr 3 2 "${CLOISTER[@]}"
    parts b.exr 3 2 "${CLOISTER[@]}" --threads 1 --band-rows 16
    parts c.exr 3 2 "${CLOISTER[@]}" --resume
    [ -z "$(find . -name '*.resume')" ] || fail "rows are kept of a part that is whole"
    for other in b c; do # but for their command lines, which the first pages of a part have
        cmp <(values a.exr) <(values $other.exr) || fail "$other"
    done
    one out.exr "${CLOISTER[@]}"
    parts out.exr 3 "" "${CLOISTER[@]}"
    "$VDBSHADE" bake "${CLOISTER[@]}" -o out.exr --shard 2/3 --resume --threads 1 --quiet & pid=$!
    while kill -0 $pid 2>/dev/null && [ "$(stat -c %s out.exr.2-of-3.part.0.resume 2>/dev/null || echo 0)" -lt 30000 ]; do
        sleep 0.01
    done
    kill -KILL $pid
    wait $pid || true
    [ -s out.exr.2-of-3.part.0.resume ] || fail "nothing was kept"
    run -0 "$VDBSHADE" bake "${CLOISTER[@]}" -o out.exr --shard 2/3 --resume --stats s.json
    [ "$(grep -o '"resumed_rows": [0-9]*' s.json | cut -d' ' -f2)" -ge 8 ]
    parts out.exr 3 "1 3" "${CLOISTER[@]}"
    "$VDBSHADE" merge out.exr --quiet
    cmp one/out.exr out.exr || fail "a part that went on is another"
}

@test "a lightmap larger than the memory limit is merged in bands of rows" {
    options=(cloister.glb --sun -0.5,0.8,-0.6 --irradiance --method cone --resolution 48 --size 256x1536 --padding 40)
    one out.exr "${options[@]}"
    parts out.exr 3 "" "${options[@]}"
    shade merge out.exr --memory-limit 16M
    done_well
    [[ $stderr == *"bands of"* ]] || fail "it was held whole"
    cmp one/out.exr out.exr
}

@test "statistics, pictures of what is invalid, and pages are made of all parts" {
    one out.exr "${CLOISTER[@]}" --stats one.json --invalid one.png
    parts out.exr 3 "" "${CLOISTER[@]}"
    "$VDBSHADE" merge out.exr --quiet --stats all.json --invalid all.png
    for key in texels invalid_texels marches rays voxel_size; do
        [ "$(grep -o "\"$key\": [0-9.]*" one.json | head -1)" = "$(grep -o "\"$key\": [0-9.]*" all.json | head -1)" ] || fail "$key"
    done
    cmp one.png all.png
    for option in "--invalid x.png" "--view x.html"; do
        shade bake "${CLOISTER[@]}" -o out.exr --shard 1/3 $option
        refused 2 "${option% *}" "not together with --shard"
    done
}

@test "parts that are missing are named, and nothing is written" {
    old_output out.exr
    write_box box.obj
    shade merge out.exr
    refused 2 "out.exr: there are no parts beside it"
    parts out.exr 3 "1 3" box.obj "${SMALL[@]}"
    shade merge out.exr
    refused 3 "out.exr: a part is missing: 2 of 3; bake it by --shard I/3"
    parts out.exr 12 1 box.obj "${SMALL[@]}"
    shade merge out.exr
    refused 2 "there are parts of 3 and of 12 shards"
    shade merge out.exr --shards 12
    refused 3 "parts are missing: 2, 3, 4, 5, 6, 7 and 5 more of 12"
    untouched out.exr
}

@test "a part of other inputs, options, another version or another bake is named, with what differs" {
    old_output out.exr
    write_box box.obj
    parts out.exr 2 1 box.obj "${SMALL[@]}"
    parts out.exr 2 2 box.obj "${SMALL[@]}" --max-error 0.1
    shade merge out.exr
    refused 2 "out.exr.2-of-2.part: is of other inputs or options: its vdbshade_command is" "max-error"
    parts out.exr 2 2 box.obj "${SMALL[@]}"
    cp out.exr.2-of-2.part good
    cp out.exr.1-of-2.part out.exr.2-of-2.part
    shade merge out.exr
    refused 2 "out.exr.2-of-2.part: holds part 1 of 2; was it renamed?"
    sed "s/^\(vdbshade part [0-9]*\)/vdbshade part 9/" good >out.exr.2-of-2.part
    shade merge out.exr
    refused 2 "out.exr.2-of-2.part: is of another version of vdbshade"
    # the input changed behind the parts
    cp good out.exr.2-of-2.part
    parts box.exr 2 "" box.obj "${SMALL[@]}"
    echo "# again" >>box.obj
    shade merge box.exr
    refused 2 "box.exr.1-of-2.part: is of other inputs or options: its vdbshade_input_0 is"
    untouched out.exr
}

@test "a damaged part is refused at whatever byte, and by name" {
    unless_sanitized "a few hundred runs"
    write_box box.obj
    parts out.exr 2 "" box.obj "${SMALL[@]}"
    cp out.exr.2-of-2.part good
    size=$(stat -c %s good)
    for at in 0 3 15 16 20 24 31 32 40 47 48 55 56 60 64 72 100 200 400 800 1200 $((size / 2)) $((size - 900)) $((size - 9)) $((size - 1)); do
        cp good out.exr.2-of-2.part
        printf '\xff' | dd of=out.exr.2-of-2.part bs=1 seek=$at conv=notrunc status=none
        cmp -s good out.exr.2-of-2.part && continue
        shade merge out.exr
        [[ $status -eq 2 || $status -eq 3 || $status -eq 4 ]] || fail "byte $at"
        [[ $stderr == *"out.exr.2-of-2.part: "* ]] || fail "byte $at"
        [ ! -e out.exr ] || fail "byte $at"
    done
    for bytes in 0 1 20 55 56 63 64 500 $((size - 8)) $((size - 1)); do
        head -c "$bytes" good >out.exr.2-of-2.part
        shade merge out.exr
        refused 2 "out.exr.2-of-2.part: "
    done
    (cat good && echo) >out.exr.2-of-2.part
    shade merge out.exr
    refused 2 "out.exr.2-of-2.part: damaged"
}

@test "what a part names is read, not written: outputs are those that merge is given" {
    write_box box.obj
    parts out.exr 1 "" box.obj "${SMALL[@]}" --stats kept.json
    rm kept.json
    mv out.exr.1-of-1.part other.exr.1-of-1.part
    "$VDBSHADE" merge other.exr --quiet
    [ -e other.exr ]
    [ ! -e out.exr ]
    [ ! -e kept.json ]
}

@test "a part that cannot be written leaves none" {
    write_box box.obj
    shade bake box.obj "${SMALL[@]}" -o none/out.exr --shard 1/2
    refused 3 "none"
    for text in 0/2 3/2 1 1/ /2 1/2/3 a/b 1/20000 -1/2; do
        shade bake box.obj "${SMALL[@]}" -o out.exr "--shard=$text"
        refused 2 "--shard '$text': expected I/N"
    done
    no_leftovers
    [ -z "$(ls ./*.part 2>/dev/null)" ]
}
