# voxelize: level sets of meshes and scenes; solids, rooms and open meshes, detected or named; AO beside studs.
load helper

# A box whose faces look inwards, and one that lacks a side.
prepare() {
    sed -E 's/^f ([^ ]*) ([^ ]*) ([^ ]*)/f \1 \3 \2/' box.obj >room.obj
    sed '$d' box.obj | sed '$d' >crate.obj
}

@test "meshes and scenes become a level set of the voxel size, resolution along the longest side and band asked for" {
    succeed_saying "out.vdb: voxel 0.04, " "active voxels" -- voxelize box.obj -o out.vdb --voxel-size 0.04 --half-width 5
    succeed_printing "grid 'surface'" "voxel size: 0.04 0.04 0.04" "(5 voxels)" -- info out.vdb
    succeed voxelize box.obj -o out.vdb --resolution 50 --quiet
    info_tells out.vdb "voxel size: 0.02 0.02 0.02"
    succeed voxelize "$ASSETS/seeds.json" -o seeds.vdb --voxel-size 0.1 --quiet
    info_tells seeds.vdb "class: level set"
}

@test "FILE.vdb:GRID names a grid wherever a .vdb is read; a file of that whole name is the file" {
    "$VDBSHADE" voxelize box.obj -o box.vdb --name hull --voxel-size 0.1 --quiet
    printf '0.1,0.2,2\n0,3,0\n' >points.csv
    write_floor floor.obj
    for grid in box.vdb box.vdb:hull box.vdb:other; do
        printf '{"casters": [{"vdb": "%s"}], "lights": [{"name": "sun", "type": "directional", "angle_deg": 1, "direction": [0, 1, 0]}],
            "receivers": [{"mesh": "floor.obj", "size": 8, "output": "scene.exr"}]}' $grid >scene.json
        for command in "query $grid --points points.csv --distance -o out.csv" "voxelize $grid -o out.vdb" \
            "volume $grid --sun 0,1,0 -o out.vdb" "render $grid --sun 0,1,0 --size 32x32 -o out.png" "info $grid" \
            "query scene.json --points points.csv -o out.csv" "bake scene.json" \
            "bake floor.obj --caster $grid --sun 0,1,0 --size 8 -o out.exr"; do
            rm -f out.*
            # shellcheck disable=SC2086
            shade $command
            if [ $grid = box.vdb:other ]; then
                refused 2 box.vdb "no grid 'other'; it holds 'hull'"
            else
                [ "$status" -eq 0 ] || fail "$command: $stderr"
            fi
        done
    done
    refuses 3 no.vdb -- query no.vdb:hull --points points.csv --distance -o out.csv
    mv box.vdb 'a.vdb:hull.vdb'
    succeed query a.vdb:hull.vdb --points points.csv --distance -o out.csv
    succeed query a.vdb:hull.vdb:hull --points points.csv --distance -o out.csv
}

@test "info says whether objects are solids, rooms or open" {
    info_tells box.obj "taken for: 1 solid"
    info_tells room.obj "taken for: 1 wall with air in front of faces"
    info_tells crate.obj "taken for: 1 open solid," "problem: 4 open edges"
}

# A slab of 6 × 6, and 25 studs without bottoms on it, 6 cm wide and 9 cm high.
write_studs() {
    {
        printf 'o floor\nv -3 0 -3\nv 3 0 -3\nv 3 0 3\nv -3 0 3\nv -3 -1 -3\nv 3 -1 -3\nv 3 -1 3\nv -3 -1 3\n'
        printf 'vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 4/4 3/3 2/2\nf 5/1 6/1 7/1 8/1\n'
        printf 'f 1/1 2/1 6/1 5/1\nf 2/1 3/1 7/1 6/1\nf 3/1 4/1 8/1 7/1\nf 4/1 1/1 5/1 8/1\no studs\n'
        awk 'BEGIN {
            n = 9
            for (i = 0; i < 25; ++i) {
                x = -2.43 + int(i / 5) * 1.19; z = -2.37 + i % 5 * 1.17
                for (y = 0; y < 2; ++y) for (k = 0; k < 4; ++k)
                    print "v", x + (k == 1 || k == 2 ? 0.06 : 0), y * 0.1 - 0.01, z + (k > 1 ? 0.06 : 0)
                print "f", n + 7, n + 6, n + 5, n + 4
                for (k = 0; k < 4; ++k) print "f", n + k, n + 4 + k, n + 4 + (k + 1) % 4, n + (k + 1) % 4
                n += 8
            }
        }'
    } >"$1"
}

@test "AO between texels keeps the contacts of studs thinner than a voxel" {
    write_studs studs.obj
    for spacing in 1 8; do
        write_scene studs.json studs.obj '' "\"objects\": \"floor\", \"ao_spacing\": $spacing"
        succeed bake studs.json --resolution 16 --ao 0.3 --size 384 -o $spacing.exr
    done
    shade compare 1.exr 8.exr
    local largest
    largest=$(sed -nE 's/^ao:.* max ([0-9.]+) at.*/\1/p' <<<"$output")
    awk -v largest="$largest" 'BEGIN { exit !(largest > 0 && largest < 0.175) }' || fail "off by $largest"
}

@test "--treat overrides detection, and an unknown name is refused with the names there are" {
    succeed_saying "baked as a shell" -- voxelize crate.obj --verbose -o crate.vdb --resolution 32
    succeed_saying "closed over the holes" -- voxelize crate.obj --verbose -o crate.vdb --resolution 32 --treat '*=solid'
    succeed_saying "baked as a shell" -- voxelize box.obj --verbose -o shell.vdb --resolution 32 --treat 'b*=sheet' --treat 'box=sheet'
    succeed_saying "triangles that face the other way" -- voxelize box.obj --verbose -o wall.vdb --resolution 32 --treat box=room
    refuses 2 "no object is named 'bix'" -- voxelize box.obj -o out.vdb --treat 'bix=solid'
    [[ $stderr == *"did you mean 'box'"* ]] || fail "no name"
    [ ! -e out.vdb ] || fail "written all the same"
    refuses 2 "no object is named 'none*'" -- bake box.obj -o out.exr --ao 1 --treat 'none*=room'
}

@test "keys of a scene's casters override detection" {
    cat >scene.json <<'JSON'
{"casters": [{"mesh": "crate.obj", "solid": "box"}, {"mesh": "box.obj", "shell": ["b*"], "inward": ["box"],
  "transform": {"translate": [3, 0, 0]}}],
 "resolution": 32}
JSON
    succeed_saying "closed over the holes" -- voxelize scene.json --verbose -o out.vdb
    [[ $stderr == *"face the other way"* ]] || fail "not inward: $stderr"
    sed -i 's/"solid": "box"/"solid": "bax"/' scene.json
    refuses 2 "no object is named 'bax'" -- voxelize scene.json -o out.vdb
}
