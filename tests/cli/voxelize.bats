# voxelize: meshes and scenes to level sets.
load helper

@test "a mesh becomes a level set of the voxel size and band asked for" {
    succeed voxelize box.obj -o out.vdb --voxel-size 0.04 --half-width 5
    [[ $stderr == *"out.vdb: voxel 0.04, "*"active voxels"* ]] || fail "no summary"
    shade info out.vdb
    [[ $output == *"grid 'surface'"*"voxel size: 0.04 0.04 0.04"*"(5 voxels)"* ]] || fail "not what was asked for"
}

@test "a resolution is counted along the longest side" {
    succeed voxelize box.obj -o out.vdb --resolution 50 --quiet
    info_tells out.vdb "voxel size: 0.02 0.02 0.02"
}

@test "a scene's casters become one level set" {
    succeed voxelize "$ASSETS/seeds.json" -o seeds.vdb --voxel-size 0.1 --quiet
    info_tells seeds.vdb "class: level set"
}

@test "the same values for any number of threads" {
    for threads in 1 5; do
        succeed voxelize box.obj -o "$threads.vdb" --resolution 64 --threads "$threads" --quiet
    done
    same_values 1.vdb 5.vdb || fail "they differ"
    shade voxelize box.obj -o other.vdb --resolution 65 --quiet
    if same_values 1.vdb other.vdb; then fail "any two are the same"; fi
}

@test "bad options and places are refused" {
    old_output out.vdb
    refuse_each voxelize <<'LIST'
2 -o | box.obj --resolution 24
2 out.exr | box.obj -o out.exr
3 none/out.vdb | box.obj -o none/out.vdb
2 --voxel-size | box.obj -o out.vdb --voxel-size 0
4 | box.obj -o out.vdb --voxel-size 1e-7
3 none.obj | none.obj -o out.vdb
2 out.vdb | out.vdb -o out.vdb
LIST
    untouched out.vdb
}

@test "FILE.vdb:GRID names a grid wherever a .vdb is read; a file of that whole name is the file" {
    "$VDBSHADE" voxelize box.obj -o box.vdb --name hull --voxel-size 0.1 --quiet
    printf '0.1,0.2,2\n0,3,0\n' >points.csv
    printf 'v -3 -1 -3\nv 3 -1 -3\nv 3 -1 3\nv -3 -1 3\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nvn 0 1 0\n%s\n' \
        'f 1/1/1 4/4/1 3/3/1 2/2/1' >floor.obj
    for grid in box.vdb box.vdb:hull box.vdb:other; do
        printf '{"casters": [{"vdb": "%s"}], "lights": [{"name": "sun", "type": "directional", "angle_deg": 1, "direction": [0, 1, 0]}],
            "receivers": [{"mesh": "floor.obj", "size": 8, "output": "scene.exr"}]}' $grid >scene.json
        for command in "query $grid --points points.csv --distance -o out.csv" "voxelize $grid -o out.vdb" \
            "volume $grid --sun 0,1,0 -o out.vdb" "render $grid --sun 0,1,0 --size 32x32 -o out.png" "info $grid" \
            "query scene.json --points points.csv -o out.csv" "bake scene.json" \
            "bake floor.obj --caster $grid --sun 0,1,0 --size 8 -o out.exr"; do
            rm -f out.*
            # shellcheck disable=SC2086
            shade $command
            if [ $grid = box.vdb:other ]; then
                refused 2 box.vdb "no grid 'other'; it holds 'hull'"
            else
                [ "$status" -eq 0 ] || fail "$command: $stderr"
            fi
        done
    done
    refuses 3 no.vdb -- query no.vdb:hull --points points.csv --distance -o out.csv
    mv box.vdb 'a.vdb:hull.vdb'
    succeed query a.vdb:hull.vdb --points points.csv --distance -o out.csv
    succeed query a.vdb:hull.vdb:hull --points points.csv --distance -o out.csv
}
