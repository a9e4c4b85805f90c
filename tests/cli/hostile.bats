# Files that mean harm: nothing of them takes the program down, and each is baked or refused with its reason.
load helper

setup() {
    cd "$BATS_TEST_TMPDIR" || return 1
    write_box box.obj
    old_output out.exr
}

bake() {
    shade bake "$1" -o out.exr "${SMALL[@]}" "${@:2}"
}

# solid FILE: what info says of the level set of a mesh, without where it came from.
solid() {
    "$VDBSHADE" voxelize "$1" -o solid.vdb --voxel-size 0.05 --quiet "${@:2}"
    "$VDBSHADE" info solid.vdb | grep -E 'active voxels|voxel size|background|problem'
}

@test "vertices far out are a limit" {
    local value
    for value in 1e30 -1e30 1e38; do
        sed "s/^v 1 1 1/v 1 $value 1/" box.obj >far.obj
        bake far.obj
        refused 4 'voxel size'
        refuses 4 'voxel size' -- bake far.obj -o out.exr --ao 1 --size 32 --voxel-size 0.05
    done
    sed -E 's/^v ([01]) ([01]) ([01])/v \1e30 \2e30 \3e30/' box.obj >large.obj
    bake large.obj
    refused 4 'voxel size'
    untouched out.exr
}

@test "indices out of range, NaN and infinity are refused with their place" {
    sed 's,^f 1/1 4/2 3/3,f 1/1 4294967295/2 3/3,' box.obj >bad.obj
    bake bad.obj
    refused 2 bad.obj
    sed 's,^f 1/1 4/2 3/3,f 1/1 -99/2 3/3,' box.obj >bad.obj
    bake bad.obj
    refused 2 bad.obj
    sed 's/^v 1 1 1/v 1 -nan 1/' box.obj >bad.obj
    bake bad.obj
    refused 2 bad.obj
    untouched out.exr
}

@test "a million triangles without area are counted and change nothing" {
    { cat box.obj && yes 'f 1/1 1/1 2/2' | head -n 1000000; } >many.obj
    bake many.obj --verbose
    done_well
    [[ $stderr == *"1000000 triangles of zero area"* ]] || fail "they are not counted"
    succeed bake box.obj -o whole.exr "${SMALL[@]}"
    "$VDBSHADE" info out.exr | grep channel >many.txt
    "$VDBSHADE" info whole.exr | grep channel >whole.txt
    cmp many.txt whole.txt
}

@test "faces that are missing, turned inward or given twice" {
    sed '$d' box.obj | sed '$d' >open.obj
    bake open.obj --verbose
    done_well
    [[ $stderr == *"4 open edges"* ]] || fail "says nothing of the missing face"
    solid box.obj >sound.txt
    sed -E 's/^f ([^ ]*) ([^ ]*) ([^ ]*)/f \1 \3 \2/' box.obj >inward.obj
    solid inward.obj >room.txt
    if cmp -s sound.txt room.txt; then fail "a room is filled"; fi
    solid inward.obj --treat '*=solid' >inward.txt
    cmp sound.txt inward.txt
    { cat box.obj && grep '^f ' box.obj; } >twice.obj
    solid twice.obj >twice.txt
    cmp sound.txt twice.txt
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

@test "a pipe in place of an image is refused, not waited for" {
    mkfifo waits.png
    refuses 3 waits.png -- info waits.png
    cat >scene.json <<'JSON'
{"casters": [{"mask": "waits.png", "size": 1, "thickness": 0.2}], "ao": {"distance": 1},
 "receivers": [{"mesh": "box.obj", "size": 16, "output": "out.exr"}]}
JSON
    refuses 3 waits.png -- bake scene.json
    untouched out.exr
}

@test "the reader's argument alone does nothing" {
    run --separate-stderr "$VDBSHADE" --vdbshade-reader </dev/null
    [ "$status" -ne 0 ] || fail "expected a failure"
    [ -z "$output" ] || fail "expected no output"
}

@test "changed bytes of every kind of file never take the program down" {
    local file at size part
    "$VDBSHADE" voxelize box.obj -o a.vdb --quiet --resolution 16
    cp "$ASSETS/thin.glb" a.glb
    cp "$ASSETS/emblem.png" a.png
    "$VDBSHADE" bake box.obj -o a.tif --quiet "${SMALL[@]}"
    for file in a.vdb a.glb a.png a.tif; do
        size=$(wc -c <"$file")
        for ((part = 1; part <= 6; ++part)); do
            at=$((part * part * size / 49))
            { head -c "$at" "$file" && printf '\377\377\377\177' && tail -c +$((at + 5)) "$file"; } >"bad.${file#a.}"
            shade info "bad.${file#a.}"
            case $status in
            0 | 2 | 3 | 4) ;;
            *) fail "$file changed at byte $at" ;;
            esac
        done
    done
}
