# Bad input: one line on standard error, the exit code of its kind, the old output untouched.
load helper

setup() {
    cd "$BATS_TEST_TMPDIR" || return 1
    write_box box.obj
    old_output out.exr
}

bake_bad() {
    shade bake "$1" -o out.exr "${SMALL[@]}" "${@:2}"
}

@test "a missing file" {
    bake_bad none.obj
    refused 3 none.obj
    bake_bad none.json
    refused 3 none.json
    bake_bad box.obj --caster none.obj
    refused 3 none.obj
    refuses 3 none.glb 'cannot be opened' -- bake none.glb
    refuses 3 none.glb 'cannot be opened' -- bake none.glb -o out.exr
    refuses 3 none.glb 'cannot be opened' -- render none.glb -o out.png
    refuses 3 none.glb 'cannot be opened' -- volume none.glb -o out.vdb
    untouched out.exr
}

@test "a folder in place of a file" {
    mkdir folder.obj
    bake_bad folder.obj
    refused 3 folder.obj
    untouched out.exr
}

@test "an empty mesh" {
    : >empty.obj
    bake_bad empty.obj
    refused 3 empty.obj
    printf 'v 0 0 0\nv 1 0 0\nv 0 1 0\n' >points.obj
    bake_bad points.obj
    refused 2 points.obj
    untouched out.exr
}

@test "a mesh without UVs" {
    sed -e '/^vt/d' -e 's,/[0-9]*,,g' box.obj >bare.obj
    bake_bad bare.obj
    refused 2 bare.obj 'no UVs'
    untouched out.exr
}

@test "a UV set that does not exist" {
    bake_bad box.obj --uv-set 3
    refused 2 box.obj 'UV set 3'
    untouched out.exr
}

@test "vertices that are not finite" {
    for value in nan inf -inf 1e999; do
        sed "s/^v 1 1 1/v 1 $value 1/" box.obj >bad.obj
        bake_bad bad.obj
        refused 2 bad.obj
    done
    untouched out.exr
}

@test "UVs that are not finite" {
    sed 's/^vt 0.31 0.02/vt nan 0.02/' box.obj >bad.obj
    bake_bad bad.obj
    refused 2
    untouched out.exr
}

@test "an index out of range" {
    sed 's,^f 1/1 4/2 3/3,f 1/1 99/2 3/3,' box.obj >bad.obj
    bake_bad bad.obj
    refused 2 bad.obj 99
    sed 's,^f 1/1 4/2 3/3,f 1/1 4/2 3/99,' box.obj >bad.obj
    bake_bad bad.obj
    refused 2 bad.obj
    untouched out.exr
}

@test "zero-area triangles are skipped and counted" {
    { cat box.obj && printf 'f 1/1 1/1 2/2\nf 3/3 3/3 3/3\n'; } >sliver.obj
    bake_bad sliver.obj --verbose
    done_well
    [[ $stderr == *"2 triangles of zero area"* ]] || fail "they are not counted"
    succeed bake box.obj -o whole.exr "${SMALL[@]}"
    same_values out.exr whole.exr
}

@test "nothing but zero-area triangles" {
    printf 'v 0 0 0\nv 1 0 0\nvt 0 0\nvt 1 0\nf 1/1 2/2 1/1\n' >line.obj
    bake_bad line.obj
    refused 2
    untouched out.exr
}

@test "a voxel size so small that the memory limit would be passed" {
    refuses 4 -- bake box.obj -o out.exr --ao 1 --size 32 --voxel-size 0.0001 --memory-limit 64MiB
    refuses 4 -- bake box.obj -o out.exr --ao 1 --size 32 --voxel-size 1e-12
    shade bake box.obj -o out.exr --ao 1 --size 32 --voxel-size 1e-300
    [ "$status" -eq 4 ] || [ "$status" -eq 2 ] || fail "expected a limit"
    untouched out.exr
}

@test "a lightmap so large that its format would pass the memory limit" {
    refuses 4 "out.webp: writing 8192 × 8192 texels takes" "write .exr" -- bake box.obj -o out.webp --ao 1 --size 8192 --resolution 24 --memory-limit 20M
    [ ! -e out.webp ]
}

@test "a scene file cut in the middle" {
    sed 's,seeds_floor.obj,box.obj,; s,seeds.exr,out.exr,' "$ASSETS/seeds.json" >whole.json
    local size
    size=$(wc -c <whole.json)
    for part in 1 2 3 5 7; do
        head -c $((size * part / 8)) whole.json >cut.json
        refuses 2 cut.json -- bake cut.json
    done
    : >cut.json
    refuses 2 cut.json -- bake cut.json
    untouched out.exr
}

@test "a damaged level set" {
    succeed voxelize box.obj -o box.vdb --resolution 24 --quiet
    cat >vdb.json <<'JSON'
{"casters": [{"vdb": "cut.vdb"}], "ao": {"distance": 1},
 "receivers": [{"mesh": "box.obj", "size": 16, "output": "out.exr"}]}
JSON
    head -c 700 box.vdb >cut.vdb
    shade bake vdb.json
    [ "$status" -eq 2 ] || [ "$status" -eq 3 ] || fail "expected bad input or a file that cannot be read"
    refused "$status" cut.vdb
    printf 'no level set at all' >cut.vdb
    shade bake vdb.json
    [ "$status" -eq 2 ] || [ "$status" -eq 3 ] || fail "expected bad input or a file that cannot be read"
    refused "$status" cut.vdb
    untouched out.exr
}

@test "a cut binary model" {
    head -c 3000 "$ASSETS/cloister.glb" >cut.glb
    bake_bad cut.glb
    [ "$status" -eq 2 ] || [ "$status" -eq 3 ] || fail "expected bad input or a file that cannot be read"
    refused "$status" cut.glb
    untouched out.exr
}

@test "a scene whose flags do not fit it" {
    cat >two.json <<'JSON'
{"casters": [{"mesh": "box.obj"}], "ao": {"distance": 1}, "resolution": 24,
 "receivers": [{"mesh": "box.obj", "size": 16, "output": "a.exr"},
               {"mesh": "box.obj", "size": 16, "output": "b.exr"}]}
JSON
    refuses 2 two.json -- bake two.json -o out.exr
    refuses 2 --sun -- bake two.json --sun 0,1,0
    untouched out.exr
    [ ! -e a.exr ]
    [ ! -e b.exr ]
}

# What stands in a file may take a hundred times its size, and is refused before it does.
@test "a scene of a million empty objects is refused within the memory limit, by every command that reads one" {
    { printf '[{}'; yes ',{}' | head -n 1000000 | tr -d '\n'; printf ']'; } >bomb.json
    local command
    for command in "info bomb.json" "bake bomb.json --sun 0,1,0" "voxelize bomb.json -o out.vdb" "flat bomb.json -o out.exr"; do
        refuses 4 'bomb.json: about ' 'MB are needed, over the memory limit of 105 MB' -- $command --memory-limit 100MiB
    done
}

@test "two images that are compared count together" {
    write_box box.obj
    run -0 "$VDBSHADE" bake box.obj --sun 1,2,1 --size 512 --resolution 8 --method hard -o one.exr --quiet
    refuses 4 'one.exr: about 16 MB are needed, over the memory limit of 12 MB' -- compare one.exr one.exr --memory-limit 12M
    run -0 "$VDBSHADE" compare one.exr one.exr --memory-limit 18M
    run -0 "$VDBSHADE" info one.exr --memory-limit 11M
    refuses 4 'one.exr: about ' 'over the memory limit of 5 MB' -- info one.exr --memory-limit 5M
}
