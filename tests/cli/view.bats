# vdbshade view: the page as a file, and what is refused. What is seen of it: browser.bats.
load helper

setup() {
    cd "$BATS_TEST_TMPDIR" || return 1
    write_box box.obj
    "$VDBSHADE" bake box.obj "${SMALL[@]}" --ao 0.5 --quiet -o box.exr
}

# block ID PAGE: the bytes of a data block of a page.
block() {
    sed -n "s|^<script type=\"application/octet-stream\" id=\"$1\">\(.*\)</script>$|\1|p" "$2" | base64 -d
}

@test "a page that needs nothing beside it, of what was given" {
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

@test "every script of the page is one that its policy lets run" {
    succeed view box.obj -o box.html --quiet
    awk 'BEGIN { RS = "</script>" } match($0, /<script>/) { file = "script" ++n; printf "%s", substr($0, RSTART + 8) > file; close(file) }' box.html
    [ -s script3 ] || fail "too few scripts"
    for script in script*; do
        hash=$(sha256sum "$script" | cut -d' ' -f1 | sed 's/../\\x&/g')
        grep -qF "'sha256-$(printf "$hash" | base64)'" box.html || fail "$script: its hash is not in the policy"
    done
}

@test "what scripts look for in the page is there once" {
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
    models=$BATS_TEST_DIRNAME/../models
    for file in "$models/scene_draco.glb" "$models/scene.fbx" box.obj; do
        succeed view "$file" -o page.html --quiet
        block data0 page.html >plain.glb
        "$VDBSHADE" info "$file" | sed -n 's/^objects: .*, \([0-9]* triangles\).*/\1/p' >before
        "$VDBSHADE" info plain.glb | sed -n 's/^objects: .*, \([0-9]* triangles\).*/\1/p' >after
        [ -s before ] && diff before after || fail "$file: other triangles"
    done
    # the same UVs: the same bake
    block data0 page.html >plain.glb
    "$VDBSHADE" bake plain.glb "${SMALL[@]}" --ao 0.5 --quiet -o plain.exr
    same_values box.exr plain.exr || fail "another bake"
}

@test "a glTF takes along what it names, and warns of what is not there" {
    models=$BATS_TEST_DIRNAME/../models
    cp "$models/scene.gltf" "$models/scene.bin" .
    succeed view scene.gltf -o page.html
    block data0 page.html | cmp - scene.gltf
    block data1 page.html | cmp - scene.bin
    grep -q '"files":\[{"uri":"scene.bin","data":"data1"}\]' page.html || fail "no word of the buffer"
    sed 's|"buffers"|"images":[{"uri":"gone.png"},{"uri":"../secret.png"}],"buffers"|' scene.gltf >named.gltf
    echo secret >../secret.png
    succeed view named.gltf -o page.html
    [[ $stderr == *"gone.png"* ]] || fail "no warning of the missing picture"
    [[ $stderr == *"'../secret.png' is outside of its folder"* ]] || fail "no warning of the picture outside"
    ! grep -q "$(base64 <../secret.png)" page.html || fail "a file outside of the folder is in the page"
    shade view named.gltf -o page.html --allow-outside
    grep -q "$(base64 <../secret.png)" page.html || fail "it was asked for"
}

@test "planes are those of the file, to a half float" {
    build=$(dirname "$(realpath "$VDBSHADE")")
    [ -e "$build/libvdbshade.so" ] || skip "this program has the library in it"
    succeed view box.obj --planes box.exr -o page.html --quiet
    cat >planes.c <<'C'
#include <Imath/half.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <vdbshade/vdbshade.h>
#include <zlib.h>
/* IMAGE BLOCK …: the blocks of the channels, in their order but for R, G and B. */
int main(int argc, char **argv) {
    vsh_image_file *file;
    if (vsh_image_read(argv[1], NULL, &file, NULL) != VSH_OK) return 2;
    const vsh_image image = vsh_image_view(file);
    const size_t count = (size_t)image.width * (size_t)image.height;
    int at = 2;
    for (int c = 0; c < image.channel_count; ++c) {
        if (image.names[c][1] == 0 && image.names[c][0] != 'A') continue;
        if (at >= argc) return 3;
        FILE *in = fopen(argv[at++], "rb");
        unsigned char *packed = malloc(1 << 20), *bytes = malloc(2 * count);
        const size_t size = fread(packed, 1, 1 << 20, in);
        uLongf length = 2 * count;
        if (uncompress(bytes, &length, packed, size) != Z_OK || length != 2 * count) return 4;
        for (size_t i = 0; i < count; ++i) {
            if (i % (size_t)image.width) bytes[i] += bytes[i - 1], bytes[count + i] += bytes[count + i - 1];
            const float value = imath_half_to_float((imath_half_bits_t)(bytes[i] << 8 | bytes[count + i]));
            if (!(fabsf(value - image.planes[c][i]) <= fabsf(image.planes[c][i]) / 2048)) {
                printf("%s %zu: %g, not %g\n", image.names[c], i, value, image.planes[c][i]);
                return 1;
            }
        }
        fclose(in);
        free(packed);
        free(bytes);
    }
    vsh_image_free(file);
    return at == argc ? 0 : 5;
}
C
    "${CC:-cc}" -std=gnu11 ${CFLAGS-} -I"$BATS_TEST_DIRNAME/../../include" planes.c -L"$build" -lvdbshade -lz -lImath-3_1 -lm \
        -Wl,-rpath,"$build" -o planes
    block data1 page.html >one
    block data2 page.html >two
    block data3 page.html >three
    ./planes box.exr one two three
}

@test "light of a PNG that says sRGB is made linear" {
    "$VDBSHADE" bake box.obj "${SMALL[@]}" --irradiance --bits 16 --quiet -o light.png
    "$VDBSHADE" info light.png | grep -q 'vdbshade_color_space: sRGB'
    write_scene box.json box.obj '' '"color_space": "linear"'
    no_sun "${SMALL[@]}"
    "$VDBSHADE" bake box.json "${rest[@]}" --irradiance --bits 16 --quiet -o plain.png
    for name in light plain; do
        succeed view box.obj --planes $name.png -o $name.html --quiet
        block data1 $name.html >$name.z
    done
    [ -s light.z ] && cmp light.z plain.z
}

@test "two bakes, of one mesh and of two" {
    succeed view box.obj --planes box.exr --other-planes box.exr -o page.html --quiet
    [ "$(grep -o '"uvSet"' page.html | wc -l)" -eq 2 ] || fail "not two"
    [ "$(grep -o '"model":"data[0-9]*"' page.html | wc -l)" -eq 1 ] || fail "not one model"
    succeed view box.obj "$ASSETS/cloister.glb" --planes box.exr -o page.html --quiet
    grep -q '"model":"data0"' page.html && grep -q '"model":"data4"' page.html || fail "not two models"
}

@test "the same page for any number of threads" {
    for threads in 1 3; do
        "$VDBSHADE" view box.obj --planes box.exr -o $threads.html --threads $threads --quiet
    done
    cmp 1.html 3.html
    sed 's/"voxel_size": 0.02/"voxel_size": 0.1/' "$ASSETS/seeds.json" >seeds.json
    for threads in 1 3; do
        "$VDBSHADE" view seeds.json -o $threads.html --threads $threads --quiet
    done
    cmp 1.html 3.html
}

@test "a scene is the surface of its voxels, with the shadow, AO and light of its sun and sky at each vertex" {
    sed 's/"voxel_size": 0.02/"voxel_size": 0.05/' "$ASSETS/seeds.json" >seeds.json
    succeed view seeds.json -o page.html --quiet
    no_leftovers
    grep -oE '"name":"[a-zA-Z.]*","data":"data[0-9]"' page.html | cut -d'"' -f4,8 --output-delimiter=' ' >channels
    printf '%s\n' 'shadow.sun data1' 'ao data2' 'irradiance.R data3' 'irradiance.G data4' 'irradiance.B data5' | diff - channels
    for block in 0 1 2 3; do
        block data$block page.html >$block
    done
    # world position of each vertex, and its values; a row of a plane has 2048
    python3 - 0 1 2 3 >vertices.txt <<'PY'
import json, struct, sys, zlib
glb = open(sys.argv[1], "rb").read()
size = struct.unpack_from("<I", glb, 12)[0]
root = json.loads(glb[20:20 + size])
count, matrix = root["accessors"][0]["count"], root["nodes"][0]["matrix"]
positions = struct.unpack_from(f"<{3 * count}f", glb, 28 + size)
texels = (count + 2047) // 2048 * 2048
planes = []
for path in sys.argv[2:]:
    data = bytearray(zlib.decompress(open(path, "rb").read()))
    for i in range(2 * texels):
        data[i] = data[i] + data[i - 1] & 255 if i % 2048 else data[i]
    planes.append(struct.unpack(f">{texels}e", bytes(b for pair in zip(data[:texels], data[texels:]) for b in pair)))
for i in range(count):
    print(*(positions[3 * i + c] + matrix[12 + c] for c in range(3)), *(plane[i] for plane in planes))
PY
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

@test "what a scene does not take, and scenes that cannot be shown" {
    old_output page.html
    cp "$ASSETS/seeds.json" .
    for option in "--planes box.exr" "--other-planes box.exr" "--uv-set 1" box.obj; do
        # shellcheck disable=SC2086
        refuses 2 seeds.json 'takes no OTHER' -- view seeds.json $option -o page.html
    done
    refuses 3 gone.json -- view gone.json -o page.html
    echo '{"casters": [{"mesh": "gone.obj"}], "ao": {"distance": 1}}' >other.json
    refuses 3 gone.obj -- view other.json -o page.html
    echo '{"casters": [], "ao": {"distance": 1}}' >other.json
    refuses 2 other.json 'casters' -- view other.json -o page.html
    untouched page.html
    cp box.obj page.html
    echo '{"casters": [{"mesh": "page.html"}], "ao": {"distance": 1}}' >other.json
    refuses 2 page.html 'is also an input' -- view other.json -o page.html
    cmp box.obj page.html
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
    "$VDBSHADE" info surface.glb | awk '$1 == "bounds:" { printf "%.2f %.2f %.2f\n", $3, $7, $6 }' >bounds
    [ "$(cat bounds)" = "-1.00 5.00 5.00" ] || fail "$(cat bounds)"
}

@test "bad usage" {
    old_output page.html
    refuse_each view <<'LIST'
2 'give -o OUT.html' | box.obj --planes box.exr
2 'page.exr' 'give -o OUT.html' | box.obj -o page.exr
2 'no INPUT' | -o page.html
2 'box.obj' | box.obj box.obj box.obj -o page.html
LIST
    cp box.obj in.html
    refuses 2 'the output is the input' -- view in.html -o in.html
    refuses 2 'also a file of planes' -- view box.obj --planes in.html -o in.html
    for set in -1 8 x; do
        refuses 2 uv-set -- view box.obj --uv-set "$set" -o page.html
    done
    untouched page.html
}

@test "files that are not there, damaged, or too large" {
    old_output page.html
    refuse_each view <<'LIST'
3 gone.glb | gone.glb -o page.html
3 gone.exr | box.obj --planes gone.exr -o page.html
3 gone.obj | box.obj gone.obj -o page.html
LIST
    head -c 3000 "$ASSETS/cloister.glb" >cut.glb
    refuses 3 cut.glb -- view cut.glb -o page.html
    head -c 300 box.exr >cut.exr
    refuses 3 cut.exr -- view box.obj --planes cut.exr -o page.html
    printf 'glTF\2\0\0\0\24\0\0\0\377\377\377\377JSON' >lies.glb
    refuses 3 lies.glb -- view lies.glb -o page.html
    refuses 3 nowhere -- view box.obj -o nowhere/page.html
    unless_sanitized "its shadow memory has no such limit"
    refuses 4 cloister.glb -- view "$ASSETS/cloister.glb" --memory-limit 100k -o page.html
    untouched page.html
}

@test "bake --view writes the page of what it baked, and the same image as without it" {
    succeed bake box.obj "${SMALL[@]}" --ao 0.5 -o again.exr --view baked.html --quiet
    cmp box.exr again.exr || fail "another image"
    shade view box.obj --planes again.exr -o page.html --quiet
    cmp baked.html page.html || fail "another page"
    old_output page.html
    for wrong in page.exr again.exr; do
        refuses 2 "--view '$wrong'" -- bake box.obj "${SMALL[@]}" -o again.exr --view $wrong
    done
    refuse_each bake box.obj <<'LIST'
3 nowhere | "${SMALL[@]}" -o again.exr --view nowhere/page.html
2 'one lightmap of one mesh' | "${SMALL[@]}" --per-object -o objects/ --view page.html
2 "--view 'page.html': an image does not hold the UVs that are made" | --ao 1 --unwrap always -o unwrapped.png --view page.html
LIST
    untouched page.html
}
