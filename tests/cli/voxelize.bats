# voxelize: meshes and scenes to level sets.
load helper

setup() {
    cd "$BATS_TEST_TMPDIR" || return 1
    write_box box.obj
}

@test "a mesh becomes a level set of the voxel size and band asked for" {
    shade voxelize box.obj -o out.vdb --voxel-size 0.04 --half-width 5
    done_well
    [[ $stderr == *"out.vdb: voxel 0.04, "*"active voxels"* ]] || fail "no summary"
    shade info out.vdb
    [[ $output == *"grid 'surface'"*"voxel size: 0.04 0.04 0.04"*"(5 voxels)"* ]] || fail "not what was asked for"
}

@test "a resolution is counted along the longest side" {
    shade voxelize box.obj -o out.vdb --resolution 50 --quiet
    done_well
    shade info out.vdb
    [[ $output == *"voxel size: 0.02 0.02 0.02"* ]] || fail "wrong voxel size"
}

@test "a scene's casters become one level set" {
    shade voxelize "$ASSETS/seeds.json" -o seeds.vdb --voxel-size 0.1 --quiet
    done_well
    shade info seeds.vdb
    [[ $output == *"class: level set"* ]] || fail "no level set"
}

@test "the same values for any number of threads" {
    for threads in 1 5; do
        shade voxelize box.obj -o "$threads.vdb" --resolution 64 --threads "$threads" --quiet
        done_well
    done
    same_values 1.vdb 5.vdb || fail "they differ"
    shade voxelize box.obj -o other.vdb --resolution 65 --quiet
    if same_values 1.vdb other.vdb; then fail "any two are the same"; fi
}

@test "bad options and places are refused" {
    old_output out.vdb
    shade voxelize box.obj --resolution 24
    refused 2 -o
    shade voxelize box.obj -o out.exr
    refused 2 out.exr
    shade voxelize box.obj -o none/out.vdb
    refused 3 none/out.vdb
    shade voxelize box.obj -o out.vdb --voxel-size 0
    refused 2 --voxel-size
    shade voxelize box.obj -o out.vdb --voxel-size 1e-7
    refused 4
    shade voxelize none.obj -o out.vdb
    refused 3 none.obj
    shade voxelize out.vdb -o out.vdb
    refused 2 out.vdb
    untouched out.vdb
}
