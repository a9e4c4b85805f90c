# Lightmap UVs made by `unwrap` and by a bake (--unwrap, --texels-per-unit, --pages); lit OBJ outputs.
load helper

LIGHT=(--sun 0.3,1,0.2 --sun-angle 5 --ao 0.5 --size 64)

# The box without UVs, two boxes, and two of which the second is twice as large.
prepare() {
    grep -v '^vt' box.obj | sed 's#/[0-9]*##g' >bare.obj
    write_boxes two.obj box second
    awk '/^o second/ {s = 1} /^v / && s {print "v", $2 * 2, $3 * 2, $4 * 2; next} {print}' two.obj >uneven.obj
}

@test "a mesh without UVs gets some that bake without a warning" {
    succeed_saying "vdbshade: out.obj: 6 charts on 1 page of 64 × 64, " "texels a unit, stretch 1.0" -- unwrap bare.obj -o out.obj --size 64
    succeed_printing "triangles: 12" "UV sets: 1" -- info out.obj --size 64
    [[ $output != *problem* ]] || fail "a problem"
    succeed bake out.obj -o out.exr --sun 0.3,1,0.2 --size 64 --resolution 24
    [[ $stderr != *warning* ]] || fail "a warning"
}

@test "an OBJ has the input's positions, normals and triangles, and a glTF one UV set more" {
    succeed unwrap "$ASSETS/cloister.glb" -o out.obj --quiet
    [ -z "$stderr" ] || fail "not quiet"
    shade info "$ASSETS/cloister.glb"
    info_tells out.obj "$(grep -o 'objects: .* triangles' <<<"$output")"
    [ "$(grep -c '^vn' out.obj)" -gt 100 ] || fail "no normals"
    succeed unwrap "$ASSETS/cloister.glb" --size 256 -o out.glb
    info_tells out.glb "UV sets: 2"
}

@test "pages are materials, and a density that does not fit names one that does" {
    refuses 4 "texels a unit: " -- unwrap bare.obj -o out.obj --size 32 --texels-per-unit 20
    [ ! -e out.obj ] || fail "it was written"
    succeed unwrap bare.obj -o out.obj --size 32 --texels-per-unit 20 --pages 6
    grep -q '^usemtl page_1' out.obj || fail "no second page"
}

@test "objects have pages of their own, as small as a density needs" {
    succeed_saying "12 charts on 2 pages of up to 64 × 64" -- unwrap uneven.obj -o out.obj --atlas objects --max-size 256 --texels-per-unit 8
    [ "$(grep '^usemtl' out.obj | tr '\n' ' ')" = "usemtl page_0 usemtl page_1 " ] || fail "$(grep usemtl out.obj)"
    refuse_each unwrap two.obj -o out.obj <<'LIST'
2 --pages | --atlas objects --pages 2
2 --max-size --texels-per-unit | --max-size 64
2 --max-size --size | --max-size 64 --size 32 --texels-per-unit 1
LIST
}

@test "unwrap --keep keeps UVs that can serve, and --density goes by name" {
    succeed_saying "1 mesh kept their UVs" -- unwrap box.obj -o out.obj --size 128 --keep
    succeed unwrap box.obj -o out.obj --size 128 --density 'b*=0.5'
}

@test "an asset gets the UVs that its mesh lacks; an image needs --unwrap auto, and the error says so" {
    succeed bake bare.obj "${SMALL[@]}" --ao 1 -o lit.glb
    show_gltf lit.glb text | grep -q '"TEXCOORD_0".*"MOZ_lightmap"' || fail "no UVs, or no light"
    ends 2 bake bare.obj "${SMALL[@]}" -o x.exr
    says "--unwrap auto"
    succeed bake bare.obj "${SMALL[@]}" --unwrap auto -o x.exr
}

@test "--unwrap auto keeps good UVs, always replaces them, and a density repacks them" {
    "$VDBSHADE" bake box.obj "${SMALL[@]}" -o plain.exr --quiet
    "$VDBSHADE" bake box.obj "${SMALL[@]}" --unwrap auto -o auto.exr --quiet
    "$VDBSHADE" bake box.obj "${SMALL[@]}" --unwrap always -o always.exr --quiet
    same plain.exr auto.exr
    differ plain.exr always.exr
    succeed bake box.obj "${SMALL[@]}" --size 64 --unwrap auto --texels-per-unit 16 -o many.exr --stats many.json
    # six unit squares
    holds "$(number_in many.json texels) >= 1536 && $(number_in many.json texels) <= 1850"
}

@test "a density makes as many pages as it needs, with an image each" {
    local options=("${SMALL[@]}" --size 64 --unwrap always --texels-per-unit 20)
    succeed bake two.obj "${options[@]}" --irradiance --ambient 0.25,0.25,0.25 -o x.exr
    [ -s x.0.exr ] && [ -s x.1.exr ] && [ ! -e x.exr ] || fail "$(ls)"
    succeed bake two.obj "${options[@]}" --seams keep --exr y.exr -o y.glb
    [ -s y.glb ] || fail "no asset"
    same x.0.exr y.0.exr
    same x.1.exr y.1.exr
}

@test "a mesh too large for a page is laid out on several, and stays solid" {
    succeed bake box.obj "${SMALL[@]}" --size 32 --unwrap always --texels-per-unit 20 -o x.exr --stats x.json --verbose
    [ -s x.5.exr ] && [ ! -e x.6.exr ] || fail "$(ls)"
    # solid still, though it is cut in six
    [[ $stderr != *"lie over"* && $stderr != *"sheet"* && $stderr != *"open edges"* ]] || fail "$stderr"
    # six squares of 20 texels and a border
    holds "$(number_in x.json texels) >= 2400 && $(number_in x.json texels) <= 2904"
}

@test "info prints density and stretch of UVs, and what --unwrap auto would do" {
    succeed_printing "lightmap UVs: 36.12 texels a unit at 100 × 100, stretch 1.048" "--unwrap auto: bakes these UVs as they are" -- info box.obj --size 100
    info_tells two.obj "--unwrap auto: packs usable charts anew"
    info_tells bare.obj "--unwrap auto: packs usable charts anew, and makes those of other meshes"
    [[ $output != *"lightmap UVs"* ]] || fail "$output"
}

@test "each object of an atlas has the image that it has alone" {
    succeed bake uneven.obj "${SMALL[@]}" --size 32 --ao 1 --unwrap always --per-object -o maps/
    [ "$(echo maps/*)" = "maps/box.exr maps/second.exr" ] || fail "$(echo maps/*)"
    succeed bake uneven.obj "${SMALL[@]}" --size 32 --ao 1 --unwrap always --receive second -o alone.exr
    same alone.exr maps/second.exr
}

@test "a scene writes images named by objects, as small as their densities allow" {
    cat >scene.json <<EOF
{"casters": [{"mesh": "uneven.obj"}], "lights": [{"name": "sun", "type": "directional", "direction": [0, 1, 0]}],
 "receivers": [{"mesh": "uneven.obj", "output": "map.png", "unwrap": "always", "atlas": "objects",
                "texels_per_unit": 8, "max_size": 256, "density": {"*": 0.5, "second": 2}}]}
EOF
    succeed bake scene.json
    info_tells map.box.png "32 × 16"
    shade info map.second.png
    [[ $output == *"128 × 64"* || $output == *"128 × 128"* ]] || fail "$output"
    [ ! -e map.png ] || fail "$(ls)"
    sed 's/"second": 2/"secnd": 2/' scene.json >bad.json
    refuses 2 "no object is named 'secnd'" "did you mean 'second'?" "'box'" -- bake bad.json
    for change in 's/"second": 2/"second": 0/' 's/"density": {[^}]*}/"density": 3/'; do
        sed "$change" scene.json >bad.json
        refuses 2 density -- bake bad.json
    done
}

@test "--density goes by name, and an unknown name is refused with the names there are" {
    local bake=(bake two.obj "${SMALL[@]}" --size 128 --unwrap always --texels-per-unit 8 --receive second) few many
    succeed "${bake[@]}" -o plain.exr --stats plain.json
    succeed "${bake[@]}" --density 'b*=3' --density 'sec*=2' -o dense.exr --stats dense.json
    few=$(number_in plain.json texels) many=$(number_in dense.json texels)
    # four times as many, and a border
    holds "$many >= 3 * $few && $many <= 4 * $few"
    refuse_each bake two.obj "${SMALL[@]}" --unwrap always -o x.exr <<'LIST'
2 two.obj "'x*'" "'box', 'second'" | --density 'x*=2'
2 --density PATTERN=X | --density box
2 --density | --density box=-1
LIST
}

@test "an asset of objects has a lightmap and materials for each" {
    write_scene fit.json uneven.obj '' '"atlas": "objects", "max_size": 128, "texels_per_unit": 8, "unwrap": "always"'
    succeed bake fit.json --resolution 24 --ao 1 --seams keep -o lit.gltf --exr all.exr
    for file in lit.lightmap.box.png lit.lightmap.second.png lit.occlusion.second.png all.box.exr all.second.exr; do
        [ -s "$file" ] || fail "no $file: $(ls)"
    done
    grep -q '"lightmap of box"' lit.gltf || fail "no name of an image"
    [ "$(grep -o '"MOZ_lightmap": {' lit.gltf | wc -l)" -eq 2 ] || fail "not two materials: $(cat lit.gltf)"
    info_tells lit.lightmap.box.png "64 × 32"
    info_tells lit.lightmap.second.png "64 × 64"
    # the values are those of the images
    shade bake fit.json --resolution 24 --ao 1 --irradiance --ambient 0.25,0.25,0.25 -o images.exr
    same images.second.exr all.second.exr
    # --invalid writes a picture for each, also for each page
    succeed bake fit.json --resolution 24 --ao 1 -o lit.glb --invalid where.png
    [ "$(echo where*)" = "where.0.lit.box.png where.1.lit.second.png" ] || fail "$(ls)"
    succeed bake uneven.obj --sun 0.3,1,0.2 --resolution 24 --ao 1 --unwrap always --size 64 --pages 2 -o lit.obj --invalid page.png
    [ "$(echo page*)" = "page.0.lit.0.png page.1.lit.1.png" ] || fail "$(ls)"
}

@test "objects that each fill the UV square keep their UVs and get a lightmap each" {
    "$VDBSHADE" bake two.obj "${SMALL[@]}" --irradiance --ambient 0.25,0.25,0.25 --size 64 --per-object -o maps/ --quiet
    succeed bake two.obj "${SMALL[@]}" --size 64 --per-object --seams keep -o lit.glb --exr all.exr
    same maps/box.exr all.box.exr
    same maps/second.exr all.second.exr
    [ "$(show_gltf lit.glb text | grep -o '"MOZ_lightmap":{' | wc -l)" -eq 2 ] || fail "not two materials"
    ! show_gltf lit.glb text | grep -q TEXCOORD_1 || fail "new UVs"
}

@test "options that exclude an atlas of objects or a largest size are refused" {
    write_scene fit.json two.obj '' '"max_size": 64, "unwrap": "always"'
    refuses 2 max_size texels_per_unit -- bake fit.json --resolution 24 -o x.exr
    refuses 2 pages -- bake two.obj "${SMALL[@]}" --per-object --pages 2 --unwrap always -o x.exr
    refuses 4 two.obj "'box'" "a chart is larger than a page of 16 × 16 texels" -- bake two.obj "${SMALL[@]}" --size 16 --texels-per-unit 40 --per-object --unwrap always -o x.exr
}

# scattered COUNT: triangles that share no edges, so each is a chart.
scattered() {
    awk -v count="$1" 'BEGIN {
        for (i = 0; i < count; ++i) printf "v %d 0 0\nv %d 0 1\nv %d 0 0\n", 2 * i, 2 * i, 2 * i + 1
        for (i = 0; i < count; ++i) printf "f %d %d %d\n", 3 * i + 1, 3 * i + 2, 3 * i + 3
    }'
}

@test "a warning about charts that cover less than a fifth names the option that helps" {
    local bake=(--ao 1 --ao-method taps --resolution 16 -o out.exr --size) few=("charts cover " " % of " "texels: ")
    # charts of the file's own: a tenth of the square
    printf 'v 0 0 0\nv 1 0 0\nv 1 0 -1\nv 0 0 -1\nvt 0 0\nvt 0.4 0\nvt 0.4 0.25\nvt 0 0.25\nf 1/1 2/2 3/3 4/4\n' >tenth.obj
    succeed_saying "${few[@]}" "--unwrap always packs them anew" -- bake tenth.obj "${bake[@]}" 64
    succeed bake tenth.obj "${bake[@]}" 64 --unwrap always
    [[ $stderr != *"charts cover"* ]] || fail "packed anew: $stderr"
    # charts that padding keeps apart
    scattered 100 >many.obj
    succeed_saying "${few[@]}" "padding takes most of the image, so use a larger --size" -- bake many.obj "${bake[@]}" 64 --unwrap auto
    # a density that is too low for the size
    succeed_saying "${few[@]}" "use a smaller --size or a higher --texels-per-unit" -- bake tenth.obj "${bake[@]}" 64 --unwrap always --texels-per-unit 8
    # the chosen objects share the layout with others
    { sed 's/^f/o tenth\nf/' tenth.obj; echo 'o other'; echo 'f 1/1 2/2 3/3'; } >chosen.obj
    succeed bake chosen.obj "${bake[@]}" 64 --receive tenth
    [[ $stderr != *"charts cover"* ]] || fail "chosen: $stderr"
}

@test "an OBJ's light is an image that its materials name" {
    succeed bake bare.obj "${LIGHT[@]}" -o lit.obj
    no_leftovers
    [ "$(ls lit.*)" = $'lit.mtl\nlit.obj\nlit.preview.png' ] || fail "$(ls)"
    [ "$(grep mtllib lit.obj)" = 'mtllib lit.mtl' ] || fail "$(head -3 lit.obj)"
    [ "$(grep usemtl lit.obj)" = 'usemtl page_0' ] || fail 'not one material'
    [ "$(grep -E '^(newmtl|map_)' lit.mtl)" = $'newmtl page_0\nmap_Ka lit.preview.png\nmap_Kd lit.preview.png' ] || fail "$(cat lit.mtl)"
    # baked by the UVs that it has now
    succeed bake lit.obj "${LIGHT[@]}" --irradiance --ambient 0.25,0.25,0.25 --seams fix --bits 8 \
        --pack R=irradiance.R,G=irradiance.G,B=irradiance.B -o again.png
    same lit.preview.png again.png
    [ "$(grep -c '^f' lit.obj)" = 12 ] || fail 'triangles are lost'
}

@test "objects and their groups keep their names" {
    { echo 'mtllib two.mtl' && sed 's/^o box/o first_box\nusemtl red/; /^f 4\//i usemtl blue' two.obj; } >named.obj
    printf 'newmtl red\nnewmtl blue\n' >two.mtl
    local parts
    for command in 'bake --sun 0.3,1,0.2 --unwrap always' unwrap; do
        succeed ${command%% *} named.obj $(cut -s -d' ' -f2- <<<"$command") --size 64 -o out.obj
        shade info named.obj
        parts=$(grep -c "^mesh" <<<"$output")
        [ "$(grep '^o ' out.obj)" = $'o first_box\no second' ] || fail "$(grep '^[og] ' out.obj)"
        info_tells out.obj "'first_box" "'second"
        [ "$(grep -c "^mesh" <<<"$output")" = "$parts" ] || fail "not $parts parts"
    done
}

@test "an OBJ has a material and an image for each page, and an unlit one for other objects" {
    succeed bake two.obj "${LIGHT[@]}" --size 32 --texels-per-unit 20 --unwrap always --no-receive second -o lit.obj
    pages=$(grep -c '^newmtl page' lit.mtl)
    [ "$pages" -gt 1 ] || fail "$(cat lit.mtl)"
    for ((i = 0; i < pages; ++i)); do
        [ -s "lit.preview.$i.png" ] && grep -q "^map_Kd lit.preview.$i.png" lit.mtl && grep -q "^usemtl page_$i" lit.obj || fail "page $i"
    done
    awk '/^usemtl/ { material = $2 } /^o / { object = $2; material = "" } /^f/ && object == "second" && material != "unlit" { exit 1 }' lit.obj ||
        fail 'the second is lit'
    grep -q '^newmtl unlit' lit.mtl || fail 'no such material'
}

@test "an OBJ output refuses --view, and replaces no foreign .mtl" {
    printf 'newmtl red\n' >lit.mtl
    refuses 2 'lit.mtl: it exists, and vdbshade did not write it' -- bake bare.obj "${LIGHT[@]}" -o lit.obj
    [ "$(cat lit.mtl)" = 'newmtl red' ] && [ ! -e lit.obj ] && [ ! -e lit.preview.png ] || fail "$(ls)"
    rm lit.mtl
    refuses 2 "--view 'lit.html': shows the light of a .glb" -- bake bare.obj "${LIGHT[@]}" -o lit.obj --view lit.html
    succeed bake bare.obj "${LIGHT[@]}" -o lit.obj
    succeed bake bare.obj "${LIGHT[@]}" -o lit.obj # over its own
}
