# Texels that are not valid: shown, counted and told of; and bakes of nothing.
load helper

# Boxes a quarter above the one, and around it.
prepare() {
    awk '$1 == "v" { print "v", $2, $3 + 0.25, $4; next } { print }' box.obj >above.obj
    awk '$1 == "v" { print "v", 3 * $2 - 1, 3 * $3 - 1, 3 * $4 - 1; next } { print }' box.obj >around.obj
}

@test "a picture and a channel show the texels that are in another solid, and one line tells of them" {
    write_scene box.json box.obj '"invalid": true'
    succeed_saying "texels are invalid (inside a solid or behind a wall)" "--invalid" -- bake box.json --caster above.obj --ao 0.5 \
        --method exact --ao-method exact --size 64 --resolution 24 -o box.exr --invalid where.png --verbose
    succeed_printing "'invalid': min 0, " ", max 1" -- info box.exr
    info_tells where.png "64 × 64"
    [[ $output == *"'R'"*"'G'"*"'B'"* ]]
    no_leftovers
}

@test "texels in a solid that lacks a side are 1 in the channel, and no line says that they are seen" {
    # A bar sticks out of the larger box through its wall. The box lacks the opposite side; a sheet stands before the gap.
    awk '$1 == "v" { print "v", $2, $3, 5 * $4; next } { print }' box.obj >bar.obj
    awk '/^o/ { print "o around"; next } /^f/ && left++ < 2 { next } { print }' around.obj >lacking.obj
    printf 'o sheet\nv -9 -9 -3\nv 9 -9 -3\nv 9 9 -3\nv -9 9 -3\nf 1 2 3 4\n' >sheet.obj
    write_scene bar.json bar.obj '"invalid": true'
    succeed bake bar.json --caster lacking.obj --caster sheet.obj --treat around=solid --ao 0.5 --size 64 --verbose -o bar.exr
    [[ $stderr == *"texels are invalid"* && $stderr != *"plain sight"* ]] || fail "claimed"
    succeed_printing "'invalid': min 0, " ", max 1" -- info bar.exr
}

@test "a bake whose every texel is in a solid is refused, and the old output stays" {
    old_output out.exr
    # what everything else lies within is a sky dome, unless it is said to be solid
    refuses 2 box.obj "inside solids" info -- \
        bake box.obj --caster around.obj --treat box=solid --ao 0.5 --method exact --ao-method exact --size 32 --resolution 24 -o out.exr
    untouched out.exr
}

@test "a bake of no texel is refused: UVs without area, or all outside the square" {
    old_output out.exr
    sed 's/^vt .*/vt 0.5 0.5/' box.obj >flat.obj
    refuses 2 flat.obj "cover none of 32 × 32 texels" "no area" "--uv-set" -- bake flat.obj "${SMALL[@]}" -o out.exr
    awk '$1 == "vt" { print "vt", $2 + 2, $3; next } { print }' box.obj >far.obj
    refuses 2 far.obj "cover none of 32 × 32 texels" "leave the unit square" -- bake far.obj "${SMALL[@]}" -o out.exr
    untouched out.exr
}

@test "the picture is a PNG" {
    refuses 2 --invalid where.jpg .png -- bake box.obj "${SMALL[@]}" -o out.exr --invalid where.jpg
}

@test "pictures of outputs of one name in several folders have names of their own" {
    mkdir a b
    local output outputs=()
    for output in a/wall.exr b/wall.exr; do
        outputs+=("{\"mesh\": \"box.obj\", \"size\": $((32 + 8 * ${#outputs[@]})), \"output\": \"$output\"}")
    done
    (IFS=, && echo "{\"casters\": [{\"mesh\": \"box.obj\"}], \"ao\": {\"distance\": 1}, \"receivers\": [${outputs[*]}]}") >walls.json
    succeed bake walls.json --invalid where.png
    info_tells where.0.wall.png "32 × 32"
    info_tells where.1.wall.png "40 × 40"
}

@test "charts closer than a texel are told of, and from which size on they are apart" {
    succeed bake box.obj "${SMALL[@]}" --size 16 -o out.exr
    [[ $stderr == *"charts lie closer than a texel"*"mesh 'box'"*"from --size 2"[56]" on"* ]] || fail "not told"
    succeed bake box.obj "${SMALL[@]}" --size 26 -o out.exr
    [[ $stderr != *"charts lie closer"* ]] || fail "told for no reason"
    # no size parts charts that touch
    sed 's/^vt 0.31 /vt 0.33 /; s/^vt 0.35 /vt 0.33 /' box.obj >touching.obj
    succeed_saying "they touch" "margin" -- bake touching.obj "${SMALL[@]}" --size 64 -o out.exr
}

@test "with nothing said rays decide what is valid, as with exact, and voxels do not" {
    options=(--caster above.obj --sun 0.3,1,0.2 --ao 0.5 --size 64 --quiet)
    succeed bake box.obj "${options[@]}" --resolution 8 -o auto.exr
    succeed bake box.obj "${options[@]}" --resolution 8 --method exact --ao-method exact -o exact.exr
    same_values auto.exr exact.exr
    succeed bake box.obj "${options[@]}" --resolution 64 -o finer.exr
    succeed_printing "A: alike; " " covered, 0 in one alone" -- compare auto.exr finer.exr
}
