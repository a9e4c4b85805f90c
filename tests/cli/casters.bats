# Casters without voxels, from scene files: terrains and spheres. What is wrong with their files is told by its place.
load helper

setup() {
    cd "$BATS_TEST_TMPDIR" || return 1
    ln -s "$(cd "$ASSETS" && pwd)"/{terrain.png,spheres.csv,seeds_floor.obj} .
}

SUN='"lights": [{"name": "sun", "type": "directional", "direction": [-0.7, 0.4, 0.3], "angle_deg": 4}]'
LAND='"heightfield": "terrain.png", "size": [10, 10], "height": 2'
OVER='"receivers": [{"heightfield": "terrain.png", "extent": [10, 10], "height": 2, "size": 96, "output": "out.exr"}]'
FLOOR='"receivers": [{"mesh": "seeds_floor.obj", "size": 64, "output": "out.exr"}]'

scene() { # casters, receivers, more keys
    printf '{"casters": [%s], %s, %s%s}\n' "$1" "$SUN" "$2" "${3:+, $3}" >scene.json
}

# refuse_scene CASTERS RECEIVERS CODE WORD …: a bake of that scene ends with the code, and says the words.
refuse_scene() {
    scene "$1" "$2"
    refuses "${@:3}" -- bake scene.json
}

# A hill of 16 bits, 257 × 257.
write_hill() {
    awk 'BEGIN {
        print "P2 257 257 65535"
        for (i = 0; i < 257; ++i)
            for (j = 0; j < 257; ++j)
                printf "%d\n", 60000 * exp(-((j - 110) ^ 2 + (i - 150) ^ 2) / 1800)
    }' >"$1"
}

@test "a direct terrain is marched by hard and classic, and makes no voxel and the same bits for any number of threads" {
    for method in hard classic; do
        scene "{$LAND, \"direct\": true}" "$OVER" "\"ao\": {\"distance\": 1}, \"method\": \"$method\""
        succeed bake scene.json --threads 1 --stats stats.json
        grep -q '"active_voxels": 0' stats.json
        one=$(sha256sum <out.exr)
        succeed bake scene.json --threads 4
        [ "$(sha256sum <out.exr)" = "$one" ]
        grep -A1 '"shadow": {' stats.json | grep -q "\"method\": \"$method\""
        grep -A1 '"ao": {' stats.json | grep -q '"method": "exact"'
    done
}

@test "a direct terrain is traced by every other method" {
    write_hill hill.pgm
    hill='"heightfield": "hill.pgm", "size": [10, 10], "height": 2'
    over='"receivers": [{"heightfield": "hill.pgm", "extent": [10, 10], "height": 2, "size": 256, "output": "out.exr"}]'
    scene "{$hill, \"direct\": true}" "$over" '"ao": {"distance": 1}'
    succeed bake scene.json
    scene "{$hill}" "$over" '"ao": {"distance": 1}'
    succeed bake scene.json -o traced.exr
    succeed compare out.exr traced.exr --max-difference 0.001
}

@test "a direct terrain and spheres are shaded by query as by bake" {
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

@test "an image of heights, a receiver alone and a caster of either name bake one terrain" {
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
}

@test "the shorter side of a terrain follows from its pixels" {
    printf 'P2 5 3 9 0 1 2 3 4 5 6 7 8 9 8 7 6 5 4\n' >long.pgm
    succeed bake long.pgm --height 2 --size-world 8 --ao 1 --size 32 -o one.exr
    succeed bake long.pgm --height 2 --size-world 8,4 --ao 1 --size 32 -o out.exr
    same_values one.exr out.exr
}

@test "what a terrain's image lacks is said, and what to do" {
    refuse_each bake <<'LIST'
2 'terrain.png' '--height H, the height of white, and --size-world W' | terrain.png --ao 1 -o out.exr
2 'terrain.png' 'give --size-world W, the length of its longer side' | terrain.png --height 2 --ao 1 -o out.exr
2 'terrain.png' 'give --height H, the height of white' | terrain.png --size-world 10 --ao 1 -o out.exr
2 "--height '0'" | terrain.png --height 0 --size-world 10 --ao 1 -o out.exr
2 "--size-world '0'" | terrain.png --height 2 --size-world 10,0 --ao 1 -o out.exr
2 '--height' 'seeds_floor.obj is no image of heights' | seeds_floor.obj --height 2 --ao 1 -o out.exr
LIST
    printf '{%s, "receivers": []}' "$SUN" >scene.json
    refuses 2 'key "casters" is missing' -- bake scene.json
    refuse_scene "{$LAND, \"extent\": [10, 10]}" "$OVER" 2 'casters[0].extent: cannot stand beside "size"'
}

@test "voxelize takes a terrain and spheres" {
    scene "{$LAND}, {\"spheres\": [[0, 3, 0, 0.5]], \"voxelised\": true}" "$OVER" '"resolution": 48'
    succeed voxelize scene.json -o out.vdb --quiet
    scene '{"spheres": [[0, 3, 0, 0.5]]}' "$FLOOR" '"method": "hard"'
    succeed voxelize scene.json -o out.vdb --quiet
}

@test "info tells of terrains and spheres" {
    scene "{$LAND, \"direct\": true}, {\"spheres\": \"spheres.csv\"}, {\"spheres\": [[0, 0, 0, 1]], \"voxelised\": true}" "$OVER"
    succeed info scene.json
    [[ $output == *"heightfield"*"terrain.png"* ]]
    [[ $output == *"spheres"*"spheres.csv"* ]]
    [[ $output == *"caster 2: spheres"* ]]
}

@test "a missing image or list of spheres, and an image that is none" {
    echo nothing >bad.png
    refuse_scene '{"heightfield": "none.png", "size": [1, 1], "height": 1}' "$OVER" 3 none.png
    refuse_scene '{"spheres": "none.csv"}' "$FLOOR" 3 none.csv
    refuse_scene '{"heightfield": "bad.png", "size": [1, 1], "height": 1, "direct": true}' "$OVER" 3 bad.png
}

@test "zero and huge sizes are refused by line and column" {
    refuse_scene '{"heightfield": "terrain.png", "size": [0, 1], "height": 1}' "$OVER" 2 'scene.json:1:' 'size[0]' 'out of range'
    refuse_scene '{"heightfield": "terrain.png", "size": [1, 2147483648e9], "height": 1}' "$OVER" 2 'size[1]' 'out of range'
}

@test "bad rows of spheres are told by their number" {
    printf 'x,y,z,r\n0,1,0,0.5\n0,1,0\n' >bad.csv
    refuse_scene '{"spheres": "bad.csv"}' "$FLOOR" 2 'bad.csv:3:' 'four numbers'
    printf '0,1,0,0.5\n0,1,0,-1\n' >bad.csv
    refuse_scene '{"spheres": "bad.csv"}' "$FLOOR" 2 'bad.csv:2:' 'radius -1'
}

@test "a memory limit holds for terrains and spheres" {
    scene "{$LAND, \"direct\": true}" "$FLOOR"
    refuses 4 terrain.png -- bake scene.json --memory-limit 200000
}

@test "an output over a caster's file is refused" {
    cp "$ASSETS/spheres.csv" own.csv
    scene '{"spheres": "own.csv"}' "$FLOOR"
    ends 2 bake scene.json -o own.csv
    cmp own.csv "$ASSETS/spheres.csv"
}

@test "trade refuses casters without voxels" {
    scene '{"spheres": "spheres.csv"}' "$FLOOR"
    refuses 2 "not part of it" -- trade scene.json -o report.html
}
