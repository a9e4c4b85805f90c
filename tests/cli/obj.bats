# bake -o OUT.obj: a mesh with new UVs, its materials and their images.
load helper

setup() {
    cd "$BATS_TEST_TMPDIR" || return 1
    write_box box.obj
    grep -v '^vt' box.obj | sed 's#/[0-9]*##g' >bare.obj
}

LIGHT=(--sun 0.3,1,0.2 --sun-angle 5 --ao 0.5 --size 64)

@test "the light is an image that materials name, and fits the UVs" {
    succeed bake bare.obj "${LIGHT[@]}" -o lit.obj
    no_leftovers
    [ "$(ls lit.*)" = $'lit.mtl\nlit.obj\nlit.preview.png' ] || fail "$(ls)"
    [ "$(grep mtllib lit.obj)" = 'mtllib lit.mtl' ] || fail "$(head -3 lit.obj)"
    [ "$(grep usemtl lit.obj)" = 'usemtl page_0' ] || fail 'not one material'
    [ "$(grep -E '^(newmtl|map_)' lit.mtl)" = $'newmtl page_0\nmap_Ka lit.preview.png\nmap_Kd lit.preview.png' ] || fail "$(cat lit.mtl)"
    # baked by the UVs that it has now
    succeed bake lit.obj "${LIGHT[@]}" --irradiance --ambient 0.25,0.25,0.25 --seams fix --bits 8 \
        --pack R=irradiance.R,G=irradiance.G,B=irradiance.B -o again.png
    succeed compare lit.preview.png again.png --max-difference 0 --max-coverage 0 --quiet
    [ "$(grep -c '^f' lit.obj)" = 12 ] || fail 'triangles are lost'
}

@test "objects and their groups keep their names" {
    {
        printf 'mtllib two.mtl\n'
        sed 's/^o box/o first_box\nusemtl red/; /^f 4\/13/i usemtl blue' box.obj
        sed 's/^o box/o second/; s/^v \([0-9]\)/v 3\1/; /^f/d' box.obj
        grep '^f' box.obj | awk '{ printf "f"; for (i = 2; i <= 4; ++i) { split($i, a, "/"); printf " %d/%d", a[1] + 8, a[2] + 24 } print "" }'
    } >two.obj
    printf 'newmtl red\nnewmtl blue\n' >two.mtl
    for command in 'bake --sun 0.3,1,0.2 --unwrap always' unwrap; do
        succeed ${command%% *} two.obj $(cut -s -d' ' -f2- <<<"$command") --size 64 -o out.obj
        shade info two.obj
        before=$(grep "^mesh" <<<"$output")
        [ "$(grep '^o ' out.obj)" = $'o first_box\no second' ] || fail "$(grep '^[og] ' out.obj)"
        shade info out.obj
        [ "$(grep -c "^mesh" <<<"$output")" = "$(wc -l <<<"$before")" ] || fail "not as many parts: $output; before: $before"
        [[ $output == *"'first_box"* && $output == *"'second"* ]] || fail "$output"
    done
}

@test "pages are materials with an image each, and what does not receive is unlit" {
    sed 's/^o box/o other/; s/^v \([0-9]\)/v 3\1/; /^f/d' box.obj >other
    { grep -v '^vt' box.obj | sed 's#/[0-9]*##g'; grep '^[ov] ' other; grep '^f' bare.obj |
        awk '{ printf "f"; for (i = 2; i <= 4; ++i) printf " %d", $i + 8; print "" }'; } >two.obj
    succeed bake two.obj "${LIGHT[@]}" --size 32 --texels-per-unit 20 --no-receive other -o lit.obj
    pages=$(grep -c '^newmtl page' lit.mtl)
    [ "$pages" -gt 1 ] || fail "$(cat lit.mtl)"
    for ((i = 0; i < pages; ++i)); do
        [ -s "lit.preview.$i.png" ] && grep -q "^map_Kd lit.preview.$i.png" lit.mtl && grep -q "^usemtl page_$i" lit.obj || fail "page $i"
    done
    awk '/^usemtl/ { material = $2 } /^o / { object = $2; material = "" } /^f/ && object == "other" && material != "unlit" { exit 1 }' lit.obj ||
        fail 'other is lit'
    grep -q '^newmtl unlit' lit.mtl || fail 'no such material'
}

@test "what an OBJ cannot have, and files of others, are refused" {
    printf 'newmtl red\n' >lit.mtl
    refuses 2 'lit.mtl: would be replaced, which vdbshade has not written' -- bake bare.obj "${LIGHT[@]}" -o lit.obj
    [ "$(cat lit.mtl)" = 'newmtl red' ] && [ ! -e lit.obj ] && [ ! -e lit.preview.png ] || fail "$(ls)"
    rm lit.mtl
    refuses 2 "--view 'lit.html': shows what a .glb" -- bake bare.obj "${LIGHT[@]}" -o lit.obj --view lit.html
    succeed bake bare.obj "${LIGHT[@]}" -o lit.obj
    succeed bake bare.obj "${LIGHT[@]}" -o lit.obj # over its own
}

@test "unwrap writes glTF, too: the input with another lightmap set" {
    succeed unwrap "$ASSETS/cloister.glb" --size 256 -o out.glb
    info_tells out.glb "UV sets: 2"
    refuses 2 'give -o OUT.obj, .glb or .gltf' -- unwrap "$ASSETS/cloister.glb" -o out.ply
}
