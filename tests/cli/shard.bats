# `bake --shard I/N` and `merge`: parts that are baked by themselves come to the bits of one bake.
load parts

@test "2, 3, 7 and 64 parts of a lightmap are one bake, byte by byte" {
    one out.exr "${CLOISTER[@]}"
    for n in 2 3 7 64; do
        merged out.exr "$n" "${CLOISTER[@]}"
    done
    no_leftovers
}

@test "what crosses parts is as in one bake: seams, padding, shared rays, what is filled, every channel" {
    local options=(--irradiance --bent-normals world --sky y --error)
    write_scene all.json "${CLOISTER[0]}" '"invalid": true, "tint": "quadratic"'
    no_sun "${CLOISTER[@]:1}"
    one out.exr all.json "${rest[@]}" "${options[@]}" --padding auto
    merged out.exr 3 all.json "${rest[@]}" "${options[@]}" --padding auto
    one out.png "${CLOISTER[@]}" --seams fix --padding auto
    merged out.png 3 "${CLOISTER[@]}" --seams fix --padding auto
    one out.exr "${CLOISTER[@]}" --padding 70 --supersample 2 --method adaptive --ao-method adaptive --resolution 48
    merged out.exr 3 "${CLOISTER[@]}" --padding 70 --supersample 2 --method adaptive --ao-method adaptive --resolution 48
    one out.exr "${CLOISTER[@]}" --method cone --ao-method cones --padding 0 --resolution 48
    merged out.exr 3 "${CLOISTER[@]}" --method cone --ao-method cones --padding 0 --resolution 48
}

@test "AO that texels share is shot by one part and finished by merge, of any spacing and error, with its error" {
    for spacing in 2 8; do
        write_scene $spacing.json "${CLOISTER[0]}" '' "\"ao_spacing\": $spacing"
    done
    write_scene 4.json "${CLOISTER[0]}"
    no_sun "${CLOISTER[@]:1}"
    for options in "8.json --error" "2.json --max-error 0.05" "4.json --max-error 0.008" \
        "4.json --method adaptive --ao-method adaptive --resolution 48 --error"; do
        one out.exr $options "${rest[@]}"
        for n in 2 5; do
            merged out.exr "$n" $options "${rest[@]}"
        done
    done
}

@test "what is made of AO is finished by merge, too: irradiance with and without light from all around, bent normals in both spaces, the sky" {
    local all=(--irradiance --ambient 0.3,0.2,0.1 --bent-normals tangent --sky -z --error)
    for options in "--irradiance --max-error 0.05" "--irradiance --ambient 0.3,0.2,0.1" "--bent-normals world" "--sky y --seams fix" \
        "${all[*]} --padding 20" "--irradiance --bent-normals tangent --sky y --method adaptive --ao-method adaptive --resolution 48"; do
        one out.exr "${CLOISTER[@]}" $options
        for n in 2 5; do
            merged out.exr "$n" "${CLOISTER[@]}" $options
        done
    done
    one out.glb "${CLOISTER[@]}" "${all[@]}"
    for n in 2 7 64; do
        merged out.glb "$n" "${CLOISTER[@]}" "${all[@]}"
    done
}

@test "so are an asset with its light in it, a terrain, objects of their own, and a scene of several lightmaps" {
    one out.glb "${CLOISTER[@]}"
    merged out.glb 3 "${CLOISTER[@]}"
    printf '%s' '{"lights": [{"name": "sun", "type": "directional", "direction": [-1, 0.5, -0.3], "angle_deg": 5}], "ao": {"distance": 2},
        "receivers": [{"heightfield": "terrain.png", "extent": [10, 10], "height": 2, "size": 64, "output": "out.exr"}]}' >terrain.json
    one out.exr terrain.json
    for n in 2 3 7 64; do
        merged out.exr "$n" terrain.json
    done
    printf '%s' '{"casters": [{"mesh": "cloister.glb"}], "resolution": 48, "ao": {"distance": 2}, "receivers": [
        {"mesh": "cloister.glb", "size": 64, "output": "a.exr"}, {"mesh": "cloister.glb", "size": 96, "output": "b.png"}]}' >two.json
    "$VDBSHADE" bake two.json --quiet
    mkdir one2 objects
    mv a.exr b.png one2
    for i in 1 2 3 4 5; do "$VDBSHADE" bake two.json --shard $i/5 --quiet; done
    "$VDBSHADE" merge a.exr --quiet
    cmp one2/a.exr a.exr
    cmp one2/b.png b.png
    "$VDBSHADE" bake "${CLOISTER[@]}" --size 64 --per-object -o one2/ --quiet
    for i in 1 2 3; do "$VDBSHADE" bake "${CLOISTER[@]}" --size 64 --per-object -o objects/ --shard $i/3 --quiet; done
    "$VDBSHADE" merge objects --quiet
    rm one2/a.exr one2/b.png
    diff -r one2 objects
    parts v1.2/ 2 "" "${CLOISTER[@]}" --size 64 --per-object
    rmdir v1.2 # parts come from elsewhere, and the folder's name tells that it is one
    "$VDBSHADE" merge v1.2/ --quiet
    diff -r one2 v1.2
}

@test "seams between pages are fixed where parts are put together, too, and objects have their own" {
    local ring=("$ASSETS/smooth.glb" --unwrap always --texels-per-unit 30 --size 128 --sun 0.5,0.5,0.1 --sun-angle 20 --ao 0.3) # a ring on two pages
    one out.glb "${ring[@]}"
    merged out.glb 3 "${ring[@]}"
    one out.glb "${CLOISTER[@]}" --unwrap always --texels-per-unit 9 --size 128 --per-object
    merged out.glb 2 "${CLOISTER[@]}" --unwrap always --texels-per-unit 9 --size 128 --per-object
}

@test "a part is the same whoever bakes it, with however many threads" {
    local all=("${CLOISTER[@]}" --irradiance --bent-normals tangent --sky y)
    parts a.exr 3 2 "${all[@]}"
    parts b.exr 3 2 "${all[@]}" --threads 1
    # but for their command lines, which the first pages of a part have
    cmp <(values a.exr) <(values b.exr)
}

@test "a lightmap that memory has no room for is merged to the same bits" {
    options=("${CLOISTER[@]}" --size 2048x128 --irradiance --bent-normals tangent --sky y --error)
    one out.exr "${options[@]}"
    parts out.exr 3 "" "${options[@]}"
    local sizes
    mapfile -t sizes < <(stat -c %s out.exr.?-of-3.part | sort -n)
    [ "${sizes[2]}" -lt $((2 * sizes[0])) ] || fail "parts of ${sizes[*]} bytes"
    succeed merge out.exr --memory-limit 16M
    cmp one/out.exr out.exr
}

@test "statistics, pictures of what is invalid, and pages are made of all parts" {
    one out.exr "${CLOISTER[@]}" --sky y --stats one.json --invalid one.png
    parts out.exr 3 "" "${CLOISTER[@]}" --sky y
    "$VDBSHADE" merge out.exr --quiet --stats all.json --invalid all.png
    for key in texels invalid_texels marches rays voxel_size estimated_rmse worst_error; do # of all, of shadow, AO and the sky
        [ "$(grep -o "\"$key\": [0-9.]*" one.json)" = "$(grep -o "\"$key\": [0-9.]*" all.json)" ] || fail "$key"
    done
    cmp one.png all.png
    for option in "--invalid x.png" "--view x.html"; do
        refuses 2 "${option% *}" "not together with --shard" -- bake "${CLOISTER[@]}" -o out.exr --shard 1/3 $option
    done
}

@test "each part has about as many samples as any other" {
    local i most=0 least=1000000 own
    for i in $(seq 7); do
        "$VDBSHADE" bake "${CLOISTER[@]}" --size 256x1024 -o out.exr --shard "$i/7" --stats "$i.json" --quiet
        own=$(grep -o '"samples": [0-9]*' "$i.json" | head -1 | grep -o '[0-9]*$')
        most=$((own > most ? own : most)) least=$((own < least ? own : least))
    done
    [ "$most" -le $((least * 2)) ] || fail "$least to $most samples"
}
