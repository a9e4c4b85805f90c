# Every scene in docs/scene.md and docs/flat.md bakes, and every command in README.md, docs/query.md, docs/view.md, docs/lit.md and
# docs/pipeline.md runs (blocks of sh; those of bash need a farm). Those of docs/tutorial.md run in browser.bats.
load helper

prepare() {
    ln -s "$(cd "$ASSETS" && pwd)" assets
    ln -s assets/* .
}

# scenes_of FILE NAME: the blocks of JSON as NAME01.json and so on.
scenes_of() {
    awk -v name="$2" '/^```json$/ { file = sprintf("%s%02d.json", name, ++n); inside = 1; next }
        /^```$/ { inside = 0 }
        inside { print > file }' "$DOCS/$1"
}

@test "every scene of docs/scene.md and docs/flat.md bakes, or voxelizes where it has no receivers" {
    scenes_of scene.md bake
    scenes_of flat.md flat
    [ -e bake01.json ] && [ -e flat02.json ] || fail "no scenes"
    local scene command vdb output
    for scene in bake??.json flat??.json; do
        command=${scene:0:4}
        for vdb in $(grep -o '"vdb": *"[^"]*"' "$scene" | grep -o '[^"]*\.vdb'); do
            [ -e "$vdb" ] || "$VDBSHADE" voxelize seeds.json -o "$vdb" --voxel-size 0.1 --quiet
        done
        if [ $command = bake ] && ! grep -q '"receivers"' "$scene"; then
            succeed voxelize "$scene" -o "${scene%.json}.vdb" --quiet
        else
            succeed $command "$scene" --quiet
        fi
        for output in $(grep -o '"output": *"[^"]*"' "$scene" | sed 's/.*"\([^"]*\)"$/\1/'); do
            [ -s "$output" ] || fail "$scene: no $output"
        done
    done
}


@test "every command of docs/query.md" {
    printf '0.5,0.001,0.5,0,1,0\n-1,0.001,1,0,1,0\n' >points.csv
    printf 'ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n' >props.ply
    printf 'property float nx\nproperty float ny\nproperty float nz\nend_header\n0 0.1 0 0 1 0\n' >>props.ply
    "$VDBSHADE" volume seeds.json --box -1,0,-1,1,1,1 --box-voxel-size 0.2 -o fog.vdb --quiet
    sed "s/fog.vdb:density/fog.vdb:ao/" "$DOCS/query.md" >query.md
    DOCS=. run_commands query.md 6
    [ -s shaded.csv ] && [ -s props-lit.ply ] && [ "$(wc -l <sorted.csv)" -eq 2 ]
    for made in band box lit; do
        "$VDBSHADE" info $made.vdb | grep -q "grid 'shadow.sun'" || fail "$made.vdb"
    done
}

# made FILE …
made() {
    empty=$(find "$@" -empty) && [ -z "$empty" ] || fail "not all of $*"
}

@test "every command of the README and of docs/lit.md, docs/pipeline.md and docs/view.md" {
    run_commands lit.md 3
    made lit.glb preview.glb lit.gltf lit.bin lit.occlusion.png lit.exr mask.png probes.png
    run_commands pipeline.md 5
    run_commands view.md 11
    made both.html seeds.html view.png court.png baked.png shafts.exr
    ONLY='^vdbshade' DOCS=$BATS_TEST_DIRNAME/../.. run_commands README.md 4
    made cloister.exr cloister.png seeds.exr
}

# options_of FILE …: lists each option in the files once, without those of other programs.
options_of() {
    grep -ohE -- '(^|[^[:alnum:]-])--[a-z][a-z0-9-]*' "$@" | grep -oE -- '--.*' | sort -u |
        grep -vxE -- '--(cflags|libs|install|stat|leak-check|preset|count|limit|runs|seconds|array|partition|retries|wd|wrap|kill-on-invalid-dep|build|component|prefix|static|test|exclude-libs|system-site-packages|python)' # of CMake, pkg-config, git, Python, Blender, tools/…
}

@test "the documents name every option of --help, and no other" {
    local command
    "$VDBSHADE" --help >help.txt
    for command in $(sed -n '/^Commands:/,/^$/s/^  \([a-z]*\) .*/\1/p' help.txt); do
        "$VDBSHADE" "$command" --help >>help.txt
    done
    options_of help.txt >told.txt
    options_of "$DOCS"/*.md "$DOCS/../README.md" >named.txt
    [ "$(wc -l <told.txt)" -gt 100 ] || fail "too few: $(cat told.txt)"
    diff told.txt named.txt || fail "< only in --help, > only in the documents"
}

@test "the documents name functions and constants that the headers declare" {
    cat "$BATS_TEST_DIRNAME"/../../include/vdbshade/*.h | grep -oE '\b(vsh|VSH)_[A-Za-z0-9_]+' | sort -u >declared.txt
    # Variables of CMake and of the tests are left out.
    grep -ohE '\b(vsh|VSH)_[A-Za-z0-9_]*[A-Za-z0-9]\b' "$DOCS"/*.md "$DOCS/../README.md" |
        grep -vxE 'VSH_(CLAIMS|BITS|TESTS|WERROR|PYTHON|EMBREE|OIIO|DRACO|BENCH.*)' | sort -u >names.txt
    [ "$(wc -l <names.txt)" -gt 20 ] || fail "too few: $(cat names.txt)"
    comm -13 declared.txt names.txt >unknown.txt
    [ ! -s unknown.txt ] || fail "not in a header: $(cat unknown.txt)"
}

@test "the C of the README, and of the header that includes all, is that of examples/lightmap.c" {
    local examples=$BATS_TEST_DIRNAME/../../examples header=$BATS_TEST_DIRNAME/../../include/vdbshade/vdbshade.h
    bake=$(sed -n '/^static vsh_result bake(/,/^}/p' "$examples/lightmap.c")
    [ "$(blocks_of c "$DOCS/../README.md" | tail -n +2)" = "$bake" ] || fail "lightmap.c"
    [ "$(sed -nE '/^ \*     static vsh_result bake/,/^ \*     }/s/^ \*     ?//p' "$header" | sed 's|// \(.*\)|/* \1 */|')" = "$bake" ] ||
        fail "vdbshade.h"
}

# installs PURPOSE PACKAGE … -- PACKAGE …: on an empty system tools/setup asks for the first packages, and not for the others.
installs() {
    local package wanted=1 asked
    run env PATH="$PWD/stubs:$PATH" "$BATS_TEST_DIRNAME/../../tools/setup" "$1"
    [ "$status" -eq 2 ] || fail "expected exit code 2"
    for package in "${@:2}"; do
        [ "$package" != -- ] || { wanted=0 && continue; }
        asked=0
        [[ " $output " != *" $package "* ]] || asked=1
        [ $asked -eq $wanted ] || fail "$1: $package"
    done
}

@test "the demo installs what building and baking need; only the thorough tests need browsers, Slurm and clang-tidy" {
    local thorough=(slurmd chromium doxygen clang-tidy lintian gcovr) tests=(bats libcmocka-dev python3-numpy)
    mkdir stubs
    printf '#!/bin/sh\nexit 1\n' | tee stubs/dpkg-query >stubs/sudo
    printf '#!/bin/sh\necho 1000\n' >stubs/id
    chmod +x stubs/*
    grep -qx 'tools/setup run' "$BATS_TEST_DIRNAME/../../tools/demo" || fail "tools/demo has another set-up"
    installs run cmake libopenvdb-dev -- "${tests[@]}" "${thorough[@]}"
    installs test cmake "${tests[@]}" -- "${thorough[@]}"
    installs all cmake "${tests[@]}" "${thorough[@]}"
    installs tests
    [[ $output == *"unknown purpose 'tests'"* ]] || fail "a wrong purpose is taken"
}
