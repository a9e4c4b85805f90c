# The accurate end: rays, adaptive, exact.
load helper

setup() {
    cd "$BATS_TEST_TMPDIR" || return 1
    write_box box.obj
}

# Builds without Embree have no exact methods.
needs_embree() {
    shade bake box.obj "${SMALL[@]}" --method exact --quiet -o probe.exr
    [[ $stderr != *"without Embree"* ]] || skip "built without Embree"
}

@test "every method bakes, and names its rays" {
    for method in rays adaptive; do
        shade bake box.obj "${SMALL[@]}" --ao 0.5 --method "$method" --ao-method "$method" --rays 8 --sampler blue \
            --frame 1 --quiet -o "$method.exr"
        done_well
    done
}

@test "exact methods bake where there is Embree" {
    needs_embree
    shade bake box.obj "${SMALL[@]}" --ao 0.5 --method exact --ao-method exact --max-error 0.05 --quiet -o exact.exr
    done_well
}

@test "exact methods need casters that are meshes" {
    cat >mixed.json <<'JSON'
{"casters": [{"mesh": "box.obj"}, {"sdf": {"shape": "sphere", "radius": 0.5, "translate": [0, 2, 0]}}],
 "resolution": 24, "lights": [{"name": "sun", "type": "directional", "direction": [0, 1, 0], "angle_deg": 5}],
 "method": "exact", "receivers": [{"mesh": "box.obj", "size": 16, "output": "a.exr"}]}
JSON
    old_output a.exr
    shade bake mixed.json --quiet
    refused 2 'casters[1] is an sdf' exact
    untouched a.exr
}

@test "--error bakes what error is left, for methods that know it" {
    shade bake box.obj "${SMALL[@]}" --ao 0.5 --method adaptive --ao-method cones --error --quiet -o out.exr
    done_well
    shade info out.exr
    [[ $output == *"channel 'error.sun'"* ]] || fail "no error.sun"
    [[ $output != *"channel 'error.ao'"* ]] || fail "cones know no error"
    shade bake box.obj "${SMALL[@]}" --ao 0.5 --method adaptive --ao-method adaptive --error --irradiance --quiet -o all.exr
    done_well
    shade info all.exr
    for channel in shadow.sun ao error.sun error.ao irradiance.R A; do
        [[ $output == *"channel '$channel'"* ]] || fail "no $channel"
    done
    [[ $output == *"11 channels"* ]] || fail "not 8 channels, and R, G and B"
}

@test "who asks for an error gets a method that keeps it" {
    shade bake box.obj "${SMALL[@]}" --ao 0.5 --max-error 0.05 --quiet -o asked.exr
    done_well
    shade bake box.obj "${SMALL[@]}" --ao 0.5 --max-error 0.05 --method adaptive --ao-method adaptive --quiet -o named.exr
    done_well
    same_values asked.exr named.exr
}

@test "the statistics say what adaptive methods know of themselves" {
    shade bake box.obj "${SMALL[@]}" --method adaptive --quiet --stats stats.json -o out.exr
    done_well
    for key in rays refined certified_share estimated_rmse; do
        grep -q "\"$key\": [0-9]" stats.json || fail "no $key: $(cat stats.json)"
    done
    shade bake box.obj "${SMALL[@]}" --method cone --quiet --stats stats.json -o out.exr
    done_well
    grep -q '"estimated_rmse": null' stats.json
}
