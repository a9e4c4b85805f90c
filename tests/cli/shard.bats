# `bake --shard I/N` and `merge`: merged parts have the bytes of one bake. Errors name bad parts, which may be of strangers.
load helper

prepare() {
    ln -s "$ASSETS/terrain.png" "$ASSETS/cloister.glb" .
}

TALL=(--ao 2 --size 64x256)
CLOISTER=(cloister.glb --sun -0.5,0.8,-0.6 --sun-angle 10 "${TALL[@]}")

# parts OUT N "I …" INPUT [options]: bakes all parts, or those that are named.
parts() {
    local out=$1 n=$2 which=${3:-$(seq "$2")} i
    shift 3
    for i in $which; do
        "$VDBSHADE" bake "$@" -o "$out" --shard "$i/$n" --quiet
    done
}

# one_is OUT "N …" INPUT [options]: merging each number of parts gives the same as one bake, whose output stays in one/.
one_is() {
    local out=$1 n
    mkdir -p one
    "$VDBSHADE" bake "${@:3}" -o "one/$out" --quiet
    for n in $2; do
        parts "$out" "$n" "" "${@:3}"
        "$VDBSHADE" merge "$out" --quiet
        cmp "one/$out" "$out" || fail "$n parts of ${*:3} are not one bake"
        rm -- "$out" *.part
    done
}

@test "2, 3, 7 and 64 merged parts of a lightmap are the bytes of one bake" {
    one_is out.exr "2 3 7 64" "${CLOISTER[@]}"
    no_leftovers
}

@test "merged parts have the seams, padding, shared AO and channels of one bake" {
    local all=(--irradiance --ambient 0.3,0.2,0.1 --bent-normals tangent --sky -z --error) adaptive="--method adaptive --ao-method adaptive"
    write_scene all.json cloister.glb '"invalid": true, "tint": "quadratic"'
    write_scene 2.json cloister.glb '' '"ao_spacing": 2'
    write_scene 8.json cloister.glb '' '"ao_spacing": 8'
    local out n options
    while read -r out n options; do
        # shellcheck disable=SC2086 # words
        one_is "$out" "$n" $options
    done <<LIST
out.exr 3 all.json ${TALL[*]} --irradiance --bent-normals world --sky y --error --padding auto
out.exr 5 8.json ${TALL[*]} --error
out.exr 2 2.json ${TALL[*]} --max-error 0.05
out.exr 5 ${CLOISTER[*]} $adaptive --resolution 48 --error --irradiance --bent-normals tangent --sky y
out.exr 3 ${CLOISTER[*]} $adaptive --resolution 48 --padding 70 --supersample 2
out.exr 3 ${CLOISTER[*]} --method cone --ao-method cones --padding 0 --resolution 48
out.png 3 ${CLOISTER[*]} --seams fix --padding auto
out.exr 2 ${CLOISTER[*]} --irradiance --max-error 0.05
out.exr 5 ${CLOISTER[*]} --irradiance --ambient 0.3,0.2,0.1
out.exr 2 ${CLOISTER[*]} --sky y --seams fix
out.exr 5 ${CLOISTER[*]} ${all[*]} --padding 20
out.glb 7 ${CLOISTER[*]} ${all[*]}
LIST
}

@test "merged parts of assets, terrains, objects and several lightmaps are the bytes of one bake" {
    one_is out.glb 3 "${CLOISTER[@]}"
    printf '%s' '{"lights": [{"name": "sun", "type": "directional", "direction": [-1, 0.5, -0.3], "angle_deg": 5}], "ao": {"distance": 2},
        "receivers": [{"heightfield": "terrain.png", "extent": [10, 10], "height": 2, "size": 64, "output": "out.exr"}]}' >terrain.json
    one_is out.exr "2 3 7 64" terrain.json
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

@test "merge fixes seams between pages, and between objects" {
    local ring=("$ASSETS/smooth.glb" --unwrap always --texels-per-unit 30 --size 128 --sun 0.5,0.5,0.1 --sun-angle 20 --ao 0.3) # a ring on two pages
    one_is out.glb 3 "${ring[@]}"
    one_is out.glb 2 "${CLOISTER[@]}" --unwrap always --texels-per-unit 9 --size 128 --per-object
}

@test "a lightmap over the memory limit is merged to the same bits" {
    options=("${CLOISTER[@]}" --size 2048x128 --irradiance --bent-normals tangent --sky y --error)
    one_is out.exr "" "${options[@]}"
    parts out.exr 3 "" "${options[@]}"
    local sizes
    mapfile -t sizes < <(stat -c %s out.exr.?-of-3.part | sort -n)
    [ "${sizes[2]}" -lt $((2 * sizes[0])) ] || fail "parts of ${sizes[*]} bytes"
    succeed merge out.exr --memory-limit 16M
    cmp one/out.exr out.exr
}

@test "merge writes statistics and --invalid of all parts" {
    one_is out.exr "" "${CLOISTER[@]}" --sky y --stats one.json --invalid one.png
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

@test "parts that are missing are named, and nothing is written" {
    old_output out.exr
    refuses 2 "out.exr: there are no parts beside it" -- merge out.exr
    parts out.exr 3 "1 3" box.obj "${SMALL[@]}"
    refuses 3 "out.exr: missing parts: 2 of 3; bake them by --shard I/3" -- merge out.exr
    parts out.exr 12 1 box.obj "${SMALL[@]}"
    refuses 2 "there are parts of 3 and of 12 shards" -- merge out.exr
    refuses 3 "missing parts: 2, 3, 4, 5, 6, 7 and 5 more of 12" -- merge out.exr --shards 12
    untouched out.exr
}

@test "a part of another bake, input, option or version is refused with the difference" {
    old_output out.exr
    parts out.exr 2 1 box.obj "${SMALL[@]}"
    parts out.exr 2 2 box.obj "${SMALL[@]}" --max-error 0.1
    refuses 2 "out.exr.2-of-2.part: was baked from other inputs or options: its vdbshade_command is" "max-error" -- merge out.exr
    parts out.exr 2 2 box.obj "${SMALL[@]}"
    cp out.exr.2-of-2.part good
    cp out.exr.1-of-2.part out.exr.2-of-2.part
    refuses 2 "out.exr.2-of-2.part: holds part 1 of 2; was it renamed?" -- merge out.exr
    sed "s/^vdbshade part ./vdbshade part 8/" good >out.exr.2-of-2.part
    refuses 2 "out.exr.2-of-2.part: was written by another version of vdbshade" -- merge out.exr
    # the input changed behind the parts
    cp good out.exr.2-of-2.part
    parts box.exr 2 "" box.obj "${SMALL[@]}"
    echo "# again" >>box.obj
    refuses 2 "box.exr.1-of-2.part: was baked from other inputs or options: its vdbshade_input_0 is" -- merge box.exr
    untouched out.exr
}

@test "a damaged part is refused by name" {
    parts out.exr 2 "" box.obj "${SMALL[@]}"
    cp out.exr.2-of-2.part good
    size=$(stat -c %s good)
    for at in 200 $((size / 2)) $((size - 1)); do
        perl -0777 -pe 'substr($_, '"$at"', 1) ^= "\x55"' good >out.exr.2-of-2.part
        refuses 2 "out.exr.2-of-2.part: " -- merge out.exr
    done
    for bytes in 0 63 $((size - 1)); do
        head -c "$bytes" good >out.exr.2-of-2.part
        refuses 2 "out.exr.2-of-2.part: " -- merge out.exr
    done
    (cat good && echo) >out.exr.2-of-2.part
    refuses 2 "out.exr.2-of-2.part: damaged" -- merge out.exr
}

@test "merge writes only the outputs that it is given, not those that a part names" {
    parts out.exr 1 "" box.obj "${SMALL[@]}" --stats kept.json
    rm kept.json
    mv out.exr.1-of-1.part other.exr.1-of-1.part
    "$VDBSHADE" merge other.exr --quiet
    [ -e other.exr ]
    [ ! -e out.exr ]
    [ ! -e kept.json ]
}

@test "a part that cannot be written leaves no file" {
    refuses 3 "none" -- bake box.obj "${SMALL[@]}" -o none/out.exr --shard 1/2
    for text in 0/2 3/2 1 1/ /2 1/2/3 a/b 1/20000 -1/2; do
        refuses 2 "--shard '$text': expected I/N" -- bake box.obj "${SMALL[@]}" -o out.exr "--shard=$text"
    done
    no_leftovers
    [ -z "$(ls ./*.part 2>/dev/null)" ]
}
