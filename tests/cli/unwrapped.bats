#!/usr/bin/env bats
# Receivers whose lightmap UVs are made for them: --unwrap, --texels-per-unit, --pages.
load helper

# The box without UVs, and with a second one beside it.
write_bare() {
    write_box full.obj
    sed -e '/^vt /d' -e 's,/[0-9]*,,g' full.obj >"$1"
    rm full.obj
}

write_two() {
    write_box one.obj
    {
        cat one.obj
        echo 'o second'
        sed -n 's/^v \([0-9]\) /v \1.5 /p' one.obj | sed 's/^v \([0-9]\)\.5/v 3\1/'
        sed -n 's/^f //p' one.obj | awk '{ out = "f"; for (i = 1; i <= NF; ++i) { split($i, p, "/"); out = out " " p[1] + 8 "/" p[2] } print out }'
    } >"$1"
    rm one.obj
}

@test "a mesh without lightmap UVs gets some where an asset is written" {
    write_bare box.obj
    succeed bake box.obj "${SMALL[@]}" --ao 1 -o lit.glb
    grep -aq '"TEXCOORD_0"' lit.glb || fail "no UVs"
    grep -aq '"MOZ_lightmap"' lit.glb || fail "no light"
}

@test "for an image it gets none unasked, and the error says how" {
    write_bare box.obj
    ends 2 bake box.obj "${SMALL[@]}" -o x.exr
    [[ $stderr == *"--unwrap auto"* ]] || fail "$stderr"
    succeed bake box.obj "${SMALL[@]}" --unwrap auto -o x.exr
}

@test "UVs that can be baked are kept, and always replaces them" {
    "$VDBSHADE" bake box.obj "${SMALL[@]}" -o plain.exr --quiet
    "$VDBSHADE" bake box.obj "${SMALL[@]}" --unwrap auto -o auto.exr --quiet
    "$VDBSHADE" bake box.obj "${SMALL[@]}" --unwrap always -o always.exr --quiet
    same_values plain.exr auto.exr
    ! same_values plain.exr always.exr || fail "the same UVs"
}

@test "objects that each fill the square are packed apart" {
    write_two two.obj
    shade bake two.obj "${SMALL[@]}" --size 64 -o x.exr
    [ "$status" -ne 0 ] || fail "baked over each other"
    succeed bake two.obj "${SMALL[@]}" --size 64 --unwrap auto -o x.exr --verbose
    [[ $stderr != *"overlap"* ]] || fail "$stderr"
}

@test "a density fills as many pages as it takes, each with an image of its own" {
    write_two two.obj
    succeed bake two.obj "${SMALL[@]}" --size 64 --unwrap always --texels-per-unit 20 --irradiance \
        --ambient 0.25,0.25,0.25 -o x.exr
    [ -s x.0.exr ] && [ -s x.1.exr ] && [ ! -e x.exr ] || fail "$(ls)"
    succeed bake two.obj "${SMALL[@]}" --size 64 --unwrap always --texels-per-unit 20 --seams keep \
        --exr y.exr -o y.glb
    [ -s y.glb ] || fail "no asset"
    same_values x.0.exr y.0.exr
    same_values x.1.exr y.1.exr
}

@test "a mesh that no page can hold lies on several, each triangle on one" {
    succeed bake box.obj "${SMALL[@]}" --size 32 --unwrap always --texels-per-unit 20 -o x.exr --stats x.json --verbose
    [ -s x.5.exr ] && [ ! -e x.6.exr ] || fail "$(ls)"
    [[ $stderr != *"lie over"* ]] || fail "$stderr"
    # six squares of 20 texels and a border
    texels=$(grep -o '"texels": [0-9]*' x.json | grep -o '[0-9]*')
    [ "$texels" -ge 2400 ] && [ "$texels" -le 2904 ] || fail "$texels texels"
    # solid still, though it is cut in six
    [[ $stderr != *"sheet"* && $stderr != *"open edges"* ]] || fail "$stderr"
}

@test "UVs that can be baked are packed anew where a density is asked for" {
    succeed bake box.obj "${SMALL[@]}" --size 64 --unwrap auto --texels-per-unit 8 -o few.exr
    succeed bake box.obj "${SMALL[@]}" --size 64 --unwrap auto --texels-per-unit 16 -o many.exr --stats many.json
    # six unit squares
    texels=$(grep -o '"texels": [0-9]*' many.json | grep -o '[0-9]*')
    [ "$texels" -ge 1536 ] && [ "$texels" -le 1850 ] || fail "$texels texels"
}

@test "info tells density and stretch of UVs, and what auto would do" {
    write_two two.obj
    write_bare bare.obj
    shade info box.obj --size 100
    [[ $output == *"lightmap UVs: 36.12 texels a unit at 100 × 100, stretch 1.048"* ]] || fail "$output"
    [[ $output == *"--unwrap auto: bakes these UVs as they are"* ]] || fail "$output"
    info_tells two.obj "--unwrap auto: packs usable charts anew"
    shade info bare.obj
    [[ $output != *"lightmap UVs"* ]] || fail "$output"
    [[ $output == *"--unwrap auto: packs usable charts anew, and makes those of other meshes"* ]] || fail "$output"
}

@test "a density that does not fit the pages is refused with one that does" {
    write_two two.obj
    old_output x.exr
    shade bake two.obj "${SMALL[@]}" --size 64 --unwrap always --texels-per-unit 20 --pages 1 -o x.exr
    [ "$status" -ne 0 ] || fail "fitted"
    [[ $stderr == *"two.obj"* && $stderr == *"fit"* ]] || fail "$stderr"
    [ "$(cat x.exr)" = old ] || fail "the old output is gone"
}

@test "threads change no bit of what is unwrapped" {
    write_two two.obj
    "$VDBSHADE" bake two.obj "${SMALL[@]}" --size 64 --ao 1 --unwrap always --threads 1 -o one.exr --quiet
    "$VDBSHADE" bake two.obj "${SMALL[@]}" --size 64 --ao 1 --unwrap always --threads 4 -o four.exr --quiet
    same_values one.exr four.exr
}

# As SMALL, without a size.
FIT=(--sun 0.3,1,0.2 --resolution 24)

# The two boxes, the second twice as large.
write_uneven() {
    write_two even.obj
    awk '/^o second/ {s = 1} /^v / && s {print "v", $2 * 2 - 3, $3 * 2, $4 * 2; next} {print}' even.obj >"$1"
    rm even.obj
}

@test "of an atlas of objects each has the image that it has alone" {
    write_uneven two.obj
    succeed bake two.obj "${SMALL[@]}" --size 32 --ao 1 --unwrap always --per-object -o maps/
    [ "$(echo maps/*)" = "maps/box.exr maps/second.exr" ] || fail "$(echo maps/*)"
    succeed bake two.obj "${SMALL[@]}" --size 32 --ao 1 --unwrap always --receive second -o alone.exr
    same_values alone.exr maps/second.exr
}

@test "a scene names its images by objects, as small as their densities need" {
    write_uneven two.obj
    cat >scene.json <<EOF
{"casters": [{"mesh": "two.obj"}], "lights": [{"name": "sun", "type": "directional", "direction": [0, 1, 0]}],
 "receivers": [{"mesh": "two.obj", "output": "map.png", "unwrap": "always", "atlas": "objects",
                "texels_per_unit": 8, "max_size": 256, "density": {"*": 0.5, "second": 2}}]}
EOF
    succeed bake scene.json
    info_tells map.box.png "32 × 16"
    shade info map.second.png
    [[ $output == *"128 × 64"* || $output == *"128 × 128"* ]] || fail "$output"
    [ ! -e map.png ] || fail "$(ls)"
    sed 's/"second": 2/"secnd": 2/' scene.json >bad.json
    refuses 2 "no object is named 'secnd'" "did you mean 'second'?" "'box'" -- bake bad.json
    sed 's/"second": 2/"second": 0/' scene.json >bad.json
    refuses 2 density -- bake bad.json
    sed 's/"density": {[^}]*}/"density": 3/' scene.json >bad.json
    refuses 2 density -- bake bad.json
}

@test "densities go by name, and a pattern that means none is refused with the names" {
    write_two two.obj
    shade bake two.obj "${SMALL[@]}" --size 128 --unwrap always --texels-per-unit 8 --receive second -o plain.exr --stats plain.json
    succeed bake two.obj "${SMALL[@]}" --size 128 --unwrap always --texels-per-unit 8 --density 'b*=3' --density 'sec*=2' \
        --receive second -o dense.exr --stats dense.json
    few=$(grep -o '"texels": [0-9]*' plain.json | grep -o '[0-9]*')
    many=$(grep -o '"texels": [0-9]*' dense.json | grep -o '[0-9]*')
    # four times as many, and a border
    [ "$many" -ge $((3 * few)) ] && [ "$many" -le $((4 * few)) ] || fail "$few, then $many texels"
    refuses 2 two.obj "'x*'" "'box', 'second'" -- bake two.obj "${SMALL[@]}" --unwrap always --density 'x*=2' -o x.exr
    refuses 2 --density PATTERN=X -- bake two.obj "${SMALL[@]}" --unwrap always --density 'box' -o x.exr
    refuses 2 --density -- bake two.obj "${SMALL[@]}" --unwrap always --density 'box=-1' -o x.exr
}

@test "an asset of objects has a lightmap for each, and materials of its own where they show one" {
    write_uneven two.obj
    write_scene fit.json two.obj '' '"atlas": "objects", "max_size": 128, "texels_per_unit": 8, "unwrap": "always"'
    no_sun "${FIT[@]}"
    succeed bake fit.json "${rest[@]}" --ao 1 --seams keep -o lit.gltf --exr all.exr
    for file in lit.lightmap.box.png lit.lightmap.second.png lit.occlusion.second.png all.box.exr all.second.exr; do
        [ -s "$file" ] || fail "no $file: $(ls)"
    done
    grep -q '"lightmap of box"' lit.gltf || fail "no name of an image"
    [ "$(grep -o '"MOZ_lightmap": {' lit.gltf | wc -l)" -eq 2 ] || fail "not two materials: $(cat lit.gltf)"
    info_tells lit.lightmap.box.png "64 × 32"
    info_tells lit.lightmap.second.png "64 × 64"
    # the values are those of the images
    shade bake fit.json "${rest[@]}" --ao 1 --irradiance --ambient 0.25,0.25,0.25 -o images.exr
    same_values images.second.exr all.second.exr
}

@test "pages of an asset have a picture each of what is invalid" {
    write_uneven two.obj
    write_scene fit.json two.obj '' '"atlas": "objects", "max_size": 128, "texels_per_unit": 8, "unwrap": "always"'
    no_sun "${FIT[@]}"
    succeed bake fit.json "${rest[@]}" --ao 1 -o lit.glb --invalid where.png
    [ "$(ls where*)" = "$(printf 'where.lit.%s.png\n' box second)" ] || fail "$(ls)"
    succeed bake two.obj "${FIT[@]}" --ao 1 --unwrap always --size 64 --pages 2 -o lit.obj --invalid page.png
    [ "$(ls page*)" = "$(printf 'page.lit.%s.png\n' 0 1)" ] || fail "$(ls)"
}

@test "objects whose UVs each fill the square are lit as they are, with a lightmap for each" {
    write_two two.obj
    "$VDBSHADE" bake two.obj "${SMALL[@]}" --irradiance --ambient 0.25,0.25,0.25 --size 64 --per-object -o maps/ --quiet
    succeed bake two.obj "${SMALL[@]}" --size 64 --per-object --seams keep -o lit.glb --exr all.exr
    same_values maps/box.exr all.box.exr
    same_values maps/second.exr all.second.exr
    [ "$(grep -ao '"MOZ_lightmap":{' lit.glb | wc -l)" -eq 2 ] || fail "not two materials"
    ! grep -aq TEXCOORD_1 lit.glb || fail "new UVs"
}

@test "what does not go together with an atlas of objects or a largest size is refused" {
    write_two two.obj
    write_scene fit.json two.obj '' '"max_size": 64, "unwrap": "always"'
    no_sun "${FIT[@]}"
    refuses 2 max_size texels_per_unit -- bake fit.json "${rest[@]}" -o x.exr
    refuses 2 pages -- bake two.obj "${SMALL[@]}" --per-object --pages 2 --unwrap always -o x.exr
    refuses 4 two.obj "'box'" "would fit" -- bake two.obj "${SMALL[@]}" --size 16 --texels-per-unit 40 --per-object --unwrap always -o x.exr
}


# scattered COUNT: triangles that share no edges, so each is a chart.
scattered() {
    awk -v count="$1" 'BEGIN {
        for (i = 0; i < count; ++i) printf "v %d 0 0\nv %d 0 1\nv %d 0 0\n", 2 * i, 2 * i, 2 * i + 1
        for (i = 0; i < count; ++i) printf "f %d %d %d\n", 3 * i + 1, 3 * i + 2, 3 * i + 3
    }'
}

@test "charts that cover less than a fifth are warned of, with the size or density that helps" {
    local bake=(--ao 1 --ao-method taps --resolution 16 -o out.exr) few="charts cover * % of *texels: " size
    # charts of the file's own: a tenth of the square
    printf 'v 0 0 0\nv 1 0 0\nv 1 0 -1\nv 0 0 -1\nvt 0 0\nvt 0.4 0\nvt 0.4 0.25\nvt 0 0.25\nf 1/1 2/2 3/3 4/4\n' >tenth.obj
    succeed bake tenth.obj "${bake[@]}" --size 64
    [[ $stderr == *$few"--unwrap always packs them anew, or --size 128 gives them more texels"* ]] || fail "$stderr"
    shade bake tenth.obj "${bake[@]}" --size 64 --unwrap always
    [[ $stderr != *"charts cover"* ]] || fail "packed anew: $stderr"
    # charts that padding keeps apart
    scattered 100 >many.obj
    shade bake many.obj "${bake[@]}" --size 64 --unwrap auto
    [[ $stderr == *$few"padding takes most of the image, so use --size "* ]] || fail "$stderr"
    size=$(sed -n 's/.*so use --size //p' <<<"$stderr")
    succeed bake many.obj "${bake[@]}" --size "$size" --unwrap auto
    [[ $stderr != *"charts cover"* ]] || fail "--size $size: $stderr"
    # a density that is too low for the size
    shade bake tenth.obj "${bake[@]}" --size 64 --unwrap always --texels-per-unit 8
    [[ $stderr == *$few"use a smaller --size, or --texels-per-unit "* ]] || fail "$stderr"
    size=$(sed -n 's/.*--texels-per-unit //p' <<<"$stderr")
    succeed bake tenth.obj "${bake[@]}" --size 64 --unwrap always --texels-per-unit "$size"
    # the chosen objects share the layout with others
    { sed 's/^f/o tenth\nf/' tenth.obj; echo 'o other'; echo 'f 1/1 2/2 3/3'; } >two.obj
    shade bake two.obj "${bake[@]}" --size 64 --receive tenth
    [[ $stderr != *"charts cover"* ]] || fail "chosen: $stderr"
}
