# bake --dry-run: what a bake will take.
load helper

setup() {
    cd "$BATS_TEST_TMPDIR" || return 1
    write_box box.obj
}

@test "a dry run says what a bake will take, and writes nothing" {
    old_output out.exr
    shade bake box.obj "${SMALL[@]}" --ao 0.5 -o out.exr --dry-run
    done_well
    for word in texels voxels memory time voxelize field bake; do
        [[ $output == *"$word"* ]] || fail "no $word"
    done
    [ -z "$stderr" ] || fail "something on standard error"
    untouched out.exr
}

@test "its texels are those of the bake" {
    shade bake box.obj "${SMALL[@]}" --size 200x90 -o out.exr --dry-run
    done_well
    local texels
    texels=$(grep -o '^texels *[0-9]*' <<<"$output" | grep -o '[0-9]*$')
    shade bake box.obj "${SMALL[@]}" --size 200x90 -o out.exr --quiet --stats stats.json
    done_well
    grep -q "\"texels\": $texels," stats.json || fail "$texels, and $(cat stats.json)"
}

@test "its voxels are near those of the bake, by resolution and by size" {
    for voxels in '--resolution 200' '--voxel-size 0.004'; do
        # shellcheck disable=SC2086
        shade bake box.obj --ao 0.5 --size 32 $voxels -o out.exr --dry-run
        done_well
        local about
        about=$(grep '^voxels' <<<"$output" | awk '{ print $3 }')
        # shellcheck disable=SC2086
        shade bake box.obj --ao 0.5 --size 32 $voxels -o out.exr --quiet --stats stats.json
        done_well
        awk -v a="$about" '/active_voxels/ { exit !(a > 0.8 * ($2 + 0) && a < 1.25 * ($2 + 0)) }' stats.json ||
            fail "about $about, and $(grep active stats.json)"
    done
}

@test "a dry run refuses what a bake refuses" {
    shade bake box.obj -o out.exr --dry-run
    refused 2 --sun --ao
    shade bake missing.obj "${SMALL[@]}" -o out.exr --dry-run
    refused 3 missing.obj
}
