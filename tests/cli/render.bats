# vdbshade render: pictures.
load helper

SUN=(--sun 0.3,1,0.2 --sun-angle 5)
QUICK=(--size 40x24 --samples 1 --resolution 24)
BOX=(render box.obj "${SUN[@]}" "${QUICK[@]}")

@test "a picture of a mesh has the size asked for, an EXR linear colours, coverage, depth and normals" {
    succeed "${BOX[@]}" --ao 0.5 -o view.png --stats stats.json
    says "40 × 24, camera "
    info_tells view.png "image: 40 × 24, 3 channels"
    [ "$(number_in stats.json points)" -eq 960 ] || fail "$(cat stats.json)"
    no_leftovers
    succeed "${BOX[@]}" -o view.exr --quiet
    [ -z "$stderr" ] || fail "something on standard error"
    info_tells view.exr "'A'" "'B'" "'G'" "'N.X'" "'N.Y'" "'N.Z'" "'R'" "'Z'"
    # without a background a PNG is transparent
    succeed "${BOX[@]}" -o view.png --background none --quiet
    info_tells view.png "4 channels" "channel 'A'"
    refuses 2 --background --shafts -- "${BOX[@]}" -o x.png --background none --shafts 0.2
}

@test "--orbit turns the camera around its target, anticlockwise from above" {
    succeed "${BOX[@]}" --camera 0.5,1.5,4 --look-at 0.5,0,0 --orbit 90 -o turned.png --quiet
    shade "${BOX[@]}" --camera 4.5,1.5,0 --look-at 0.5,0,0 -o placed.png --quiet
    same turned.png placed.png
    shade "${BOX[@]}" --camera 0.5,1.5,4 --look-at 0.5,0,0 -o front.png --quiet
    differ front.png placed.png
}

@test "cameras that see nothing, nothing to show and a memory limit are refused before the work" {
    old_output view.png
    refuse_each render box.obj "${SUN[@]}" <<'LIST'
2 'position and target' | --camera 1,2,3 --look-at 1,2,3 -o view.png
2 'along the view' | --camera 0,5,0 --look-at 0,0,0 -o view.png
2 'along the view' | --camera 0.5,5,0.5 --resolution 24 -o view.png --quiet
2 --look-at | --look-at 0,0,0 -o view.png
LIST
    refuses 4 -- render box.obj "${SUN[@]}" --memory-limit 1M -o view.png
    refuses 2 view.png -- render box.obj "${SUN[@]}" -o view.png --stats view.png
    refuses 2 --sun -- render box.obj -o view.png
    untouched view.png
}

@test "a lightmap of any size is shown on the receiver" {
    succeed bake box.obj "${SUN[@]}" --size 64x32 --resolution 24 -o box.exr --quiet
    succeed "${BOX[@]}" --lightmap box.exr -o lit.png --quiet
    shade "${BOX[@]}" -o computed.png --quiet
    # The same mesh is seen, and on a lone convex body the same light; a lightmap that is all dark shows.
    "$VDBSHADE" compare computed.png lit.png --max-rmse 0.02 --quiet || fail "not the light that is computed"
    succeed bake box.obj --sun 0,-1,0 --size 16 --resolution 24 -o night.exr --quiet
    succeed "${BOX[@]}" --lightmap night.exr -o dark.png --quiet
    ! same_values lit.png dark.png || fail "the lightmap is not what is shown"
}

@test "lightmaps that do not fit are refused" {
    succeed bake box.obj --ao 0.5 --size 16 --resolution 24 -o ao.exr --quiet
    succeed bake box.obj --ao 0.5 --size 16 --resolution 24 -o ao.png --quiet
    refuse_each "${BOX[@]}" --lightmap <<'LIST'
2 shadow.sun | ao.exr -o view.png --quiet
2 'expected an .exr' | ao.png -o view.png --quiet
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

@test "open and closed meshes are seen in their place" {
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

@test "casters have their colours, also in layers" {
    for second in ', "color": [0.05, 0.05, 0.9]' ', "color": [0.05, 0.05, 0.9], "layer": "other"'; do
        scene "$second"
        succeed render scene.json --size 60x20 --samples 2 --camera 0.6,0,6 --look-at 0.6,0,0 --fov 12 -o view.ppm --quiet
        read -r r _ b <<<"$(pixel view.ppm 20 10)"
        [ "$r" -gt 180 ] && [ "$b" -lt 100 ] || fail "left: $r $b"
        read -r r _ b <<<"$(pixel view.ppm 40 10)"
        [ "$b" -gt 180 ] && [ "$r" -lt 100 ] || fail "right: $r $b"
    done
}

@test "light shafts show" {
    succeed "${BOX[@]}" --shafts 0.5 -o shafts.png --quiet
    succeed "${BOX[@]}" -o none.png --quiet
    differ shafts.png none.png
}

@test "terrains and spheres without voxels look as they do with voxels" {
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
