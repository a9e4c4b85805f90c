# A folder of a stranger's: files that never end, and names that lead out of it.
load helper

setup() {
    cd "$BATS_TEST_TMPDIR" || return 1
    write_box box.obj
    old_output out.exr
    models=$BATS_TEST_DIRNAME/../models
}

# Every run of the program must end by itself soon.
shade() {
    run --separate-stderr timeout "${VSH_SLOWER:-1}0" "$VDBSHADE" "$@"
    [ "$status" -ne 124 ] || fail "it hung: $*"
}

# scene_of CASTER: a scene that bakes onto box.obj.
scene_of() {
    cat >scene.json <<JSON
{"casters": [$1], "ao": {"distance": 1}, "receivers": [{"mesh": "box.obj", "size": 16, "output": "out.exr"}]}
JSON
}

@test "devices and pipes in place of files are refused at once, in a reader and without" {
    mkfifo waits waits.{csv,json,obj,glb,gltf,ply,stl,fbx,vdb,exr,png,tif,ttf}
    local caster file trust
    for trust in "" "--sandbox off"; do
        for file in waits.csv /dev/zero; do
            scene_of "{\"spheres\": \"$file\"}"
            refuses 3 "$file" "no regular file" -- bake scene.json $trust
        done
        for caster in '"mesh": "waits.obj"' '"mesh": "waits.glb"' '"mesh": "waits.gltf"' '"mesh": "waits.ply"' \
            '"mesh": "waits.fbx"' '"vdb": "waits.vdb"' '"heightfield": "waits.exr", "size": [1, 1], "height": 1' \
            '"mask": "waits.tif", "size": 1, "thickness": 1' \
            '"text": "a", "font": "waits.ttf", "height": 1, "thickness": 0.1'; do
            scene_of "{$caster}"
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
    cp "$models/scene.gltf" a.gltf
    mkfifo scene.bin a.mtl
    refuses 3 "scene.bin" "no regular file" -- info a.gltf
    { echo "mtllib a.mtl" && cat box.obj; } >a.obj
    succeed info a.obj
    succeed info a.obj --sandbox off
}

@test "a model's files lie in its folder, but with --allow-outside" {
    mkdir inside
    cp "$models/scene.bin" "$models/scene.mtl" .
    sed 's,scene.bin,../scene.bin,' "$models/scene.gltf" >inside/a.gltf
    { echo "mtllib ../scene.mtl" && cat box.obj; } >inside/a.obj
    sed "s,scene.bin,$PWD/scene.bin," "$models/scene.gltf" >inside/b.gltf
    cp "$models/scene.gltf" inside/c.gltf
    ln -s ../scene.bin inside/scene.bin
    local file trust
    for file in a.gltf a.obj b.gltf c.gltf; do
        for trust in "" "--sandbox off"; do
            refuses 2 "inside/$file" "outside of its folder" "--allow-outside" -- info "inside/$file" $trust
            succeed info "inside/$file" $trust --allow-outside
        done
    done
    # where every file is a link to one store, the model's own place is as good
    mkdir links
    cp "$models/scene.gltf" d.gltf
    ln -s ../d.gltf links/d.gltf
    ln -s ../scene.bin links/scene.bin
    succeed info links/d.gltf
}

@test "nothing is told of a file outside that a model does not use" {
    mkdir inside
    cp "$models/scene.bin" inside
    echo secret >secret
    sed -e 's|"buffers" : \[|&{"byteLength": 7, "uri": "../secret"},|' -e 's|"buffer" : 0|"buffer" : 1|' \
        "$models/scene.gltf" >inside/a.gltf
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
