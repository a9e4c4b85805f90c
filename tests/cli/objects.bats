# Objects of a file: choosing receivers and casters, an image for each, overlaps, and warnings about them.
load helper

@test "objects that each fill the unit square are refused with counts, the worst pair and both ways out" {
    write_boxes level.obj floor wall roof
    refuses 2 level.obj '2 of 3 meshes' "'wall' on" "over 'floor'" --per-object --receive 'one atlas' allow_overlap -- \
        bake level.obj "${SMALL[@]}" -o out.exr
    [ ! -e out.exr ] || fail "an image beside the error"
    write_scene level.json level.obj '' '"allow_overlap": true'
    succeed_saying "2 times" "lie over charts of other objects" -- bake level.json "${COARSE[@]}" -o out.exr
}

@test "an atlas of objects, and charts that only touch, are not refused" {
    write_boxes level.obj floor wall
    awk '/^o /{n++} /^vt/{$2 = $2 / 2 + (n - 1) / 2} {print}' level.obj >atlas.obj
    succeed bake atlas.obj "${SMALL[@]}" -o out.exr
    [[ $stderr != *"other objects"* ]] || fail "nothing overlaps"
    # a column of texels or two of the second object over the first
    awk '/^o /{n++} /^vt/{$2 = $2 / 2 + (n - 1) * 0.472} {print}' level.obj >touching.obj
    succeed_saying "mesh 'wall': " " texels lie over charts of other objects" -- bake touching.obj --sun 0.3,1,0.2 --size 256 --resolution 24 -o out.exr
}

@test "--receive chooses receivers by name and pattern; the others still cast" {
    write_boxes level.obj floor wall_1 wall_2
    succeed bake level.obj "${SMALL[@]}" --receive floor -o floor.exr --quiet
    succeed bake level.obj "${SMALL[@]}" --receive 'f*' -o pattern.exr --quiet
    same floor.exr pattern.exr
    succeed bake level.obj "${SMALL[@]}" --no-receive 'wall_?' -o others.exr --quiet
    same floor.exr others.exr
    refuses 2 '1 of 2 meshes' "'wall_2'" "'wall_1'" -- bake level.obj "${SMALL[@]}" --receive 'wall*' -o walls.exr
    # from the side, the next object's shadow; none where nothing else casts
    local side=(--sun 1,0.3,0 --sun-angle 2 --size 32 --voxel-size 0.05 --receive floor --quiet)
    succeed bake level.obj "${side[@]}" -o shadowed.exr
    succeed bake level.obj "${side[@]}" --no-cast 'wall*' -o alone.exr
    ! same_values shadowed.exr alone.exr || fail "the walls cast nothing"
}

@test "a name that is not there is an error with the names that are" {
    write_boxes level.obj floor wall
    refuse_each bake level.obj "${SMALL[@]}" <<'LIST'
2 level.obj "'Flor*'" "did you mean 'floor'?" "'floor', 'wall'" | --receive 'Flor*' -o out.exr
2 level.obj "'zzz'" "'floor', 'wall'" | --no-cast zzz -o out.exr
2 'no object is left' | --receive wall --no-receive wall -o out.exr
LIST
}

@test "--per-object writes the image that --receive of each object writes" {
    write_boxes level.obj floor wall roof
    succeed bake level.obj "${SMALL[@]}" --per-object -o maps/new/ --quiet
    [ "$(ls maps/new | tr '\n' ' ')" = "floor.exr roof.exr wall.exr " ] || fail "$(ls maps/new)"
    succeed bake level.obj "${SMALL[@]}" --receive roof -o roof.exr --quiet
    same_values roof.exr maps/new/roof.exr || fail "another image"
    succeed bake level.obj "${SMALL[@]}" --per-object -o base.png --quiet
    [ -s base.floor.png ] && [ -s base.wall.png ] || fail "$(ls)"
    succeed bake level.obj "${SMALL[@]}" --per-object -o 'x/%s_light.png' --quiet
    [ -s x/roof_light.png ] || fail "$(ls x)"
    refuses 2 maps/ --per-object -- bake level.obj "${SMALL[@]}" -o maps/
}

@test "names are made safe for file systems and unique" {
    write_boxes level.obj 'a/b' 'a_b' 'A-b' 'a-b' 'Wände' '../evil' '...' 'a?b'
    succeed bake level.obj "${SMALL[@]}" --per-object -o maps/ --quiet
    [ "$(ls maps | wc -l)" -eq 8 ] || fail "$(ls maps)"
    for name in a_b a_b-2 a_b-3 A-b a-b-2 'Wände' _._evil ___; do
        [ -s "maps/$name.exr" ] || fail "no $name: $(ls maps)"
    done
    [ ! -e evil.exr ] || fail "out of the folder"
}

@test "with --per-object, objects without UVs only cast, and one warning names them" {
    write_boxes level.obj floor bare naked
    awk '/^o /{n++} n > 1 && /^vt/{next} n > 1 && /^f/{gsub(/\/[0-9]+/, "")} {print}' level.obj >bare.obj
    succeed bake bare.obj "${SMALL[@]}" --per-object -o maps/
    [ "$(ls maps)" = floor.exr ] || fail "$(ls maps)"
    [ "$(grep -c 'no UVs' <<<"$stderr")" -eq 1 ] || fail "not one line"
    says "2 times" "'bare'" "casts only"
    refuses 2 bare.obj "'bare'" 'no UVs' '--unwrap auto' --no-receive -- bake bare.obj "${SMALL[@]}" -o out.exr
    ends 2 bake bare.obj "${SMALL[@]}" --per-object --no-cast '*' -o maps/
    [[ ${stderr_lines[0]} == *"warning: 2 times"* ]] || fail "lost"
}

@test "a scene's receivers choose objects too, and may overlap on purpose" {
    write_boxes level.obj floor wall roof
    cat >scene.json <<'JSON'
{"casters": [{"mesh": "level.obj", "except": "roof"}], "resolution": 24, "ao": {"distance": 1},
 "receivers": [{"mesh": "level.obj", "objects": ["fl*"], "size": 16, "output": "floor.exr"},
               {"mesh": "level.obj", "except": "floor", "allow_overlap": true, "size": 16, "output": "rest.exr"}]}
JSON
    succeed bake scene.json --quiet
    sed 's/true/false/' scene.json >refused.json
    sed 's/fl\*/flo/' scene.json >near.json
    sed 's/\["fl\*"\]/[]/' scene.json >empty.json
    refuse_each bake --quiet <<'LIST'
2 level.obj "'roof' on" "over 'wall'" | refused.json
2 "'flo'" "did you mean 'floor'?" | near.json
2 empty.json:2 'receivers[0].objects' 'is empty' | empty.json
LIST
}

@test "warnings of a kind are one line with the worst; --verbose prints all, --quiet none" {
    write_boxes level.obj $(seq -f 'crate_%03g' 40)
    write_scene level.json level.obj '' '"allow_overlap": true'
    succeed bake level.json "${COARSE[@]}" -o out.exr
    [ "$(grep -c warning: <<<"$stderr")" -lt 4 ] || fail "too many lines"
    [[ $stderr == *"warning: 39 times, the worst: level.obj: mesh 'crate_"*"--verbose lists all"* ]] || fail "no summary"
    succeed bake level.json "${COARSE[@]}" -o out.exr --verbose
    [ "$(grep -c 'lie over charts of other objects' <<<"$stderr")" -eq 39 ] || fail "not all"
    succeed bake level.json "${COARSE[@]}" -o out.exr --quiet
    [ -z "$stderr" ] || fail "--quiet said something"
}

@test "notes need no action, and only --verbose prints them" {
    write_boxes level.obj floor crate
    printf 'o card\nv 0 0 -3\nv 1 0 -3\nv 0 1 -3\nf -3 -2 -1\nf -1 -1 -2\n' >>level.obj
    succeed bake level.obj "${SMALL[@]}" --receive floor -o out.exr
    [[ $stderr != *warning:* && $stderr != *note:* ]] || fail "told: $stderr"
    succeed bake level.obj "${SMALL[@]}" --receive floor -o out.exr --verbose
    says "vdbshade: note: level.obj: mesh 'card': 1 triangles of zero area are skipped" "vdbshade: note: mesh 'card' (" "3 open edges: baked as a "
    [[ $stderr != *warning:* ]] || fail "a warning"
}

@test "info prints a table of objects, and what bake would refuse at a size" {
    write_boxes level.obj $(seq -f 'crate_%03g' 12)
    succeed info level.obj --size 64
    [[ ${lines[0]} == "objects: 12, in 12 meshes, 144 triangles; UV sets: 1" ]] || fail "no summary"
    [ "$(grep -c ' crate_' <<<"$output")" -eq 12 ] || fail "no line each"
    [[ $output == *"64 × 64 texels"*"problem: objects share texels: 11 of 12 meshes"*"'crate_002'"*"over 'crate_001'"*--per-object* ]] ||
        fail "not what bake refuses"
    shade info level.obj --verbose
    [ "$(grep -c '^mesh ' <<<"$output")" -eq 12 ] || fail "no paragraph each"
}

@test "the error of an unknown channel, points file or UV set lists those there are" {
    write_boxes level.obj floor
    refuses 2 'no such channel: shadow' 'shadow.sun, ao, A' -- bake level.obj --sun 0,1,0 --ao 1 --pack R=shadow -o out.png
    refuses 2 level.obj '.csv' "export the mesh's vertices as .ply" -- query level.obj --sun 0,1,0 --points level.obj -o out.csv
    refuses 2 level.obj 'no UV set 3' 'it has set 0' -- bake level.obj --ao 1 --uv-set 3 -o out.png
}

@test "info prints no problem of a volume, and compare no measure without a value" {
    write_boxes level.obj floor
    succeed volume level.obj --sun 0,1,0 --resolution 16 --box -1,-1,-1,2,2,2 --box-voxel-size 0.5 -o box.vdb --quiet
    succeed info box.vdb
    [[ $output == *"holds: values that vdbshade baked"* && $output != *problem* ]] || fail "a problem"
    write_boxes level.obj floor wall
    succeed bake level.obj --receive floor --sun 1,0.3,0 --sun-angle 2 --method cone --size 8 --resolution 48 --quiet -o out.exr
    succeed compare out.exr out.exr
    [[ $output == *"shadow.sun: alike; "*"rmse 0"* && $output != *penumbra* && $output != *nan* ]] || fail "$output"
}

@test "every warning and note that is printed is documented" {
    local sources=("$BATS_TEST_DIRNAME"/../../src) docs=$BATS_TEST_DIRNAME/../../docs/warnings.md missing=
    # of each call, joins the strings, cuts out formats, and prints the longest piece of the rest
    while IFS= read -r piece; do
        grep -qF -- "$piece" "$docs" || missing+="$piece"$'\n'
    done < <(find "${sources[@]}" -name '*.c' -o -name '*.cpp' | xargs awk '
        /(vshi_warn|vshi_note|cli_warn)\(/ || (/snprintf\(line, sizeof line/ && FILENAME ~ /cli/) { on = 1; text = "" }
        on {
            rest = $0
            while (match(rest, /"([^"\\]|\\.)*"/)) {
                piece = substr(rest, RSTART + 1, RLENGTH - 2)
                if (RLENGTH > 4 || piece ~ /%/) text = text piece
                rest = substr(rest, RSTART + RLENGTH)
                if (rest ~ /^ PRIu64/) text = text "u"
            }
            if (/;[ ]*$/) {
                on = 0
                n = split(text, part, /%[-+ 0-9.*]*(zu|s|d|u|g|f|lu)/)
                best = ""
                for (i = 1; i <= n; ++i) if (length(part[i]) > length(best)) best = part[i]
                gsub(/%%/, "%", best)
                gsub(/^[ :;,.()'"'"']+|[ :;,.()'"'"']+$/, "", best)
                if (length(best) > 12) print best
            }
        }')
    [ -z "$missing" ] || fail "not in docs/warnings.md: $missing"
}

# add_box FILE NAME LOW HIGH [FACE]: a closed box that looks outwards, without the face (1 is that at the lowest y).
add_box() {
    awk -v name="$2" -v low="$3" -v high="$4" -v left_out="${5:-0}" -v before="$(cat "$1" 2>/dev/null | grep -c '^v ')" 'BEGIN {
        split(low, l, ","); split(high, h, ","); print "o " name
        for (i = 0; i < 8; ++i) print "v", (i % 2 ? h[1] : l[1]), (int(i / 2) % 2 ? h[2] : l[2]), (i > 3 ? h[3] : l[3])
        n = split("1 2 6 5,3 7 8 4,1 5 7 3,2 4 8 6,1 3 4 2,5 6 8 7", face, ",")
        for (i = 1; i <= n; ++i) if (i != left_out) {
            split(face[i], v, " "); print "f", before + v[1], before + v[2], before + v[3], before + v[4]
        }
    }' >>"$1"
}

@test "a light that reaches no texel, or a sun that reaches one object of several, gets a warning, and no other light does" {
    local sun=(--sun 0.4,0.8,0.3) options=(--unwrap always --size 64 -o out.exr) name
    add_box open.obj ground -20,-1,-20 20,0,20
    add_box open.obj crate -1,0,-1 1,2,1
    cp open.obj dome.obj
    add_box dome.obj sky -30,-2,-30 30,30,30 1
    local alone="reaches 'sky' alone; if that hides it from the others, --no-cast 'sky' lets it through"
    succeed_saying "light sun $alone" "the sky $alone" -- bake dome.obj "${sun[@]}" --sky y "${options[@]}"
    for name in 1 2; do
        succeed bake dome.obj "${sun[@]}" "${options[@]}" --shard "$name/2"
        [[ $stderr != *reaches* ]] || fail "a part knows only its own rows"
    done
    succeed_saying "light sun $alone" -- merge out.exr
    succeed_saying "light sun reaches no texel" -- bake dome.obj "${sun[@]}" --no-receive sky --method cone --resolution 32 "${options[@]}"
    succeed bake dome.obj "${sun[@]}" --sky y --no-cast sky "${options[@]}"
    [[ $stderr != *reaches* ]] || fail "the dome does not cast"
    succeed bake open.obj "${sun[@]}" --receive ground "${options[@]}"
    [[ $stderr != *reaches* ]] || fail "one object receives"
    # a lamp in its bulb; and in the open
    add_box open.obj 'bulb+1' -0.1,4,-0.1 0.1,4.2,0.1
    for height in 4.1 5; do
        cat >lamp.json <<JSON
{"casters": [{"mesh": "open.obj"}], "lights": [{"name": "lamp", "type": "sphere", "position": [0, $height, 0], "radius": 0.05}],
 "receivers": [{"mesh": "open.obj", "size": 64, "unwrap": "always", "output": "out.exr"}]}
JSON
        succeed bake lamp.json
        [[ $height != 4.1 || $stderr == *"light lamp reaches no texel; "* ]] || fail "no bulb"
        [[ $height != 5 || $stderr != *reaches* ]] || fail "the lamp is in the open"
    done
}
