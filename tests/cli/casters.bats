# Casters of scene files: terrains and spheres without voxels, images, text and level sets.
load helper

prepare() {
    ln -s "$(cd "$ASSETS" && pwd)"/{terrain.png,spheres.csv,seeds_floor.obj} .
    cp "$ASSETS/emblem.png" .
}

SUN='"lights": [{"name": "sun", "type": "directional", "direction": [-0.7, 0.4, 0.3], "angle_deg": 4}]'
LAND='"heightfield": "terrain.png", "size": [10, 10], "height": 2'
OVER='"receivers": [{"heightfield": "terrain.png", "extent": [10, 10], "height": 2, "size": 96, "output": "out.exr"}]'
FLOOR='"receivers": [{"mesh": "seeds_floor.obj", "size": 64, "output": "out.exr"}]'

scene() { # casters, receivers, more keys
    printf '{"casters": [%s], %s, %s%s}\n' "$1" "$SUN" "$2" "${3:+, $3}" >scene.json
}

@test "a direct terrain is marched by hard and classic, without a voxel" {
    for method in hard classic; do
        scene "{$LAND, \"direct\": true}" "$OVER" "\"ao\": {\"distance\": 1}, \"method\": \"$method\""
        succeed bake scene.json --stats stats.json
        grep -q '"active_voxels": 0' stats.json
        grep -A1 '"shadow": {' stats.json | grep -q "\"method\": \"$method\""
        grep -A1 '"ao": {' stats.json | grep -q '"method": "exact"'
    done
}

@test "query shades a direct terrain and spheres" {
    scene "{$LAND, \"direct\": true}, {\"spheres\": [[0, 2, 0, 0.5]]}" "$OVER" '"method": "hard"'
    # above all, beneath the terrain, in the sphere's shadow, and as far away on its other side
    printf 'x,y,z\n0,5,0\n2,-1,0\n1.05,1.4,-0.45\n-1.05,2.6,0.45\n' >points.csv
    succeed query scene.json --points points.csv -o answers.csv --quiet
    [ "$(cut -d, -f4 answers.csv | tr '\n' ' ')" = "shadow.sun 1 0 0 1 " ] || fail "$(cat answers.csv)"
}

@test "AO beside a terrain and spheres without voxels leaves their hard and classic shadows as they are" {
    local method kind
    for method in hard classic; do
        for kind in '{"spheres": [[0, 1, 0, 0.4]]}' "{$LAND, \"direct\": true, \"transform\": {\"translate\": [-7.5, -0.5, 0]}}"; do
            scene "$kind" "$FLOOR" "\"method\": \"$method\""
            succeed bake scene.json -o alone.exr --quiet
            succeed bake scene.json --ao 2 -o both.exr --quiet
            # texels on the edge of a shadow may change, as rays of AO have a start offset of their own
            shade compare alone.exr both.exr
            [[ $output =~ shadow.sun:[^$'\n']*' p99 '0(,|[.]00) ]] || fail "$kind, $method: $output"
            shade info both.exr
            [[ $output == *"'A': min 1, mean 1"* && $output == *"'ao': min 0."* ]] || fail "$kind, $method: $output"
        done
    done
}

@test "an image of heights, a receiver alone and a caster bake the same terrain" {
    scene "{$LAND}" "$OVER" '"ao": {"distance": 1}'
    succeed bake scene.json -o one.exr
    printf '{%s, %s, "ao": {"distance": 1}}' "$SUN" "$OVER" >scene.json
    succeed bake scene.json
    same_values one.exr out.exr || fail "a receiver alone"
    scene "{${LAND/size/extent}}" "$OVER" '"ao": {"distance": 1}'
    succeed bake scene.json
    same_values one.exr out.exr || fail "extent"
    for world in 10 10,10; do
        succeed bake terrain.png --height 2 --size-world $world --sun=-0.7,0.4,0.3 --sun-angle 4 --ao 1 --size 96 -o out.exr
        same_values one.exr out.exr || fail "--size-world $world"
    done
    printf 'P2 5 3 9 0 1 2 3 4 5 6 7 8 9 8 7 6 5 4\n' >long.pgm
    succeed bake long.pgm --height 2 --size-world 8 --ao 1 --size 32 -o one.exr
    succeed bake long.pgm --height 2 --size-world 8,4 --ao 1 --size 32 -o out.exr
    same_values one.exr out.exr
}

@test "missing or zero sizes of a terrain are refused with advice" {
    refuse_each bake <<'LIST'
2 'terrain.png' '--height H, the height of white, and --size-world W' | terrain.png --ao 1 -o out.exr
2 'terrain.png' 'give --size-world W, the length of its longer side' | terrain.png --height 2 --ao 1 -o out.exr
2 'terrain.png' 'give --height H, the height of white' | terrain.png --size-world 10 --ao 1 -o out.exr
2 "--height '0'" | terrain.png --height 0 --size-world 10 --ao 1 -o out.exr
2 "--size-world '10,0'" | terrain.png --height 2 --size-world 10,0 --ao 1 -o out.exr
2 '--height' 'seeds_floor.obj is no image of heights' | seeds_floor.obj --height 2 --ao 1 -o out.exr
LIST
}

@test "voxelize and info read terrains and spheres" {
    scene "{$LAND}, {\"spheres\": [[0, 3, 0, 0.5]], \"voxelised\": true}" "$OVER" '"resolution": 48'
    succeed voxelize scene.json -o out.vdb --quiet
    scene '{"spheres": [[0, 3, 0, 0.5]]}' "$FLOOR" '"method": "hard"'
    succeed voxelize scene.json -o out.vdb --quiet
    scene "{$LAND, \"direct\": true}, {\"spheres\": \"spheres.csv\"}, {\"spheres\": [[0, 0, 0, 1]], \"voxelised\": true}" "$OVER"
    succeed_printing "heightfield" "terrain.png" -- info scene.json
    [[ $output == *"spheres"*"spheres.csv"* ]]
    [[ $output == *"caster 2: spheres"* ]]
}

@test "terrains and spheres keep the memory limit, are not replaced, and have no trade report" {
    scene "{$LAND, \"direct\": true}" "$FLOOR"
    refuses 4 terrain.png -- bake scene.json --memory-limit 200000
    cp "$ASSETS/spheres.csv" own.csv
    scene '{"spheres": "own.csv"}' "$FLOOR"
    refuses 2 own.csv -- bake scene.json -o own.csv
    cmp own.csv "$ASSETS/spheres.csv"
    scene '{"spheres": "spheres.csv"}' "$FLOOR"
    refuses 2 "not part of it" -- trade scene.json -o report.html
}

@test "masks and text cast in a bake" {
    write_bake scene.json '{"text": "vdb", "font": "'$FONT'", "height": 1.5, "align": "center", "thickness": 0.3,
            "transform": {"rotate_deg": [90, 0, 0], "translate": [0, 1, 0]}},
        {"mask": "emblem.png", "size": 1, "thickness": 0.2, "transform": {"translate": [0, 0.5, -1]}}' \
        '"voxel_size": 0.04' '"mesh": "seeds_floor.obj", "size": 64'
    succeed bake scene.json --quiet -o one.exr
    succeed_printing "caster 0: text $FONT" "caster 1: mask emblem.png" -- info scene.json
    succeed_printing "channel 'shadow.sun': min 0, " "max 1" -- info one.exr
}

@test "several .vdb files, and one of them twice, cast together" {
    local name
    echo '{"casters": [{"sdf": {"shape": "sphere", "radius": 0.6, "translate": [-0.9, 0, 0]}}], "voxel_size": 0.04}' >ball.json
    echo '{"casters": [{"sdf": {"shape": "box", "half_size": [0.4, 0.5, 0.3], "translate": [0.5, 0, 0]}}], "voxel_size": 0.04}' >block.json
    for name in ball block; do
        "$VDBSHADE" voxelize $name.json -o $name.vdb --name $name --quiet
    done
    cat >files.json <<'JSON'
{"casters": [{"vdb": "ball.vdb"}, {"vdb": "block.vdb", "grid": "block"},
             {"vdb": "ball.vdb", "grid": "ball", "transform": {"translate": [0.9, 1.2, 0.3], "scale": 0.5}},
             {"vdb": "block.vdb", "transform": {"rotate_deg": [0, 90, 0], "translate": [0, -1.2, 0]}}], "voxel_size": 0.04}
JSON
    # a point on the surface of each, and one beside the turned block
    printf '%s\n' -1.5,0,0 0.5,0.5,0 0.45,1.5,0.3 0.3,-1.2,-0.5 0.4,-1.2,-0.5 >points.csv
    succeed query files.json --points points.csv --distance --answers-only --quiet -o -
    awk 'NR > 1 { off = $1 - (NR == 6) * 0.1; bad += off ^ 2 > 0.02 ^ 2 } END { exit bad || NR != 6 }' <<<"$output" || fail "distances"
}

@test "Alembic and USD files are refused by name" {
    printf '#usda 1.0\n' >set.usda
    printf 'Ogawa' >cache.abc
    printf 'PXR-USDC' >crate.USDC
    local file
    for file in set.usda crate.USDC cache.abc; do
        refuses 2 "$file" 'which is not read' 'OBJ, glTF, GLB, PLY, STL, FBX or DAE' -- bake "$file" -o out.vdb.exr --ao 1
        refuses 2 "$file" 'which is not read' -- info "$file"
    done
}
