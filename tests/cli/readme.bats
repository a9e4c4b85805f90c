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

@test "the C program of the README" {
    local build
    build=$(dirname "$(realpath "$VDBSHADE")")
    awk '/^```c$/ { inside = 1; next } /^```$/ { inside = 0 } inside' "$README" >main.c
    "${CC:-cc}" -std=c11 -Wall -Wextra -Werror ${CFLAGS-} -I"$BATS_TEST_DIRNAME/../../include" main.c -L"$build" \
        -lvdbshade -Wl,-rpath,"$build" -o main
    [ "$(./main)" = "0 1" ]
}
