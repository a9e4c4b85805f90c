# Where the output cannot go, and that it comes whole or not at all.
load helper

BAKE=(bake box.obj "${SMALL[@]}" -o)

@test "a folder that does not exist" {
    refuses 3 none/out.exr -- "${BAKE[@]}" none/out.exr
    refuses 3 none/stats.json -- "${BAKE[@]}" out.exr --stats none/stats.json
    [ ! -e out.exr ]
}

@test "a folder that cannot be written to" {
    [ "$(id -u)" -ne 0 ] || skip "root may write anywhere"
    mkdir shut
    chmod 555 shut
    shade "${BAKE[@]}" shut/out.exr
    chmod 755 shut
    refused 3 shut/out.exr
}

@test "a folder in place of the output" {
    mkdir out.exr
    refuses 3 out.exr -- "${BAKE[@]}" out.exr
}

@test "an ending of no known format, and none" {
    refuses 2 out.xyz -- "${BAKE[@]}" out.xyz
    refuses 2 out -- "${BAKE[@]}" out
}

@test "what bake writes is listed with the assets, images alone without them" {
    for out in out.fbx out.psd; do
        refuses 2 "expected one of exr, png," "glb, gltf, obj" -- "${BAKE[@]}" "$out"
    done
    refuses 2 out.fbx -- render box.obj "${SMALL[@]}" -o out.fbx
    [[ $stderr != *glb* ]] || fail "render writes no asset"
}

@test "bits and packings that a format does not have" {
    refuses 2 32 -- "${BAKE[@]}" out.png --bits 32
    refuses 2 shadow.moon -- "${BAKE[@]}" out.png --pack R=shadow.moon
    no_leftovers
}

@test "the input, a caster and the scene are never replaced" {
    cp box.obj copy.obj
    refuses 2 box.obj -- "${BAKE[@]}" box.obj
    refuses 2 box.obj -- "${BAKE[@]}" ./box.obj
    ln -s copy.obj link.exr
    refuses 2 link.exr -- "${BAKE[@]}" link.exr --caster copy.obj
    refuses 2 box.obj -- "${BAKE[@]}" out.exr --stats box.obj
    refuses 2 out.exr -- "${BAKE[@]}" out.exr --stats out.exr
    cmp box.obj copy.obj
}

@test "a full disk leaves the old output" {
    old_output out.exr
    # The limit counts blocks of 1 KiB; the lightmap takes more.
    run --separate-stderr bash -c 'ulimit -f 1; exec "$@"' - "$VDBSHADE" bake box.obj --sandbox off "${SMALL[@]}" \
        --size 256 --ao 1 --quiet -o out.exr
    refused 3 out.exr
    untouched out.exr
}

@test "a limit on the size of files that a reader's answer passes is told" {
    # 402 vertices with UVs are 8 KB, however they are sent; the lightmap is under 4.
    awk 'BEGIN { for (i = 0; i <= 200; ++i) { x = i / 200; printf "v %g 0 0\nv %g 0 1\nvt %g 0\nvt %g 1\n", x, x, x, x }
         for (i = 1; i < 400; i += 2) printf "f %d/%d %d/%d %d/%d %d/%d\n", i, i, i + 1, i + 1, i + 3, i + 3, i + 2, i + 2 }' >strip.obj
    old_output out.exr
    run --separate-stderr bash -c 'ulimit -f 4; exec "$@"' - "$VDBSHADE" bake strip.obj "${SMALL[@]}" --quiet -o out.exr
    refused 4 strip.obj "ulimit -f"
    untouched out.exr
    run --separate-stderr bash -c 'ulimit -f 4; exec "$@"' - "$VDBSHADE" bake strip.obj --sandbox off "${SMALL[@]}" --quiet -o out.exr
    done_well
}

@test "a full disk leaves the old PNG and the old level set" {
    old_output out.png
    run --separate-stderr bash -c 'ulimit -f 1; exec "$@"' - "$VDBSHADE" bake box.obj --sandbox off "${SMALL[@]}" \
        --size 256 --ao 1 --bits 16 --quiet -o out.png
    refused 3 out.png
    untouched out.png
    old_output out.vdb
    run --separate-stderr bash -c 'ulimit -f 1; exec "$@"' - "$VDBSHADE" voxelize box.obj --sandbox off --quiet -o out.vdb
    refused 3 out.vdb
    untouched out.vdb
}

@test "a complete run replaces the old output" {
    old_output out.exr
    succeed "${BAKE[@]}" out.exr --quiet
    [ "$(head -c 4 out.exr | od -An -tx1 | tr -d ' ')" = 762f3101 ] || fail "no EXR"
    [ -z "$stderr" ] || fail "--quiet said something"
    no_leftovers
}

@test "--output-folder takes all outputs of a scene by their names, and nothing else" {
    mkdir -p elsewhere maps
    cat >two.json <<'JSON'
{"casters": [{"mesh": "box.obj"}], "resolution": 16, "ao": {"distance": 1},
 "receivers": [{"mesh": "box.obj", "size": 16, "output": "maps/one.exr"},
               {"mesh": "box.obj", "size": 8, "output": "two.png"}]}
JSON
    succeed bake two.json --output-folder elsewhere --quiet
    [ -s elsewhere/one.exr ] && [ -s elsewhere/two.png ] || fail "not there"
    [ ! -e maps/one.exr ] && [ ! -e two.png ] || fail "in both places"
    succeed bake two.json --output-folder no/where --quiet
    [ -s no/where/one.exr ] || fail "the folder was not made"
    refuse_each bake <<'LIST'
3 box.obj/maps 'cannot be made' | two.json --output-folder box.obj/maps --quiet
3 missing/out.exr "no folder 'missing'" "mkdir -p 'missing'" | box.obj --ao 1 --resolution 16 -o missing/out.exr
2 --output-folder | box.obj --ao 1 --output-folder elsewhere -o out.exr
LIST
    sed -i 's/two.png/one.exr/' two.json
    refuses 2 elsewhere/one.exr 'two receivers' -- bake two.json --output-folder elsewhere --quiet
}
