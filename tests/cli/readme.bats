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

@test "the C of the README, and of the header that includes all, is that of examples/lightmap.c" {
    local examples=$BATS_TEST_DIRNAME/../../examples header=$BATS_TEST_DIRNAME/../../include/vdbshade/vdbshade.h
    bake=$(sed -n '/^static vsh_result bake(/,/^}/p' "$examples/lightmap.c")
    [ "$(block 1 "$README" | tail -n +2)" = "$bake" ] || fail "lightmap.c"
    [ "$(sed -nE '/^ \*     static vsh_result bake/,/^ \*     }/s/^ \*     ?//p' "$header" | sed 's|// \(.*\)|/* \1 */|')" = "$bake" ] ||
        fail "vdbshade.h"
}

# missing [TAG…]: what tools/setup asks for on a system where nothing is installed.
missing() {
    mkdir -p stubs
    printf '#!/bin/sh\nexit 1\n' | tee stubs/dpkg-query >stubs/sudo
    printf '#!/bin/sh\necho 1000\n' >stubs/id
    chmod +x stubs/*
    run env PATH="$PWD/stubs:$PATH" "$BATS_TEST_DIRNAME/../../tools/setup" "$@"
}

@test "the demo installs what building and baking take, and nothing of Python or tests" {
    local tools=$BATS_TEST_DIRNAME/../../tools package
    grep -qx 'tools/setup' "$tools/demo" || fail "tools/demo has another set-up"
    grep -qx 'tools/setup python test' "$tools/test" || fail "tools/test has another set-up"
    missing
    [ "$status" -eq 2 ] || fail "expected exit code 2"
    [[ $output == *" cmake "*" libopenvdb-dev "* ]] || fail "what building takes is missing"
    for package in slurmd chromium doxygen clang-tidy lintian bats libcmocka-dev python3-numpy gcovr; do
        [[ " $output " != *" $package "* ]] || fail "$package is installed"
    done
    missing python test
    for package in cmake slurmd chromium bats libcmocka-dev python3-numpy; do
        [[ " $output " == *" $package "* ]] || fail "$package is not installed"
    done
    missing pyton
    [[ $status -eq 2 && $output == *"no tag 'pyton'"* ]] || fail "a wrong tag is taken"
}
