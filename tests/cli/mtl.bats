# Materials of an OBJ that a texture cuts out (map_d).
load helper

# write_level FILE: a floor of 4 × 4 under a leaf of 1 × 1 and a plate of wood beside it, as materials.bats has them.
write_level() {
    {
        printf 'mtllib level.mtl\n'
        printf 'v %s %s %s\n' -2 0 2 2 0 2 2 0 -2 -2 0 -2 -1 1 0.5 0 1 0.5 0 1 -0.5 -1 1 -0.5 0.25 1 0.5 1.25 1 0.5 1.25 1 -0.5 0.25 1 -0.5
        printf 'vt %s %s\n' 0 0 1 0 1 1 0 1
        printf 'o floor\nusemtl earth\nf 1/1 2/2 3/3\nf 1/1 3/3 4/4\n'
        printf 'o plate\nusemtl leaf\nf 5/1 6/2 7/3\nf 5/1 7/3 8/4\n'
        printf 'usemtl wood\nf 9/1 10/2 11/3\nf 9/1 11/3 12/4\n'
    } >"$1"
}

# leaf STATEMENTS: what the leaf is made of.
leaf() {
    printf 'newmtl earth\nnewmtl wood\nnewmtl leaf\n%b\n' "$1" >level.mtl
}

# Four columns of grey or of red and green, of which half are opaque.
setup() {
    cd "$BATS_TEST_TMPDIR" || return 1
    write_level level.obj
    printf 'P5 4 1 255\n\0\0\377\377' >right.pgm
    printf 'P5 4 1 255\n\377\377\0\0' >'left half.pgm'
    printf 'P6 4 1 255\n\0\377\0\0\377\0\377\0\0\377\0\0' >both.ppm
    printf 'P5 8 1 255\n\0\0\377\377\0\0\377\377' >twice.pgm
    printf 'P5 2 1 255\n\377\377' >opaque.pgm
    printf 'P5 8 1 255\n\40\60\100\120\140\160\200\220' >smoke.pgm
}

# bake STATEMENTS OUT [options]
bake() {
    leaf "$1"
    succeed bake level.obj --sun 0,1,0 --sun-angle 1 --size 96 --receive floor -o "$2" "${@:3}"
}

same() {
    same_values "$1" "$2" || fail "$1 and $2 are not the same"
}

# lit FILE SHARE: of the floor in 1 / 100
lit() {
    "$VDBSHADE" info "$1" | awk -v want="$2" '/shadow.sun/ { for (i = 1; i < NF; ++i) if ($i == "mean") { off = 100 * $(i + 1) - want } }
        END { exit !(off < 0.2 && off > -0.2) }' || fail "$1: not $2 % are lit: $("$VDBSHADE" info "$1")"
}

@test "light comes through where map_d is dark" {
    bake 'map_d right.pgm' right.exr --verbose
    [[ $stderr == *"blended materials that their textures cut out"* ]] || fail "$stderr"
    lit right.exr 90.625 # all but 1.5 of 16
    bake 'map_d left half.pgm' left.exr
    lit left.exr 90.625
    ! same_values left.exr right.exr || fail "the same half"
    bake '' whole.exr
    lit whole.exr 87.5
    bake 'map_d right.pgm' blended.exr --cast-blended
    same blended.exr right.exr
    info_tells level.obj "it casts no shadow, unless its texture cuts it out"
}

@test "an image with alpha cuts out as a glTF's mask does" {
    cp "$ASSETS/emblem.png" .
    cat >mask.gltf <<GLTF
{"asset": {"version": "2.0"}, "scenes": [{"nodes": [0, 1]}],
 "nodes": [{"name": "floor", "mesh": 0}, {"name": "plate", "mesh": 1}],
 "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "indices": 2}]},
            {"primitives": [{"attributes": {"POSITION": 3, "TEXCOORD_0": 1}, "indices": 2, "material": 0}]}],
 "materials": [{"alphaMode": "MASK", "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}],
 "textures": [{"source": 0}], "images": [{"uri": "emblem.png"}],
 "accessors": [{"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"},
               {"bufferView": 1, "componentType": 5126, "count": 4, "type": "VEC2"},
               {"bufferView": 2, "componentType": 5123, "count": 6, "type": "SCALAR"},
               {"bufferView": 3, "componentType": 5126, "count": 4, "type": "VEC3"}],
 "bufferViews": [{"buffer": 0, "byteLength": 48}, {"buffer": 0, "byteOffset": 48, "byteLength": 32},
                 {"buffer": 0, "byteOffset": 80, "byteLength": 12}, {"buffer": 0, "byteOffset": 92, "byteLength": 48}],
 "buffers": [{"byteLength": 140, "uri": "level.bin"}]}
GLTF
    {
        printf '\0\0\0\xc0\0\0\0\0\0\0\0\x40\0\0\0\x40\0\0\0\0\0\0\0\x40\0\0\0\x40\0\0\0\0\0\0\0\xc0\0\0\0\xc0\0\0\0\0\0\0\0\xc0'
        printf '\0\0\0\0\0\0\x80\x3f\0\0\x80\x3f\0\0\x80\x3f\0\0\x80\x3f\0\0\0\0\0\0\0\0\0\0\0\0'
        printf '\0\0\1\0\2\0\0\0\2\0\3\0'
        printf '\0\0\x80\xbf\0\0\x80\x3f\0\0\0\x3f\0\0\0\0\0\0\x80\x3f\0\0\0\x3f'
        printf '\0\0\0\0\0\0\x80\x3f\0\0\0\xbf\0\0\x80\xbf\0\0\x80\x3f\0\0\0\xbf'
    } >level.bin
    bake 'map_d emblem.png' obj.exr --no-cast wood --ao 1
    succeed bake mask.gltf --sun 0,1,0 --sun-angle 1 --size 96 --receive floor -o gltf.exr --ao 1
    same obj.exr gltf.exr
    bake 'map_d -imfchan m emblem.png' matte.exr --no-cast wood --ao 1
    same matte.exr gltf.exr
}

@test "options of map_d" {
    bake 'map_d right.pgm' right.exr
    bake 'map_d left half.pgm' left.exr
    bake 'map_d twice.pgm' twice.exr
    bake 'map_d -blendu on -texres 4 -o 0.5 0 0 right.pgm' moved.exr
    same moved.exr left.exr
    bake 'map_d -o 0.5 right.pgm' moved.exr
    same moved.exr left.exr
    bake 'map_d -s 2 1 1 right.pgm' scaled.exr
    same scaled.exr twice.exr
    bake 'map_d -s 2 -clamp on right.pgm' clamped.exr
    lit clamped.exr 89.0625 # the last column goes on: three quarters are there
    bake 'map_d -imfchan r both.ppm' red.exr
    same red.exr right.exr
    bake 'map_d -imfchan g both.ppm' green.exr
    same green.exr left.exr
    mkdir -p textures
    cp right.pgm textures/
    bake 'map_d textures\\\\right.pgm' backslash.exr
    same backslash.exr right.exr
    bake 'map_d -mm 0 1 right.pgm' gain.exr
    [[ $stderr == *"level.mtl: line 4: 'map_d' is read without its option '-mm'"* ]] || fail "$stderr"
    same gain.exr right.exr
}

@test "what leaves nothing out casts whole, and so does what cannot be had" {
    bake '' whole.exr
    bake 'map_d opaque.pgm' opaque.exr
    same opaque.exr whole.exr
    bake 'map_d gone.pgm' gone.exr
    [[ $stderr == *"material 'leaf' casts whole, without the holes of its texture"* ]] || fail "$stderr"
    same gone.exr whole.exr
    bake 'map_d -what on right.pgm' unknown.exr
    [[ $stderr == *"level.mtl: line 4: 'map_d' has the option '-what'"* ]] || fail "$stderr"
    same unknown.exr whole.exr
    bake 'map_Kd right.pgm' colour.exr
    same colour.exr whole.exr
    mkdir -p in
    mv level.obj in/
    leaf 'map_d ../right.pgm'
    mv level.mtl in/
    shade bake in/level.obj --sun 0,1,0 --sun-angle 1 --size 96 --receive floor -o outside.exr
    [[ $stderr == *"in/level.mtl: line 4: 'map_d' names 'in/../right.pgm' outside of the model's folder"* ]] || fail "$stderr"
    same outside.exr whole.exr
}

@test "a material library that is missing is named" {
    bake 'd 0.3' there.exr
    [[ $stderr != *library* ]] || fail "it is there: $stderr"
    rm level.mtl
    shade bake level.obj --sun 0,1,0 --sun-angle 1 --size 96 --receive floor -o gone.exr
    [[ $stderr == *"level.obj: the material library 'level.mtl' cannot be read"* ]] || fail "$stderr"
}

@test "what is neither clear nor opaque is glass" {
    bake '' without.exr --no-cast material:leaf
    bake 'map_d smoke.pgm' smoke.exr
    [[ $stderr == *"1 of 3 meshes have blended materials (glass, smoke) and cast no shadow"* ]] || fail "$stderr"
    same smoke.exr without.exr
    bake 'd 0.3\nmap_d right.pgm' thin.exr
    same thin.exr without.exr
    bake 'map_d right.pgm\nd 0.7' thick.exr
    bake 'map_d right.pgm' right.exr
    same thick.exr right.exr
}

@test "the material library and its texture are inputs, and nothing replaces them" {
    bake 'map_d left half.pgm' out.exr
    local names
    names=$("$VDBSHADE" info out.exr | sed -n 's/^vdbshade_input_[0-9]*: sha256:[0-9a-f]* //p' | sort | tr '\n' ' ')
    [ "$names" = "left half.pgm level.mtl level.obj " ] || fail "$names"
    shade bake level.obj --sun 0,1,0 --size 16 --receive floor --no-cast material:leaf -o 'left half.pgm'
    refused 2 'left half.pgm: the output is also an input'
    refuses 2 'level.mtl: the output is also an input' -- bake level.obj --sun 0,1,0 --size 16 --receive floor -o out.exr --stats level.mtl
}
