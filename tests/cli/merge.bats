# `merge`: volumes; and what is wrong with parts, which may be of strangers.
load parts

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
    volume 2 --ao 1 --shard-least 0
    volume 3 --box -2,-1,-2,3,2,3 --error --method adaptive --shard-least 0
    volume 7 --inside off # one of them has all the voxels
    volume 64 --box -1,-1,-1,2,2,2 --ao 1 --shard-least 0
    # parts of a lightmap and of a volume know each other
    parts out.png 1 "" box.obj "${SMALL[@]}"
    local b=(volume box.obj --sun 1,1,1 --resolution 24 --shard-least 0 -o b.vdb)
    "$VDBSHADE" "${b[@]}" --shard 1/2 --quiet
    shade merge b.vdb
    refused 3 "b.vdb: a part is missing: 2 of 2"
    cp out.png.1-of-1.part b.vdb.2-of-2.part
    shade merge b.vdb
    refused 2 "b.vdb.2-of-2.part: is a part of a bake, not of a volume"
    "$VDBSHADE" "${b[@]}" --inside off --shard 2/2 --quiet
    shade merge b.vdb
    refused 2 "b.vdb.2-of-2.part: is of other inputs or options: its vdbshade_command is"
    "$VDBSHADE" "${b[@]}" --shard 2/2 --quiet --shard-least 1
    shade merge b.vdb
    refused 2 "b.vdb.2-of-2.part: is of other inputs or options: its number of parts with voxels is '1', of the others or here '2'"
    "$VDBSHADE" "${b[@]}" --shard 2/2 --quiet
    printf x | dd of=b.vdb.2-of-2.part bs=1 seek=3000 conv=notrunc status=none
    shade merge b.vdb
    refused 2 "b.vdb.2-of-2.part: damaged"
    [ ! -e b.vdb ]
}

@test "parts of a volume have as much work as is worth a part, and those without read nothing" {
    write_box box.obj
    local volume=(volume box.obj --sun 1,1,1 --box -1,-1,-1,2,2,2 --box-voxel-size 0.1 --resolution 16 -o b.vdb)
    # nothing is baked by a forecast, which reads all, of whichever part
    shade "${volume[@]}" --shard 5/5 --shard-least 0.004 --dry-run
    done_well
    [ -z "$(ls b.vdb* 2>/dev/null)" ] || fail "something was written"
    [[ "$output" == *"voxels        27000, those inside too, in 1 grid"*"memory "*"time "*"parts         3 of 5 have voxels" ]] || fail "$output"
    # 27,000 voxels, each of 450 ns: three shares of 4 ms
    shade "${volume[@]}" --shard 4/5 --shard-least 0.004
    done_well
    [[ "$stderr" == *"b.vdb.4-of-5.part: nothing to do, as there is work for 3 (--shard-least)"* ]]
    local i
    for i in 1 2 3 5; do
        "$VDBSHADE" "${volume[@]}" --shard "$i/5" --shard-least 0.004 --quiet
    done
    "$VDBSHADE" merge b.vdb --quiet
    mv b.vdb merged.vdb
    "$VDBSHADE" "${volume[@]}" --quiet
    cmp b.vdb merged.vdb
    # of the band of a named size only files tell
    shade volume box.obj --sun 1,1,1 --voxel-size 0.1 -o c.vdb --shard 5/5
    done_well
    [[ "$stderr" != *"nothing to do"* ]]
    shade "${volume[@]}" --shard 1/2 --shard-least -1
    refused 2 --shard-least
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
