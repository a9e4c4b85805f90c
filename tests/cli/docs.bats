# Every scene in docs/scene.md and docs/flat.md bakes, and every command in docs/query.md, docs/view.md, docs/lit.md
# and docs/pipeline.md runs (blocks of sh; those of bash need a farm).
load helper

: "${DOCS:=$BATS_TEST_DIRNAME/../../docs}"

setup() {
    cd "$BATS_TEST_TMPDIR" || return 1
    ln -s "$(cd "$ASSETS" && pwd)"/* .
    awk '/^```json$/ { name = sprintf("example%02d.json", ++n); inside = 1; next }
         /^```$/ { inside = 0 }
         inside { print > name }' "$DOCS/scene.md"
}

# run_commands FILE LEAST: every command of docs/FILE runs; there are LEAST at least.
run_commands() {
    mkdir bin
    ln -s "$(realpath "$VDBSHADE")" bin/vdbshade
    ln -s "$(cd "$ASSETS" && pwd)" assets
    awk '/^```sh$/ { inside = 1; next } /^```$/ { inside = 0 } inside' "$DOCS/$1" >commands
    [ "$(grep -c vdbshade commands)" -ge "$2" ]
    while read -r command; do
        PATH=$PWD/bin:$PATH bash -c "set -o pipefail; $command" >/dev/null 2>err.txt || fail "$command: $(cat err.txt)"
    done <commands
}

@test "there are examples" {
    [ -e example01.json ]
}

@test "every example bakes, or voxelizes where it has no receivers" {
    for scene in example*.json; do
        if grep -q '"receivers"' "$scene"; then
            # Levels sets that an example names are made first.
            for vdb in $(grep -o '"vdb": *"[^"]*"' "$scene" | grep -o '[^"]*\.vdb'); do
                [ -e "$vdb" ] || "$VDBSHADE" voxelize seeds.json -o "$vdb" --voxel-size 0.1 --quiet
            done
            shade bake "$scene" --quiet
        else
            shade voxelize "$scene" -o "${scene%.json}.vdb" --quiet
        fi
        done_well || fail "$scene: $(cat "$scene")"
        for output in $(grep -o '"output": *"[^"]*"' "$scene" | sed 's/.*"\([^"]*\)"$/\1/'); do
            [ -s "$output" ] || fail "$scene: no $output"
        done
    done
}

@test "every flat scene of docs/flat.md" {
    awk '/^```json$/ { name = sprintf("flat%02d.json", ++n); inside = 1; next }
         /^```$/ { inside = 0 }
         inside { print > name }' "$DOCS/flat.md"
    [ -e flat02.json ]
    for scene in flat??.json; do
        shade flat "$scene" --quiet
        done_well || fail "$scene: $(cat "$scene")"
        [ -s "$(sed -n 's/.*"output": *"\([^"]*\)".*/\1/p' "$scene")" ] || fail "$scene: no output"
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

@test "every command of docs/lit.md" {
    run_commands lit.md 3
    for made in lit.glb preview.glb lit.gltf lit.bin lit.occlusion.png lit.exr; do
        [ -s "$made" ] || fail "no $made"
    done
}

@test "every command of docs/pipeline.md" {
    run_commands pipeline.md 5
}

@test "every command of docs/view.md" {
    run_commands view.md 11
    for made in both.html seeds.html view.png court.png baked.png shafts.exr; do
        [ -s "$made" ] || fail "no $made"
    done
}

# options_of FILE …: each option that is named there, once. Those of other programs are left out.
options_of() {
    grep -ohE -- '(^|[^[:alnum:]-])--[a-z][a-z0-9-]*' "$@" | grep -oE -- '--.*' | sort -u |
        grep -vxE -- '--(cflags|libs|install|stat|leak-check|preset|count|limit|runs|seconds|array|partition|retries|wd|wrap|kill-on-invalid-dep|build|component|prefix|static|test|exclude-libs)' # of CMake, pkg-config, git, tools/…
}

@test "the documents name every option of --help, and no other" {
    local command
    "$VDBSHADE" --help >help.txt
    for command in bake voxelize info trade query volume flat render compare regress unwrap view merge help; do
        "$VDBSHADE" "$command" --help >>help.txt
    done
    options_of help.txt >told.txt
    options_of "$DOCS"/*.md "$DOCS/../README.md" >named.txt
    [ "$(wc -l <told.txt)" -gt 100 ] || fail "too few: $(cat told.txt)"
    diff told.txt named.txt || fail "< only in --help, > only in the documents"
}

@test "the documents name functions and constants that the headers declare" {
    cat "$BATS_TEST_DIRNAME"/../../include/vdbshade/*.h | grep -oE '\b(vsh|VSH)_[A-Za-z0-9_]+' | sort -u >declared.txt
    # What CMake and the tests are told is left out.
    grep -ohE '\b(vsh|VSH)_[A-Za-z0-9_]*[A-Za-z0-9]\b' "$DOCS"/*.md "$DOCS/../README.md" |
        grep -vxE 'VSH_(CLAIMS|BITS|TESTS|WERROR|PYTHON|EMBREE|OIIO|DRACO|BENCH.*)' | sort -u >names.txt
    [ "$(wc -l <names.txt)" -gt 20 ] || fail "too few: $(cat names.txt)"
    comm -13 declared.txt names.txt >unknown.txt
    [ ! -s unknown.txt ] || fail "not in a header: $(cat unknown.txt)"
}
