# Every scene in docs/scene.md bakes.
load helper

: "${DOCS:=$BATS_TEST_DIRNAME/../../docs}"

setup() {
    cd "$BATS_TEST_TMPDIR" || return 1
    ln -s "$(cd "$ASSETS" && pwd)"/* .
    awk '/^```json$/ { name = sprintf("example%02d.json", ++n); inside = 1; next }
         /^```$/ { inside = 0 }
         inside { print > name }' "$DOCS/scene.md"
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
