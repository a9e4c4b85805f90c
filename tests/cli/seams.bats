# Seams of lightmaps, and padding for mip levels.
load helper

# A tube with smooth normals, whose only chart meets itself, in the shadow of nothing but itself.
write_tube() {
    awk 'BEGIN {
        n = 24; print "o tube"
        for (i = 0; i <= n; ++i) for (k = 0; k < 2; ++k) {
            a = 6.283185307179586 * (i % n) / n
            printf "v %.6f %.6f %d\nvn %.6f %.6f 0\nvt %.6f %.6f\n", cos(a), sin(a), 2 * k, cos(a), sin(a), 0.113 + 0.77 * i / n, 0.121 + 0.5 * k
        }
        for (i = 0; i < n; ++i) { a = 2 * i + 1; b = a + 2; c = a + 3; d = a + 1
            printf "f %d/%d/%d %d/%d/%d %d/%d/%d\nf %d/%d/%d %d/%d/%d %d/%d/%d\n", a, a, a, b, b, b, c, c, c, a, a, a, c, c, c, d, d, d }
    }' >"$1"
}

# The sun stands where the seam is half lit.
TUBE=(--sun 0.1,1,0.3 --sun-angle 60 --ao 1 --size 48 --quiet)

@test "seams are fixed where that is asked for, by option and by scene" {
    write_tube tube.obj
    succeed bake tube.obj "${TUBE[@]}" -o plain.exr
    succeed bake tube.obj "${TUBE[@]}" --seams keep -o kept.exr
    succeed bake tube.obj "${TUBE[@]}" --seams fix -o fixed.exr
    same plain.exr kept.exr
    differ plain.exr fixed.exr
    # texels that were baked: within the error that was asked for
    succeed compare plain.exr fixed.exr --max-difference 0.020001 --max-rmse 0.02 --max-coverage 0
    printf '{"casters": [{"mesh": "tube.obj"}], "ao": {"distance": 1},
             "lights": [{"name": "sun", "type": "directional", "direction": [0.1, 1, 0.3], "angle_deg": 60}],
             "receivers": [{"mesh": "tube.obj", "size": 48, "seams": "fix", "output": "scene.exr"}]}' >scene.json
    succeed bake scene.json --quiet
    same fixed.exr scene.exr
    succeed bake scene.json --seams keep --quiet -o kept.exr
    same plain.exr kept.exr
}

@test "--padding auto leaves no texel empty" {
    write_tube tube.obj
    options=(--ao 1 --size 256 --quiet)
    succeed bake tube.obj "${options[@]}" --padding 16 -o grown.exr
    info_tells grown.exr "'ao': min 0, "
    succeed bake tube.obj "${options[@]}" --padding auto -o filled.exr
    succeed info filled.exr
    [[ $output != *"'ao': min 0, "* ]]
    succeed compare grown.exr filled.exr --max-difference 0 --max-coverage 0
}

@test "a scene's padding that is neither a number nor auto is refused" {
    printf '{"casters": [{"mesh": "box.obj"}], "ao": {"distance": 1},
             "receivers": [{"mesh": "box.obj", "padding": "all", "output": "out.exr"}]}' >scene.json
    refuses 2 'scene.json:2:' 'padding: "all" is none of auto, a whole number from 0 to 4096' -- bake scene.json
    [ ! -e out.exr ]
}

@test "a face that is hidden where boxes touch takes the nearest visible values" {
    # another one on top of it
    write_boxes row.obj lower upper
    awk '/^o upper/ { up = 1 } /^v / && up { print "v", $2 - 2, $3 + 1, $4; next } { print }' row.obj >two.obj
    for seams in keep fix; do
        succeed bake two.obj --ao 1 --max-error 0.02 --size 128 --unwrap always --seams $seams -o $seams.exr --quiet
    done
    # all that is seen is 1; two faces of twelve are hidden, some of whose texels padding reaches
    holds "$(mean_of keep.exr ao) > 0.3 && $(mean_of fix.exr ao) > 1.03 * $(mean_of keep.exr ao)"
    # nothing that is seen is another
    succeed compare keep.exr fix.exr --max-difference 0.020001 --max-coverage 0
}

# Two tiles of a floor side by side, two objects, and a box that stands over where they meet and only casts.
write_tiles() {
    {
        printf 'o left\n'
        printf 'v %s 0 %s\n' -2 -1 0 -1 0 1 -2 1
        printf 'f 4 3 2 1\no right\n'
        printf 'v %s 0 %s\n' 0 -1 2 -1 2 1 0 1
        printf 'f 8 7 6 5\n'
    } >"$1"
    write_boxes boxes.obj box
    awk '/^v / { print "v", $2 - 0.7, $3 + 0.6, $4 - 0.5 } /^f / { print "f", $2 + 8, $3 + 8, $4 + 8, $5 + 8 } /^o / { print }' boxes.obj >>"$1"
}

@test "borders between two lightmaps are stitched, by no more than the error" {
    write_tiles tiles.obj
    for seams in keep fix; do
        succeed bake tiles.obj --no-receive box --ao 2 --max-error 0.02 --size 48 --unwrap always --per-object --seams $seams -o $seams.exr --quiet
    done
    for tile in left right; do # which is one chart, without a seam of its own
        differ keep.$tile.exr fix.$tile.exr
        succeed compare keep.$tile.exr fix.$tile.exr --max-difference 0.020001 --max-coverage 0
    done
    # the same in one receiver each
    cat >two.json <<'EOF'
{"casters": [{"mesh": "tiles.obj"}], "ao": {"distance": 2},
 "receivers": [{"mesh": "tiles.obj", "objects": "left", "unwrap": "always", "size": 48, "seams": "fix", "output": "two.left.exr"},
               {"mesh": "tiles.obj", "objects": "right", "unwrap": "always", "size": 48, "seams": "fix", "output": "two.right.exr"}]}
EOF
    succeed bake two.json --max-error 0.02 --quiet
    same fix.left.exr two.left.exr
    same fix.right.exr two.right.exr
}

@test "seams between lightmaps are fixed although planes exceed the memory limit" {
    write_tiles tiles.obj
    tiles() {
        succeed bake tiles.obj --no-receive box --ao 2 --max-error 0.1 --size 1024 --unwrap always --per-object --seams fix --quiet \
            -o "$1.exr" "${@:2}"
    }
    tiles all
    tiles few --memory-limit 40M --threads 1
    same all.left.exr few.left.exr
    same all.right.exr few.right.exr
}
