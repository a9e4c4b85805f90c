# What a bake can give beside shadow and AO: bent normals, tints, ambient light; casters in layers.
load helper

@test "bent normals, tints and irradiance have channels of their own" {
    write_scene box.json box.obj '"tint": "quadratic"' '' '1, 1, 1'
    run -0 "$VDBSHADE" bake box.json --ao 0.5 --size 32 --resolution 32 --bent-normals world \
        --ambient 0.1,0.2,0.3 -o box.exr --quiet
    run -0 "$VDBSHADE" info box.exr
    for channel in shadow.sun ao irradiance.R irradiance.B bent.X bent.Y bent.Z tint.sun.R tint.sun.G tint.sun.B A; do
        [[ $output == *"'$channel'"* ]]
    done
    # nothing is beside a box: bent normals are those of its sides, of all six directions
    [[ $output == *"'bent.X': min -1, "*", max 1"* ]]
    # what is turned away from the sun has the ambient light
    [[ $output == *"'irradiance.B': min 0.3, "* ]]
}

@test "eight bits hold half of a bent normal and a half" {
    run -0 "$VDBSHADE" bake box.obj --ao 0.5 --size 32 --resolution 32 --bent-normals tangent \
        --pack R=bent.X,G=bent.Y,B=bent.Z --bits 8 -o box.png --quiet
    run -0 "$VDBSHADE" info box.png
    # out of the surface: (0, 0, 1)
    [[ $output == *"'R': min 0.501961, mean 0.501961, max 0.501961"* ]]
    [[ $output == *"'B': min 1, mean 1, max 1"* ]]
}

@test "the sky over a box is 1, 1/2 and 0, by option and scene" {
    options=(--size 64 --resolution 32 --quiet)
    run -0 "$VDBSHADE" bake box.obj --sky z "${options[@]}" --stats stats.json -o whole.exr
    run -0 "$VDBSHADE" info whole.exr
    [[ $output == *"'sky': min 0, "*", max 1"* ]]
    # method and error are told, of the channel and of outputs
    [[ $output =~ "vdbshade_sky: "(exact|adaptive)" over z, max error 0.02, sobol" ]] || fail "$output"
    grep -q '"name": "sky"' stats.json || fail "$(cat stats.json)"
    awk '/"sky": {/ { here = 1 } here && /"estimated_rmse"/ { exit !($2 + 0 <= 0.02 && $2 !~ /null/) }' stats.json ||
        fail "$(cat stats.json)"
    for sky in z -z; do
        printf '{"casters": [{"mesh": "box.obj"}], "resolution": 32, "sky": "%s",
                 "receivers": [{"mesh": "box.obj", "size": 64, "padding": 4, "output": "scene%s.exr"}]}' $sky $sky >scene.json
        run -0 "$VDBSHADE" bake scene.json --quiet
    done
    run -0 "$VDBSHADE" compare whole.exr scenez.exr
    run -1 "$VDBSHADE" compare whole.exr scene-z.exr
    refuses 2 "'up'" -- bake box.obj --sky up -o box.exr
    refuses 2 "AO over a horizon: method cones" -- bake box.obj --sky y --ao 1 --ao-method cones -o box.exr
}

@test "what does not go together is told" {
    refuses 2 "vdbshade: --bent-normals: there is no --ao" -- bake box.obj --sun 1,1,1 --bent-normals world -o box.exr
    refuses 2 "AO by taps knows no directions" -- bake box.obj --ao 1 --ao-method taps --bent-normals world -o box.exr
    refuses 2 "'up'" "world, tangent" -- bake box.obj --ao 1 --bent-normals up -o box.exr
    write_scene box.json box.obj '"tint": [0, 1, 1]'
    refuses 2 "box.json" "tint" -- bake box.json -o box.exr
    refuses 2 "expected three numbers of at least 0" -- bake box.obj --sun 1,1,1 --ambient -1,1,1 -o box.exr
}

# A wall over a floor, in one level set or in a layer, with its own voxels, or hard.
scene_of() {
    cat >"$1" <<JSON
{
    "casters": [
        {"sdf": {"shape": "plane", "half_size": [3, 3], "thickness": 0.5}},
        {"sdf": {"shape": "box", "half_size": [0.2, 1, 2], "translate": [0, 1, 0]}$2}
    ],
    "resolution": 96,
    $3
    "lights": [{"name": "sun", "type": "directional", "direction": [-1, 1.2, 0], "angle_deg": 20}],
    "receivers": [{"mesh": "$ASSETS/seeds_floor.obj", "size": 64, "output": "${1%.json}.exr"}]
}
JSON
}

mean() {
    "$VDBSHADE" info "$1" | sed -n "s/.*'shadow.sun'.*mean \([0-9.]*\),.*/\1/p"
}

@test "a layer casts as the casters in none do, harder or only for some lights where it says so" {
    scene_of one.json '' ''
    scene_of layer.json ', "layer": "wall"' '"layers": [{"name": "wall", "voxel_size": 0.05}],'
    scene_of hard.json ', "layer": "wall"' '"layers": [{"name": "wall", "softness": 0}],'
    scene_of none.json ', "layer": "wall"' '"layers": [{"name": "wall", "lights": []}],'
    scene_of named.json ', "layer": "wall"' '"layers": [{"name": "wall"}, {"name": "other"}],'
    sed -i 's/"angle_deg": 20/"angle_deg": 20, "layers": ["other"]/' named.json
    for scene in one layer hard none named; do
        run -0 "$VDBSHADE" bake "$scene.json" --quiet
    done
    # a layer for no light, and a light with another layer, are the same
    same_values none.exr named.exr
    awk -v a="$(mean one.exr)" -v b="$(mean layer.exr)" 'BEGIN {exit !(a > 0.3 && a < 0.9 && (a - b) ^ 2 < 0.01 ^ 2)}'
    awk -v a="$(mean hard.exr)" 'BEGIN {exit !(a > 0.3 && a < 0.9)}'
    [ "$(mean none.exr)" = 1 ] || [[ $("$VDBSHADE" info none.exr) == *"'shadow.sun': min 1"* ]] ||
        awk -v a="$(mean none.exr)" -v b="$(mean one.exr)" 'BEGIN {exit !(a > b + 0.05)}'
    info_tells layer.json "layer 'wall': combine multiply"
    refuses 2 "trade measures one field, not layers" -- trade layer.json -o trade.html
}
