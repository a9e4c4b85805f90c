# Assets as outputs (.glb, .gltf): the mesh file with its light.
load helper

# files [PATTERN]: names in one line, without the cube and Bats' own files.
files() {
    local name names=()
    for name in ${1:-*}; do
        [[ $name == separate-stderr-* || $name == box.obj ]] || names+=("$name")
    done
    echo "${names[@]}"
}

BAKE=(--sun 0.4,0.8,0.3 --sun-angle 5 --ao 1 --size 32)

@test "a mesh comes back as GLB with AO as occlusion and its light as lightmap" {
    succeed bake "$MODELS/scene.glb" "${BAKE[@]}" -o lit.glb
    says "lit.glb: 32 × 32, " " texels"
    show_gltf lit.glb text | grep -q '"occlusionTexture":{"index":0,"texCoord":1}' || fail "no occlusion"
    show_gltf lit.glb text | grep -q '"MOZ_lightmap":{"index":1,"texCoord":1,"intensity":3.' || fail "no lightmap"
    [ "$(files)" = lit.glb ] || fail "$(files) beside it"
    info_tells lit.glb "2, in 3 meshes, 16 triangles; UV sets: 2"
}

@test "a glTF has its buffer and images beside it, and --exr writes the lightmap" {
    succeed bake "$MODELS/scene.gltf" "${BAKE[@]}" --irradiance --ambient 0.2,0.2,0.2 --seams keep -o lit.gltf \
        --exr all.exr
    [ "$(files '*')" = "all.exr lit.bin lit.gltf lit.lightmap.png lit.occlusion.png" ] || fail "$(files)"
    shade bake "$MODELS/scene.gltf" "${BAKE[@]}" --irradiance --ambient 0.2,0.2,0.2 -o image.exr
    same all.exr image.exr
}

@test "--preview writes unlit base colour; other formats become GLB" {
    for model in scene.glb scene.fbx scene.dae figure.fbx scene_draco.glb; do
        succeed bake "$MODELS/$model" "${BAKE[@]}" -o lit.glb --preview
        show_gltf lit.glb text | grep -q '"KHR_materials_unlit":{}' || fail "$model: no preview"
    done
    succeed bake "$MODELS/scene_draco.glb" --sun 0.4,0.8,0.3 --vertex-colors irradiance -o lit.glb
    show_gltf lit.glb text | grep '"COLOR_0"' | grep -v KHR_draco | grep -q '"KHR_materials_unlit":{}' || fail "no colours"
    succeed_saying "too large for the light on them" -- bake "$MODELS/scene_draco.glb" --ao 1 --max-error 0.01 --vertex-colors ao -o lit.glb
    succeed bake "$MODELS/scene_draco.glb" --ao 1 --ao-method rays --rays 2 --vertex-colors ao -o lit.glb
    [[ $stderr != *"too large"* ]] || fail "noise of few rays: $stderr"
    succeed bake box.obj "${BAKE[@]}" -o lit.glb
    show_gltf lit.glb text | grep -q '"TEXCOORD_0"' || fail "no UVs"
}

@test "options that only assets have, and those that assets lack, are refused" {
    cp "$MODELS/scene.glb" in.glb
    for words in "--preview -o a.png" "--exr b.exr -o a.png"; do
        # shellcheck disable=SC2086
        refuses 2 "${words%% *}" ".glb, .gltf or .obj" -- bake in.glb "${BAKE[@]}" $words
    done
    refuses 2 b.png .exr -- bake in.glb "${BAKE[@]}" --exr b.png -o a.glb
    refuses 2 -- bake in.glb "${BAKE[@]}" --exr in.glb -o a.glb
    refuses 2 a.glb "32 bits" -- bake in.glb "${BAKE[@]}" --bits 32 -o a.glb
    refuses 2 a.glb pack -- bake in.glb "${BAKE[@]}" --pack R=ao -o a.glb
    refuses 2 in.glb "the output is also an input" -- bake in.glb "${BAKE[@]}" -o in.glb
    refuses 2 a.glb AO -- bake in.glb --sky y --size 32 -o a.glb
    refuses 2 a.png "vertex colours 'ao'" -- bake in.glb --ao 1 --vertex-colors ao -o a.png
    refuses 2 a.glb "vertex colours 'shadow.moon'" "shadow.sun," -- bake in.glb --sun 0,1,0 --vertex-colors shadow.moon -o a.glb
    refuses 2 --size -- bake in.glb --ao 1 --vertex-colors ao --size 8 -o a.glb
    [ "$(files)" = in.glb ] || fail "$(files)"
    echo '{"casters": [{"mesh": "in.glb"}], "lights": [{"name": "sun", "type": "directional", "direction": [0, 1, 0], "color": [9, 9, 9]}],
        "receivers": [{"mesh": "in.glb", "output": "a.glb", "vertex_colors": "irradiance"}, {"mesh": "in.glb", "output": "a.exr", "size": 16}]}' >both.json
    succeed bake both.json
    [[ $stderr == *'light of up to'*'is cut to 1'* ]] || fail "$stderr"
}

# sets_are FILE COUNT [SET …]: the count of its UV sets, and those that its materials use.
sets_are() {
    local found
    found=$(show_gltf "$1" 'len(set(re.findall("TEXCOORD_.", text)))' 'sorted(set(re.findall("texCoord\":(.)", text)))')
    [ "$found" = "${*:2}" ] || fail "$1: $found"
}

@test "new UVs replace the old lightmap's set, and no set that other textures use" {
    cp "$MODELS/scene.glb" lit0.glb
    local n
    for n in 1 2 3; do
        succeed bake lit$((n - 1)).glb "${BAKE[@]}" --unwrap always -o lit$n.glb
        sets_are lit$n.glb 2 1
        [[ $stderr != *TEXCOORD* ]] || fail "$stderr"
    done
    # the lightmap's UVs can be baked again
    succeed bake lit3.glb "${BAKE[@]}" --uv-set 1 --unwrap never --irradiance -o again.exr
    # a lightmap that stays keeps its set
    for n in ao.glb ao2.glb; do
        succeed bake "$([ $n = ao.glb ] && echo lit1.glb || echo ao.glb)" --ao 1 --size 32 --unwrap always -o $n
        says "textures that stay use TEXCOORD_1, so the lightmap's UVs are TEXCOORD_2"
        sets_are $n 3 1 2
    done
    # and when both are replaced they share the first
    succeed bake ao2.glb "${BAKE[@]}" --unwrap always -o both.glb
    sets_are both.glb 3 1
    # sets made by a preview, by unwrap, and from another format
    succeed bake lit1.glb "${BAKE[@]}" --unwrap always --preview -o preview.glb
    sets_are preview.glb 3 1 2
    "$VDBSHADE" unwrap "$MODELS/scene.glb" -o one.glb
    "$VDBSHADE" unwrap one.glb -o two.glb
    sets_are two.glb 2
    succeed bake "$MODELS/scene.fbx" "${BAKE[@]}" --unwrap always -o fbx.glb
    sets_are fbx.glb 2 1
}

@test "a mesh that has no room for another set of UVs is refused" {
    cp "$MODELS"/scene.* .
    local eight='&'
    for set in 2 3 4 5 6 7; do
        eight+=", \"TEXCOORD_$set\" : \1"
    done
    sed "s/\"TEXCOORD_1\" : \([0-9]*\)/$eight/" scene.gltf >free.gltf
    sets_are free.gltf 8
    succeed bake free.gltf --ao 1 --size 32 --unwrap always -o free.glb
    sets_are free.glb 8 1
    sed 's/"doubleSided" : true/&, "emissiveTexture":{"index":0,"texCoord":1}/' free.gltf >eight.gltf
    old_output out.gltf
    shade bake eight.gltf --ao 1 --size 32 --unwrap always --quiet -o out.gltf
    refused 4 eight.gltf 'meshes[1].primitives[0] has 8 sets of UVs' 'no more than 8'
    [ "$(cat out.gltf)" = old ] || fail "the old output is gone"
    succeed bake eight.gltf --ao 1 --size 32 --unwrap always -o out.exr
}

@test "UVs that a packer made integers are baked as its textures see them" {
    write_packed plain.gltf 5126 1
    write_packed packed.gltf 5123 4096 '{"scale": [0.000244140625, 0.000244140625]}' # 1 / 4096
    for file in plain packed; do
        succeed bake $file.gltf "${BAKE[@]}" --unwrap never -o $file.exr
    done
    same plain.exr packed.exr
    # an asset gets new UVs in a set of their own, or uses the file's own UVs through the same transform
    succeed bake packed.gltf "${BAKE[@]}" --size 64 -o anew.glb
    sets_are anew.glb 2 1
    succeed bake packed.gltf "${BAKE[@]}" --unwrap never -o own.glb
    show_gltf own.glb text | grep -q '"occlusionTexture":{[^}]*"scale":\[0.000244140625,' || fail "AO without the transform"
    succeed bake own.glb "${BAKE[@]}" --unwrap never -o own.exr
    same plain.exr own.exr
    # an OBJ has no transform, so its UVs include it
    succeed bake packed.gltf "${BAKE[@]}" --unwrap never -o own.obj
    grep -q '^vt 0.75 0.75$' own.obj || fail "$(grep '^vt' own.obj)"
    # textures with different transforms leave the packing unknown: all UVs are new
    sed 's/"baseColorTexture"/"metallicRoughnessTexture": {"index": 0}, &/' packed.gltf >mixed.gltf
    succeed bake mixed.gltf "${BAKE[@]}" --size 64 -o mixed.glb
    sets_are mixed.glb 2 1
}

@test "beside an occlusion texture the lightmap has ambient light without AO" {
    cat >dark.json <<JSON
{"casters": [{"mesh": "$MODELS/scene.glb"}], "irradiance": true, "ambient": [0.5, 0.5, 0.5], "ao": {"distance": 1},
 "lights": [{"name": "sun", "type": "directional", "direction": [0.4, 0.8, 0.3], "color": [0, 0, 0]}],
 "receivers": [{"mesh": "$MODELS/scene.glb", "size": 32, "padding": "auto", "output": "dark.gltf"}]}
JSON
    succeed bake dark.json
    info_tells dark.occlusion.png "'Y': min 0.4"
    info_tells dark.lightmap.png "min 0.50196" "max 0.50196" # 0.5 of 8 bits, in every texel
}

@test "baked again over its own output, or beside files of its input, a glTF replaces only what is its own" {
    succeed bake "$ASSETS/thin.glb" --ao 0.5 --size 32 -o lit.gltf
    cp lit.gltf in.gltf # which names lit.bin and lit.occlusion.png
    cp lit.bin bin.before
    cp lit.occlusion.png png.before
    for again in 1 2; do
        succeed bake in.gltf --ao 0.2 --size 32 -o new.gltf
        succeed bake in.gltf --ao 0.2 --size 32 -o lit.gltf
    done
    [ "$(ls lit.* new.*)" = "$(printf '%s\n' lit.1.bin lit.bin lit.gltf lit.occlusion.1.png lit.occlusion.png new.bin new.gltf new.occlusion.png)" ] || fail "$(ls)"
    cmp lit.bin bin.before && cmp lit.occlusion.png png.before || fail 'a file of the input was replaced'
    grep -q '"uri": "lit.1.bin"' lit.gltf && grep -q '"uri": "lit.occlusion.1.png"' lit.gltf || fail "$(grep uri lit.gltf)"
    cmp lit.occlusion.1.png new.occlusion.png || fail 'another image'
    # an image that is replaced is neither named, nor copied, nor missed
    [ "$(grep -o '"uri": "[^"]*"' new.gltf | sort | tr '\n' ' ')" = '"uri": "new.bin" "uri": "new.occlusion.png" ' ] || fail "$(grep uri new.gltf)"
    mkdir far
    rm lit.occlusion.png
    succeed bake in.gltf --ao 0.2 --size 32 -o far/new.gltf
    [[ $stderr != *lit.occlusion.png* ]] || fail "$stderr"
    [ "$(ls far | tr '\n' ' ')" = 'new.bin new.gltf new.occlusion.png ' ] || fail "$(ls far)"
}

@test "an asset says where it comes from, in its extras, as images do" {
    succeed bake "$ASSETS/thin.glb" --ao 0.5 --size 32 -o lit.gltf --exr lit.exr
    shade info lit.exr
    told=$(grep '^vdbshade_' <<<"$output" | grep -v '^vdbshade_rgb') # which is of the EXR's own picture
    [[ $told == *vdbshade_ao:* && $told == *vdbshade_input_0:\ sha256:*thin.glb* && $told == *"vdbshade_command: bake --ao 0.5"* ]] || fail "$told"
    show_gltf lit.gltf '"\n".join("%s: %s" % one for one in root["asset"]["extras"].items())' >extras
    [ "$(cat extras)" = "$told" ] || fail "$(cat extras), not $told"
    # others' stay, and what an earlier bake has told goes
    sed -i 's/"extras": {/"extras": {"mine": [1], "vdbshade_old": "x",/' lit.gltf
    grep -q '"mine"' lit.gltf
    latin=$(printf 'n\xe9.gltf')
    mv lit.gltf "$latin"
    succeed bake "$latin" --ao 0.2 --size 32 -o again.gltf
    show_gltf again.gltf 'root["asset"]["extras"]' >extras
    grep -q "'mine': \[1\].*'vdbshade_command': [^,]*--ao 0.2.*'vdbshade_input_0': [^,]*n?.gltf'" extras || fail "$(cat extras)"
    ! grep -q vdbshade_old extras || fail "$(cat extras)"
    succeed bake "$ASSETS/thin.glb" --ao 0.5 --size 32 -o lit.obj
    grep -q '^# vdbshade_ao: ' lit.obj && grep -q '^# vdbshade_input_0: sha256' lit.obj || fail "$(head -9 lit.obj)"
}
