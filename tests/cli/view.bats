# vdbshade view: the page as a file, and its errors. browser.bats looks at it.
load helper

prepare() {
    "$VDBSHADE" bake box.obj "${SMALL[@]}" --ao 0.5 --quiet -o box.exr
}

# block ID PAGE: the bytes of a data block of a page.
block() {
    sed -n "s|^<script type=\"application/octet-stream\" id=\"$1\">\(.*\)</script>$|\1|p" "$2" | base64 -d
}

@test "the page needs no other file, and holds the channels of the bake" {
    succeed view box.obj --planes box.exr -o box.html
    [ -z "$output" ] || fail "something on standard output"
    no_leftovers
    ! grep -qE '(src|href)="?(https?:|/|\.)' box.html || fail "the page needs something beside it"
    grep -q "default-src 'none'" box.html || fail "no policy"
    tail -1 box.html | grep -q '</html>$' || fail "cut short"
    grep -q '"name":"box.obj"' box.html || fail "no name"
    grep -o '"name":"[a-zA-Z.]*","data"' box.html | sort >channels
    printf '"name":"%s","data"\n' A ao shadow.sun | diff - channels || fail "other channels"
    grep -q '"vdbshade_version"' box.html || fail "nothing of where the bake is from"
}

@test "the page's policy has the hash of every script" {
    succeed view box.obj -o box.html --quiet
    awk 'BEGIN { RS = "</script>" } match($0, /<script>/) { file = "script" ++n; printf "%s", substr($0, RSTART + 8) > file; close(file) }' box.html
    [ -s script3 ] || fail "too few scripts"
    for script in script*; do
        hash=$(sha256sum "$script" | cut -d' ' -f1 | sed 's/../\\x&/g')
        grep -qF "'sha256-$(printf "$hash" | base64)'" box.html || fail "$script: its hash is not in the policy"
    done
}

@test "the page has each element that its scripts use, once" {
    local id
    succeed view box.obj --planes box.exr -o box.html --quiet
    grep -oE '<[a-z0-9]+ ([^<>]* )?id="[a-z0-9-]+"' box.html | grep -oE 'id="[^"]+"' | sort >ids
    [ -z "$(uniq -d ids)" ] || fail "twice: $(uniq -d ids)"
    grep -ohE "byId\('[a-z-]+'\)" "$BATS_TEST_DIRNAME"/../../src/view/page/*.js | cut -d"'" -f2 | sort -u >sought
    [ "$(wc -l <sought)" -gt 10 ] || fail "nothing is looked for"
    while read -r id; do
        grep -qxF "id=\"$id\"" ids || fail "no $id"
    done <sought
}

@test "a GLB goes in byte by byte; compressed geometry and other formats as triangles" {
    succeed view "$ASSETS/cloister.glb" -o page.html --quiet
    block data0 page.html | cmp - "$ASSETS/cloister.glb" || fail "another GLB"
    for file in "$MODELS/scene_draco.glb" "$MODELS/scene.fbx" box.obj; do
        succeed view "$file" -o page.html --quiet
        block data0 page.html >plain.glb
        "$VDBSHADE" info "$file" | sed -n 's/^objects: .*, \([0-9]* triangles\).*/\1/p' >before
        "$VDBSHADE" info plain.glb | sed -n 's/^objects: .*, \([0-9]* triangles\).*/\1/p' >after
        [ -s before ] && diff before after || fail "$file: other triangles"
    done
    # the same UVs: the same bake
    block data0 page.html >plain.glb
    "$VDBSHADE" bake plain.glb "${SMALL[@]}" --ao 0.5 --quiet -o plain.exr
    same box.exr plain.exr
}

@test "the page contains the files that a glTF names, and warns of missing ones" {
    cp "$MODELS/scene.gltf" "$MODELS/scene.bin" .
    succeed view scene.gltf -o page.html
    block data0 page.html | cmp - scene.gltf
    block data1 page.html | cmp - scene.bin
    grep -q '"files":\[{"uri":"scene.bin","data":"data1"}\]' page.html || fail "no word of the buffer"
    sed 's|"buffers"|"images":[{"uri":"gone.png"},{"uri":"../secret.png"}],"buffers"|' scene.gltf >named.gltf
    echo secret >../secret.png
    succeed_saying gone.png "'../secret.png' is outside of its folder" -- view named.gltf -o page.html
    ! grep -q "$(base64 <../secret.png)" page.html || fail "a file outside of the folder is in the page"
    shade view named.gltf -o page.html --allow-outside
    grep -q "$(base64 <../secret.png)" page.html || fail "it was asked for"
}

# planes N FILE …: the values of the N blocks that are planes, which hold half floats. Each row has all values of a position.
# A row of a plane is 2048 wide at most.
planes() {
    python3 - "$@" <<'PY'
import struct, sys, zlib
planes = []
for path in sys.argv[2:]:
    data = bytearray(zlib.decompress(open(path, "rb").read()))
    for i in range(len(data)):
        data[i] = data[i] + data[i - 1] & 255 if i % int(sys.argv[1]) else data[i]
    half = len(data) // 2
    planes.append(struct.unpack(f">{half}e", bytes(b for pair in zip(data[:half], data[half:]) for b in pair)))
for row in zip(*planes):
    print(*row)
PY
}

@test "planes are those of the file, to a half float" {
    [ -e "$(dirname "$(realpath "$VDBSHADE")")/libvdbshade.so" ] || skip "this program has the library in it"
    cat >print.c <<'C'
#include <stdio.h>
#include <vdbshade/vdbshade.h>
int main(void) {
    vsh_image_file *file;
    if (vsh_image_read("box.exr", NULL, &file, NULL) != VSH_OK) return 2;
    const vsh_image image = vsh_image_view(file);
    for (int i = 0; i < image.width * image.height; ++i)
        printf("%.9g %.9g %.9g\n", image.planes[0][i], image.planes[1][i], image.planes[2][i]);
    vsh_image_free(file);
    return 0;
}
C
    compile print
    "$VDBSHADE" bake box.obj "${SMALL[@]}" --ao 0.5 --pack channels --quiet -o box.exr
    succeed view box.obj --planes box.exr -o page.html --quiet
    for block in 1 2 3; do
        block data$block page.html >$block
    done
    paste -d' ' <(./print) <(planes 32 1 2 3) |
        awk '{ for (i = 1; i <= 3; ++i) { d = $i - $(i + 3); bad += (d < 0 ? -d : d) > $i / 2048 } } END { exit bad || NR != 1024 }'
}

@test "light of a PNG that says sRGB is made linear" {
    "$VDBSHADE" bake box.obj "${SMALL[@]}" --irradiance --bits 16 --quiet -o light.png
    "$VDBSHADE" info light.png | grep -q 'vdbshade_color_space: sRGB'
    write_scene box.json box.obj '' '"color_space": "linear"'
    "$VDBSHADE" bake box.json "${COARSE[@]}" --irradiance --bits 16 --quiet -o plain.png
    for name in light plain; do
        succeed view box.obj --planes $name.png -o $name.html --quiet
        block data1 $name.html >$name.z
    done
    [ -s light.z ] && cmp light.z plain.z
}

@test "the page compares two bakes of one mesh or two" {
    succeed view box.obj --planes box.exr --other-planes box.exr -o page.html --quiet
    [ "$(grep -o '"uvSet"' page.html | wc -l)" -eq 2 ] || fail "not two"
    [ "$(grep -o '"model":"data[0-9]*"' page.html | wc -l)" -eq 1 ] || fail "not one model"
    succeed view box.obj "$ASSETS/cloister.glb" --planes box.exr -o page.html --quiet
    grep -q '"model":"data0"' page.html && grep -q '"model":"data4"' page.html || fail "not two models"
}

@test "a scene's page has shadow, AO and light at each vertex of its surface" {
    sed 's/"voxel_size": 0.02/"voxel_size": 0.05/' "$ASSETS/seeds.json" >seeds.json
    succeed view seeds.json -o page.html --quiet
    no_leftovers
    grep -oE '"name":"[a-zA-Z.]*","data":"data[0-9]"' page.html | cut -d'"' -f4,8 --output-delimiter=' ' >channels
    printf '%s\n' 'shadow.sun data1' 'ao data2' 'irradiance.R data3' 'irradiance.G data4' 'irradiance.B data5' | diff - channels
    block data0 page.html >0.glb
    for block in 1 2 3; do
        block data$block page.html >$block
    done
    # world position of each vertex, and its values
    show_gltf 0.glb 'root["accessors"][0]["count"]' 'root["nodes"][0]["matrix"][12:15]' >shape
    read -r count x y z <shape
    tail -c +$((29 + $(od -An -tu4 -j12 -N4 0.glb))) 0.glb | od -An -v -w12 -tf4 -N$((12 * count)) |
        awk -v x="$x" -v y="$y" -v z="$z" '{ print $1 + x, $2 + y, $3 + z }' |
        paste -d' ' - <(planes 2048 1 2 3 | head -n "$count") >vertices.txt
    # x y z shadow ao light. The floor is 6 × 6 at y = 0, the sphere's radius 0.5 around y = 0.8; the sun casts its shadow to
    # x = 0.67, z = 0.8. Under it AO is 1 - (0.5 / 0.8)². Light is 0.3 of the sky and the sun's cosine, 0.609.
    awk 'function near(x, y, z, r) { return ($1 - x) ^ 2 + ($2 - y) ^ 2 + ($3 - z) ^ 2 < r * r }
         function off(value, wanted, most) { return value - wanted > most || wanted - value > most }
         $2 > -0.03 && $2 < 0.03 { floor++ }
         near(0, 1.3, 0, 0.1) { top++; bad += off($4, 1, 0.01) }
         near(-2, 0, -2, 0.5) { open++; bad += off($4, 1, 0.01) || off($5, 1, 0.01) || off($6, 0.909, 0.01) }
         near(0.667, 0, 0.8, 0.2) { dark++; bad += off($4, 0, 0.01) || off($6, 0.3 * $5, 0.01) }
         near(0, 0, 0, 0.1) { under++; sum += $5 }
         END { print floor, top, open, dark, under, sum / under, bad
               exit !(floor > 13000 && top > 3 && open > 200 && dark > 30 && under > 5 && bad == 0 && !off(sum / under, 0.609, 0.03)) }' vertices.txt
}

@test "options without a meaning for scenes, and empty scenes, are refused" {
    old_output page.html
    cp "$ASSETS/seeds.json" .
    echo '{"casters": [{"mesh": "gone.obj"}], "ao": {"distance": 1}}' >names.json
    echo '{"casters": [], "ao": {"distance": 1}}' >empty.json
    echo '{"casters": [{"mesh": "page.html"}], "ao": {"distance": 1}}' >own.json
    refuse_each view -o page.html <<'LIST'
2 seeds.json 'takes no OTHER' | seeds.json --planes box.exr
2 seeds.json 'takes no OTHER' | seeds.json --other-planes box.exr
2 seeds.json 'takes no OTHER' | seeds.json --uv-set 1
2 seeds.json 'takes no OTHER' | seeds.json box.obj
3 gone.json | gone.json
3 gone.obj | names.json
2 empty.json casters | empty.json
2 page.html 'is also an input' | own.json
LIST
    untouched page.html
}

@test "layers, terrains and spheres of a scene are in its surface; without light only its shape is shown" {
    ln -s "$(cd "$ASSETS" && pwd)/terrain.png" .
    cat >scene.json <<'JSON'
{"casters": [{"heightfield": "terrain.png", "size": [10, 10], "height": 2, "base": 1, "direct": true},
             {"spheres": [[0, 4, 0, 1]], "layer": "above"}],
 "layers": [{"name": "above", "voxel_size": 0.2}], "voxel_size": 0.2}
JSON
    succeed view scene.json -o page.html --quiet
    block data0 page.html >surface.glb
    # the terrain's base is at y = -1, the sphere's top at y = 5
    "$VDBSHADE" info surface.glb | awk '$1 == "bounds:" { printf "%.2f %.2f %.2f\n", $3, $7, $6; exit }' >bounds
    [ "$(cat bounds)" = "-1.00 5.00 5.00" ] || fail "$(cat bounds)"
}

@test "view refuses missing, damaged and too large files, and too few or too many inputs" {
    old_output page.html
    head -c 3000 "$ASSETS/cloister.glb" >cut.glb
    head -c 300 box.exr >cut.exr
    printf 'glTF\2\0\0\0\24\0\0\0\377\377\377\377JSON' >lies.glb
    refuse_each view <<'LIST'
3 cut.glb | cut.glb -o page.html
3 cut.exr | box.obj --planes cut.exr -o page.html
3 lies.glb | lies.glb -o page.html
3 gone.exr | box.obj --planes gone.exr -o page.html
3 gone.obj | box.obj gone.obj -o page.html
2 'no INPUT' | -o page.html
2 'box.obj' | box.obj box.obj box.obj -o page.html
2 'page.html: the output is also an input' | box.obj --planes page.html -o page.html
LIST
    unless_sanitized "its shadow memory has no such limit"
    refuses 4 cloister.glb -- view "$ASSETS/cloister.glb" --memory-limit 100k -o page.html
    untouched page.html
}

@test "bake --view writes the page of its lightmap, and does not change the image" {
    succeed bake box.obj "${SMALL[@]}" --ao 0.5 -o again.exr --view baked.html --quiet
    cmp box.exr again.exr || fail "another image"
    shade view box.obj --planes again.exr -o page.html --quiet
    cmp baked.html page.html || fail "another page"
    old_output page.html
    refuse_each bake box.obj <<'LIST'
2 "--view 'page.exr': expected a name that ends in .html" | "${SMALL[@]}" -o again.exr --view page.exr
2 'again.exr: two outputs' | "${SMALL[@]}" -o again.exr --view again.exr
3 nowhere | "${SMALL[@]}" -o again.exr --view nowhere/page.html
2 'one lightmap of one mesh' | "${SMALL[@]}" --per-object -o objects/ --view page.html
2 "--view 'page.html': an image cannot store the new UVs" | --ao 1 --unwrap always -o unwrapped.png --view page.html
LIST
    untouched page.html
}
