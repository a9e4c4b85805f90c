# Invalid texels: pictures, counts and warnings of them; and bakes of nothing.
load helper

# Boxes a quarter above the one, and around it.
prepare() {
    awk '$1 == "v" { print "v", $2, $3 + 0.25, $4; next } { print }' box.obj >above.obj
    awk '$1 == "v" { print "v", 3 * $2 - 1, 3 * $3 - 1, 3 * $4 - 1; next } { print }' box.obj >around.obj
}

@test "--invalid and the channel show texels inside other solids, and one warning names them" {
    write_scene box.json box.obj '"invalid": true'
    succeed_saying "texels are invalid (inside a solid or behind a wall)" "--invalid" -- bake box.json --caster above.obj --ao 0.5 \
        --method exact --ao-method exact --size 64 --resolution 24 -o box.exr --invalid where.png --verbose
    succeed_printing "'invalid': min 0, " ", max 1" -- info box.exr
    info_tells where.png "64 × 64"
    [[ $output == *"'R'"*"'G'"*"'B'"* ]]
    no_leftovers
}

@test "texels in a solid without one side are invalid, and no warning calls them visible" {
    # A bar sticks out of the larger box through its wall. The box lacks the opposite side; a sheet stands before the gap.
    awk '$1 == "v" { print "v", $2, $3, 5 * $4; next } { print }' box.obj >bar.obj
    awk '/^o/ { print "o around"; next } /^f/ && left++ < 2 { next } { print }' around.obj >lacking.obj
    printf 'o sheet\nv -9 -9 -3\nv 9 -9 -3\nv 9 9 -3\nv -9 9 -3\nf 1 2 3 4\n' >sheet.obj
    write_scene bar.json bar.obj '"invalid": true'
    succeed bake bar.json --caster lacking.obj --caster sheet.obj --treat around=solid --ao 0.5 --size 64 --verbose -o bar.exr
    [[ $stderr == *"texels are invalid"* && $stderr != *"plain sight"* ]] || fail "claimed"
    succeed_printing "'invalid': min 0, " ", max 1" -- info bar.exr
}

@test "a bake with all texels inside solids is refused, and the old output stays" {
    old_output out.exr
    # an object around everything else is a sky dome, unless the user says that it is solid
    refuses 2 box.obj "inside solids" info -- \
        bake box.obj --caster around.obj --treat box=solid --ao 0.5 --method exact --ao-method exact --size 32 --resolution 24 -o out.exr
    untouched out.exr
}

@test "a bake of no texel is refused with the reason" {
    old_output out.exr
    sed 's/^vt .*/vt 0.5 0.5/' box.obj >flat.obj
    refuses 2 flat.obj "cover none of 32 × 32 texels" "no area" "--uv-set" -- bake flat.obj "${SMALL[@]}" -o out.exr
    awk '$1 == "vt" { print "vt", $2 + 2, $3; next } { print }' box.obj >far.obj
    refuses 2 far.obj "cover none of 32 × 32 texels" "leave the unit square" -- bake far.obj "${SMALL[@]}" -o out.exr
    untouched out.exr
}

@test "--invalid writes PNG only, and names its pictures apart if outputs have one name in several folders" {
    refuses 2 --invalid where.jpg .png -- bake box.obj "${SMALL[@]}" -o out.exr --invalid where.jpg
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

@test "a warning about charts closer than a texel names the size that parts them" {
    succeed bake box.obj "${SMALL[@]}" --size 16 -o out.exr
    [[ $stderr == *"charts lie closer than a texel"*"mesh 'box'"*"from --size 2"[56]" on"* ]] || fail "not told"
    succeed bake box.obj "${SMALL[@]}" --size 26 -o out.exr
    [[ $stderr != *"charts lie closer"* ]] || fail "told for no reason"
    # no size separates charts that touch
    sed 's/^vt 0.31 /vt 0.33 /; s/^vt 0.35 /vt 0.33 /' box.obj >touching.obj
    succeed_saying "they touch" "margin" -- bake touching.obj "${SMALL[@]}" --size 64 -o out.exr
}
