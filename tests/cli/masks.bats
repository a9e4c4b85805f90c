# Casters from images and text, and several level sets in one scene: bakes and distances against the same solids made
# otherwise; bad input.
load helper

FONT=/usr/share/fonts/truetype/dejavu/DejaVuSans.ttf

setup() {
    cd "$BATS_TEST_TMPDIR" || return 1
    cp "$ASSETS/emblem.png" .
    old_output out.vdb
}

# points N: rows x,y,z all over [-2, 2]³, the same each time.
points() {
    awk -v n="$1" -v OFS=, '
        BEGIN { srand(7); for (i = 0; i < n; ++i) print 4 * rand() - 2, 4 * rand() - 2, 4 * rand() - 2 }'
}

# same_distances A.json B.json TOLERANCE: within 0.1 of the surface. Farther off, where the field has coarser voxels,
# within a tenth.
same_distances() {
    points 4000 >points.csv
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
    cat >mask.json <<'JSON'
{"casters": [{"mask": "emblem.png", "size": 3.84, "thickness": 0.5},
             {"sdf": {"shape": "cylinder", "half_height": 0.25, "radius": 1.3, "rotate_deg": [90, 0, 0]}}],
 "voxel_size": 0.03}
JSON
    cat >ring.json <<'JSON'
{"casters": [{"sdf": {"op": "union", "of": [
    {"op": "subtraction", "of": [{"shape": "cylinder", "half_height": 0.25, "radius": 1.76},
                                 {"shape": "cylinder", "half_height": 1, "radius": 1.44}]},
    {"shape": "cylinder", "half_height": 0.25, "radius": 1.3}], "rotate_deg": [90, 0, 0]}}],
 "voxel_size": 0.03}
JSON
    same_distances mask.json ring.json 0.012
}

@test "an inverted mask of another channel and a transform" {
    # the whole picture is white in its colours: below a threshold of 2 everything
    cat >mask.json <<'JSON'
{"casters": [{"mask": "emblem.png", "size": [2, 1], "thickness": 0.4, "channel": "luminance", "threshold": 2,
              "invert": true, "transform": {"rotate_deg": [0, 0, 90], "scale": 1.5, "translate": [0.2, 0, 0]}}],
 "voxel_size": 0.04}
JSON
    cat >box.json <<'JSON'
{"casters": [{"sdf": {"shape": "box", "half_size": [0.75, 1.5, 0.3], "translate": [0.2, 0, 0]}}], "voxel_size": 0.04}
JSON
    same_distances mask.json box.json 0.001
}

@test "text is the solid of its letters" {
    # l of DejaVu Sans is a bar from 193 to 377 of 2048 units, 1556 high
    cat >text.json <<JSON
{"casters": [{"text": "l", "font": "$FONT", "height": 2.048, "thickness": 0.3,
              "transform": {"translate": [-0.285, -0.778, 0]}}], "voxel_size": 0.02}
JSON
    cat >bar.json <<'JSON'
{"casters": [{"sdf": {"shape": "box", "half_size": [0.092, 0.778, 0.15]}}], "voxel_size": 0.02}
JSON
    same_distances text.json bar.json 0.001
}

@test "masks and text cast in a bake" {
    cat >scene.json <<JSON
{"casters": [{"text": "vdb", "font": "$FONT", "height": 1.5, "align": "center", "thickness": 0.3,
              "transform": {"rotate_deg": [90, 0, 0], "translate": [0, 1, 0]}},
             {"mask": "emblem.png", "size": 1, "thickness": 0.2, "transform": {"translate": [0, 0.5, -1]}}],
 "voxel_size": 0.04, "lights": [{"name": "sun", "type": "directional", "direction": [0, 1, 0.2], "angle_deg": 5}],
 "receivers": [{"mesh": "$ASSETS/seeds_floor.obj", "size": 64, "output": "one.exr"}]}
JSON
    succeed bake scene.json --threads 1 --quiet
    sed -i 's/one.exr/two.exr/' scene.json
    succeed bake scene.json --threads 7 --quiet
    same_values one.exr two.exr
    succeed info scene.json
    [[ $output == *"caster 0: text $FONT"*"caster 1: mask emblem.png"* ]] || fail "not described"
    succeed info one.exr
    [[ $output == *"channel 'shadow.sun': min 0, "*"max 1"* ]] || fail "no shadow, or nothing else"
}

refuses_caster() { # STATUS CASTER WORD …
    printf '{"casters": [%s], "voxel_size": 0.05}' "$2" >bad.json
    refuses "$1" "${@:3}" -- voxelize bad.json -o out.vdb
}

@test "masks that are no masks" {
    refuses_caster 3 '{"mask": "none.png", "size": 1, "thickness": 1}' none.png
    refuses_caster 2 '{"mask": "emblem.png", "size": 1, "thickness": 1, "threshold": 1.5}' emblem.png 'no outline'
    refuses_caster 2 '{"mask": "emblem.png", "size": 1, "thickness": 1, "channel": "depth"}' emblem.png "no channel 'depth'"
    refuses_caster 2 '{"mask": "bad.json", "size": 1, "thickness": 1}' bad.json
    head -c 300 emblem.png >cut.png
    refuses_caster 3 '{"mask": "cut.png", "size": 1, "thickness": 1}' cut.png
    printf '{"casters": [{"mask": "emblem.png", "size": 1, "thickness": 1}]}' >large.json
    refuses 4 -- voxelize large.json -o out.vdb --voxel-size 0.0001 --memory-limit 64MiB
    mkdir folder.png
    refuses_caster 3 '{"mask": "folder.png", "size": 1, "thickness": 1}' folder.png
    untouched out.vdb
}

@test "text that is no text" {
    refuses_caster 3 '{"text": "a", "font": "none.ttf", "height": 1, "thickness": 1}' none.ttf
    refuses_caster 2 '{"text": "a", "font": "emblem.png", "height": 1, "thickness": 1}' emblem.png 'no font'
    refuses_caster 2 "{\"text\": \"a字\", \"font\": \"$FONT\", \"height\": 1, \"thickness\": 1}" U+5B57
    refuses_caster 2 "{\"text\": \"  \", \"font\": \"$FONT\", \"height\": 1, \"thickness\": 1}" 'no outline'
    refuses_caster 2 "{\"text\": \"a\\tb\", \"font\": \"$FONT\", \"height\": 1, \"thickness\": 1}" U+0009
    refuses_caster 4 "{\"text\": \"$(head -c 1100000 /dev/zero | tr '\0' o)\", \"font\": \"$FONT\", \"height\": 1, \"thickness\": 1}" 1048576
    head -c 30000 "$FONT" >cut.ttf
    refuses_caster 2 '{"text": "a", "font": "cut.ttf", "height": 1, "thickness": 1}' cut.ttf
    untouched out.vdb
}

@test "exact traces the surface of a mask's voxels" {
    cat >scene.json <<JSON
{"casters": [{"mask": "emblem.png", "size": 1, "thickness": 0.2}], "voxel_size": 0.05, "method": "exact",
 "lights": [{"name": "sun", "type": "directional", "direction": [0, 1, 0]}],
 "receivers": [{"mesh": "$ASSETS/seeds_floor.obj", "size": 16, "output": "o.exr"}]}
JSON
    succeed bake scene.json
    [[ $stderr == *"shadow exact"* ]] || fail "$stderr"
}

# --- several level sets

solid() {
    printf '{"casters": [{"sdf": %s}], "voxel_size": 0.04}' "$2" >"$1.json"
    "$VDBSHADE" voxelize "$1.json" -o "$1.vdb" --name "$1" --quiet
}

@test "several .vdb files, and one of them twice, are their union" {
    solid ball '{"shape": "sphere", "radius": 0.6, "translate": [-0.9, 0, 0]}'
    solid block '{"shape": "box", "half_size": [0.4, 0.5, 0.3], "translate": [0.5, 0, 0]}'
    cat >files.json <<'JSON'
{"casters": [{"vdb": "ball.vdb"}, {"vdb": "block.vdb", "grid": "block"},
             {"vdb": "ball.vdb", "grid": "ball", "transform": {"translate": [0.9, 1.2, 0.3], "scale": 0.5}},
             {"vdb": "block.vdb", "transform": {"rotate_deg": [0, 90, 0], "translate": [0, -1.2, 0]}}],
 "voxel_size": 0.04}
JSON
    cat >shapes.json <<'JSON'
{"casters": [{"sdf": {"op": "union", "of": [
    {"shape": "sphere", "radius": 0.6, "translate": [-0.9, 0, 0]},
    {"shape": "box", "half_size": [0.4, 0.5, 0.3], "translate": [0.5, 0, 0]},
    {"shape": "sphere", "radius": 0.3, "translate": [0.45, 1.2, 0.3]},
    {"shape": "box", "half_size": [0.3, 0.5, 0.4], "translate": [0, -1.2, -0.5]}]}}],
 "voxel_size": 0.04}
JSON
    same_distances files.json shapes.json 0.02
}

@test "a grid that its file does not have" {
    solid ball '{"shape": "sphere", "radius": 0.6}'
    refuses_caster 2 '{"vdb": "ball.vdb"}, {"vdb": "ball.vdb", "grid": "cube"}' ball.vdb cube
    untouched out.vdb
}

# --- formats that are not read

@test "Alembic and USD files are refused by name" {
    printf '#usda 1.0\n' >set.usda
    printf 'PXR-USDC' >set.obj
    printf 'Ogawa' >cache.abc
    local file
    for file in set.usda set.obj cache.abc; do
        refuses 2 "$file" 'which is not read' 'OBJ, glTF, GLB, PLY, STL, FBX or DAE' -- bake "$file" -o out.vdb.exr --ao 1
        refuses 2 "$file" 'which is not read' -- voxelize "$file" -o out.vdb
        refuses_caster 2 "{\"mesh\": \"$file\"}" "$file" 'which is not read'
        refuses 2 "$file" 'which is not read' -- info "$file"
    done
    cp set.usda scene.json
    refuses 2 scene.json 'a USD file' -- bake scene.json
    untouched out.vdb
}
