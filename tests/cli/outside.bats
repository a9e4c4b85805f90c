# A stranger's folder: pipes in place of files, and names and links that lead out. Links that the user names are followed.
load helper

# For outputs: a stranger's folder, and the user's.
prepare() {
    old_output out.exr
    mkdir theirs elsewhere
    write_box theirs/box.obj
    write_output box.exr
    old_output elsewhere/mine.exr
}

# Fails if the program does not end soon by itself.
shade() {
    run --separate-stderr timeout "${VSH_SLOWER:-1}0" "$VDBSHADE" "$@"
    [ "$status" -ne 124 ] || fail "it hung: $*"
}

@test "devices and pipes in place of files are refused at once, in a reader and without" {
    mkfifo waits waits.{csv,json,obj,glb,gltf,ply,stl,fbx,vdb,exr,png,tif,ttf}
    local caster file trust
    for trust in "" "--sandbox off"; do
        for file in waits.csv /dev/zero; do
            write_bake scene.json "{\"spheres\": \"$file\"}"
            refuses 3 "$file" "no regular file" -- bake scene.json $trust
        done
        for caster in '"mesh": "waits.obj"' '"mesh": "waits.glb"' '"mesh": "waits.gltf"' '"mesh": "waits.ply"' \
            '"mesh": "waits.fbx"' '"vdb": "waits.vdb"' '"heightfield": "waits.exr", "size": [1, 1], "height": 1' \
            '"mask": "waits.tif", "size": 1, "thickness": 1' \
            '"text": "a", "font": "waits.ttf", "height": 1, "thickness": 0.1'; do
            write_bake scene.json "{$caster}"
            refuses 3 "waits." "no regular file" -- bake scene.json $trust
        done
        for file in waits.json waits.stl waits.obj waits.png; do
            refuses 3 "$file" "no regular file" -- info "$file" $trust
        done
        refuses 3 "waits.json" "no regular file" -- bake waits.json -o out.exr $trust
    done
    refuses 3 "waits.csv" "no regular file" "--points -" -- query box.obj --points waits.csv --ao 1 -o out.csv
    refuses 3 "waits.json" "no regular file" -- compare out.exr out.exr --tolerances waits.json
    mkdir folder && mkfifo folder/regress.json
    refuses 3 "regress.json" "no regular file" -- regress folder
    mkdir other && mkfifo other/a.json
    shade regress other
    [[ $status -eq 3 && $stderr == *"a.json: cannot be read: it is no regular file"* ]] || fail "regress"
    untouched out.exr
}

@test "a pipe that a model names is not waited for" {
    cp "$MODELS/scene.gltf" a.gltf
    mkfifo scene.bin a.mtl
    refuses 3 "scene.bin" "no regular file" -- info a.gltf
    { echo "mtllib a.mtl" && cat box.obj; } >a.obj
    succeed info a.obj
    succeed info a.obj --sandbox off
}

@test "a model's files lie in its folder, but with --allow-outside" {
    mkdir inside
    cp "$MODELS/scene.bin" "$MODELS/scene.mtl" .
    sed 's,scene.bin,../scene.bin,' "$MODELS/scene.gltf" >inside/a.gltf
    { echo "mtllib ../scene.mtl" && cat box.obj; } >inside/a.obj
    sed "s,scene.bin,$PWD/scene.bin," "$MODELS/scene.gltf" >inside/b.gltf
    cp "$MODELS/scene.gltf" inside/c.gltf
    ln -s ../scene.bin inside/scene.bin
    local file trust
    for file in a.gltf a.obj b.gltf c.gltf; do
        for trust in "" "--sandbox off"; do
            refuses 2 "inside/$file" "outside of its folder" "--allow-outside" -- info "inside/$file" $trust
            succeed info "inside/$file" $trust --allow-outside
        done
    done
    # every file may be a link into one store: then files beside the model's target are allowed, too
    mkdir links
    cp "$MODELS/scene.gltf" d.gltf
    ln -s ../d.gltf links/d.gltf
    ln -s ../scene.bin links/scene.bin
    succeed info links/d.gltf
}

@test "provenance names no file outside that a model does not use" {
    mkdir inside
    cp "$MODELS/scene.bin" inside
    echo secret >secret
    sed -e 's|"buffers" : \[|&{"byteLength": 7, "uri": "../secret"},|' -e 's|"buffer" : 0|"buffer" : 1|' \
        "$MODELS/scene.gltf" >inside/a.gltf
    succeed info inside/a.gltf
    succeed bake inside/a.gltf -o out.exr "${SMALL[@]}" --unwrap always
    local hash
    hash=$(sha256sum <secret)
    grep -aq "scene.bin" out.exr || fail "the file that is used is not told"
    ! grep -aq "${hash%% *}" out.exr || fail "its hash is told"
    ! grep -aq "secret" out.exr || fail "its name is told"
    succeed bake inside/a.gltf -o out.exr "${SMALL[@]}" --unwrap always --allow-outside
    grep -aq "${hash%% *}" out.exr || fail "it is not told where it is allowed"
}

# write_output OUTPUT: theirs/scene.json, which names the output.
write_output() {
    write_bake theirs/scene.json '{"mesh": "box.obj"}' '"resolution": 16, "method": "hard"'
    sed -i "s|scene.exr|$1|" theirs/scene.json
}

# kept: nothing was written elsewhere, nor left behind.
kept() {
    [ "$(ls -A elsewhere)" = mine.exr ] || fail "elsewhere: $(ls -A elsewhere)"
    untouched elsewhere/mine.exr
}

@test "an output that a scene names does not leave its folder by a link" {
    ln -s ../elsewhere/mine.exr theirs/box.exr
    shade bake theirs/scene.json
    refused 3 "theirs/box.exr: cannot be written: a link leads from the folder of 'theirs/scene.json' to " elsewhere/mine.exr
    kept
    ln -sf ../elsewhere/new.exr theirs/box.exr # to nothing that is there
    refuses 3 "theirs/box.exr: cannot be written: a link leads" -- bake theirs/scene.json
    kept
    ln -s "$PWD/elsewhere" theirs/sub
    local one
    for one in sub/mine.exr ./sub/../sub/new.exr; do
        write_output "$one"
        refuses 3 "a link leads" -- bake theirs/scene.json
        kept
        (cd theirs && run --separate-stderr "$VDBSHADE" bake scene.json && refused 3 "a link leads") || fail "from inside"
        kept
    done
    write_output sub/made/x.exr
    refuses 3 "a link leads" -- bake theirs/scene.json --per-object
    kept
}

@test "a link that stays below the scene's folder, and one that the user names, are followed" {
    mkdir theirs/bakes
    ln -s bakes/kept.exr theirs/box.exr
    old_output theirs/bakes/kept.exr
    succeed bake theirs/scene.json --quiet
    [ -L theirs/box.exr ] && [ "$(wc -c <theirs/bakes/kept.exr)" -gt 100 ] || fail "not followed"
    ln -s elsewhere/mine.exr link.exr
    succeed bake theirs/scene.json -o link.exr --quiet
    [ -L link.exr ] && [ "$(wc -c <elsewhere/mine.exr)" -gt 100 ] || fail "the user's link"
    write_output ../elsewhere/said.exr # openly elsewhere
    succeed bake theirs/scene.json --quiet
    [ -s elsewhere/said.exr ] || fail "not written"
    write_output absent/x.exr
    refuses 3 "there is no folder 'theirs/absent'" -- bake theirs/scene.json
}

@test "a scene of 2D does not write through a link" {
    ln -s ../elsewhere/mine.exr theirs/flat.exr
    cat >theirs/flat.json <<'JSON'
{"region": [-1, -1, 1, 1], "size": 16, "output": "flat.exr",
 "casters": [{"shape": "box", "half_size": [0.3, 0.1]}],
 "lights": [{"name": "moon", "type": "directional", "direction": [1, 1], "angle_deg": 5}]}
JSON
    refuses 3 "theirs/flat.exr: cannot be written: a link leads" -- flat theirs/flat.json
    kept
}

@test "a folder of scenes does not have its golden bakes written elsewhere" {
    old_output elsewhere/mine.exr
    ln -s ../elsewhere theirs/golden
    shade regress theirs --update --quiet
    [ "$status" -eq 3 ] && [[ $stderr == *"theirs/golden/box.exr: cannot be written: a link leads"* ]] || fail "folder"
    kept
    rm theirs/golden
    mkdir theirs/golden
    sed 's/0, 1, 0.2/1, 0.2, 0/' theirs/scene.json >theirs/other.json
    "$VDBSHADE" bake theirs/other.json -o elsewhere/mine.exr --quiet
    rm theirs/other.json
    cp elsewhere/mine.exr mine.exr
    ln -s ../../elsewhere/mine.exr theirs/golden/box.exr
    shade regress theirs --update --quiet
    [ "$status" -eq 3 ] && [[ $stderr == *"theirs/golden/box.exr: cannot be written: a link leads"* ]] || fail "file"
    cmp mine.exr elsewhere/mine.exr
}
