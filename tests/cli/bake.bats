# bake: its images, statistics, messages and dry run; and any number of threads, for all commands.
load helper

SUN=(--sun 0.3,1,0.2 --sun-angle 5)

@test "any number of threads writes the same bytes" {
    ln -s "$ASSETS"/* .
    cat >casters.json <<JSON
{"casters": [{"text": "vdb", "font": "$FONT", "height": 1.5, "thickness": 0.3, "transform": {"rotate_deg": [90, 0, 0], "translate": [0, 1, 0]}},
             {"mask": "emblem.png", "size": 1, "thickness": 0.2, "transform": {"translate": [0, 0.5, -1]}}], "voxel_size": 0.04,
 "lights": [{"name": "sun", "type": "directional", "direction": [0, 1, 0.2], "angle_deg": 5}],
 "receivers": [{"mesh": "seeds_floor.obj", "size": 64, "output": "casters.exr"}]}
JSON
    sed 's/"casters": \[/&{"heightfield": "terrain.png", "size": [10, 10], "height": 2, "direct": true}, /' casters.json >terrain.json
    cat >flat.json <<JSON
{"region": [-3, -1, 3, 2], "size": [96, 48], "supersample": 2,
 "casters": [{"text": "vdbshade", "font": "$FONT", "height": 1, "align": "center"},
             {"mask": "emblem.png", "size": 1, "translate": [2, 1.2], "rotate_deg": 20}],
 "lights": [{"name": "lamp", "type": "disc", "position": [0, 1.5], "radius": 0.2, "reach": 3},
            {"name": "torch", "type": "spot", "position": [-3, 1], "direction": [1, -0.2], "radius": 0.1, "inner_deg": 10, "outer_deg": 20}]}
JSON
    local command out threads
    while read -r out command; do
        for threads in 1 2 5; do
            # shellcheck disable=SC2086 # words
            succeed $command --threads $threads --quiet -o "$threads.$out"
            cmp "1.$out" "$threads.$out" || fail "$threads threads: $command"
        done
    done <<LIST
cloister.exr bake cloister.glb --sun -0.5,0.8,-0.6 --sun-angle 5 --ao 0.6 --irradiance --size 128 --resolution 96
casters.exr bake casters.json
hard.exr bake terrain.json --method hard --ao 1
lit.glb bake $MODELS/scene.glb ${SMALL[*]} --ao 1
letters.vdb voxelize casters.json
flat.exr flat flat.json
atlas.obj unwrap smooth.glb --size 256
picture.png render box.obj ${SUN[*]} --ao 0.5 --shafts 0.5 --size 40x24 --samples 1 --resolution 24
mesh.html view box.obj
scene.html view casters.json
LIST
}

@test "an image has the channels that the options ask for, named by light, and no others" {
    succeed bake box.obj "${SMALL[@]}" --ao 1 --irradiance --quiet -o out.exr
    info_tells out.exr "32 × 32, 9 channels" "'A'" "'ao'" "'irradiance.B'" "'irradiance.G'" "'irradiance.R'" "'shadow.sun'" "vdbshade_rgb: irradiance"
    succeed bake box.obj --ao 1 --size 64x16 --resolution 24 --quiet -o out.exr
    info_tells out.exr "64 × 16, 5 channels"
    succeed bake box.obj --ao 1 "${COARSE[@]}" --pack channels --quiet -o out.exr
    info_tells out.exr "2 channels"
    succeed bake box.obj "${SMALL[@]}" --ao 1 --pack R=shadow.sun,G=ao,B=0,A=A --bits 8 --quiet -o out.png
    info_tells out.png "32 × 32, 4 channels" "channel 'B': min 0, mean 0, max 0"
}

@test "the statistics have every key" {
    succeed bake box.obj "${SMALL[@]}" --method cone --ao 1 --ao-method cones --quiet --stats stats.json --threads 2 -o out.exr
    for key in version stages_s load voxelize field bake write texels invalid_texels samples marches \
        certified unfinished skipped rays peak_bytes threads voxel_size levels field_bytes field_bytes_per_voxel active_voxels; do
        grep -q "\"$key\":" stats.json || fail "$key is missing"
    done
    local share="$(number_in stats.json field_bytes) / $(number_in stats.json active_voxels) / $(number_in stats.json field_bytes_per_voxel)"
    holds "$share > 0.999 && $share < 1.001"
    [ "$(number_in stats.json rays) $(number_in stats.json threads)" = "0 2" ] || fail "$(cat stats.json)"
    ! grep -q '"\(texels\|marches\|active_voxels\|peak_bytes\)": 0,' stats.json || fail "a count is 0: $(cat stats.json)"
}

@test "the summary names the output, the texels and the stages" {
    succeed bake box.obj "${SMALL[@]}" -o out.exr
    [ -z "$output" ] || fail "something on standard output"
    says "out.exr: 32 × 32, " " texels" load voxelize field bake write
    [[ $stderr != *%* ]] || fail "progress without a terminal"
    # progress on request
    succeed bake box.obj "${SMALL[@]}" --ao 1 --progress -o out.exr
    for stage in load charts voxelize field bake ao padding write; do
        [[ $stderr == *"vdbshade: $stage "*%* ]] || fail "no $stage"
    done
}

# terminal COLUMNS ARG …: prints the program's output to a terminal of that width, a line for each line that it begins or rewrites.
terminal() {
    script -qec "stty cols $1; exec $(printf '%q ' "$VDBSHADE" "${@:2}")" /dev/null | tr '\r' '\n'
}

@test "a terminal shows a bar with percent and time left that fits, and colours unless NO_COLOR or TERM=dumb" {
    local -x TERM=xterm columns
    for columns in 100 30; do
        VDBSHADE=timeout terminal $columns -s INT $((3 * ${VSH_SLOWER:-1})) "$VDBSHADE" bake "$ASSETS/cloister.glb" --ao 0.6 --max-error 0.005 --size 2048 -o out.exr | sed -n 's/^\x1b\[K//; / %/p' >$columns
        awk -v columns=$columns 'length >= columns || /left/ && !begun { exit 1 } { begun = 1 }' $columns || fail "$(cat $columns)"
    done
    ! terminal 100 bake "$ASSETS/cloister.glb" --ao 0.6 --size 1024 -o out.exr --dry-run | grep '%[a-z]' || fail "results on the bar"
    grep -qE '^vdbshade: \[##* *\] bake [0-9]+ %, about [0-9]+ (s|min) left$' 100 || fail "$(cat 100)"
    grep -q '^vdbshade: bake [0-9]* %, about' 30 || fail "$(cat 30)"
    [[ $(terminal 100 info none.obj) == $'\033[31mvdbshade: '* && $(NO_COLOR=1 terminal 100 info none.obj) == vdbshade* &&
        $(TERM=dumb terminal 100 bake box.obj "${SMALL[@]}" -o out.exr) != *[%$'\033']* ]] || fail "colours"
    [[ $(TERM=dumb VDBSHADE=timeout terminal 100 -s INT $((2 * ${VSH_SLOWER:-1})) "$VDBSHADE" bake box.obj --ao 1 --size 8192 --supersample 8 -o out.exr) =~ \
        ^[^$'\033']*interrupted[^$'\033']*$ ]] || fail "an interrupt"
}

@test "an open mesh, overlapping charts and UVs outside the square are reported with the mesh's name" {
    sed -e '$d' -e 's/^vt 0.35 0.02/vt 0.05 0.02/' -e 's/^vt 0.97 0.97/vt 1.2 0.97/' box.obj >bad.obj
    succeed_saying "note: " "box" "open edges" -- bake bad.obj "${SMALL[@]}" --size 128 --verbose -o out.exr
    [[ $stderr == *"warning: "*"box"*"lie over other charts"* && $stderr == *"warning: "*"box"*"leave the UV square"* ]] || fail "no charts"
    [ "$(grep -c 'overlap other' <<<"$stderr")" -eq 0 ] || fail "overlaps are told twice"
}

@test "a scene's receivers are all baked, flags override it, and those that do not fit it are refused" {
    cat >two.json <<'JSON'
{"casters": [{"mesh": "box.obj"}, {"sdf": {"shape": "sphere", "radius": 0.5, "translate": [0, 2, 0]}}],
 "ao": {"distance": 1}, "resolution": 24, "lights": [{"name": "lamp", "type": "sphere", "position": [3, 4, 0], "radius": 0.3}],
 "receivers": [{"mesh": "box.obj", "size": 16, "output": "a.exr"},
               {"mesh": "box.obj", "size": 16, "output": "b.exr"}]}
JSON
    refuses 2 two.json -- bake two.json -o out.exr
    refuses 2 --sun -- bake two.json --sun 0,1,0
    [ -z "$(find . -name '*.exr')" ] || fail "something is written"
    succeed bake two.json --size 24 --method smooth --quiet
    cmp a.exr b.exr
    info_tells a.exr "24 × 24, 6 channels" "shadow.lamp"
}

# receiver NAME KEYS: the seeds' scene, coarse, on that receiver.
receiver() {
    sed "s/0\.02,/0.06,/; s|\"mesh\": \"seeds_floor.obj\", \"size\": 512, \"output\": \"seeds.exr\"|$2, \"size\": 48, \"output\": \"$1.exr\"|" \
        "$ASSETS/seeds.json" >"$1.json"
    succeed bake "$1.json" --quiet
}

@test "a plane receives as its mesh does, also with a normal or a transform" {
    receiver mesh "\"mesh\": \"$ASSETS/seeds_floor.obj\""
    receiver plane '"plane": {"size": [5, 5]}'
    same mesh.exr plane.exr
    # a wall that faces +x, turned up by its transform
    receiver wall '"transform": {"rotate_deg": [0, 0, 90]}, "plane": {"size": [5, 5], "normal": [2, 0, 0], "center": [0, 0, 0]}'
    "$VDBSHADE" compare mesh.exr wall.exr || fail "another wall"
    printf 'v -2 0 1\nv 2 0 1\nv 2 4 1\nv -2 4 1\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nvn 0 0 1\nf 1/1/1 2/2/1 3/3/1 4/4/1\n' >quad.obj
    receiver quad '"mesh": "quad.obj"'
    receiver facing '"plane": {"size": [4, 4], "normal": [0, 0, 1], "center": [0, 2, 1]}'
    "$VDBSHADE" compare quad.exr facing.exr || fail "another facing"
}

@test "--floor receives for casters without receivers, also in trade" {
    shade voxelize box.obj -o box.vdb --voxel-size 0.1 --quiet
    refuses 2 box.vdb --floor 'vdbshade volume' -- bake box.vdb --sun 1,2,1 -o floor.exr
    succeed bake box.vdb --sun 1,2,1 --sun-angle 5 --floor 6,6,0,-1,0 --size 32 --quiet -o floor.exr
    local scene='"casters": [{"vdb": "box.vdb"}], "voxel_size": 0.1, "lights": [{"name": "sun", "type": "directional", "direction": [1, 2, 1], "angle_deg": 5}]'
    echo "{$scene}" >bare.json
    echo "{$scene, \"receivers\": [{\"plane\": {\"size\": [6, 6], \"center\": [0, -1, 0]}, \"size\": 32, \"output\": \"scene.exr\"}]}" >scene.json
    refuses 2 bare.json --floor -- bake bare.json -o bare.exr
    succeed bake bare.json --floor 6,6,0,-1,0 --size 32 --quiet -o bare.exr
    succeed bake scene.json --quiet
    same_values bare.exr scene.exr || fail "the option and the key differ"
    refuses 2 --floor plane -- bake scene.json --floor 6,6 -o other.exr
    refuses 2 box.vdb --floor -- trade box.vdb --sun 1,2,1 -o trade.html
    succeed trade box.vdb --sun 1,2,1 --floor 6,6,0,-1,0 --size 16 --resolutions 16 --truth-rays 16 --budget 1 --quiet -o trade.html
    [ -s trade.html ] || fail "no page"
}

# --- --dry-run: what a bake will take

@test "a dry run needs no folder that a bake would make" {
    for out in new/ new/lit.glb; do
        succeed bake box.obj "${SMALL[@]}" --per-object -o "$out" --dry-run
    done
    printf '{"casters": [{"mesh": "box.obj"}], "ao": {"distance": 1}, "receivers": [{"mesh": "box.obj", "size": 32, "output": "lit.glb"}]}' >scene.json
    succeed bake scene.json -o new/ --dry-run
    [ ! -e new ] || fail "it was made"
    # it refuses what a bake refuses
    refuse_each bake --dry-run <<'LIST'
3 "no folder 'new'" | box.obj "${SMALL[@]}" -o new/out.exr
2 --sun --ao | box.obj -o out.exr
3 missing.obj | missing.obj "${SMALL[@]}" -o out.exr
LIST
}

@test "a dry run's texels are the bake's, its voxels within a quarter, and it writes nothing" {
    local texels
    old_output out.exr
    succeed bake box.obj "${SMALL[@]}" --ao 0.5 --size 200x90 -o out.exr --dry-run
    prints texels voxels memory
    [ -z "$stderr" ] || fail "something on standard error"
    untouched out.exr
    texels=$(grep -o '^texels *[0-9]*' <<<"$output" | grep -o '[0-9]*$')
    succeed bake box.obj "${SMALL[@]}" --size 200x90 -o out.exr --quiet --stats stats.json
    [ "$texels" -eq "$(number_in stats.json texels)" ] || fail "$texels, and $(cat stats.json)"
    for voxels in '--resolution 200' '--voxel-size 0.004'; do
        # shellcheck disable=SC2086
        succeed bake box.obj --ao 0.5 --size 32 $voxels -o out.exr --dry-run
        local about
        about=$(grep '^voxels' <<<"$output" | awk '{ print $3 }')
        # shellcheck disable=SC2086
        succeed bake box.obj --ao 0.5 --size 32 $voxels -o out.exr --quiet --stats stats.json
        holds "$about > 0.8 * $(number_in stats.json active_voxels) && $about < 1.25 * $(number_in stats.json active_voxels)"
    done
}
