# `merge`: what is wrong with parts, which may be of strangers.
load parts

@test "parts that are missing are named, and nothing is written" {
    old_output out.exr
    write_box box.obj
    refuses 2 "out.exr: there are no parts beside it" -- merge out.exr
    parts out.exr 3 "1 3" box.obj "${SMALL[@]}"
    refuses 3 "out.exr: a part is missing: 2 of 3; bake it by --shard I/3" -- merge out.exr
    parts out.exr 12 1 box.obj "${SMALL[@]}"
    refuses 2 "there are parts of 3 and of 12 shards" -- merge out.exr
    refuses 3 "parts are missing: 2, 3, 4, 5, 6, 7 and 5 more of 12" -- merge out.exr --shards 12
    untouched out.exr
}

@test "a part of other inputs, options, another version or another bake is named, with what differs" {
    old_output out.exr
    write_box box.obj
    parts out.exr 2 1 box.obj "${SMALL[@]}"
    parts out.exr 2 2 box.obj "${SMALL[@]}" --max-error 0.1
    refuses 2 "out.exr.2-of-2.part: is of other inputs or options: its vdbshade_command is" "max-error" -- merge out.exr
    parts out.exr 2 2 box.obj "${SMALL[@]}"
    cp out.exr.2-of-2.part good
    cp out.exr.1-of-2.part out.exr.2-of-2.part
    refuses 2 "out.exr.2-of-2.part: holds part 1 of 2; was it renamed?" -- merge out.exr
    sed "s/^vdbshade part ./vdbshade part 8/" good >out.exr.2-of-2.part
    refuses 2 "out.exr.2-of-2.part: is of another version of vdbshade" -- merge out.exr
    # the input changed behind the parts
    cp good out.exr.2-of-2.part
    parts box.exr 2 "" box.obj "${SMALL[@]}"
    echo "# again" >>box.obj
    refuses 2 "box.exr.1-of-2.part: is of other inputs or options: its vdbshade_input_0 is" -- merge box.exr
    untouched out.exr
}

@test "a damaged part is refused at whatever byte, and by name" {
    unless_sanitized "a few hundred runs"
    write_box box.obj
    parts out.exr 2 "" box.obj "${SMALL[@]}" --size 96
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
        refuses 2 "out.exr.2-of-2.part: " -- merge out.exr
    done
    (cat good && echo) >out.exr.2-of-2.part
    refuses 2 "out.exr.2-of-2.part: damaged" -- merge out.exr
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
    refuses 3 "none" -- bake box.obj "${SMALL[@]}" -o none/out.exr --shard 1/2
    for text in 0/2 3/2 1 1/ /2 1/2/3 a/b 1/20000 -1/2; do
        refuses 2 "--shard '$text': expected I/N" -- bake box.obj "${SMALL[@]}" -o out.exr "--shard=$text"
    done
    no_leftovers
    [ -z "$(ls ./*.part 2>/dev/null)" ]
}
