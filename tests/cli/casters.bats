# Casters of scene files: terrains and spheres without voxels, images, text and level sets. What is wrong with their files is told by
# its place.
load helper

prepare() {
    ln -s "$(cd "$ASSETS" && pwd)"/{terrain.png,spheres.csv,seeds_floor.obj} .
    cp "$ASSETS/emblem.png" .
    old_output out.vdb
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

@test "an image of heights, a receiver alone and a caster of either name bake one terrain, whose shorter side follows from its pixels" {
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
    printf '{%s, "receivers": []}' "$SUN" >scene.json
    refuses 2 'key "casters" is missing' -- bake scene.json
    refuse_scene "{$LAND, \"extent\": [10, 10]}" "$OVER" 2 'casters[0].extent: cannot stand beside "size"'
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

@test "faults of terrains, spheres and their files are refused with their place" {
    echo nothing >bad.png
    refuse_scene '{"heightfield": "none.png", "size": [1, 1], "height": 1}' "$OVER" 3 none.png
    refuse_scene '{"spheres": "none.csv"}' "$FLOOR" 3 none.csv
    refuse_scene '{"heightfield": "bad.png", "size": [1, 1], "height": 1, "direct": true}' "$OVER" 3 bad.png
    refuse_scene '{"heightfield": "terrain.png", "size": [0, 1], "height": 1}' "$OVER" 2 'scene.json:1:' 'size[0]' 'out of range'
    refuse_scene '{"heightfield": "terrain.png", "size": [1, 2147483648e9], "height": 1}' "$OVER" 2 'size[1]' 'out of range'
    printf 'x,y,z,r\n0,1,0,0.5\n0,1,0\n' >bad.csv
    refuse_scene '{"spheres": "bad.csv"}' "$FLOOR" 2 'bad.csv:3:' 'four numbers'
    printf '0,1,0,0.5\n0,1,0,-1\n' >bad.csv
    refuse_scene '{"spheres": "bad.csv"}' "$FLOOR" 2 'bad.csv:2:' 'radius -1'
    scene "{$LAND, \"direct\": true}" "$FLOOR"
    refuses 4 terrain.png -- bake scene.json --memory-limit 200000
    cp "$ASSETS/spheres.csv" own.csv
    scene '{"spheres": "own.csv"}' "$FLOOR"
    ends 2 bake scene.json -o own.csv
    cmp own.csv "$ASSETS/spheres.csv"
    scene '{"spheres": "spheres.csv"}' "$FLOOR"
    refuses 2 "not part of it" -- trade scene.json -o report.html
}

# write_casters FILE.json VOXEL_SIZE CASTERS
write_casters() {
    printf '{"casters": [%s], "voxel_size": %s}' "$3" "$2" >"$1"
}

# same_distances A.json B.json TOLERANCE: at points all over [-2, 2]³, within 0.1 of the surface. Farther off, where the field has coarser voxels,
# within a tenth.
same_distances() {
    awk -v OFS=, 'BEGIN { srand(7); for (i = 0; i < 4000; ++i) print 4 * rand() - 2, 4 * rand() - 2, 4 * rand() - 2 }' >points.csv
    local scene
    for scene in "$1" "$2"; do
        "$VDBSHADE" query "$scene" --points points.csv -o "$scene.csv" --distance --answers-only --quiet
    done
    paste -d, "$1.csv" "$2.csv" | awk -F, -v tolerance="$3" '
        $1 + 0 == $1 && $2 + 0 == $2 { ++n; d = $1 - $2; if (d < 0) d = -d; if (d > worst) worst = d }
        $1 < 0.1 && $1 > -0.1 { ++beside; if (d > near) near = d }
        END { printf "%d points, at most %g apart; %d near, %g\n", n, worst, beside, near
              exit !(n > 3000 && worst < 0.1 && beside > 8 && near < tolerance) }'
}

@test "a mask is the solid that its picture shows" {
    # the ring of the emblem: 36 … 44 of 96 pixels, scaled to a picture of 3.84 units; the star left out by a cylinder
    write_casters mask.json 0.03 '{"mask": "emblem.png", "size": 3.84, "thickness": 0.5},
             {"sdf": {"shape": "cylinder", "half_height": 0.25, "radius": 1.3, "rotate_deg": [90, 0, 0]}}'
    write_casters ring.json 0.03 '{"sdf": {"op": "union", "of": [
    {"op": "subtraction", "of": [{"shape": "cylinder", "half_height": 0.25, "radius": 1.76},
                                 {"shape": "cylinder", "half_height": 1, "radius": 1.44}]},
    {"shape": "cylinder", "half_height": 0.25, "radius": 1.3}], "rotate_deg": [90, 0, 0]}}'
    same_distances mask.json ring.json 0.012
}

@test "masks and text cast in a bake" {
    write_bake scene.json '{"text": "vdb", "font": "'$FONT'", "height": 1.5, "align": "center", "thickness": 0.3,
            "transform": {"rotate_deg": [90, 0, 0], "translate": [0, 1, 0]}},
        {"mask": "emblem.png", "size": 1, "thickness": 0.2, "transform": {"translate": [0, 0.5, -1]}}' \
        '"voxel_size": 0.04' '"mesh": "seeds_floor.obj", "size": 64'
    succeed bake scene.json --threads 1 --quiet -o one.exr
    succeed bake scene.json --threads 7 --quiet -o two.exr
    same one.exr two.exr
    succeed_printing "caster 0: text $FONT" "caster 1: mask emblem.png" -- info scene.json
    succeed_printing "channel 'shadow.sun': min 0, " "max 1" -- info one.exr
}

# refuses_caster CODE CASTER WORD …
refuses_caster() {
    write_casters bad.json 0.05 "$2"
    refuses "$1" "${@:3}" -- voxelize bad.json -o out.vdb
}

@test "masks that are no masks, and text that is no text" {
    mkdir folder.png
    head -c 300 emblem.png >cut.png
    head -c 30000 "$FONT" >cut.ttf
    local code words caster
    while IFS='|' read -r code words caster; do
        eval "words=($words)"
        refuses_caster "$code" "$caster, \"thickness\": 1}" "${words[@]}"
    done <<LIST
3|none.png|{"mask": "none.png", "size": 1
2|emblem.png 'no outline'|{"mask": "emblem.png", "size": 1, "threshold": 1.5
2|emblem.png "no channel 'depth'"|{"mask": "emblem.png", "size": 1, "channel": "depth"
2|bad.json|{"mask": "bad.json", "size": 1
3|cut.png|{"mask": "cut.png", "size": 1
3|folder.png|{"mask": "folder.png", "size": 1
3|none.ttf|{"text": "a", "font": "none.ttf", "height": 1
2|emblem.png 'no font'|{"text": "a", "font": "emblem.png", "height": 1
2|U+5B57|{"text": "a字", "font": "$FONT", "height": 1
2|'no outline'|{"text": "  ", "font": "$FONT", "height": 1
2|U+0009|{"text": "a\\tb", "font": "$FONT", "height": 1
4|1048576|{"text": "$(head -c 1100000 /dev/zero | tr '\0' o)", "font": "$FONT", "height": 1
2|cut.ttf|{"text": "a", "font": "cut.ttf", "height": 1
LIST
    printf '{"casters": [{"mask": "emblem.png", "size": 1, "thickness": 1}]}' >large.json
    refuses 4 -- voxelize large.json -o out.vdb --voxel-size 0.0001 --memory-limit 64MiB
    untouched out.vdb
}

@test "exact traces the surface of a mask's voxels" {
    write_bake scene.json '{"mask": "emblem.png", "size": 1, "thickness": 0.2}' '"voxel_size": 0.05, "method": "exact"'
    succeed_saying "shadow exact" -- bake scene.json
}

solid() {
    write_casters "$1.json" 0.04 "{\"sdf\": $2}"
    "$VDBSHADE" voxelize "$1.json" -o "$1.vdb" --name "$1" --quiet
}

@test "several .vdb files, and one of them twice, are their union" {
    solid ball '{"shape": "sphere", "radius": 0.6, "translate": [-0.9, 0, 0]}'
    solid block '{"shape": "box", "half_size": [0.4, 0.5, 0.3], "translate": [0.5, 0, 0]}'
    write_casters files.json 0.04 '{"vdb": "ball.vdb"}, {"vdb": "block.vdb", "grid": "block"},
             {"vdb": "ball.vdb", "grid": "ball", "transform": {"translate": [0.9, 1.2, 0.3], "scale": 0.5}},
             {"vdb": "block.vdb", "transform": {"rotate_deg": [0, 90, 0], "translate": [0, -1.2, 0]}}'
    write_casters shapes.json 0.04 '{"sdf": {"op": "union", "of": [
    {"shape": "sphere", "radius": 0.6, "translate": [-0.9, 0, 0]},
    {"shape": "box", "half_size": [0.4, 0.5, 0.3], "translate": [0.5, 0, 0]},
    {"shape": "sphere", "radius": 0.3, "translate": [0.45, 1.2, 0.3]},
    {"shape": "box", "half_size": [0.3, 0.5, 0.4], "translate": [0, -1.2, -0.5]}]}}'
    same_distances files.json shapes.json 0.02
}

@test "Alembic and USD files are refused by name" {
    printf '#usda 1.0\n' >set.usda
    printf 'Ogawa' >cache.abc
    printf 'PXR-USDC' >crate.USDC
    local file
    for file in set.usda crate.USDC cache.abc; do
        refuses 2 "$file" 'which is not read' 'OBJ, glTF, GLB, PLY, STL, FBX or DAE' -- bake "$file" -o out.vdb.exr --ao 1
        refuses 2 "$file" 'which is not read' -- voxelize "$file" -o out.vdb
        refuses_caster 2 "{\"mesh\": \"$file\"}" "$file" 'which is not read'
        refuses 2 "$file" 'which is not read' -- info "$file"
    done
    untouched out.vdb
}
