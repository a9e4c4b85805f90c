# volume: shadow and AO on voxels, from the command line.
load helper

# The seeds' scene, coarse.
setup() {
    cd "$BATS_TEST_TMPDIR" || return 1
    sed 's/"voxel_size": 0.02/"voxel_size": 0.1/' "$ASSETS/seeds.json" >scene.json
    ln -s "$(cd "$ASSETS" && pwd)/seeds_floor.obj" .
    write_box box.obj
    SUN=(--sun 0.3,1,0.2 --sun-angle 5)
}

info() {
    succeed info "$1"
}

@test "a scene's band has a grid for each light, and ao" {
    succeed volume scene.json -o out.vdb
    [[ $stderr == *"out.vdb: 2 grids of "*" voxels"* ]] || fail "no summary"
    info out.vdb
    [[ $output == *"grid 'shadow.sun'"*"class: unknown"*"voxel size: 0.1 0.1 0.1"*"background: 1"*"grid 'ao'"* ]] || fail "not what was asked for"
}

@test "a mesh's band is the level set's, or narrower" {
    shade voxelize box.obj -o box.vdb --resolution 24 --quiet
    info box.vdb
    [[ $output =~ active\ voxels:\ ([0-9]+) ]]
    band=${BASH_REMATCH[1]}
    succeed volume box.obj "${SUN[@]}" -o out.vdb --resolution 24 --quiet
    info out.vdb
    [[ $output =~ active\ voxels:\ ([0-9]+) ]]
    [ "${BASH_REMATCH[1]}" -eq "$band" ] || fail "not $band"
    shade volume box.obj "${SUN[@]}" -o out.vdb --resolution 24 --band 1 --quiet
    info out.vdb
    [[ $output =~ active\ voxels:\ ([0-9]+) ]]
    [ "${BASH_REMATCH[1]}" -lt "$((band * 3 / 4))" ] || fail "no narrower band"
    shade volume box.obj "${SUN[@]}" -o out.vdb --resolution 24 --band 6 --quiet
    info out.vdb
    [[ $output =~ active\ voxels:\ ([0-9]+) ]]
    [ "${BASH_REMATCH[1]}" -gt "$((band * 3 / 2))" ] || fail "no wider band"
}

@test "a level set is shaded on its own voxels, and inside voxels are left off where that is asked for" {
    shade voxelize box.obj -o asset.vdb --voxel-size 0.07 --quiet
    info asset.vdb
    box=$(grep 'active voxels' <<<"$output" | sed 's/.*: //')
    succeed volume asset.vdb "${SUN[@]}" -o out.vdb --quiet
    info out.vdb
    [[ $output == *"voxel size: 0.07 0.07 0.07"*"active voxels: $box"* ]] || fail "other voxels than $box"
    succeed volume asset.vdb "${SUN[@]}" -o off.vdb --inside off --stats stats.json
    [[ $stderr == *" 0 of them filled"* ]] || fail "some were filled"
    grep -q '"inside_voxels": [1-9]' stats.json && grep -q '"voxels": [1-9]' stats.json
    info off.vdb
    [[ $output != *"active voxels: $box"* ]] || fail "none was left off"
}

@test "a box has its own voxels" {
    succeed volume scene.json -o out.vdb --box -2,-0.2,-2,2,1.8,2 --box-voxel-size 0.25 --quiet
    info out.vdb
    [[ $output == *"voxel size: 0.25 0.25 0.25"*"0 0 0 to 15 7 15"* ]] || fail "another box"
    succeed volume scene.json -o out.vdb --box 0,3,0,1,4,1 --quiet
    info out.vdb
    [[ $output == *"voxel size: 0.1 0.1 0.1"*"active voxels: 1000,"* ]] || fail "not the casters' voxels"
}

@test "a fog's voxels are those of its grid, and of no other file's" {
    shade volume scene.json -o fog.vdb --box -1,0.5,-1,1,1.5,1 --box-voxel-size 0.1 --quiet
    info fog.vdb
    for like in fog.vdb fog.vdb:ao fog.vdb:shadow.sun ./fog.vdb:ao; do
        succeed volume scene.json -o lit.vdb --like "$like" --quiet
        same_values fog.vdb lit.vdb || fail "$like: other voxels or values"
    done
}

@test "half floats take less room, and values are the same for any number of threads" {
    shade volume scene.json --method cone --ao-method cones -o 1.vdb --threads 1 --quiet
    shade volume scene.json --method cone --ao-method cones -o 5.vdb --threads 5 --quiet
    cmp 1.vdb 5.vdb
    succeed volume scene.json --method cone --ao-method cones -o half.vdb --half --quiet
    [ "$(stat -c %s half.vdb)" -lt "$(($(stat -c %s 1.vdb) * 19 / 20))" ] || fail "not smaller"
    info half.vdb
    [[ $output == *"Tree_float_5_4_3"* ]] || fail "no floats"
}

@test "errors have grids of their own" {
    succeed volume scene.json -o out.vdb --max-error 0.1 --error --quiet
    info out.vdb
    [[ $output == *"shadow.sun"*"'ao'"*"error.sun"*"error.ao"* ]] || fail "no errors"
}

@test "a dry run tells voxels and memory, and bakes nothing" {
    succeed volume "$ASSETS/cloister.glb" --sun 1,1,1 --ao 1 --box 0,0,0,1,2,3 --box-voxel-size 0.1 --resolution 16 -o out.vdb --dry-run
    [[ "$output" =~ ^"voxels        6000, those inside too"$'\n'"memory        about "[0-9.]+" MiB at most"$ ]] || fail "$output"
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
2 'no --box' | out.vdb --box-voxel-size 1
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
    refuses 2 ls.vdb --like -- volume scene.json -o ls.vdb --like ls.vdb
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
    rm -f err.txt
    (
        ulimit -t 60
        exec "$VDBSHADE" volume scene.json -o out.vdb --box -4,-4,-4,4,4,4 --box-voxel-size 0.03 --ao 3 --ao-method cones \
            --progress 2>err.txt
    ) &
    local pid=$!
    until grep -q volume err.txt 2>/dev/null; do
        sleep 0.02
    done
    kill -INT "$pid"
    status=0
    wait "$pid" || status=$?
    output= stderr=$(cat err.txt)
    [ "$status" -eq 130 ] || fail "expected 130"
    untouched out.vdb
}

@test "spheres cast into a box" {
    cat >scene.json <<'JSON'
{"casters": [{"spheres": [[0, 1, 0, 0.25]]}, {"sdf": {"shape": "plane", "half_size": [1, 1], "thickness": 0.25}}],
 "voxel_size": 0.05, "lights": [{"name": "top", "type": "directional", "direction": [0, 1, 0], "angle_deg": 2}]}
JSON
    run -0 "$VDBSHADE" volume scene.json --box -1,0.1,-1,1,0.6,1 -o fog.vdb --quiet
    info_tells fog.vdb "grid 'shadow.top'"
    # the column under the ball is dark: 1 - pi / 64 of the box is lit
    printf '0 0.5 0\n0.5 0.5 0.5\n' >points.csv
    run --separate-stderr -0 "$VDBSHADE" query scene.json --points points.csv -o - --answers-only --quiet
    [[ $output == *$'\n0'* ]]
    [[ $output == *$'\n1'* ]]
    run -0 "$VDBSHADE" volume scene.json --box -1,0.1,-1,1,0.6,1 --ao 0.5 -o ao.vdb --quiet
}
