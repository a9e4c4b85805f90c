# Channels beside shadow and AO: bent normals, tints, the sky, ambient light. And casters in layers.
load helper

@test "bent normals, tints and irradiance have channels of their own" {
    write_scene box.json box.obj '"tint": "quadratic"' '' '1, 1, 1'
    succeed bake box.json --ao 0.5 --size 32 --resolution 32 --bent-normals world \
        --ambient 0.1,0.2,0.3 -o box.exr --quiet
    # nothing hides the sky from a box, so bent normals are those of its sides; sides away from the sun have the ambient light
    info_tells box.exr "'A'" "'ao'" "'bent.X': min -1, " ", max 1" "'bent.Y'" "'bent.Z'" "'irradiance.B': min 0.3, " "'irradiance.R'" \
        "'shadow.sun'" "'tint.sun.B'" "'tint.sun.G'" "'tint.sun.R'"
}

@test "eight bits hold half of a bent normal and a half" {
    succeed bake box.obj --ao 0.5 --size 32 --resolution 32 --bent-normals tangent \
        --pack R=bent.X,G=bent.Y,B=bent.Z --bits 8 -o box.png --quiet
    succeed info box.png
    # out of the surface: (0, 0, 1)
    [[ $output == *"'R': min 0.501961, mean 0.501961, max 0.501961"* ]]
    [[ $output == *"'B': min 1, mean 1, max 1"* ]]
}

@test "the sky over a box is 1, 1/2 and 0, by option and scene" {
    options=(--size 64 --resolution 32 --quiet)
    succeed bake box.obj --sky z "${options[@]}" --stats stats.json -o whole.exr
    succeed_printing "'sky': min 0, " ", max 1" -- info whole.exr
    # image and statistics record method and error
    [[ $output =~ "vdbshade_sky: "(exact|adaptive)" over z, max error 0.02, sobol" ]] || fail "$output"
    grep -q '"name": "sky"' stats.json || fail "$(cat stats.json)"
    awk '/"sky": {/ { here = 1 } here && /"estimated_rmse"/ { exit !($2 + 0 <= 0.02 && $2 !~ /null/) }' stats.json ||
        fail "$(cat stats.json)"
    for sky in z -z; do
        printf '{"casters": [{"mesh": "box.obj"}], "resolution": 32, "sky": "%s",
                 "receivers": [{"mesh": "box.obj", "size": 64, "padding": 4, "output": "scene%s.exr"}]}' $sky $sky >scene.json
        succeed bake scene.json --quiet
    done
    succeed compare whole.exr scenez.exr
    ends 1 compare whole.exr scene-z.exr
    refuses 2 "'up'" -- bake box.obj --sky up -o box.exr
    refuses 2 "AO over a horizon: method cones" -- bake box.obj --sky y --ao 1 --ao-method cones -o box.exr
}

@test "channels without the options they need are refused" {
    write_scene box.json box.obj '"tint": [0, 1, 1]'
    refuse_each bake -o box.exr <<'LIST'
2 "vdbshade: --bent-normals: needs --ao DISTANCE" | box.obj --sun 1,1,1 --bent-normals world
2 "AO by taps has no directions" | box.obj --ao 1 --ao-method taps --bent-normals world
2 "'up'" "world, tangent" | box.obj --ao 1 --bent-normals up
2 box.json tint | box.json
2 "expected three numbers of at least 0" | box.obj --sun 1,1,1 --ambient -1,1,1
LIST
}

# scene_of NAME.json LAYER KEYS: a wall over a floor, in one level set or in a layer, with its own voxels, or hard.
scene_of() {
    write_bake "$1" '{"sdf": {"shape": "plane", "half_size": [3, 3], "thickness": 0.5}},
        {"sdf": {"shape": "box", "half_size": [0.2, 1, 2], "translate": [0, 1, 0]}'"$2}" "$3\"resolution\": 96" \
        '"mesh": "'"$ASSETS"'/seeds_floor.obj", "size": 64'
    sed -i 's/"direction": .*, "angle_deg": 5/"direction": [-1, 1.2, 0], "angle_deg": 20/' "$1"
}

@test "a layer casts as other casters do, unless its softness or lights differ" {
    scene_of one.json '' ''
    scene_of layer.json ', "layer": "wall"' '"layers": [{"name": "wall", "voxel_size": 0.05}],'
    scene_of hard.json ', "layer": "wall"' '"layers": [{"name": "wall", "softness": 0}],'
    scene_of none.json ', "layer": "wall"' '"layers": [{"name": "wall", "lights": []}],'
    for scene in one layer hard none; do
        succeed bake "$scene.json" --quiet
    done
    mean() {
        mean_of "$1.exr" shadow.sun
    }
    holds "$(mean one) > 0.3 && $(mean one) < 0.9 && ($(mean one) - $(mean layer)) ^ 2 < 0.01 ^ 2"
    holds "$(mean hard) > 0.3 && $(mean hard) < 0.9 && $(mean none) > $(mean one) + 0.05"
    info_tells layer.json "layer 'wall': combine multiply"
    refuses 2 "trade measures one field, not layers" -- trade layer.json -o trade.html
}
