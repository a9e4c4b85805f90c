# Materials: cut-outs by textures, opacity maps (map_d) and vertex alpha; one-sided ones; choosing by name.
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

# write_leaf FILE MATERIAL COLORS: a leaf of 1 × 1 over a floor of 4 × 4. Its four corners have the colours.
write_leaf() {
    write_gltf "$1" <<GLTF
{"nodes": [{"name": "floor", "mesh": 0}, {"name": "leaf", "mesh": 1}], "materials": [$2],
 "meshes": [{"primitives": [{"plate": [-2, 0, -2, 2, 2]}]},
            {"primitives": [{"plate": [-0.5, 1, -0.5, 0.5, 0.5], "attributes": {"COLOR_0": {$3}}, "material": 0}]}],
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
FADE='"alphas":[0,255,255,0]' FAINT='"alphas":[102,102,102,102]' WHOLE='"alphas":[255,255,255,255]'
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

# leaf MODE [SURFACE]
leaf() {
    printf '{"name": "leaf", "alphaMode": "%s", "pbrMetallicRoughness": {%s}}' "$1" "${2-$TEXTURE}"
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

# bake_obj STATEMENTS OUT [options]: bakes the floor of write_obj().
bake_obj() {
    write_obj "$1"
    bake level.obj "${@:2}"
}

# lit FILE SHARE: of the floor in 1 / 100, by the sun
lit() {
    holds "(100 * $(mean_of "$1" shadow.sun) - $2) ^ 2 < 0.2 ^ 2"
}

@test "a texture beside the file, in it, and without the confined reader casts the same" {
    write_level within.gltf "$(leaf MASK)" "data:image/png;base64,$(base64 -w0 emblem.png)"
    bake masked.gltf beside.exr
    bake within.gltf within.exr
    bake within.gltf trusted.exr --sandbox off
    bake whole.gltf whole.exr
    same beside.exr within.exr
    same beside.exr trusted.exr
    differ beside.exr whole.exr
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
    sed 's/"translation": \[-0.5, 0, 0\]/"translation": [-0.5, 2, 0], "rotation": [1, 0, 0, 0]/' whole.gltf >turned.gltf
    local mesh
    for mesh in whole turned; do # the plates' fronts are up, or down
        cat >$mesh.json <<JSON
{"casters": [{"mesh": "$mesh.gltf", "one_sided": ["leaf", "material:wood"]}], "ao": {"distance": 1},
 "lights": [{"name": "sun", "type": "directional", "direction": [0, 1, 0], "angle_deg": 1}],
 "receivers": [{"mesh": "$mesh.gltf", "objects": "floor", "size": 96, "output": "$mesh.one_sided.exr"}]}
JSON
        succeed bake $mesh.json
        bake $mesh.gltf $mesh.exr
    done
    same whole.exr whole.one_sided.exr
    bake turned.gltf none.exr --no-cast plate
    differ turned.exr none.exr
    same turned.one_sided.exr none.exr
    succeed_saying "2 of 3 meshes are one-sided, but voxels cast to both sides" -- bake turned.json --method cone --ao-method cones -o cone.exr
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

@test "no output replaces a file that a model names" {
    write_level level.gltf "$(leaf MASK)" emblem.png
    sed -i 's,"uri": "data:[^"]*","uri": "level.bin",' level.gltf
    sed 's/.*base64,\([^"]*\).*/\1/' masked.gltf | base64 -d >level.bin
    ln -s emblem.png link.png
    ln level.bin hard.json
    write_obj 'map_d left half.png'
    cp emblem.png 'left half.png'
    sha256sum emblem.png level.bin level.mtl 'left half.png' >sums
    local out
    for out in emblem.png link.png; do
        refuses 2 "$out: the output is also an input" emblem.png -- bake level.gltf "${BAKE[@]}" --receive floor -o "$out"
        refuses 2 "$out: the output is also an input" emblem.png -- render level.gltf --sun 0,1,0 --size 16x16 -o "$out"
        refuses 2 "$out: the output is also an input" -- bake level.gltf "${BAKE[@]}" --receive floor -o out.exr --stats "$out"
    done
    refuse_each bake "${BAKE[@]}" --receive floor <<'LIST'
2 'level.bin: the output is also an input' | level.gltf -o out.exr --stats level.bin
2 'hard.json: the output is also an input' | level.gltf -o out.exr --stats hard.json
2 'left half.png: the output is also an input' | level.obj --no-cast material:leaf -o 'left half.png'
2 'level.mtl: the output is also an input' | level.obj -o out.exr --stats level.mtl
LIST
    sha256sum --check --quiet sums || fail "an input was replaced"
    bake level.gltf out.exr
    bake level.gltf out.exr
}

@test "map_d cuts out where it is dark, by its options, and a warning names what cannot be read" {
    bake_obj '' whole.exr
    lit whole.exr 87.5
    bake_obj '' without.exr --no-cast material:leaf
    bake_obj 'map_d right.pgm' right.exr
    lit right.exr 90.625 # all but 1.5 of 16
    bake_obj 'map_d left half.pgm' left.exr
    lit left.exr 90.625
    differ left.exr right.exr
    bake_obj 'map_d twice.pgm' twice.exr
    bake masked.gltf emblem.exr
    mkdir -p textures
    cp right.pgm textures/
    local statements expected said
    while IFS='|' read -r statements expected said; do
        bake_obj "$statements" out.exr --verbose
        same out.exr "$expected.exr" || fail "$statements"
        says "$said"
    done <<'LIST'
map_d right.pgm|right|blended materials that their textures cut out
map_d emblem.png|emblem|
map_d -imfchan m emblem.png|emblem|
map_d -blendu on -texres 4 -o 0.5 0 0 right.pgm|left|
map_d -o 0.5 right.pgm|left|
map_d -s 2 1 1 right.pgm|twice|
map_d -imfchan r both.ppm|right|
map_d -imfchan g both.ppm|left|
map_d textures\\\\right.pgm|right|
map_d -mm 0 1 right.pgm|right|level.mtl: line 4: 'map_d' is read without its option '-mm'
map_d -what on right.pgm|whole|level.mtl: line 4: 'map_d' has the option '-what'
map_d opaque.pgm|whole|
map_d gone.pgm|whole|material 'leaf' casts whole, without the holes of its texture
map_Kd right.pgm|whole|
map_d smoke.pgm|without|1 of 3 meshes have blended materials (glass, smoke) and cast no shadow
d 0.3\nmap_d right.pgm|without|
map_d right.pgm\nd 0.7|right|
LIST
    bake_obj 'map_d -s 2 -clamp on right.pgm' clamped.exr
    lit clamped.exr 89.0625 # the last column goes on: three quarters are there
    bake_obj 'map_d right.pgm' blended.exr --cast-blended
    same blended.exr right.exr
    info_tells level.obj "it casts no shadow, unless its texture cuts it out"
}

@test "a material library that is missing, and a mask outside of the folder, are named" {
    bake_obj 'd 0.3' there.exr
    [[ $stderr != *library* ]] || fail "it is there"
    rm level.mtl
    bake level.obj gone.exr
    says "level.obj: the material library 'level.mtl' cannot be read"
    mkdir -p in
    write_obj 'map_d ../right.pgm'
    mv level.* in/
    bake in/level.obj out.exr
    says "in/level.mtl: line 4: 'map_d' names 'in/../right.pgm' outside of the model's folder"
    lit out.exr 87.5
}

@test "alpha at vertices cuts out where it passes the cutoff, or is a factor" {
    local name material alphas expected
    while IFS='|' read -r name expected material alphas; do
        write_leaf "$name.gltf" "$material" "$alphas"
        bake "$name.gltf" "$name.exr" --verbose
        case $expected in
            [0-9]*) lit "$name.exr" "$expected" ;;
            *) same "$name.exr" "$expected.exr" ;;
        esac || fail "$name"
    done <<LIST
half|96.875|$(mask 0.5)|$FADE
more|95.3125|$(mask 0.25)|$FADE
factor|half|$(mask 0.25 '"baseColorFactor": [1, 1, 1, 0.5]')|$FADE
whole|93.75|{}|$FADE
without alpha|whole|$(mask 0.5)|"VEC3":[255,255,255,0,0,0,0,0,0,255,255,255],"componentType":5121,"normalized":true
clear|100|$(mask 0.5)|$FAINT
times a texture|97.99|$(mask 0.25 "$TEXTURE, \"baseColorFactor\": [1, 1, 1, 0.4]")|$WHOLE
faint|times a texture|$(mask 0.25 "$TEXTURE")|$FAINT
smoke|100|$(leaf BLEND '')|"alphas":[64,128,160,112]
blended|half|$(leaf BLEND '')|$FADE
LIST
    says "blended materials that their textures cut out"
    bake half.gltf trusted.exr --sandbox off
    same trusted.exr half.exr
    bake half.gltf marched.exr --method cone --resolution 96
    bake whole.gltf marched_whole.exr --method cone --resolution 96
    differ marched.exr marched_whole.exr
}

@test "the alpha of vertices is ignored beside a texture's, with a warning, if it fades" {
    write_leaf fading.gltf "$(mask 0.5 "$TEXTURE")" "$FADE"
    bake fading.gltf fading.exr
    says "the alpha of its vertices is ignored beside a texture's"
    write_leaf plain.gltf "$(mask 0.5 "$TEXTURE")" "$WHOLE"
    bake plain.gltf plain.exr
    same fading.exr plain.exr
}
