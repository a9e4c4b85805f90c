# volume: shadow and AO on voxels, from the command line.
load helper

# The seeds' scene, coarse.
prepare() {
    sed 's/"voxel_size": 0.02/"voxel_size": 0.1/' "$ASSETS/seeds.json" >scene.json
    ln -s "$(cd "$ASSETS" && pwd)/seeds_floor.obj" .
    SUN=(--sun 0.3,1,0.2 --sun-angle 5)
}

@test "a volume has a grid for each light, for AO and for their errors" {
    succeed_saying "out.vdb: 2 grids of " " voxels" -- volume scene.json -o out.vdb
    info_tells out.vdb "grid 'shadow.sun'" "class: unknown" "voxel size: 0.1 0.1 0.1" "background: 1" "grid 'ao'"
    succeed volume scene.json -o out.vdb --max-error 0.1 --error --quiet
    info_tells out.vdb shadow.sun "'ao'" error.sun error.ao
}

@test "a level set is shaded on its own voxels, and --inside off leaves inner ones off" {
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

@test "--box has voxels of its own" {
    succeed volume scene.json -o out.vdb --box -2,-0.2,-2,2,1.8,2 --box-voxel-size 0.25 --quiet
    info_tells out.vdb "voxel size: 0.25 0.25 0.25" "0 0 0 to 15 7 15"
    succeed volume scene.json -o out.vdb --box 0,3,0,1,4,1 --quiet
    info_tells out.vdb "voxel size: 0.1 0.1 0.1" "active voxels: 1000," # the casters' voxels
}

@test "--like takes the voxels of a grid" {
    shade volume scene.json -o fog.vdb --box -1,0.5,-1,1,1.5,1 --box-voxel-size 0.1 --quiet
    for like in fog.vdb fog.vdb:ao fog.vdb:shadow.sun ./fog.vdb:ao; do
        succeed volume scene.json -o lit.vdb --like "$like" --quiet
        same fog.vdb lit.vdb
    done
}

@test "a dry run prints voxels and memory, and bakes nothing" {
    succeed volume "$ASSETS/cloister.glb" --sun 1,1,1 --ao 1 --box 0,0,0,1,2,3 --box-voxel-size 0.1 --resolution 16 -o out.vdb --dry-run
    [[ "$output" =~ ^"voxels        6000, with those inside"$'\n'"memory        about "[0-9.]+" MiB at most"$ ]] || fail "$output"
    [ ! -e out.vdb ]
}

@test "options that do not go together, a volume of nothing, and too many voxels are refused" {
    old_output out.vdb
    refuses 2 'nothing to bake' -- volume box.obj -o out.vdb
    refuse_each volume scene.json -o out.vdb <<'LIST'
2 'needs --box' | --box-voxel-size 1
2 'one of' | --box 0,0,0,1,1,1 --band 2
2 'one of' | --box 0,0,0,1,1,1 --like a.vdb
2 --band | --band 0
2 --band | --band 101
2 'nearest, off' | --inside maybe
2 taps | --box 0,3,0,1,4,1 --ao-method taps
2 'slices.png: the slices of a 3D texture need --box' | -o slices.png
2 'slices.png: --half is for .vdb and .exr' | -o slices.png --half
2 'room for 3 grids, not 4' | --box 0,3,0,1,4,1 --max-error 0.1 --error -o slices.png
2 'scene.json: the output is also an input' | --box 0,3,0,1,4,1 -o scene.raw
LIST
    refuses 4 '1299 x 1299 x 1299' limit -- volume scene.json -o out.vdb --box -5,-5,-5,5,5,5 --box-voxel-size 0.0077 --memory-limit 2G
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

@test "slices of a box have the values of queries at the voxels' centres" {
    local box=(volume box.obj "${SUN[@]}" --box 0.5,-1,-1,2.5,-0.25,1 --box-voxel-size 0.25 --method cone --quiet)
    succeed "${box[@]}" -o out.raw
    python3 -c 'import itertools, struct, sys; sys.stdout.buffer.write(b"".join(
        struct.pack("<3f", 0.625 + 0.25 * x, 0.25 * y - 0.875, 0.25 * z - 0.875) for z, y, x in itertools.product(range(8), range(3), range(8))))' >points.raw
    succeed query box.obj "${SUN[@]}" --method cone --points points.raw -o answers.raw --answers-only
    cmp answers.raw out.raw
    [ "$(tr -d ' \n' <out.json | cut -d, -f1-11)" = '{"grids":["shadow.sun"],"type":"float32","size":[8,3,8],"box_min":[0.5,-1.0,-1.0],"box_max":[2.5,-0.25,1.0]' ] || fail "$(cat out.json)"
    succeed "${box[@]}" --ao 1 -o out.exr
    info_tells out.exr "image: 8 × 24, 3 channels" "'G'"
}
