# The alpha of a glTF's vertex colours (COLOR_0), which multiplies its material's.
load helper

# write_leaf FILE MATERIAL COLORS COUNT: a leaf of 1 × 1 over a floor of 4 × 4, whose corners have COLORS (RGBA of a byte each,
# as printf has them), COUNT components of them.
write_leaf() {
    {
        printf '\0\0\0\xc0\0\0\0\0\0\0\0\x40\0\0\0\x40\0\0\0\0\0\0\0\x40\0\0\0\x40\0\0\0\0\0\0\0\xc0\0\0\0\xc0\0\0\0\0\0\0\0\xc0'
        printf '\0\0\0\xbf\0\0\x80\x3f\0\0\0\x3f\0\0\0\x3f\0\0\x80\x3f\0\0\0\x3f'
        printf '\0\0\0\x3f\0\0\x80\x3f\0\0\0\xbf\0\0\0\xbf\0\0\x80\x3f\0\0\0\xbf'
        printf '\0\0\0\0\0\0\x80\x3f\0\0\x80\x3f\0\0\x80\x3f\0\0\x80\x3f\0\0\0\0\0\0\0\0\0\0\0\0'
        printf '\0\0\1\0\2\0\0\0\2\0\3\0'
        printf '%b' "$3"
    } >"${1%.gltf}.bin"
    cat >"$1" <<GLTF
{"asset": {"version": "2.0"}, "scenes": [{"nodes": [0, 1]}],
 "nodes": [{"name": "floor", "mesh": 0}, {"name": "leaf", "mesh": 1}],
 "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_0": 2}, "indices": 3}]},
            {"primitives": [{"attributes": {"POSITION": 1, "TEXCOORD_0": 2, "COLOR_0": 4}, "indices": 3, "material": 0}]}],
 "materials": [$2],
 "textures": [{"source": 0}], "images": [{"uri": "emblem.png"}],
 "accessors": [{"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"},
               {"bufferView": 1, "componentType": 5126, "count": 4, "type": "VEC3"},
               {"bufferView": 2, "componentType": 5126, "count": 4, "type": "VEC2"},
               {"bufferView": 3, "componentType": 5123, "count": 6, "type": "SCALAR"},
               {"bufferView": 4, "componentType": 5121, "normalized": true, "count": 4, "type": "VEC${4:-4}"}],
 "bufferViews": [{"buffer": 0, "byteLength": 48}, {"buffer": 0, "byteOffset": 48, "byteLength": 48},
                 {"buffer": 0, "byteOffset": 96, "byteLength": 32}, {"buffer": 0, "byteOffset": 128, "byteLength": 12},
                 {"buffer": 0, "byteOffset": 140, "byteLength": 16, "byteStride": 4}],
 "buffers": [{"byteLength": 156, "uri": "${1%.gltf}.bin"}]}
GLTF
}

# Clear on the left, opaque on the right; between them alpha is u.
FADE='\377\377\377\0\377\377\377\377\377\377\377\377\377\377\377\0'
FAINT='\377\377\377\146\377\377\377\146\377\377\377\146\377\377\377\146' # 0.4
WHOLE='\377\377\377\377\377\377\377\377\377\377\377\377\377\377\377\377'
TEXTURE='"baseColorTexture": {"index": 0}'

setup() {
    cd "$BATS_TEST_TMPDIR" || return 1
    cp "$ASSETS/emblem.png" .
}

# mask CUTOFF [SURFACE]
mask() {
    printf '{"alphaMode": "MASK", "alphaCutoff": %s, "pbrMetallicRoughness": {%s}}' "$1" "${2:-}"
}

blend() {
    printf '{"alphaMode": "BLEND", "pbrMetallicRoughness": {%s}}' "${1:-}"
}

# bake FILE OUT [options]
bake() {
    succeed bake "$1" --sun 0,1,0 --sun-angle 1 --size 96 --receive floor -o "$2" "${@:3}"
}

# lit FILE SHARE: of the floor in 1 / 100
lit() {
    "$VDBSHADE" info "$1" | awk -v want="$2" '/shadow.sun/ { for (i = 1; i < NF; ++i) if ($i == "mean") { off = 100 * $(i + 1) - want } }
        END { exit !(off < 0.2 && off > -0.2) }' || fail "$1: not $2 % are lit: $("$VDBSHADE" info "$1")"
}

same() {
    same_values "$1" "$2" || fail "$1 and $2 are not the same"
}

@test "a mask's edge runs where alpha between vertices is the cutoff" {
    write_leaf half.gltf "$(mask 0.5)" "$FADE"
    bake half.gltf half.exr
    lit half.exr 96.875
    write_leaf more.gltf "$(mask 0.25)" "$FADE"
    bake more.gltf more.exr
    lit more.exr 95.3125
    write_leaf factor.gltf "$(mask 0.25 '"baseColorFactor": [1, 1, 1, 0.5]')" "$FADE"
    bake factor.gltf factor.exr
    same factor.exr half.exr
    bake half.gltf trusted.exr --sandbox off --threads 1
    same trusted.exr half.exr
    write_leaf opaque.gltf '{}' "$FADE"
    bake opaque.gltf whole.exr
    lit whole.exr 93.75
    write_leaf three.gltf "$(mask 0.5)" "$FADE" 3
    bake three.gltf three.exr
    same three.exr whole.exr
}

@test "voxels have the same edge" {
    write_leaf half.gltf "$(mask 0.5)" "$FADE"
    bake half.gltf made.exr --method cone --resolution 96
    write_leaf whole.gltf "$(mask 0.5)" "$WHOLE"
    bake whole.gltf whole.exr --method cone --resolution 96
    ! same_values made.exr whole.exr || fail "voxels are whole"
}

@test "where all vertices have one alpha it is a factor" {
    write_leaf faint.gltf "$(mask 0.5)" "$FAINT"
    succeed bake faint.gltf --sun 0,1,0 --receive floor --size 16 -o faint.exr
    lit faint.exr 100
    write_leaf faint.gltf "$(mask 0.25 "$TEXTURE")" "$FAINT"
    write_leaf factor.gltf "$(mask 0.25 "$TEXTURE, \"baseColorFactor\": [1, 1, 1, 0.4]")" "$WHOLE"
    bake faint.gltf faint.exr
    bake factor.gltf factor.exr
    same faint.exr factor.exr
}

@test "blended leaves whose vertices are clear or opaque are cut out, and fading ones beside a texture are as it is" {
    write_leaf masked.gltf "$(mask 0.5)" "$FADE"
    write_leaf blended.gltf "$(blend)" "$FADE"
    bake masked.gltf masked.exr
    bake blended.gltf blended.exr --verbose
    [[ $stderr == *"blended materials that their textures cut out"* ]] || fail "$stderr"
    same masked.exr blended.exr
    write_leaf smoke.gltf "$(blend)" '\377\377\377\100\377\377\377\200\377\377\377\240\377\377\377\160'
    bake smoke.gltf smoke.exr
    lit smoke.exr 100
    write_leaf textured.gltf "$(mask 0.5 "$TEXTURE")" "$FADE"
    write_leaf plain.gltf "$(mask 0.5 "$TEXTURE")" "$WHOLE"
    bake textured.gltf textured.exr
    [[ $stderr == *"the alpha of its vertices is ignored beside a texture's"* ]] || fail "$stderr"
    bake plain.gltf plain.exr
    same textured.exr plain.exr
}
