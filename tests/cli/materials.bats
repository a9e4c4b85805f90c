# Materials: what they cut out, what of them is blended, and what is chosen by their names.
load helper

# write_level FILE MATERIAL IMAGE: a floor of 4 × 4 under material "earth" and a plate over it, of two primitives side by
# side: one of MATERIAL, one of "wood". The texture is the image at the URI.
write_level() {
    cat >"$1" <<GLTF
{"asset": {"version": "2.0"}, "scenes": [{"nodes": [0, 1]}],
 "nodes": [{"name": "floor", "mesh": 0}, {"name": "plate", "mesh": 1, "translation": [-0.5, 0, 0]},
           {"name": "unused"}],
 "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "indices": 2, "material": 1}]},
            {"primitives": [{"attributes": {"POSITION": 3, "TEXCOORD_0": 1}, "indices": 2, "material": 0},
                            {"attributes": {"POSITION": 4, "TEXCOORD_0": 1}, "indices": 2, "material": 2}]}],
 "materials": [$2, {"name": "earth"}, {"name": "wood"}],
 "textures": [{"source": 0}], "images": [{"uri": "$3"}],
 "accessors": [{"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"},
               {"bufferView": 1, "componentType": 5126, "count": 4, "type": "VEC2"},
               {"bufferView": 2, "componentType": 5123, "count": 6, "type": "SCALAR"},
               {"bufferView": 3, "componentType": 5126, "count": 4, "type": "VEC3"},
               {"bufferView": 4, "componentType": 5126, "count": 4, "type": "VEC3"}],
 "bufferViews": [{"buffer": 0, "byteLength": 48}, {"buffer": 0, "byteOffset": 48, "byteLength": 32},
                 {"buffer": 0, "byteOffset": 80, "byteLength": 12},
                 {"buffer": 0, "byteOffset": 92, "byteLength": 48},
                 {"buffer": 0, "byteOffset": 140, "byteLength": 48}],
 "buffers": [{"byteLength": 188, "uri": "data:;base64,$BUFFER"}]}
GLTF
}

# Corners of the floor, UVs, indices, corners of both plates: as numbers of awk's, little-endian.
setup_file() {
    BUFFER=$({
        floats -2 0 2 2 0 2 2 0 -2 -2 0 -2
        floats 0 1 1 1 1 0 0 0
        printf '\0\0\1\0\2\0\0\0\2\0\3\0'
        floats -0.5 1 0.5 0.5 1 0.5 0.5 1 -0.5 -0.5 1 -0.5
        floats 0.75 1 0.5 1.75 1 0.5 1.75 1 -0.5 0.75 1 -0.5
    } | base64 -w0)
    export BUFFER
}

# Of -2, -0.5, 0, 0.5, 0.75, 1, 1.75, 2.
floats() {
    local number
    for number; do
        case $number in
        -2) printf '\0\0\0\xc0' ;;
        -0.5) printf '\0\0\0\xbf' ;;
        0) printf '\0\0\0\0' ;;
        0.5) printf '\0\0\0\x3f' ;;
        0.75) printf '\0\0\x40\x3f' ;;
        1) printf '\0\0\x80\x3f' ;;
        1.75) printf '\0\0\xe0\x3f' ;;
        2) printf '\0\0\0\x40' ;;
        esac
    done
}

setup() {
    cd "$BATS_TEST_TMPDIR" || return 1
    cp "$ASSETS/emblem.png" .
    write_level masked.gltf "$(leaf MASK)" emblem.png
    write_level whole.gltf '{"name": "leaf"}' emblem.png
}

leaf() {
    printf '{"name": "leaf", "alphaMode": "%s", "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}' "$1"
}

BAKE=(--sun 0,1,0 --sun-angle 2 --ao 1 --size 96)

# bake FILE OUT [options]: the light on the floor.
bake() {
    succeed bake "$1" "${BAKE[@]}" --receive floor -o "$2" "${@:3}"
}

# mean_of FILE: of the sun's shadow.
mean_of() {
    "$VDBSHADE" info "$1" | awk '/shadow.sun/ { for (i = 1; i < NF; ++i) if ($i == "mean") print $(i + 1) + 0 }'
}

differ() {
    ! same_values "$1" "$2" || fail "$1 and $2 are the same"
}

@test "a texture beside the file, in it, and without the confined reader are one" {
    write_level within.gltf "$(leaf MASK)" "data:image/png;base64,$(base64 -w0 emblem.png)"
    bake masked.gltf beside.exr
    bake within.gltf within.exr
    bake within.gltf trusted.exr --sandbox off
    bake whole.gltf whole.exr
    same_values beside.exr within.exr || fail "beside and within"
    same_values beside.exr trusted.exr || fail "by the reader and here"
    differ beside.exr whole.exr
}

@test "the same values for any number of threads" {
    bake masked.gltf one.exr --threads 1
    bake masked.gltf two.exr --threads 2
    same_values one.exr two.exr || fail "not the same"
}

@test "exact with voxels is exact without" {
    bake masked.gltf none.exr --max-error 0.005
    bake masked.gltf fine.exr --max-error 0.005 --method exact --ao-method exact --resolution 96
    # each keeps 0.005; single values and edges are those of other rays
    succeed compare fine.exr none.exr --max-rmse 0.004 --max-difference 0.1 --max-p99 1 --max-penumbra 9 --max-shift 9
}

@test "a texture that is not there leaves the material whole, with a warning" {
    rm emblem.png
    succeed bake masked.gltf "${BAKE[@]}" --receive floor -o out.exr
    [[ $stderr == *"material 'leaf' casts whole, without the holes of its texture"* ]] || fail "$stderr"
    cp "$ASSETS/emblem.png" .
    bake whole.gltf whole.exr
    same_values out.exr whole.exr || fail "not the same"
}

@test "a texture outside of the folder is not read" {
    mkdir -p in
    cp masked.gltf in/
    sed -i 's,"emblem.png","../emblem.png",' in/masked.gltf
    succeed bake in/masked.gltf "${BAKE[@]}" --receive floor -o out.exr
    [[ $stderr == *"outside of its folder"* ]] || fail "$stderr"
    bake in/masked.gltf allowed.exr --allow-outside
    bake masked.gltf beside.exr
    same_values allowed.exr beside.exr || fail "not the same"
    differ out.exr beside.exr
}

@test "blended materials cast where they are cut out, by --cast-blended too, and glass only by that" {
    write_level hashed.gltf "$(leaf BLEND)" emblem.png
    bake masked.gltf masked.exr
    succeed bake hashed.gltf "${BAKE[@]}" --receive floor --verbose -o hashed.exr
    [[ $stderr == *"blended materials that their textures cut out"* ]] || fail "$stderr"
    same_values masked.exr hashed.exr || fail "hashed leaves"
    bake hashed.gltf asked.exr --cast-blended
    same_values masked.exr asked.exr || fail "--cast-blended"
    write_level glass.gltf '{"name": "leaf", "alphaMode": "BLEND", "pbrMetallicRoughness": {"baseColorFactor": [1, 1, 1, 0.2]}}' emblem.png
    shade bake glass.gltf "${BAKE[@]}" --receive floor -o glass.exr
    [[ $stderr == *"1 of 3 meshes have blended materials (glass, smoke) and cast no shadow"* ]] || fail "$stderr"
    bake whole.gltf without.exr --no-cast leaf
    same_values glass.exr without.exr || fail "glass casts"
    bake glass.gltf asked.exr --cast-blended
    bake whole.gltf whole.exr
    same_values asked.exr whole.exr || fail "glass does not cast when asked to"
}

@test "materials are chosen by name where no object is called so" {
    bake whole.gltf whole.exr
    bake whole.gltf leafless.exr --no-cast leaf
    bake whole.gltf woodless.exr --no-cast 'material:w*'
    bake whole.gltf bare.exr --no-cast leaf --no-cast wood
    bake whole.gltf plateless.exr --no-cast plate
    differ whole.exr leafless.exr
    differ leafless.exr woodless.exr
    same_values bare.exr plateless.exr || fail "both materials are not the object"
    succeed bake whole.gltf "${BAKE[@]}" --no-receive leaf --no-receive wood -o others.exr
    same_values others.exr whole.exr || fail "--no-receive"
    succeed bake whole.gltf "${BAKE[@]}" --receive earth -o named.exr
    same_values named.exr whole.exr || fail "--receive"
    local -a fit=(--sun 0,1,0 --size 96 --unwrap always)
    shade bake whole.gltf "${fit[@]}" --density floor=0.5 -o whole.exr
    succeed bake whole.gltf "${fit[@]}" --density earth=0.5 -o named.exr
    same_values named.exr whole.exr || fail "--density"
    succeed bake whole.gltf "${BAKE[@]}" --receive floor --treat leaf=sheet --treat 'material:w*=solid' -o named.exr
    old_output out.exr
    refuses 2 "no object is named 'woof'" "did you mean 'wood'" "materials 'leaf', 'earth'" -- bake whole.gltf "${BAKE[@]}" --no-cast woof -o out.exr
}

@test "light on the backs of one-sided materials comes through" {
    # the plates' fronts are up
    one_sided() { # MESH
        cat >scene.json <<JSON
{"casters": [{"mesh": "$1", "one_sided": ["leaf", "material:wood"]}], "ao": {"distance": 1},
 "lights": [{"name": "sun", "type": "directional", "direction": [0, 1, 0], "angle_deg": 2}],
 "receivers": [{"mesh": "$1", "objects": "floor", "size": 96, "output": "scene.exr"}]}
JSON
    }
    bake whole.gltf whole.exr
    one_sided whole.gltf
    succeed bake scene.json -o above.exr
    same_values whole.exr above.exr || fail "their fronts do not cast"
    sed 's/"translation": \[-0.5, 0, 0\]/"translation": [-0.5, 2, 0], "rotation": [1, 0, 0, 0]/' whole.gltf >turned.gltf
    bake turned.gltf both.exr
    bake turned.gltf none.exr --no-cast plate
    differ both.exr none.exr
    one_sided turned.gltf
    succeed bake scene.json
    same_values scene.exr none.exr || fail "their backs cast"
    succeed bake scene.json --method cone --ao-method cones -o cone.exr
    [[ $stderr == *"2 of 3 meshes are one-sided, but voxels cast to both sides"* ]] || fail "$stderr"
}

@test "in a lit asset a material that does not receive stays as it was" {
    succeed bake masked.gltf --sun 0,1,0 --unwrap always --no-receive leaf --size 64 -o lit.gltf
    grep -o '"name": *"leaf"[^]]*' lit.gltf | head -1 | grep -q MOZ_lightmap && fail "the leaf has a lightmap"
    grep -q MOZ_lightmap lit.gltf || fail "nothing has a lightmap"
    succeed info lit.gltf
}

@test "info says how a material casts" {
    info_tells masked.gltf "masked (leaves, fences): it casts by its texture's alpha"
}

# The names of an image's inputs.
inputs_of() {
    "$VDBSHADE" info "$1" | sed -n 's/^vdbshade_input_[0-9]*: sha256:[0-9a-f]* //p' | tr '\n' ' '
}

@test "what decides where light comes through is an input" {
    bake masked.gltf one.exr
    [ "$(inputs_of one.exr)" = "masked.gltf emblem.png " ] || fail "$(inputs_of one.exr)"
    bake whole.gltf whole.exr
    [ "$(inputs_of whole.exr)" = "whole.gltf " ] || fail "$(inputs_of whole.exr)"
    printf 'mtllib my box.mtl\n' >box.obj
    write_box solid.obj
    cat solid.obj >>box.obj
    printf 'newmtl box\nd 1\n' >'my box.mtl'
    shade bake box.obj "${SMALL[@]}" -o box.exr
    [ "$(inputs_of box.exr)" = "box.obj my box.mtl " ] || fail "$(inputs_of box.exr)"
    mv 'my box.mtl' box.mtl
    shade bake box.obj "${SMALL[@]}" -o box.exr
    [ "$(inputs_of box.exr)" = "box.obj box.mtl " ] || fail "$(inputs_of box.exr)"
}

@test "no output replaces what is read with a model" {
    cp masked.gltf level.gltf
    base64 -d <<<"$BUFFER" >level.bin
    sed -i 's,"uri": "data:[^"]*","uri": "level.bin",' level.gltf
    ln -s emblem.png link.png
    ln level.bin hard.json
    sha256sum emblem.png level.bin >sums
    local out
    for out in emblem.png link.png; do
        refuses 2 "$out: the output is also an input" emblem.png -- bake level.gltf "${BAKE[@]}" --receive floor -o "$out"
        refuses 2 "$out: the output is also an input" emblem.png -- render level.gltf --sun 0,1,0 --size 16x16 -o "$out"
        refuses 2 "$out: the output is also an input" emblem.png -- bake level.gltf "${BAKE[@]}" --receive floor -o out.exr --stats "$out"
    done
    for out in level.bin hard.json; do
        refuses 2 "$out: the output is also an input" level.bin -- bake level.gltf "${BAKE[@]}" --receive floor -o out.exr --stats "$out"
    done
    sha256sum --check --quiet sums || fail "an input was replaced"
    bake level.gltf out.exr
    bake level.gltf out.exr
}

# Another image in place of the leaf's, opaque all over.
change_texture() {
    "$VDBSHADE" bake "$ASSETS/seeds_floor.obj" --sun 0,1,0 --size 8 -o emblem.png --quiet
}

@test "parts of a bake and golden bakes are told from those of another texture" {
    mkdir scenes
    cat >scenes/leaf.json <<'JSON'
{"casters": [{"mesh": "../masked.gltf"}],
 "lights": [{"name": "sun", "type": "directional", "direction": [0, 1, 0], "angle_deg": 2}],
 "receivers": [{"mesh": "../masked.gltf", "objects": ["floor"], "size": 32, "output": "leaf.exr"}]}
JSON
    "$VDBSHADE" regress scenes --update --quiet
    bake masked.gltf part.exr --shard 1/2
    change_texture
    bake masked.gltf part.exr --shard 2/2
    refuses 2 part.exr.1-of-2.part 'is of other inputs or options' emblem.png -- merge part.exr
    shade regress scenes
    [[ $output == *"leaf: not alike"* ]] || fail "not baked again"
}
