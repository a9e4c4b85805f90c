# The accurate end: rays, adaptive, exact.
load helper

# by_rays METHOD: a lone box by the method is lit, dark and open, and the file names the method's rays.
by_rays() {
    write_scene box.json box.obj '"sampler": "blue", "frame": 1'
    no_sun "${SMALL[@]}"
    succeed bake box.json "${rest[@]}" --ao 0.5 --method "$1" --ao-method "$1" --rays 8 --quiet \
        --stats stats.json -o "$1.exr"
    grep -q '"rays": [1-9]' stats.json || fail "no rays: $(cat stats.json)"
    info_tells "$1.exr" "channel 'shadow.sun': min 0, mean 0.5, max 1" "channel 'ao': min 1, mean 1, max 1"
    grep -qx "vdbshade_shadow: $1, .*8 rays, blue, frame 1" <<<"$output" || fail "what rays of shadows?"
    grep -qx "vdbshade_ao: $1 within 0.5, .*8 rays, blue, frame 1" <<<"$output" || fail "what rays of AO?"
}

@test "rays and adaptive bake, and name their rays" {
    by_rays rays
    by_rays adaptive
}

@test "exact bakes where there is Embree, and names its rays" {
    by_rays exact
}

@test "exact traces shapes and level sets as well as meshes" {
    printf '{"casters": [{"sdf": {"shape": "torus", "radius": 0.6, "tube_radius": 0.2, "translate": [0, 2, 0]}}]}' >ring.json
    "$VDBSHADE" voxelize ring.json --resolution 48 --quiet -o ring.vdb
    cat >mixed.json <<'JSON'
{"casters": [{"mesh": "box.obj"}, {"sdf": {"shape": "sphere", "radius": 0.5, "translate": [0, 2, 0]}}, {"vdb": "ring.vdb"}],
 "lights": [{"name": "sun", "type": "directional", "direction": [0, 1, 0], "angle_deg": 5}],
 "method": "exact", "receivers": [{"mesh": "box.obj", "size": 16, "output": "a.exr"}]}
JSON
    succeed bake mixed.json
    [[ $stderr == *"no voxels"*"shadow exact"* ]] || fail "are there voxels?"
}

@test "--error bakes what error is left, for methods that know it" {
    succeed bake box.obj "${SMALL[@]}" --ao 0.5 --method adaptive --ao-method cones --error --quiet -o out.exr
    info_tells out.exr "channel 'error.sun'"
    [[ $output != *"channel 'error.ao'"* ]] || fail "cones know no error"
    succeed bake box.obj "${SMALL[@]}" --ao 0.5 --method adaptive --ao-method adaptive --error --irradiance --quiet -o all.exr
    shade info all.exr
    for channel in shadow.sun ao error.sun error.ao irradiance.R A; do
        [[ $output == *"channel '$channel'"* ]] || fail "no $channel"
    done
    [[ $output == *"11 channels"* ]] || fail "not 8 channels, and R, G and B"
}

@test "who asks for an error gets a method that keeps it" {
    succeed bake box.obj "${SMALL[@]}" --ao 0.5 --max-error 0.05 --quiet -o asked.exr
    succeed bake box.obj "${SMALL[@]}" --ao 0.5 --max-error 0.05 --method adaptive --ao-method adaptive --quiet -o named.exr
    same_values asked.exr named.exr
}

@test "the statistics say what adaptive methods know of themselves" {
    succeed bake box.obj "${SMALL[@]}" --method adaptive --quiet --stats stats.json -o out.exr
    for key in rays refined certified_share estimated_rmse; do
        grep -q "\"$key\": [0-9]" stats.json || fail "no $key: $(cat stats.json)"
    done
    succeed bake box.obj "${SMALL[@]}" --method cone --quiet --stats stats.json -o out.exr
    grep -q '"estimated_rmse": null' stats.json
}
