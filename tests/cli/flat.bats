# flat: light maps of a plane.
load helper

prepare() {
    cp "$ASSETS/emblem.png" .
    old_output out.exr
    cat >wall.json <<'JSON'
{"region": [-2, -2, 2, 2], "size": 64, "padding": 0,
 "casters": [{"shape": "box", "half_size": [1.5, 0.1], "translate": [-1.5, 0.5]}],
 "lights": [{"name": "lamp", "type": "disc", "position": [0, 1.5], "radius": 0.2, "reach": 3, "color": [1, 0.5, 0]},
            {"name": "sun", "type": "directional", "direction": [0, 1], "angle_deg": 10}]}
JSON
}

@test "a map has shadow, light and coverage as its geometry says" {
    succeed flat wall.json -o out.exr --quiet
    # the wall covers 1.9 to 2.1 … of 16: x from -2 to 0 and 0.2 high, so 3 or 4 rows of 64, half of them
    holds "1 - $(mean_of out.exr A) < 0.032 && 1 - $(mean_of out.exr A) > 0.022"
    # under the sun lies the shadow of the left half, below the wall: 2.4 by 2 of 16, its edge at half light
    [[ $(values_of out.exr shadow.sun) == "0 0.6"[5678]*" 1" ]] || fail "$(values_of out.exr shadow.sun)"
    # no light of its own beyond the lamp's reach, and no blue in it
    [[ $(values_of out.exr irradiance.B) == *" 1" ]] || fail "$(values_of out.exr irradiance.B)"
    holds "$(values_of out.exr irradiance.R | cut -d' ' -f3) > 1.8 && $(values_of out.exr irradiance.R | cut -d' ' -f3) <= 2"
}

@test "options override the scene's keys" {
    succeed_saying "small.png: 32 × 16, 2 lights" -- flat wall.json -o small.png --size 32x16 --bits 8 --pack R=shadow.sun --stats stats.json
    info_tells small.png "32 × 16"
    grep -q '"texels": 512' stats.json
    sed -i 's/"padding": 0/"padding": 0, "output": "own.exr"/' wall.json
    succeed flat wall.json --quiet
    [ -s own.exr ]
    refuses 2 "region" "which 'vdbshade flat' bakes" -- info wall.json
}

# spoil FROM TO: bad.json, the scene with one thing changed.
spoil() {
    sed "s|$1|$2|" wall.json >bad.json
}

@test "a missing mask is refused with the caster's number" {
    spoil '"shape": "box", "half_size": \[1.5, 0.1\]' '"mask": "none.png", "size": 1'
    refuses 3 'casters[0]' none.png -- flat bad.json -o out.exr
    untouched out.exr
}

@test "flat scenes are sent to flat, and scenes with receivers to bake" {
    refuse_each <<'LIST'
2 seeds.json "vdbshade bake" | flat "$ASSETS/seeds.json" -o out.exr
2 wall.json:1 "vdbshade flat" | bake wall.json -o out.exr
2 wall.json:1 "vdbshade flat" | query wall.json --points points.csv --distance -o out.csv
LIST
    untouched out.exr
}

@test "maps over the memory limit are refused" {
    refuse_each flat wall.json -o <<'LIST'
4 out.exr | out.exr --size 8192 --memory-limit 64MiB
4 | out.exr --size 2048x64 --memory-limit 2MiB
LIST
    untouched out.exr
}

@test "flat does not replace a caster's picture" {
    spoil '"shape": "box", "half_size": \[1.5, 0.1\]' '"mask": "emblem.png", "size": 1'
    refuses 2 emblem.png -- flat bad.json -o emblem.png
    succeed flat bad.json -o out.exr
}
