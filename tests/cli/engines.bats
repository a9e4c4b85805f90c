# Engines run the code of docs/lit.md and its scripts in examples, and their pictures are compared with the bake.
load helper
load browser

WIDE=64

# bake_floor SET OUT: floor.gltf has a floor with the lightmap's UVs in that set, 1 or 2, under a roof. It is baked into OUT, and
# into mask.png: shadow in R, AO in G.
bake_floor() {
    cp "$BATS_TEST_DIRNAME/three.html" .
    local floor='"VEC2": [0, 1, 1, 1, 1, 0, 0, 0]' up='"VEC3": [0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1, 0]' none='"VEC2": [0, 0, 0, 0, 0, 0, 0, 0]'
    write_gltf floor.gltf floor.bin <<JSON
{"nodes": [{"name": "floor", "mesh": 0}, {"name": "roof", "mesh": 1}],
 "meshes": [{"primitives": [{"plate": [-2, 0, -2, 2, 2], "material": 0, "attributes": {"NORMAL": {$up}, "TEXCOORD_0": {$none}, "TEXCOORD_$((3 - $1))": {$none}, "TEXCOORD_$1": {$floor}}}]},
            {"primitives": [{"plate": [-1, 1, -1, 0.5, 1], "material": 1}]}], "materials": [{"name": "clay", "pbrMetallicRoughness": {"baseColorFactor": [0.6, 0.4, 0.2, 1], "metallicFactor": 0}}, {"name": "slate"}]}
JSON
    local options=(floor.gltf --receive floor --sun 0,1,0 --sun-angle 20 --ao 3 --size 64 --unwrap never --uv-set "$1" --quiet)
    "$VDBSHADE" bake "${options[@]}" --ambient 0.5,0.5,0.5 -o "$2"
    "$VDBSHADE" bake "${options[@]}" --pack R=shadow.sun,G=ao --bits 8 -o mask.png
}

# shows DRAWN BAKED CURVE COLOUR: each pixel of a picture, without its curve, is c[1 … 3] that COLOUR of awk makes of r, g and b
# (0 … 1) of the bake's first 64 rows. A step of sRGB is up to 2.3 of 255.
shows() {
    local at=({0..63}\ {0..63})
    # shellcheck disable=SC2048,SC2086 # pairs of numbers
    paste <(picture get "$1" ${at[*]}) <(picture get "$2" ${at[*]}) | awk -v curve="$3" '
        function linear(c) { return curve == "linear" ? c : c <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ^ 2.4 }
        { r = $4 / 255; g = $5 / 255; b = $6 / 255; '"$4"'
          for (i = 1; i <= 3; ++i) { d = linear($i / 255) - c[i]; sum += d * d; most = d > most ? d : -d > most ? -d : most; seen = c[i] > seen ? c[i] : seen } }
        END { printf "largest difference %.2f of 255, RMS %.2f\n", 255 * most, 255 * sqrt(sum / NR / 3); exit !(NR == 4096 && seen > 0.5 && 255 * most < 3) }' ||
        fail "$1 is not $2"
}

LIT='c[1] = 0.6 * (r + 0.5) * g; c[2] = 0.4 * (r + 0.5) * g; c[3] = 0.2 * (r + 0.5) * g'
OPTIONS=(-- --allow-file-access-from-files)

@test "three.js shows a lit glTF as it was baked, on the second and third UV set" {
    blocks_of js "$DOCS/lit.md" 1 >script.js
    for set in 1 2; do
        bake_floor $set lit.glb
        look three.html "" "${OPTIONS[@]}"
        shows page.png mask.png linear "$LIT"
    done
}

@test "three.js samples the slices of a volume" {
    bake_floor 1 lit.glb
    for output in probes.raw probes.png; do
        "$VDBSHADE" volume floor.gltf --sun 0.3,1,0.2 --ao 1 --box -2,-0.5,-1,2,1.5,1 --box-voxel-size 0.0625 -o $output --quiet
    done
    { blocks_of js "$DOCS/lit.md" 2 && echo 'drawSlices(0)'; } >script.js
    look three.html "" "${OPTIONS[@]}"
    shows page.png probes.png linear 'c[1] = r; c[2] = g; c[3] = 0'
}

@test "Godot 3 shows a lit glTF, a shadow mask and the slices of a volume as they were baked" {
    command -v godot3 >/dev/null && command -v xvfb-run >/dev/null || skip "there is no Godot 3, or no Xvfb"
    bake_floor 1 lit.gltf
    "$VDBSHADE" volume floor.gltf --sun 0,1,0 --sun-angle 20 --ao 3 --box -2,0,-2,2,0.0625,2 --box-voxel-size 0.0625 -o probes.png --quiet
    cp -r "$BATS_TEST_DIRNAME/godot" game
    mv lit.*.png lit.bin mask.png probes.png game # lit.gltf waits until its images are imported
    cd game
    cp "$BATS_TEST_DIRNAME/../../examples/godot3_lit.gd" lit.gd
    blocks_of glsl "$DOCS/lit.md" 1 >mask.shader.txt
    blocks_of glsl "$DOCS/lit.md" 2 >probes.shader.txt
    HOME=$PWD LIBGL_ALWAYS_SOFTWARE=1 timeout 400 xvfb-run -a bash -c 'godot() { godot3 --path . --audio-driver Dummy "$@"; }
        godot --export-pack all all.pck
        mv ../lit.gltf .
        godot --export-pack all all.pck
        godot --resolution 64x64 --script draw.gd' >godot.log 2>&1 || fail "$(tail -9 godot.log)"
    shows lit.drawn.png mask.png sRGB "$LIT"
    shows mask.drawn.png mask.png sRGB 'c[1] = c[2] = c[3] = r'
    shows probes.drawn.png probes.png sRGB 'c[1] = r; c[2] = g; c[3] = 0'
}
