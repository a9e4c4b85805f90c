# volume: shadow and AO on voxels, from the command line.
load helper

# The seeds' scene, coarse.
prepare() {
    sed 's/"voxel_size": 0.02/"voxel_size": 0.1/' "$ASSETS/seeds.json" >scene.json
    ln -s "$(cd "$ASSETS" && pwd)/seeds_floor.obj" .
    SUN=(--sun 0.3,1,0.2 --sun-angle 5)
}

@test "a scene's band has a grid for each light, ao and their errors" {
    succeed_saying "out.vdb: 2 grids of " " voxels" -- volume scene.json -o out.vdb
    info_tells out.vdb "grid 'shadow.sun'" "class: unknown" "voxel size: 0.1 0.1 0.1" "background: 1" "grid 'ao'"
    succeed volume scene.json -o out.vdb --max-error 0.1 --error --quiet
    info_tells out.vdb shadow.sun "'ao'" error.sun error.ao
}

@test "a mesh's band is the level set's, or narrower" {
    voxels() {
        "$VDBSHADE" info "$1" | sed -n '/active voxels/{s/.*active voxels: \([0-9]*\).*/\1/p;q}'
    }
    succeed voxelize box.obj -o box.vdb --resolution 24 --quiet
    succeed volume box.obj "${SUN[@]}" -o out.vdb --resolution 24 --quiet
    for band in 1 6; do
        succeed volume box.obj "${SUN[@]}" -o $band.vdb --resolution 24 --band $band --quiet
    done
    holds "$(voxels out.vdb) == $(voxels box.vdb)"
    holds "$(voxels 1.vdb) < 3 / 4 * $(voxels box.vdb) && $(voxels 6.vdb) > 3 / 2 * $(voxels box.vdb)"
}

@test "a level set is shaded on its own voxels, and inside voxels are left off where that is asked for" {
    shade voxelize box.obj -o asset.vdb --voxel-size 0.07 --quiet
    succeed info asset.vdb
    box=$(grep 'active voxels' <<<"$output" | sed 's/.*: //')
    succeed volume asset.vdb "${SUN[@]}" -o out.vdb --quiet
    info_tells out.vdb "voxel size: 0.07 0.07 0.07" "active voxels: $box"
    succeed_saying " 0 of them filled" -- volume asset.vdb "${SUN[@]}" -o off.vdb --inside off --stats stats.json
    grep -q '"inside_voxels": [1-9]' stats.json && grep -q '"voxels": [1-9]' stats.json
    succeed info off.vdb
    [[ $output != *"active voxels: $box"* ]] || fail "none was left off"
}

@test "a box has its own voxels" {
    succeed volume scene.json -o out.vdb --box -2,-0.2,-2,2,1.8,2 --box-voxel-size 0.25 --quiet
    info_tells out.vdb "voxel size: 0.25 0.25 0.25" "0 0 0 to 15 7 15"
    succeed volume scene.json -o out.vdb --box 0,3,0,1,4,1 --quiet
    info_tells out.vdb "voxel size: 0.1 0.1 0.1" "active voxels: 1000," # the casters' voxels
}

@test "a fog's voxels are those of its grid, and of no other file's" {
    shade volume scene.json -o fog.vdb --box -1,0.5,-1,1,1.5,1 --box-voxel-size 0.1 --quiet
    for like in fog.vdb fog.vdb:ao fog.vdb:shadow.sun ./fog.vdb:ao; do
        succeed volume scene.json -o lit.vdb --like "$like" --quiet
        same fog.vdb lit.vdb
    done
}

@test "half floats take less room" {
    shade volume scene.json --method cone --ao-method cones -o 1.vdb --quiet
    succeed volume scene.json --method cone --ao-method cones -o half.vdb --half --quiet
    [ "$(stat -c %s half.vdb)" -lt "$(($(stat -c %s 1.vdb) * 19 / 20))" ] || fail "not smaller"
    info_tells half.vdb Tree_float_5_4_3
}

@test "a dry run tells voxels and memory, and bakes nothing" {
    succeed volume "$ASSETS/cloister.glb" --sun 1,1,1 --ao 1 --box 0,0,0,1,2,3 --box-voxel-size 0.1 --resolution 16 -o out.vdb --dry-run
    [[ "$output" =~ ^"voxels        6000, with those inside"$'\n'"memory        about "[0-9.]+" MiB at most"$ ]] || fail "$output"
    [ ! -e out.vdb ]
}

@test "bad options are refused, and the old file stays" {
    old_output out.vdb
    refuse_each volume <<'LIST'
2 -o | scene.json
2 out.exr | scene.json -o out.exr
2 'nothing to bake' | box.obj -o out.vdb
LIST
    for box in 0,0,0,1,1 0,0,0,1,0,1 0,0,0,1,-1,1 0,0,nan,1,1,1 0,0,0,1,1,1,1 a; do
        refuses 2 --box "$box" -- volume scene.json -o out.vdb --box "$box"
    done
    for size in 0 -1 nan 1x; do
        refuses 2 --box-voxel-size -- volume scene.json -o out.vdb --box 0,0,0,1,1,1 --box-voxel-size "$size"
    done
    refuse_each volume scene.json -o <<'LIST'
2 'needs --box' | out.vdb --box-voxel-size 1
2 'one of' | out.vdb --box 0,0,0,1,1,1 --band 2
2 'one of' | out.vdb --box 0,0,0,1,1,1 --like a.vdb
2 --band | out.vdb --band 0
2 --band | out.vdb --band 101
2 'nearest, off' | out.vdb --inside maybe
2 taps | out.vdb --box 0,3,0,1,4,1 --ao-method taps
3 none/out.vdb | none/out.vdb
LIST
    untouched out.vdb
}

@test "a bad --like is refused with its reason" {
    old_output out.vdb
    shade voxelize box.obj -o ls.vdb --resolution 24 --quiet
    refuse_each volume scene.json -o out.vdb --like <<'LIST'
3 none.vdb | none.vdb
2 ls.vdb "no grid 'density'" "'surface'" | ls.vdb:density
2 --like | ls.vdb:
3 scene.json | scene.json
LIST
    head -c 300 ls.vdb >cut.vdb
    refuses 3 cut.vdb -- volume scene.json -o out.vdb --like cut.vdb
    refuses 2 'ls.vdb: the output is also an input' -- volume scene.json -o ls.vdb --like ls.vdb
    untouched out.vdb
}

@test "too many voxels are a limit, named before memory is taken" {
    old_output out.vdb
    refuse_each volume scene.json -o out.vdb --box -5,-5,-5,5,5,5 --box-voxel-size <<'LIST'
4 '1299 x 1299 x 1299' 'limit' | 0.0077 --memory-limit 2G
4 'limit' | 0.05 --memory-limit 40M
4 1e-06 | 1e-6
LIST
    untouched out.vdb
}

@test "a signal ends it, and leaves the old file" {
    old_output out.vdb
    interrupted INT 0.1 volume scene.json -o out.vdb --box -4,-4,-4,4,4,4 --box-voxel-size 0.03 --ao 3 --ao-method cones
    untouched out.vdb
}
