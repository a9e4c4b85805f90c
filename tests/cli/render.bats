# vdbshade render: pictures.
load helper

SUN=(--sun 0.3,1,0.2 --sun-angle 5)
QUICK=(--size 40x24 --samples 1 --resolution 24)
BOX=(render box.obj "${SUN[@]}" "${QUICK[@]}")

@test "a picture of a mesh has the size asked for, an EXR linear colours, coverage, depth and normals; threads change no byte" {
    succeed "${BOX[@]}" --ao 0.5 -o view.png --stats stats.json
    says "40 × 24, camera "
    info_tells view.png "image: 40 × 24, 3 channels"
    [ "$(number_in stats.json points)" -eq 960 ] || fail "$(cat stats.json)"
    no_leftovers
    succeed "${BOX[@]}" --ao 0.5 -o one.png --threads 1 --quiet
    [ -z "$stderr" ] || fail "something on standard error"
    succeed "${BOX[@]}" --ao 0.5 -o three.png --threads 3 --quiet
    cmp one.png three.png || fail "threads show"
    succeed "${BOX[@]}" -o view.exr --quiet
    info_tells view.exr "'A'" "'B'" "'G'" "'N.X'" "'N.Y'" "'N.Z'" "'R'" "'Z'"
    # without a background a PNG is transparent
    succeed "${BOX[@]}" -o view.png --background none --quiet
    info_tells view.png "4 channels" "channel 'A'"
    refuses 2 --background --shafts -- "${BOX[@]}" -o x.png --background none --shafts 0.2
}

@test "--orbit turns the camera around what it looks at, anticlockwise from above" {
    succeed "${BOX[@]}" --camera 0.5,1.5,4 --look-at 0.5,0,0 --orbit 90 -o turned.png --quiet
    shade "${BOX[@]}" --camera 4.5,1.5,0 --look-at 0.5,0,0 -o placed.png --quiet
    same turned.png placed.png
    shade "${BOX[@]}" --camera 0.5,1.5,4 --look-at 0.5,0,0 -o front.png --quiet
    differ front.png placed.png
}

@test "cameras that see nothing, outputs that cannot be written and a memory limit are refused before the work" {
    old_output view.png
    refuse_each render box.obj "${SUN[@]}" <<'LIST'
2 --camera | --camera nan,0,0 -o view.png
2 --camera | --camera 1,2 -o view.png
2 'position and target' | --camera 1,2,3 --look-at 1,2,3 -o view.png
2 'along the view' | --camera 0,5,0 --look-at 0,0,0 -o view.png
2 'along the view' | --camera 0.5,5,0.5 --resolution 24 -o view.png --quiet
2 --up | --up 0,0,0 -o view.png
2 --fov | --fov 180 -o view.png
2 --look-at | --look-at 0,0,0 -o view.png
LIST
    refuse_each render box.obj <<'LIST'
4 | "${SUN[@]}" --memory-limit 1M -o view.png
3 missing | "${SUN[@]}" -o missing/view.png
2 view.xyz | "${SUN[@]}" -o view.xyz
2 box.obj | "${SUN[@]}" -o box.obj
2 view.png | "${SUN[@]}" -o view.png --stats view.png
2 'no output' | "${SUN[@]}"
2 --sun | -o view.png
LIST
    untouched view.png
}

@test "a lightmap of any size is shown on the receiver" {
    succeed bake box.obj "${SUN[@]}" --size 64x32 --resolution 24 -o box.exr --quiet
    succeed "${BOX[@]}" --lightmap box.exr -o lit.png --quiet
    shade "${BOX[@]}" -o computed.png --quiet
    # The same mesh is seen, and on a lone convex body the same light; a lightmap that is all dark shows.
    "$VDBSHADE" compare computed.png lit.png --max-rmse 0.02 --quiet || fail "not the light that is computed"
    printf 'P5 2 2 255\n\0\0\0\0' >black.pgm
    succeed "${BOX[@]}" --lightmap black.pgm --lightmap-pack R=shadow.sun -o dark.png --quiet
    ! same_values lit.png dark.png || fail "the lightmap is not what is shown"
    # With other sizes the picture is nearly the same.
    shade bake box.obj "${SUN[@]}" --irradiance --size 256 --resolution 24 -o fine.exr --quiet
    succeed "${BOX[@]}" --lightmap fine.exr -o fine.png --quiet
}

@test "a packed lightmap is told what it holds" {
    succeed bake box.obj "${SUN[@]}" --size 64 --resolution 24 -o box.png --pack R=shadow.sun --bits 16 --quiet
    shade "${BOX[@]}" --lightmap box.png -o lit.png
    refused 2 shadow.sun
    succeed "${BOX[@]}" --lightmap box.png --lightmap-pack R=shadow.sun -o lit.png --quiet
    shade bake box.obj "${SUN[@]}" --size 64 --resolution 24 -o box.exr --quiet
    shade "${BOX[@]}" --lightmap box.exr -o same.exr --quiet
    succeed "${BOX[@]}" --lightmap box.png --lightmap-pack R=shadow.sun -o lit.exr --quiet
    for pack in shadow.sun RG=ao R= Q=ao; do
        refuses 2 --lightmap-pack -- "${BOX[@]}" --lightmap box.png --lightmap-pack "$pack" -o x.png
    done
}

@test "lightmaps that do not fit are refused" {
    succeed bake box.obj --ao 0.5 --size 16 --resolution 24 -o ao.exr --quiet
    refuse_each "${BOX[@]}" --lightmap <<'LIST'
2 shadow.sun | ao.exr -o view.png --quiet
3 gone.exr | gone.exr -o view.png --quiet
2 receivers | ao.exr --lightmap ao.exr -o view.png --quiet
2 'the output is also an input' | ao.exr -o ao.exr --quiet
LIST
    # Without lights its AO is what there is to show.
    succeed render box.obj "${QUICK[@]}" --lightmap ao.exr -o view.png --quiet
}

# write_quad FILE: a square of two triangles that faces +z, open.
write_quad() {
    printf '%s\n' 'o quad' 'v -1 -1 0' 'v 1 -1 0' 'v 1 1 0' 'v -1 1 0' 'vt 0 0' 'vt 1 0' 'vt 1 1' 'vt 0 1' \
        'f 1/1 2/2 3/3' 'f 1/1 3/3 4/4' >"$1"
}

@test "a mesh is what is seen, where it is, open or closed" {
    write_quad quad.obj
    local which
    for which in quad box; do
        succeed render $which.obj --sun 0,0,1 --resolution 12 --size 9 --samples 1 --camera 0.5,0.5,4 --look-at 0.5,0.5,0 --fov 3 -o $which.exr --quiet
    done
    [ "$(values_of quad.exr Z), $(values_of box.exr Z)" = "4 4 4, 3 3 3" ] || fail "quad: $(values_of quad.exr Z), box: $(values_of box.exr Z)"
}

# write_post FILE: a post of 0.25 × 3 × 0.5 on a wide floor, whose default voxels are larger than the post.
write_post() {
    {
        printf 'o floor\n'
        printf 'v %s %s %s\n' -50 0 -50 50 0 -50 50 0 50 -50 0 50
        printf 'f 4 3 2\nf 4 2 1\no post\n'
        for z in -0.25 0.25; do
            printf "v %s %s $z\n" -0.125 0 0.125 0 0.125 3 -0.125 3
        done
        printf 'f %s %s %s %s\n' 5 8 7 6 9 10 11 12 5 6 10 9 8 12 11 7 5 9 12 8 6 7 11 10
    } >"$1"
}

# From above; column c of 200 sees the floor at x = -3.5 + 0.02 (c + 0.5), row 25 of 50 at z = 0.01.
ABOVE=(--camera -1.5,20,0 --look-at -1.5,0,0 --up 0,0,-1 --fov 2.86419 --size 200x50 --samples 1)

# The row of pixels that crosses the post's shadow: red of each, 0 … 255.
middle_row() {
    od -An -v -tu1 -w3 -j$((14 + 3 * 200 * 25)) -N600 "$1" | awk '{ print $1 }'
}

@test "a post's shadow begins at its foot and is as long as the sun says" {
    write_post post.obj
    # The floor is dark from x = -3.125 to the foot at -0.125; behind it the post's dark side is seen up to 0.118.
    for options in "" "--resolution 64" "--voxel-size 0.5 --ao 1 --ao-method cones"; do
        # shellcheck disable=SC2086
        succeed render post.obj --sun 1,1,0 --sun-angle 0 "${ABOVE[@]}" --sky 0,0,0 $options -o view.ppm --quiet
        middle_row view.ppm | awk '{ c = NR - 1; bad += c >= 20 && c <= 179 && $1 > 60 || c <= 17 && $1 < 150 } END { exit bad > 0 }' ||
            fail "'$options': $(middle_row view.ppm | tr '\n' ' ')"
    done
}

@test "a picture of triangles has the light that query gives at the same points" {
    write_post post.obj
    for c in $(seq 4 6 164); do
        echo "$c" | awk '{ print -3.5 + 0.02 * ($1 + 0.5), 0, 0.01, 0, 1, 0 }'
    done >points.csv
    # Light that falls on the floor where all is open: a sun's cosine, the whole sky.
    while read -r open sky light; do
        # shellcheck disable=SC2086
        succeed query post.obj --points points.csv $light --max-error 0.003 -o answers.csv --answers-only --quiet
        # shellcheck disable=SC2086
        succeed render post.obj $light --max-error 0.003 "${ABOVE[@]}" --sky "$sky,$sky,$sky" -o view.ppm --quiet
        paste <(grep -v '[a-z]' answers.csv) <(middle_row view.ppm | awk 'NR % 6 == 5 && NR <= 165') |
            awk -v open="$open" '{ v = $2 / 255; seen = v < 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ^ 2.4
                    n++; bad += (seen - 0.6 * open * $1) ^ 2 > 0.012 ^ 2 }
                END { exit n != 27 || bad > 0 }' ||
            fail "$light: $(paste answers.csv <(middle_row view.ppm | awk 'NR % 6 == 5 && NR <= 165') | tr '\n' ' ')"
    done <<'LIGHTS'
0.70711 0 --sun 1,1,0 --sun-angle 20
1 1 --ao 1
LIGHTS
}

@test "a dark lightmap leaves nothing light of an open mesh" {
    write_quad quad.obj
    printf 'P5 2 2 255\n\0\0\0\0' >black.pgm
    for from in 0,0,4 2,0.4,1.5 -0.5,1,-3; do
        succeed render quad.obj --sun 0.2,0.3,1 --lightmap black.pgm --lightmap-pack R=shadow.sun --camera $from \
            --resolution 12 --size 40 --samples 1 --sky 0,0,0 --background 0,0,0 -o view.ppm --quiet
        [ "$(tail -c 4800 view.ppm | tr -d '\0' | wc -c)" -eq 0 ] || fail "from $from: not all dark"
    done
    shade render quad.obj --sun 0.2,0.3,1 --camera 0,0,4 --resolution 12 --size 40 --samples 1 --sky 0,0,0 --background 0,0,0 -o view.ppm --quiet
    [ "$(tail -c 4800 view.ppm | tr -d '\0' | wc -c)" -gt 1000 ] || fail "without a lightmap it is lit"
}

@test "surfaces fill 80 to 90 % of the picture" {
    for up in 0,1,0 0,0,1; do
        succeed render box.obj "${SUN[@]}" --size 50 --samples 2 --resolution 24 --background 0,0,0 --up $up -o view.ppm --quiet
        # Columns and rows of the pixels that are not black.
        tail -c 7500 view.ppm | od -An -v -tu1 -w3 | awk '$1 + $2 + $3 > 0 {
                x = (NR - 1) % 50; y = int((NR - 1) / 50); n++
                if (n == 1) { x0 = x1 = x; y0 = y1 = y }
                if (x < x0) x0 = x; if (x > x1) x1 = x; if (y < y0) y0 = y; if (y > y1) y1 = y
            } END { w = x1 - x0 + 1; h = y1 - y0 + 1; most = w > h ? w : h; print w, h; exit !(most >= 40 && most <= 46) }' ||
            fail "up $up"
    done
}

scene() {
    cat >scene.json <<JSON
{"casters": [{"sdf": {"shape": "sphere", "radius": 0.5}, "color": [0.9, 0.05, 0.05]},
             {"sdf": {"shape": "sphere", "radius": 0.5, "translate": [1.2, 0, 0]}$1}],
 "layers": [{"name": "other"}],
 "resolution": 32, "ao": {"distance": 0.2},
 "lights": [{"name": "sun", "type": "directional", "direction": [0, 0, 1]}]}
JSON
}

# pixel FILE X Y: R G B of a pixel of a PPM of 60 × 20, whose header takes 13 bytes.
pixel() {
    od -An -v -tu1 -w3 -j$((13 + 3 * ($3 * 60 + $2))) -N3 "$1"
}

@test "casters have their colours, in a layer or in none" {
    for second in ', "color": [0.05, 0.05, 0.9]' ', "color": [0.05, 0.05, 0.9], "layer": "other"'; do
        scene "$second"
        succeed render scene.json --size 60x20 --samples 2 --camera 0.6,0,6 --look-at 0.6,0,0 --fov 12 -o view.ppm --quiet
        read -r r _ b <<<"$(pixel view.ppm 20 10)"
        [ "$r" -gt 180 ] && [ "$b" -lt 100 ] || fail "left: $r $b"
        read -r r _ b <<<"$(pixel view.ppm 40 10)"
        [ "$b" -gt 180 ] && [ "$r" -lt 100 ] || fail "right: $r $b"
    done
}

@test "a colour out of range is refused with its place" {
    scene ', "color": [0.5, 1.5, 0]'
    refuses 2 scene.json:2: color 1.5 -- render scene.json -o view.png
    scene ', "color": [0, 0, 0]'
    refuses 2 color -- render scene.json -o view.png
    scene ', "colour": [0, 0, 0]'
    refuses 2 'did you mean "color"?' -- render scene.json -o view.png
}

@test "light shafts show, and are the same for any number of threads" {
    succeed "${BOX[@]}" --shafts 0.5 -o one.png --threads 1 --quiet
    shade "${BOX[@]}" --shafts 0.5 -o two.png --threads 2 --quiet
    cmp one.png two.png || fail "threads show"
    shade "${BOX[@]}" -o none.png --quiet
    ! same_values one.png none.png || fail "no shafts"
}

@test "casters without voxels are seen, and in the light that they give as solids" {
    ln -s "$(cd "$ASSETS" && pwd)/terrain.png" .
    for direct in true false; do
        cat >terrain.json <<JSON
{"casters": [{"heightfield": "terrain.png", "size": [10, 10], "height": 2, "base": 1, "direct": $direct},
             {"spheres": [[0, 4, 0, 1]], "voxelised": $([ $direct = true ] && echo false || echo true), "color": [0.9, 0.05, 0.05]}],
 "resolution": 64, "ao": {"distance": 1},
 "lights": [{"name": "sun", "type": "directional", "direction": [0.6, 0.5, 0.3], "angle_deg": 3}]}
JSON
        succeed render terrain.json --size 60x40 --samples 2 --camera 6,8,16 --look-at 0,1.5,0 -o $direct.ppm --quiet
    done
    # Both see the same; light differs by what voxels lose.
    paste <(od -An -v -tu1 -w1 -j13 true.ppm) <(od -An -v -tu1 -w1 -j13 false.ppm) |
        awk '{ sum += ($1 - $2) ^ 2 } END { exit sqrt(sum / NR) < 6 ? 0 : 1 }' ||
        fail "the pictures differ"
    [ "$(od -An -v -tu1 -w3 -j13 true.ppm | awk '$1 > 120 && $2 < 90' | wc -l)" -gt 20 ] || fail "no red sphere"
}
