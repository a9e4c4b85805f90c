# The project's own bakes: every method, kind of caster and kind of output, against what they were.
load helper

@test "the project's scenes bake as they did" {
    shade regress "$BATS_TEST_DIRNAME/../golden" --all --cache "$BATS_TEST_TMPDIR/cache.json"
    done_well
    [ "$(grep -c ': alike$' <<<"$output")" -eq 15 ] || fail "not all cases"
}
