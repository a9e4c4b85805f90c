# What is baked where no method is named, what is said of it, and what voxels lose.
load helper

setup() {
    cd "$BATS_TEST_TMPDIR" || return 1
    write_box box.obj
    write_fence fence.obj
}

# A board of one quad with UVs, and pickets a fiftieth of it thick.
write_fence() {
    {
        printf 'o board\nv -1 0 1\nv 1 0 1\nv 1 0 -1\nv -1 0 -1\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3 4/4\no pickets\n'
        local n=5
        for x in -0.8 -0.5 -0.2 0.1 0.4 0.7; do
            for z in 0 0.01; do
                for y in 0.1 0.9; do
                    printf 'v %s %s %s\nv %s %s %s\n' "$x" "$y" "$z" "$(awk "BEGIN{print $x+0.1}")" "$y" "$z"
                done
            done
            local a=$n b=$((n + 1)) c=$((n + 2)) d=$((n + 3)) e=$((n + 4)) f=$((n + 5)) g=$((n + 6)) h=$((n + 7))
            printf 'f %d/1 %d/1 %d/1 %d/1\n' "$b" "$a" "$c" "$d" "$e" "$f" "$h" "$g" "$a" "$b" "$f" "$e" \
                "$d" "$c" "$g" "$h" "$a" "$e" "$g" "$c" "$f" "$b" "$d" "$h"
            n=$((n + 8))
        done
    } >"$1"
}

# What the statistics say of "shadow" or "ao": method, max_error, estimated_rmse.
said() {
    sed -n "/\"$1\": {/,/}/s/.*\"$2\": \"\{0,1\}\([^\",]*\).*/\1/p" s.json
}

is_at_most() {
    awk "BEGIN {exit !($1 <= $2)}" || fail "$1 > $2"
}

@test "with nothing said meshes are baked by exact, and it is said" {
    succeed bake box.obj "${SMALL[@]}" --ao 0.5 --stats s.json -o a.exr
    [[ $stderr == *"shadow exact, AO exact, max error 0.02"* ]] || fail "$stderr"
    for kind in shadow ao; do
        [ "$(said $kind method)" = exact ] || fail "$(cat s.json)"
        is_at_most "$(said $kind estimated_rmse)" "$(said $kind max_error)"
    done
    succeed bake box.obj "${SMALL[@]}" --ao 0.5 --method exact --ao-method exact --quiet -o b.exr
    same_values a.exr b.exr
    info_tells a.exr "exact, max error 0.02, sobol"
    shade bake box.obj "${SMALL[@]}" --ao 0.5 --dry-run -o c.exr
    [[ $output == *"shadow exact, AO exact"* ]] || fail "$output"
}

@test "a level set alone is baked by adaptive" {
    printf '{"casters": [{"sdf": {"shape": "sphere", "radius": 0.5, "translate": [0, 2, 0]}}]}' >ball.json
    "$VDBSHADE" voxelize ball.json --resolution 24 --quiet -o ball.vdb
    cat >sphere.json <<'JSON'
{"casters": [{"vdb": "ball.vdb"}],
 "lights": [{"name": "sun", "type": "directional", "direction": [0, 1, 0], "angle_deg": 5}],
 "receivers": [{"mesh": "box.obj", "size": 16, "output": "a.exr"}]}
JSON
    succeed bake sphere.json --stats s.json
    [ "$(said shadow method)" = adaptive ] || fail "$(cat s.json)"
    [[ $stderr == *"shadow adaptive, max error 0.02"* ]] || fail "$stderr"
}

@test "an error that a limit of rays does not keep is told" {
    succeed bake fence.obj --size 64 --resolution 32 --sun 0.3,1,0.5 --sun-angle 20 --max-error 0.003 --rays 8 \
        --stats s.json -o a.exr
    [[ $stderr == *"above the limit of 0.003: 8 rays are too few"* ]] || fail "$stderr"
    is_at_most "$(said shadow max_error)" "$(said shadow estimated_rmse)"
    succeed bake fence.obj --size 64 --resolution 32 --sun 0.3,1,0.5 --sun-angle 20 --max-error 0.003 \
        --stats s.json -o a.exr
    [[ $stderr != *"above the limit"* ]] || fail "$stderr"
    is_at_most "$(said shadow estimated_rmse)" 0.003
}

@test "what voxels leave of an error is measured, told, and by exact not there" {
    succeed bake fence.obj --size 96 --resolution 32 --sun 0.3,1,0.5 --sun-angle 2 --method adaptive --max-error 0.01 \
        --stats s.json -o a.exr
    [[ $stderr == *"shadow: the estimated error is "*"above the limit of 0.01: "*"comes from voxels of"*"--method exact has none"* ]] ||
        fail "$stderr"
    [[ $stderr == *"estimated error: shadow "*"(the voxels' "* ]] || fail "$stderr"
    is_at_most 0.05 "$(said shadow estimated_rmse)"
    is_at_most 0.05 "$(said shadow field_rmse)"
    succeed bake fence.obj --size 96 --resolution 32 --sun 0.3,1,0.5 --sun-angle 2 --max-error 0.01 --stats s.json -o a.exr
    [[ $stderr != *"above the limit"* ]] || fail "$stderr"
    is_at_most "$(said shadow estimated_rmse)" 0.01
}

@test "any number of threads tells the same error" {
    local bake=(bake fence.obj --size 96 --resolution 32 --sun 0.3,1,0.5 --sun-angle 2 --method adaptive -o a.exr --quiet)
    shade "${bake[@]}" --stats whole.json
    succeed "${bake[@]}" --stats one.json --threads 1
    whole=$(sed -n '/"channels"/,/]/p' whole.json)
    [ -n "$whole" ] && [ "$whole" = "$(sed -n '/"channels"/,/]/p' one.json)" ] || fail "$whole $(cat one.json)"
}

@test "a fence that voxels lose is named, unless its triangles are traced" {
    succeed bake fence.obj --size 32 --resolution 32 --sun 0.3,1,0.5 --method cone -o a.exr
    [[ $stderr == *"pickets"*"thinner than 1.25 voxels"*"casts nothing"* ]] || fail "$stderr"
    succeed bake fence.obj --size 32 --resolution 32 --sun 0.3,1,0.5 -o a.exr
    [[ $stderr != *"casts nothing"* ]] || fail "$stderr"
}

# The project's own bakes: every method, kind of caster and kind of output, against what they were.
@test "the project's scenes bake as they did" {
    succeed regress "$BATS_TEST_DIRNAME/../golden" --all --cache "$BATS_TEST_TMPDIR/cache.json"
    [ "$(grep -c ': alike$' <<<"$output")" -eq 15 ] || fail "not all cases"
}
