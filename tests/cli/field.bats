# field: fields made once, and taken with --field by what shades: the same bytes, or a refusal that says why.
load helper

sun=(--sun 0.6,0.75,0.5 --sun-angle 4)

setup() {
    cd "$BATS_TEST_TMPDIR" || return 1
    write_box box.obj
}

# same OUT FIELD COMMAND INPUT [options]: a command writes the same bytes without and with a file of fields
same() {
    local out=$1 field=$2
    shift 2
    shade "$@" -o "a.$out" --quiet
    done_well
    shade "$@" -o "b.$out" --quiet --field "$field"
    done_well
    cmp "a.$out" "b.$out" || fail "$*: other bytes with --field"
}

@test "a bake with --field has the bytes of one without, by every method" {
    shade field "$ASSETS/cloister.glb" --resolution 64 -o c.field
    done_well
    [[ $stderr == *"c.field: 1 field, voxel 0.09"*"active voxels"* ]] || fail "no summary"
    for method in hard classic improved smooth cone rays adaptive exact; do
        same exr c.field bake "$ASSETS/cloister.glb" "${sun[@]}" --resolution 64 --method $method --size 64
    done
    for method in taps cones rays adaptive exact; do
        same exr c.field bake "$ASSETS/cloister.glb" --ao 0.5 --resolution 64 --ao-method $method --size 48
    done
    # another sun and wider, whose cones reach further, with surfaces for the rays of adaptive
    same exr c.field bake "$ASSETS/cloister.glb" --sun -1,0.4,0.2 --sun-angle 90 --method adaptive --max-error 0.003 \
        --resolution 64 --size 128
    same glb c.field bake "$ASSETS/cloister.glb" "${sun[@]}" --resolution 64 --method cone --size 256 --unwrap always
}

@test "pictures, points and volumes take it too" {
    shade field "$ASSETS/cloister.glb" --resolution 64 -o c.field --quiet
    done_well
    printf 'x,y,z,nx,ny,nz\n0,0.1,0,0,1,0\n1,0.5,0.3,0,1,0\n-1,2,0.3,0,1,0\n' >p.csv
    same png c.field render "$ASSETS/cloister.glb" "${sun[@]}" --resolution 64 --method cone --size 64
    same csv c.field query "$ASSETS/cloister.glb" --points p.csv "${sun[@]}" --ao 0.4 --distance --resolution 64
    same vdb c.field volume "$ASSETS/cloister.glb" "${sun[@]}" --resolution 64 --box -1,0,-1,1,1,1 --box-voxel-size 0.25
    # the level set's band, with values of every kind, and the size of its voxels
    same vdb c.field volume "$ASSETS/cloister.glb" "${sun[@]}" --resolution 64
    same vdb c.field volume "$ASSETS/cloister.glb" "${sun[@]}" --ao 0.5 --resolution 64 --band 3 --inside off --half \
        --method exact
    same vdb c.field volume "$ASSETS/cloister.glb" "${sun[@]}" --resolution 64 --box -1,0,-1,1,1,1
    old_output v.vdb
    shade volume "$ASSETS/cloister.glb" "${sun[@]}" --resolution 64 --band 1.5 -o v.vdb --field c.field
    refused 2 c.field "as a whole" "none of 1.5"
    shade volume "$ASSETS/cloister.glb" "${sun[@]}" --resolution 65 -o v.vdb --field c.field
    refused 2 c.field stale "resolution was 64"
    untouched v.vdb
}

@test "the band of a .vdb is kept to the bit, in its own voxels, moved and scaled" {
    shade voxelize box.obj --resolution 24 -o box.vdb --quiet
    done_well
    shade field box.vdb -o box.field --quiet # in its own voxels
    done_well
    same vdb box.field volume box.vdb --sun 1,2,3
    same vdb box.field volume box.vdb --sun 1,2,3 --box 0,0,0,1,1,1
    cat >t.json <<'JSON'
{"casters": [{"vdb": "box.vdb"}],
 "lights": [{"name": "sun", "type": "directional", "direction": [0.3, 1, 0.2], "angle_deg": 6}]}
JSON
    sed 's/"box.vdb"/"box.vdb", "transform": {"rotate_deg": [20, 30, 40], "scale": 0.5, "translate": [1, 2, 3]}/' t.json >u.json
    for scene in t u; do
        shade field $scene.json -o $scene.field --quiet
        done_well
        same vdb $scene.field volume $scene.json
        same vdb $scene.field volume $scene.json --box 0,0,0,1,1,1
    done
}

@test "parts of a scene of layers reach as far from each layer's field as one bake does" {
    cp "$ASSETS/seeds_floor.obj" .
    # the floor lies within the one field and far from the other
    cat >layers.json <<JSON
{"casters": [{"sdf": {"shape": "plane", "half_size": [3, 3], "thickness": 0.5}},
  {"sdf": {"shape": "capsule", "half_height": 0.6, "radius": 0.15, "translate": [0, 0.75, 0]}, "layer": "posts"}],
 "layers": [{"name": "posts", "resolution": 24}], "resolution": 48,
 "lights": [{"name": "sun", "type": "directional", "direction": [1, 0.25, 0.3], "angle_deg": 30}],
 "receivers": [{"mesh": "seeds_floor.obj", "size": 64, "output": "layers.exr"}]}
JSON
    "$VDBSHADE" field layers.json --method cone -o layers.field --quiet
    "$VDBSHADE" bake layers.json --method cone -o one.exr --quiet
    for i in 1 2; do
        "$VDBSHADE" bake layers.json --method cone --field layers.field -o out.exr --shard "$i/2" --shard-least 0 --quiet
    done
    "$VDBSHADE" merge out.exr --quiet
    cmp one.exr out.exr
}

@test "a scene's layers and casters of every kind are kept" {
    shade voxelize box.obj --resolution 32 -o box.vdb --quiet
    done_well
    cp "$ASSETS"/{terrain,emblem}.png "$ASSETS"/{spheres.csv,seeds_floor.obj} .
    cat >s.json <<'JSON'
{"casters": [{"mesh": "box.obj"}, {"mask": "emblem.png", "size": 1, "thickness": 0.2, "layer": "b"},
  {"vdb": "box.vdb", "transform": {"translate": [2, 0, 0], "scale": 0.5}, "color": [1, 0, 0]},
  {"heightfield": "terrain.png", "size": [4, 4], "height": 0.5, "layer": "a"},
  {"spheres": "spheres.csv", "voxelised": true, "layer": "b"}, {"spheres": "spheres.csv"},
  {"sdf": {"shape": "sphere", "radius": 0.4, "translate": [0, 2, 0]}, "layer": "a"}],
 "layers": [{"name": "a", "softness": 2}, {"name": "b", "resolution": 40}], "resolution": 48,
 "lights": [{"name": "sun", "type": "directional", "direction": [0.3, 1, 0.2], "angle_deg": 6}],
 "ao": {"distance": 0.5, "method": "adaptive"}, "method": "cone",
 "receivers": [{"mesh": "seeds_floor.obj", "size": 64, "output": "s.exr"}]}
JSON
    shade field s.json -o s.field --quiet
    done_well
    same exr s.field bake s.json
    same png s.field render s.json --size 48
    shade volume s.json -o v.vdb --field s.field
    refused 2 s.field layer
    shade info s.field
    [[ $output == "fields: 3, "*"sha256:"*" box.vdb"*"caster_2: vdb sha256:"*"field of layer 'a'"* ]] || fail "not what is there"
    [[ $output == *"field of layer 'b'"*"resolution: 40"*"caster_4: spheres, 48 of them"* ]] || fail "not what is there"
    shade voxelize box.obj --resolution 33 -o box.vdb --quiet
    shade bake s.json -o c.exr --field s.field
    refused 2 s.field stale caster_2 box.vdb
    sed -i 's/"radius": 0.4/"radius": 0.41/' s.json
    shade voxelize box.obj --resolution 32 -o box.vdb --quiet
    shade bake s.json -o c.exr --field s.field
    refused 2 s.field stale caster_6 "sdf, 1 nodes"
}

@test "what shapes a field makes it stale, what does not leaves it" {
    shade field box.obj --resolution 40 --half-width 4 -o b.field --quiet
    done_well
    bake() { shade bake box.obj "${sun[@]}" --method cone --size 32 -o o.exr --field b.field "$@"; }
    old_output o.exr
    bake --resolution 41 --half-width 4
    refused 2 b.field stale "resolution was 40, and is 41 here"
    bake --voxel-size 0.03 --half-width 4
    refused 2 b.field stale voxel_size
    bake
    refused 2 b.field stale "half_width was 4, and is 3 here"
    bake --half-width 4 --shell-thickness 3
    refused 2 b.field stale shell_thickness
    bake --half-width 4 --shell '*'
    refused 2 b.field stale caster_0 box.obj
    bake --half-width 4 --unit cm
    refused 2 b.field stale caster_0 box.obj
    bake --half-width 4 --caster "$ASSETS/smooth.glb"
    refused 2 b.field "without caster_1" smooth.glb
    sed 's/^v 1 1 1$/v 1 1 1.01/' box.obj >other.obj
    mv box.obj whole.obj
    mv other.obj box.obj
    bake --half-width 4
    refused 2 b.field stale caster_0 box.obj
    mv whole.obj box.obj
    sed -i '1i # a comment' box.obj
    untouched o.exr
    bake --half-width 4 # the file names its voxels, so that the bake need not
    done_well
    [[ $stderr == *"voxel 0.025, "* ]] || fail "not the file's voxels"
    shade bake box.obj "${sun[@]}" --method cone --size 32 -o without.exr --half-width 4 --resolution 40
    cmp without.exr o.exr
}

@test "where nothing names voxels, those of auto are kept or there is nothing to keep" {
    shade field box.obj -o b.field
    refused 2 box.obj voxels method
    shade field box.obj --method cone -o b.field --quiet
    done_well
    same exr b.field bake box.obj "${sun[@]}" --method cone --size 32
    shade bake box.obj "${sun[@]}" --method cone --size 32 --resolution 100 --field b.field -o o.exr
    refused 2 b.field stale "resolution was 256, and is 100 here"
}

@test "files that are none, damaged, cut or of another version are refused in a line" {
    shade field box.obj --resolution 16 -o b.field --quiet
    done_well
    bake() { shade bake box.obj "${sun[@]}" --resolution 16 --size 16 -o o.exr --field "$1"; }
    old_output o.exr
    bake none.field
    refused 3 none.field "No such file"
    bake box.obj
    refused 3 box.obj "no file of fields"
    head -c 9000 b.field >cut.field
    bake cut.field
    refused 3 cut.field "cut short"
    cp b.field damaged.field
    printf '\xff\xff\xff' | dd of=damaged.field bs=1 seek=20000 conv=notrunc status=none
    bake damaged.field
    refused 3 damaged.field damaged
    sed '1s/VSHFIELD\(.\{8\}\)[0-9.]*/VSHFIELD\10.0.1/' b.field >old.field
    [ "$(stat -c %s old.field)" = "$(stat -c %s b.field)" ]
    bake old.field
    refused 2 old.field "vdbshade 0.0.1"
    bake b.field
    done_well
}

@test "it is written whole or not at all, and within the limits" {
    old_output b.field
    shade field box.obj --resolution 200 -o b.field --memory-limit 1M
    refused 4
    shade field none.obj --resolution 16 -o b.field
    refused 3 none.obj
    shade field box.obj --resolution 16 -o box.obj
    refused 2 box.obj
    shade field box.obj --resolution 16 -o out.exr
    refused 2 out.exr
    shade field box.obj --resolution 16
    refused 2 -o
    untouched b.field
    shade field box.obj --resolution 300 --dry-run
    [ "$status" = 0 ]
    [[ $output == *"voxels        about "*"of 0.003"*"memory        level sets about "*"time          about "* ]] || fail "no forecast"
    shade field box.obj --resolution 16 -o b.field --quiet
    done_well
    shade bake box.obj "${sun[@]}" --size 16 -o o.exr --field b.field --memory-limit 100k
    refused 4 b.field
    shade bake box.obj "${sun[@]}" --size 16 -o o.exr --field b.field --dry-run
    [[ $output == *"16 along the longest side"*"level set 0 bytes"* ]] || fail "what is there is not made"
}
