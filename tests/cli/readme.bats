# What the README shows runs as it stands there.
load helper

README=$BATS_TEST_DIRNAME/../../README.md

setup() {
    cd "$BATS_TEST_TMPDIR" || return 1
    ln -s "$(cd "$ASSETS" && pwd)" assets
}

@test "every command of the README" {
    mkdir bin
    ln -s "$(realpath "$VDBSHADE")" bin/vdbshade
    # blocks of sh, with continued lines joined
    awk '/^ *```sh$/ { inside = 1; next } /^ *```$/ { inside = 0 } inside' "$README" |
        sed -e ':a' -e '/\\$/N; s/\\\n//; ta' | sed 's/^ *//' | grep '^vdbshade' >commands
    [ "$(wc -l <commands)" -ge 4 ] || fail "too few commands: $(cat commands)"
    while read -r command; do
        PATH=$PWD/bin:$PATH bash -c "$command" >/dev/null 2>err.txt || fail "$command: $(cat err.txt)"
    done <commands
    [ -s cloister.exr ] && [ -s cloister.png ] && [ -s seeds.exr ]
}

# block N FILE: the Nth block of C of a Markdown file.
block() {
    awk -v wanted="$1" '/^```c$/ { inside = ++n == wanted; next } /^```$/ { inside = 0 } inside' "$2"
}

@test "the C of the README, and of the header that includes all, is that of the examples" {
    local examples=$BATS_TEST_DIRNAME/../../examples header=$BATS_TEST_DIRNAME/../../include/vdbshade/vdbshade.h
    [ "$(block 2 "$README")" = "$(cat "$examples/points.c")" ] || fail "points.c"
    bake=$(sed -n '/^static vsh_result bake(/,/^}/p' "$examples/lightmap.c")
    [ "$(block 1 "$README" | tail -n +2)" = "$bake" ] || fail "lightmap.c"
    [ "$(sed -nE '/^ \*     static vsh_result bake/,/^ \*     }/s/^ \*     ?//p' "$header" | sed 's|// \(.*\)|/* \1 */|')" = "$bake" ] ||
        fail "vdbshade.h"
}
