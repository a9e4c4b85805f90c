# Default methods, errors of voxels and rays and their warnings; methods by rays; the golden bakes.
load helper

prepare() {
    write_fence fence.obj
}

# A board of one quad with UVs, and pickets a fiftieth of it thick.
write_fence() {
    {
        printf 'o board\nv -1 0 1\nv 1 0 1\nv 1 0 -1\nv -1 0 -1\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3 4/4\no pickets\n'
        awk 'BEGIN {
            split("2 1 3 4 5 6 8 7 1 2 6 5 4 3 7 8 1 5 7 3 6 2 4 8", corner, " ")
            for (n = 4; n < 52; n += 8) {
                x = 0.3 * (n - 4) / 8 - 0.8
                for (k = 0; k < 8; ++k) print "v", x + 0.1 * (k % 2), k % 4 < 2 ? 0.1 : 0.9, k < 4 ? 0 : 0.01
                for (k = 1; k <= 24; k += 4)
                    print "f", n + corner[k] "/1", n + corner[k + 1] "/1", n + corner[k + 2] "/1", n + corner[k + 3] "/1"
            }
        }'
    } >"$1"
}

# said CHANNEL KEY: prints the key's value in s.json, of "shadow" or "ao".
said() {
    sed -n "/\"$1\": {/,/}/s/.*\"$2\": \"\{0,1\}\([^\",]*\).*/\1/p" s.json
}

@test "meshes are baked by exact by default, and the summary says so" {
    succeed_saying "shadow exact, AO exact, max error 0.02" -- bake box.obj "${SMALL[@]}" --ao 0.5 --stats s.json -o a.exr
    grep -q '"refined": [0-9]' s.json && grep -q '"certified_share": [0-9]' s.json || fail "$(cat s.json)"
    for kind in shadow ao; do
        [ "$(said $kind method)" = exact ] || fail "$(cat s.json)"
        holds "$(said $kind estimated_rmse) <= $(said $kind max_error)"
    done
    succeed bake box.obj "${SMALL[@]}" --ao 0.5 --method exact --ao-method exact --quiet -o b.exr
    same_values a.exr b.exr
    info_tells a.exr "exact, max error 0.02, sobol"
    succeed_printing "shadow exact, AO exact" -- bake box.obj "${SMALL[@]}" --ao 0.5 --dry-run -o c.exr
}

@test "a level set alone is baked by adaptive" {
    printf '{"casters": [{"sdf": {"shape": "sphere", "radius": 0.5, "translate": [0, 2, 0]}}]}' >ball.json
    "$VDBSHADE" voxelize ball.json --resolution 24 --quiet -o ball.vdb
    write_bake sphere.json '{"vdb": "ball.vdb"}'
    succeed_saying "shadow adaptive, max error 0.02" -- bake sphere.json --stats s.json
    [ "$(said shadow method)" = adaptive ] || fail "$(cat s.json)"
    succeed bake sphere.json --method cone --stats s.json
    grep -q '"estimated_rmse": null' s.json || fail "$(cat s.json)"
}

@test "a warning says that --rays is too small for --max-error" {
    succeed_saying "above the limit of 0.003: 8 rays are too few" -- bake fence.obj --size 64 --resolution 32 --sun 0.3,1,0.5 \
        --sun-angle 20 --max-error 0.003 --rays 8 --stats s.json -o a.exr
    holds "$(said shadow max_error) <= $(said shadow estimated_rmse)"
    succeed bake fence.obj --size 64 --resolution 32 --sun 0.3,1,0.5 --sun-angle 20 --max-error 0.003 \
        --stats s.json -o a.exr
    [[ $stderr != *"above the limit"* ]] || fail "$stderr"
    holds "$(said shadow estimated_rmse) <= 0.003"
}

@test "a warning says that voxels are too coarse for --max-error, by any number of threads, and exact has no such error" {
    local bake=(bake fence.obj --size 96 --resolution 32 --sun 0.3,1,0.5 --sun-angle 2 --max-error 0.01 -o a.exr) channels
    succeed_saying "shadow: the estimated error is " "above the limit of 0.01: " "comes from voxels of" "--method exact has none" -- \
        "${bake[@]}" --method adaptive --stats s.json
    [[ $stderr == *"estimated error: shadow "*"(the voxels' "* ]] || fail "$stderr"
    holds "0.05 <= $(said shadow estimated_rmse)"
    holds "0.05 <= $(said shadow field_rmse)"
    channels=$(sed -n '/"channels"/,/]/p' s.json)
    succeed "${bake[@]}" --method adaptive --stats s.json --threads 1 --quiet
    [ -n "$channels" ] && [ "$channels" = "$(sed -n '/"channels"/,/]/p' s.json)" ] || fail "one thread: $channels"
    succeed "${bake[@]}" --stats s.json
    [[ $stderr != *"above the limit"* ]] || fail "$stderr"
    holds "$(said shadow estimated_rmse) <= 0.01"
}

@test "a fence that voxels lose is named, unless its triangles are traced" {
    succeed bake fence.obj --size 32 --resolution 32 --sun 0.3,1,0.5 --method cone -o a.exr
    [[ $stderr == *"pickets"*"thinner than 1.25 voxels"*"casts nothing"* ]] || fail "$stderr"
    succeed bake fence.obj --size 32 --resolution 32 --sun 0.3,1,0.5 -o a.exr
    [[ $stderr != *"casts nothing"* ]] || fail "$stderr"
}

# The project's own golden bakes: every method, kind of caster and kind of output.
@test "the project's scenes bake as they did" {
    succeed regress "$BATS_TEST_DIRNAME/../golden"
    [ "$(grep -c ': alike$' <<<"$output")" -eq 15 ] || fail "not all cases"
}

# by_rays METHOD: a lone box by the method is lit, dark and open, and the file names the method's rays.
by_rays() {
    write_scene box.json box.obj '"sampler": "blue", "frame": 1'
    succeed bake box.json "${COARSE[@]}" --ao 0.5 --method "$1" --ao-method "$1" --rays 8 --quiet \
        --stats stats.json -o "$1.exr"
    grep -q '"rays": [1-9]' stats.json || fail "no rays: $(cat stats.json)"
    info_tells "$1.exr" "channel 'ao': min 1, mean 1, max 1" "channel 'shadow.sun': min 0, mean 0.5, max 1"
    grep -qx "vdbshade_shadow: $1, .*8 rays, blue, frame 1" <<<"$output" || fail "what rays of shadows?"
    grep -qx "vdbshade_ao: $1 within 0.5, .*8 rays, blue, frame 1" <<<"$output" || fail "what rays of AO?"
}

@test "methods by rays obey --rays, and --max-error chooses adaptive" {
    for method in rays adaptive exact; do
        by_rays $method
    done
    succeed bake box.obj "${SMALL[@]}" --ao 0.5 --max-error 0.05 --quiet -o asked.exr
    succeed bake box.obj "${SMALL[@]}" --ao 0.5 --max-error 0.05 --method adaptive --ao-method adaptive --quiet -o named.exr
    same_values asked.exr named.exr
}

@test "exact traces shapes, masks and level sets as well as meshes" {
    printf '{"casters": [{"sdf": {"shape": "torus", "radius": 0.6, "tube_radius": 0.2, "translate": [0, 2, 0]}}]}' >ring.json
    "$VDBSHADE" voxelize ring.json --resolution 48 --quiet -o ring.vdb
    write_bake mixed.json '{"mesh": "box.obj"}, {"sdf": {"shape": "sphere", "radius": 0.5, "translate": [0, 2, 0]}}, {"vdb": "ring.vdb"},
        {"mask": "'$ASSETS'/emblem.png", "size": 1, "thickness": 0.2}' \
        '"method": "exact"'
    succeed_saying "no voxels" "shadow exact" -- bake mixed.json
}

@test "--error bakes the estimated error, for methods that have one" {
    succeed bake box.obj "${SMALL[@]}" --ao 0.5 --method adaptive --ao-method cones --error --quiet -o out.exr
    info_tells out.exr "channel 'error.sun'"
    [[ $output != *"channel 'error.ao'"* ]] || fail "cones know no error"
    succeed bake box.obj "${SMALL[@]}" --ao 0.5 --method adaptive --ao-method adaptive --error --irradiance --quiet -o all.exr
    info_tells all.exr "11 channels" "'A'" "'ao'" "'error.ao'" "'error.sun'" "'irradiance.R'" "'shadow.sun'" # 8, and R, G and B
}
