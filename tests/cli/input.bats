# Bad input: one line on standard error, the exit code of its kind, the old output untouched.
load helper

setup() {
    cd "$BATS_TEST_TMPDIR" || return 1
    write_box box.obj
    old_output out.exr
}

# refuse_input CODE INPUT WORD …: a bake of the INPUT ends with CODE, says its name and the WORDs, and leaves the old output.
refuse_input() {
    refuses "$1" "${@:2}" -- bake "$2" -o out.exr "${SMALL[@]}"
    untouched out.exr
}

@test "a mesh or scene that is not there, a folder and an empty file are refused with code 3" {
    refuse_input 3 none.obj
    refuse_input 3 none.json
    refuses 3 none.obj -- bake box.obj -o out.exr "${SMALL[@]}" --caster none.obj
    refuses 3 none.glb 'cannot be opened' -- bake none.glb
    refuses 3 none.glb 'cannot be opened' -- bake none.glb -o out.exr
    refuses 3 none.glb 'cannot be opened' -- render none.glb -o out.png
    refuses 3 none.glb 'cannot be opened' -- volume none.glb -o out.vdb
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
    sed -e '/^vt/d' -e 's,/[0-9]*,,g' box.obj >bare.obj
    refuse_input 2 bare.obj 'no UVs'
    refuses 2 box.obj 'UV set 3' -- bake box.obj -o out.exr "${SMALL[@]}" --uv-set 3
    untouched out.exr
}

@test "vertices and UVs that are not finite and indices out of range are refused" {
    local change
    for change in 's/^v 1 1 1/v 1 nan 1/' 's/^v 1 1 1/v 1 inf 1/' 's/^v 1 1 1/v 1 -inf 1/' 's/^v 1 1 1/v 1 1e999 1/' \
        's/^vt 0.31 0.02/vt nan 0.02/' 's,^f 1/1 4/2 3/3,f 1/1 4/2 3/99,'; do
        sed "$change" box.obj >bad.obj
        refuse_input 2 bad.obj
    done
    sed 's,^f 1/1 4/2 3/3,f 1/1 99/2 3/3,' box.obj >bad.obj
    refuse_input 2 bad.obj 99
}

@test "zero-area triangles are skipped and counted" {
    { cat box.obj && printf 'f 1/1 1/1 2/2\nf 3/3 3/3 3/3\n'; } >sliver.obj
    succeed bake sliver.obj -o out.exr "${SMALL[@]}" --verbose
    [[ $stderr == *"2 triangles of zero area"* ]] || fail "they are not counted"
    succeed bake box.obj -o whole.exr "${SMALL[@]}"
    same_values out.exr whole.exr
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
    refuses 3 cut.vdb -- bake vdb.json
    printf 'no level set at all' >cut.vdb
    refuses 3 cut.vdb -- bake vdb.json
    untouched out.exr
}

@test "a cut binary model" {
    head -c 3000 "$ASSETS/cloister.glb" >cut.glb
    refuse_input 3 cut.glb
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
