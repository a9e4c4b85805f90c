# Materials: what they cut out by textures, opacity maps (map_d) and vertex alpha, what of them is blended, and choosing by their names.
load helper

# write_level FILE MATERIAL IMAGE: a floor of 4 × 4 under material "earth" and a plate over it, of two primitives side by
# side: one of MATERIAL, one of "wood". The texture is the image at the URI.
write_level() {
    write_gltf "$1" <<GLTF
{"scenes": [{"nodes": [0, 1]}],
 "nodes": [{"name": "floor", "mesh": 0}, {"name": "plate", "mesh": 1, "translation": [-0.5, 0, 0]}, {"name": "unused"}],
 "meshes": [{"primitives": [{"plate": [-2, 0, -2, 2, 2], "material": 1}]},
            {"primitives": [{"plate": [-0.5, 1, -0.5, 0.5, 0.5], "material": 0}, {"plate": [0.75, 1, -0.5, 1.75, 0.5], "material": 2}]}],
 "materials": [$2, {"name": "earth"}, {"name": "wood"}], "textures": [{"source": 0}], "images": [{"uri": "$3"}]}
GLTF
}

# write_leaf FILE MATERIAL ALPHAS [COLORS]: a leaf of 1 × 1 over a floor of 4 × 4. Its four corners have the alphas, or COLORS.
write_leaf() {
    local colors=${4:-\"alphas\": [$3]}
    write_gltf "$1" <<GLTF
{"nodes": [{"name": "floor", "mesh": 0}, {"name": "leaf", "mesh": 1}], "materials": [$2],
 "meshes": [{"primitives": [{"plate": [-2, 0, -2, 2, 2]}]},
            {"primitives": [{"plate": [-0.5, 1, -0.5, 0.5, 0.5], "attributes": {"COLOR_0": {$colors}}, "material": 0}]}],
 "textures": [{"source": 0}], "images": [{"uri": "emblem.png"}]}
GLTF
}

# write_obj STATEMENTS: level.obj, which has the floor and the plate of write_level(), and level.mtl with its leaf's statements.
write_obj() {
    {
        printf 'mtllib level.mtl\n'
        printf 'v %s %s %s\n' -2 0 2 2 0 2 2 0 -2 -2 0 -2 -1 1 0.5 0 1 0.5 0 1 -0.5 -1 1 -0.5 0.25 1 0.5 1.25 1 0.5 1.25 1 -0.5 0.25 1 -0.5
        printf 'vt %s %s\n' 0 0 1 0 1 1 0 1
        printf 'o floor\nusemtl earth\nf 1/1 2/2 3/3 4/4\no plate\nusemtl leaf\nf 5/1 6/2 7/3 8/4\nusemtl wood\nf 9/1 10/2 11/3 12/4\n'
    } >level.obj
    printf 'newmtl earth\nnewmtl wood\nnewmtl leaf\n%b\n' "$1" >level.mtl
}

# Clear on the left, opaque on the right; between them alpha is u.
FADE='0, 255, 255, 0' FAINT='102, 102, 102, 102' WHOLE='255, 255, 255, 255'
TEXTURE='"baseColorTexture": {"index": 0}'

# Images of four columns of grey or of red and green, of which half are opaque; and others.
prepare() {
    cp "$ASSETS/emblem.png" .
    write_level masked.gltf "$(leaf MASK)" emblem.png
    write_level whole.gltf '{"name": "leaf"}' emblem.png
    printf 'P5 4 1 255\n\0\0\377\377' >right.pgm
    printf 'P5 4 1 255\n\377\377\0\0' >'left half.pgm'
    printf 'P6 4 1 255\n\0\377\0\0\377\0\377\0\0\377\0\0' >both.ppm
    printf 'P5 8 1 255\n\0\0\377\377\0\0\377\377' >twice.pgm
    printf 'P5 2 1 255\n\377\377' >opaque.pgm
    printf 'P5 8 1 255\n\40\60\100\120\140\160\200\220' >smoke.pgm
}

leaf() {
    printf '{"name": "leaf", "alphaMode": "%s", "pbrMetallicRoughness": {%s}}' "$1" "$TEXTURE"
}

# mask CUTOFF [SURFACE]
mask() {
    printf '{"alphaMode": "MASK", "alphaCutoff": %s, "pbrMetallicRoughness": {%s}}' "$1" "${2:-}"
}

BAKE=(--sun 0,1,0 --sun-angle 1 --ao 1 --size 96)

# bake FILE OUT [options]: the light on the floor.
bake() {
    succeed bake "$1" "${BAKE[@]}" --receive floor -o "$2" "${@:3}"
}

# bake_leaf OUT MATERIAL ALPHAS [COLORS]: the same of write_leaf().
bake_leaf() {
    write_leaf "${1%.exr}.gltf" "${@:2}"
    bake "${1%.exr}.gltf" "$1"
}

# bake_obj STATEMENTS OUT [options]: the same of write_obj().
bake_obj() {
    write_obj "$1"
    bake level.obj "${@:2}"
}

# lit FILE SHARE: of the floor in 1 / 100, by the sun
lit() {
    holds "(100 * $(mean_of "$1" shadow.sun) - $2) ^ 2 < 0.2 ^ 2"
}

@test "a texture beside the file, in it, and without the confined reader are one, for any number of threads" {
    write_level within.gltf "$(leaf MASK)" "data:image/png;base64,$(base64 -w0 emblem.png)"
    bake masked.gltf beside.exr
    bake within.gltf within.exr
    bake within.gltf trusted.exr --sandbox off
    bake whole.gltf whole.exr
    same beside.exr within.exr
    same beside.exr trusted.exr
    differ beside.exr whole.exr
    bake masked.gltf one.exr --threads 1
    bake masked.gltf two.exr --threads 2
    same one.exr two.exr
}

@test "exact with voxels is exact without" {
    bake masked.gltf none.exr --max-error 0.005
    bake masked.gltf fine.exr --max-error 0.005 --method exact --ao-method exact --resolution 96
    # each keeps 0.005; single values and edges are those of other rays
    succeed compare fine.exr none.exr --max-rmse 0.004 --max-difference 0.1 --max-p99 1 --max-penumbra 9 --max-shift 9
}

@test "a texture outside of the folder is not read" {
    mkdir -p in
    sed 's,"emblem.png","../emblem.png",' masked.gltf >in/masked.gltf
    bake in/masked.gltf out.exr
    says "outside of its folder"
    bake in/masked.gltf allowed.exr --allow-outside
    bake masked.gltf beside.exr
    same allowed.exr beside.exr
    differ out.exr beside.exr
}

@test "blended materials cast where they are cut out, by --cast-blended too, and glass only by that" {
    write_level hashed.gltf "$(leaf BLEND)" emblem.png
    bake masked.gltf masked.exr
    bake hashed.gltf hashed.exr --verbose
    says "blended materials that their textures cut out"
    same masked.exr hashed.exr
    bake hashed.gltf asked.exr --cast-blended
    same masked.exr asked.exr
    write_level glass.gltf '{"name": "leaf", "alphaMode": "BLEND", "pbrMetallicRoughness": {"baseColorFactor": [1, 1, 1, 0.2]}}' emblem.png
    bake glass.gltf glass.exr
    says "1 of 3 meshes have blended materials (glass, smoke) and cast no shadow"
    bake whole.gltf without.exr --no-cast leaf
    same glass.exr without.exr
    bake glass.gltf asked.exr --cast-blended
    bake whole.gltf whole.exr
    same asked.exr whole.exr
}

@test "materials are chosen by name where no object is called so" {
    bake whole.gltf whole.exr
    bake whole.gltf leafless.exr --no-cast leaf
    bake whole.gltf woodless.exr --no-cast 'material:w*'
    bake whole.gltf bare.exr --no-cast leaf --no-cast wood
    bake whole.gltf plateless.exr --no-cast plate
    differ whole.exr leafless.exr
    differ leafless.exr woodless.exr
    same bare.exr plateless.exr
    succeed bake whole.gltf "${BAKE[@]}" --no-receive leaf --no-receive wood -o others.exr
    same others.exr whole.exr
    succeed bake whole.gltf "${BAKE[@]}" --receive earth -o named.exr
    same named.exr whole.exr
    local -a fit=(--sun 0,1,0 --size 96 --unwrap always)
    succeed bake whole.gltf "${fit[@]}" --density floor=0.5 -o whole.exr
    succeed bake whole.gltf "${fit[@]}" --density earth=0.5 -o named.exr
    same named.exr whole.exr
    bake whole.gltf named.exr --treat leaf=sheet --treat 'material:w*=solid'
    refuses 2 "no object is named 'woof'" "did you mean 'wood'" "materials 'leaf', 'earth'" -- bake whole.gltf "${BAKE[@]}" --no-cast woof -o out.exr
}

@test "light on the backs of one-sided materials comes through" {
    # the plates' fronts are up
    one_sided() { # MESH
        cat >scene.json <<JSON
{"casters": [{"mesh": "$1", "one_sided": ["leaf", "material:wood"]}], "ao": {"distance": 1},
 "lights": [{"name": "sun", "type": "directional", "direction": [0, 1, 0], "angle_deg": 1}],
 "receivers": [{"mesh": "$1", "objects": "floor", "size": 96, "output": "scene.exr"}]}
JSON
    }
    bake whole.gltf whole.exr
    one_sided whole.gltf
    succeed bake scene.json -o above.exr
    same whole.exr above.exr
    sed 's/"translation": \[-0.5, 0, 0\]/"translation": [-0.5, 2, 0], "rotation": [1, 0, 0, 0]/' whole.gltf >turned.gltf
    bake turned.gltf both.exr
    bake turned.gltf none.exr --no-cast plate
    differ both.exr none.exr
    one_sided turned.gltf
    succeed bake scene.json
    same scene.exr none.exr
    succeed_saying "2 of 3 meshes are one-sided, but voxels cast to both sides" -- bake scene.json --method cone --ao-method cones -o cone.exr
}

@test "in a lit asset a material that does not receive stays as it was, and info says how it casts" {
    succeed bake masked.gltf --sun 0,1,0 --unwrap always --no-receive leaf --size 64 -o lit.gltf
    [ "$(show_gltf lit.gltf '["MOZ_lightmap" in str(one) for one in root["materials"] if one["name"] == "leaf"][0]')" = False ] || fail "the leaf"
    grep -q MOZ_lightmap lit.gltf || fail "nothing has a lightmap"
    succeed info lit.gltf
    info_tells masked.gltf "masked (leaves, fences): it casts by its texture's alpha"
}

# inputs_are FILE NAME …: the names of an image's inputs.
inputs_are() {
    "$VDBSHADE" info "$1" | sed -n 's/^vdbshade_input_[0-9]*: sha256:[0-9a-f]* //p' | diff - <(printf "%s\n" "${@:2}") || fail "$1: other inputs"
}

@test "textures that cut out casters count as inputs" {
    bake masked.gltf one.exr
    inputs_are one.exr masked.gltf emblem.png
    bake whole.gltf whole.exr
    inputs_are whole.exr whole.gltf
    sed -i '1i mtllib my box.mtl' box.obj
    printf 'newmtl box\nd 1\n' | tee box.mtl >'my box.mtl'
    succeed bake box.obj "${SMALL[@]}" -o box.exr
    inputs_are box.exr box.obj 'my box.mtl'
    rm 'my box.mtl'
    succeed bake box.obj "${SMALL[@]}" -o box.exr
    inputs_are box.exr box.obj box.mtl
    bake_obj 'map_d left half.pgm' out.exr
    inputs_are out.exr level.obj 'left half.pgm' level.mtl
}

@test "no output replaces what is read with a model" {
    write_level level.gltf "$(leaf MASK)" emblem.png
    sed -i 's,"uri": "data:[^"]*","uri": "level.bin",' level.gltf
    sed 's/.*base64,\([^"]*\).*/\1/' masked.gltf | base64 -d >level.bin
    ln -s emblem.png link.png
    ln level.bin hard.json
    sha256sum emblem.png level.bin >sums
    local out again="the output is also an input"
    for out in emblem.png link.png; do
        refuses 2 "$out: $again" emblem.png -- bake level.gltf "${BAKE[@]}" --receive floor -o "$out"
        refuses 2 "$out: $again" emblem.png -- render level.gltf --sun 0,1,0 --size 16x16 -o "$out"
    done
    for out in emblem.png link.png level.bin hard.json; do
        refuses 2 "$out: $again" -- bake level.gltf "${BAKE[@]}" --receive floor -o out.exr --stats "$out"
    done
    sha256sum --check --quiet sums || fail "an input was replaced"
    bake level.gltf out.exr
    bake level.gltf out.exr
    cp emblem.png 'left half.png'
    write_obj 'map_d left half.png'
    refuses 2 "left half.png: $again" -- bake level.obj "${BAKE[@]}" --receive floor --no-cast material:leaf -o 'left half.png'
    refuses 2 "level.mtl: $again" -- bake level.obj "${BAKE[@]}" --receive floor -o out.exr --stats level.mtl
}

@test "parts of a bake and golden bakes are told from those of another texture" {
    mkdir scenes
    write_bake scenes/leaf.json '{"mesh": "../masked.gltf"}' '' '"mesh": "../masked.gltf", "objects": ["floor"], "size": 32'
    "$VDBSHADE" regress scenes --update --quiet
    bake masked.gltf part.exr --shard 1/2
    "$VDBSHADE" bake "$ASSETS/seeds_floor.obj" --sun 0,1,0 --size 8 -o emblem.png --quiet # which is opaque
    bake masked.gltf part.exr --shard 2/2
    refuses 2 part.exr.1-of-2.part 'was baked from other inputs or options' emblem.png -- merge part.exr
    differ_printing "leaf: not alike" -- regress scenes
}

@test "light comes through where map_d is dark" {
    bake_obj 'map_d right.pgm' right.exr --verbose
    says "blended materials that their textures cut out"
    lit right.exr 90.625 # all but 1.5 of 16
    bake_obj 'map_d left half.pgm' left.exr
    lit left.exr 90.625
    differ left.exr right.exr
    bake_obj '' whole.exr
    lit whole.exr 87.5
    bake_obj 'map_d right.pgm' blended.exr --cast-blended
    same blended.exr right.exr
    info_tells level.obj "it casts no shadow, unless its texture cuts it out"
}

@test "map_d with an image that has alpha cuts out as a glTF's mask does" {
    bake masked.gltf gltf.exr --no-cast wood
    bake_obj 'map_d emblem.png' obj.exr --no-cast material:wood
    same obj.exr gltf.exr
    bake_obj 'map_d -imfchan m emblem.png' matte.exr --no-cast material:wood
    same matte.exr gltf.exr
}

@test "options of map_d" {
    bake_obj 'map_d right.pgm' right.exr
    bake_obj 'map_d left half.pgm' left.exr
    bake_obj 'map_d twice.pgm' twice.exr
    mkdir -p textures
    cp right.pgm textures/
    while IFS='|' read -r statement expected; do
        bake_obj "map_d $statement" out.exr
        same out.exr "$expected.exr"
    done <<'LIST'
-blendu on -texres 4 -o 0.5 0 0 right.pgm|left
-o 0.5 right.pgm|left
-s 2 1 1 right.pgm|twice
-imfchan r both.ppm|right
-imfchan g both.ppm|left
textures\\\\right.pgm|right
-mm 0 1 right.pgm|right
LIST
    says "level.mtl: line 4: 'map_d' is read without its option '-mm'"
    bake_obj 'map_d -s 2 -clamp on right.pgm' clamped.exr
    lit clamped.exr 89.0625 # the last column goes on: three quarters are there
}

@test "casters cast whole if their mask is opaque or missing" {
    bake_obj '' whole.exr
    bake_obj 'map_d opaque.pgm' out.exr
    same out.exr whole.exr
    bake_obj 'map_d gone.pgm' out.exr
    says "material 'leaf' casts whole, without the holes of its texture"
    same out.exr whole.exr
    bake_obj 'map_d -what on right.pgm' out.exr
    says "level.mtl: line 4: 'map_d' has the option '-what'"
    same out.exr whole.exr
    bake_obj 'map_Kd right.pgm' out.exr
    same out.exr whole.exr
    mkdir -p in
    write_obj 'map_d ../right.pgm'
    mv level.* in/
    bake in/level.obj out.exr
    says "in/level.mtl: line 4: 'map_d' names 'in/../right.pgm' outside of the model's folder"
    same out.exr whole.exr
}

@test "a material library that is missing is named" {
    bake_obj 'd 0.3' there.exr
    [[ $stderr != *library* ]] || fail "it is there"
    rm level.mtl
    bake level.obj gone.exr
    says "level.obj: the material library 'level.mtl' cannot be read"
}

@test "materials neither clear nor opaque are glass" {
    bake_obj '' without.exr --no-cast material:leaf
    bake_obj 'map_d smoke.pgm' smoke.exr
    says "1 of 3 meshes have blended materials (glass, smoke) and cast no shadow"
    same smoke.exr without.exr
    bake_obj 'd 0.3\nmap_d right.pgm' thin.exr
    same thin.exr without.exr
    bake_obj 'map_d right.pgm\nd 0.7' thick.exr
    bake_obj 'map_d right.pgm' right.exr
    same thick.exr right.exr
}

@test "a mask's edge runs where alpha between vertices is the cutoff" {
    bake_leaf half.exr "$(mask 0.5)" "$FADE"
    lit half.exr 96.875
    bake_leaf more.exr "$(mask 0.25)" "$FADE"
    lit more.exr 95.3125
    bake_leaf factor.exr "$(mask 0.25 '"baseColorFactor": [1, 1, 1, 0.5]')" "$FADE"
    same factor.exr half.exr
    bake half.gltf trusted.exr --sandbox off --threads 1
    same trusted.exr half.exr
    bake_leaf whole.exr '{}' "$FADE"
    lit whole.exr 93.75
    bake_leaf three.exr "$(mask 0.5)" '' '"VEC3": [255, 255, 255, 0, 0, 0, 0, 0, 0, 255, 255, 255], "componentType": 5121, "normalized": true'
    same three.exr whole.exr
}

@test "voxels have the same edge" {
    write_leaf half.gltf "$(mask 0.5)" "$FADE"
    bake half.gltf made.exr --method cone --resolution 96
    write_leaf whole.gltf "$(mask 0.5)" "$WHOLE"
    bake whole.gltf whole.exr --method cone --resolution 96
    differ made.exr whole.exr
}

@test "one alpha at all vertices is a factor" {
    bake_leaf clear.exr "$(mask 0.5)" "$FAINT"
    lit clear.exr 100
    bake_leaf faint.exr "$(mask 0.25 "$TEXTURE")" "$FAINT"
    bake_leaf factor.exr "$(mask 0.25 "$TEXTURE, \"baseColorFactor\": [1, 1, 1, 0.4]")" "$WHOLE"
    same faint.exr factor.exr
}

@test "blended leaves whose vertices are clear or opaque are cut out, and fading ones beside a texture are as it is" {
    local blend='{"alphaMode": "BLEND", "pbrMetallicRoughness": {}}'
    bake_leaf masked.exr "$(mask 0.5)" "$FADE"
    write_leaf blended.gltf "$blend" "$FADE"
    bake blended.gltf blended.exr --verbose
    says "blended materials that their textures cut out"
    same masked.exr blended.exr
    bake_leaf smoke.exr "$blend" '64, 128, 160, 112'
    lit smoke.exr 100
    bake_leaf textured.exr "$(mask 0.5 "$TEXTURE")" "$FADE"
    says "the alpha of its vertices is ignored beside a texture's"
    bake_leaf plain.exr "$(mask 0.5 "$TEXTURE")" "$WHOLE"
    same textured.exr plain.exr
}
