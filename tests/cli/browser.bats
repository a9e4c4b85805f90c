# Chromium shows the pages of `view`, and the tests look at pixels of its picture.
load helper
load browser

# Two squares side by side, facing the camera: a from x = -1 to 0, b from 0 to 1, y from -1 to 1. Their lightmaps are in
# the third UV set, v down: a has the left half of the picture, b the right one. The other two sets are all zero.
write_squares() {
    square() { # X U MATERIAL: from x, its lightmap from u
        local none='{"VEC2": [0, 0, 0, 0, 0, 0, 0, 0]}' x=$(($1 + 1)) u
        u=$(awk "BEGIN { print $2 + 0.5 }")
        printf '{"primitives": [{"attributes": {"POSITION": {"VEC3": [%s]}, "TEXCOORD_0": %s, "TEXCOORD_1": %s, "TEXCOORD_2": {"VEC2": [%s]}}, "material": %d}]}' \
            "$1, -1, 0, $x, -1, 0, $x, 1, 0, $1, 1, 0" "$none" "$none" "$2, 1, $u, 1, $u, 0, $2, 0" "$3"
    }
    write_gltf squares.gltf squares.bin <<JSON
{"extensionsUsed": ["MOZ_lightmap"], "nodes": [{"name": "${NAME_A-square a}", "mesh": 0}, {"name": "square b", "mesh": 1}],
 "meshes": [$(square -1 0 0), $(square 0 0.5 1)],
 "materials": [{"name": "dim", "pbrMetallicRoughness": {"baseColorFactor": [0.8, 0.4, 0.2, 1]},
                "occlusionTexture": {"index": 1, "texCoord": 2, "strength": 0.5},
                "extensions": {"MOZ_lightmap": {"index": 0, "texCoord": 2, "intensity": 0.75}}},
               {"pbrMetallicRoughness": {"baseColorFactor": [1, 1, 1, 1]},
                "occlusionTexture": {"index": 1, "texCoord": 2},
                "extensions": {"MOZ_lightmap": {"index": 0, "texCoord": 2}}}],
 "textures": [{"source": 0}, {"source": 1}], "images": [{"uri": "${LIGHT-light%20map.png}"}, {"uri": "ao.png"}]}
JSON
    picture put "light map.png" 4 2  10 20 30  60 70 80  110 120 130  160 170 180   200 210 220  250 240 230  5 5 5  90 0 190
    picture put ao.png 4 2  255 0 0  128 0 0  64 0 0  200 0 0   30 0 0  90 0 0  150 0 0  220 0 0
}

show_squares() {
    write_squares
    succeed view squares.gltf -o squares.html --quiet
}

# lit R G B BASE_R BASE_G BASE_B FACTOR: base colour times (linear) light, as sRGB, 0 … 255. A lightmap's intensity is over π.
lit() {
    awk -v v="$*" 'function least(a, b) { return a < b ? a : b }
        BEGIN { split(v, a)
            for (i = 1; i <= 3; ++i) { c = least(a[i] / 255 * a[i + 3] * a[7], 1)
                printf "%.2f ", 255 * (c <= 0.0031308 ? 12.92 * c : 1.055 * c ^ (1 / 2.4) - 0.055) } }'
}

over_pi() {
    awk "BEGIN { print ($1) / 3.14159265 }"
}

# Looks at x and y from -1 to 1.
FRONT="fov=90&camera=0,0,1,0,0,0&ui=0"

@test "lit: base colour times the lightmap of the third UV set times its intensity times AO" {
    show_squares
    rm squares.gltf squares.bin ao.png "light map.png"
    look squares.html "$FRONT&texels=1"
    pixel_is 50 100 $(lit 10 20 30 0.8 0.4 0.2 "$(over_pi 0.75)")                                                # its AO is 1
    pixel_is 150 100 $(lit 60 70 80 0.8 0.4 0.2 "$(over_pi '0.75 * (1 + 128 / 255) / 2')") # half of AO's strength
    pixel_is 50 300 $(lit 200 210 220 0.8 0.4 0.2 "$(over_pi '0.75 * (1 + 30 / 255) / 2')")
    pixel_is 350 100 $(lit 160 170 180 1 1 1 "$(over_pi '200 / 255')")
    pixel_is 250 300 $(lit 5 5 5 1 1 1 "$(over_pi '150 / 255')")
}

@test "the page shows AO, the lightmap or base colour alone, and exposure brightens it" {
    show_squares
    look squares.html "$FRONT&texels=1&mode=ao"
    pixel_is 150 100 128 128 128
    pixel_is 250 100 64 64 64
    pixel_is 350 300 220 220 220
    look squares.html "$FRONT&texels=1&mode=light&exposure=1"
    pixel_is 350 300 $(lit 90 0 190 1 1 1 "$(over_pi 2)")
    pixel_is 50 100 $(lit 10 20 30 1 1 1 "$(over_pi 1.5)")
    look squares.html "$FRONT&mode=base"
    pixel_is 50 100 $(lit 255 255 255 0.8 0.4 0.2 1)
    pixel_is 350 100 255 255 255
}

@test "the panel shows place and values of a picked texel" {
    show_squares
    look squares.html "ui=1&$FRONT&mode=charts&pick=0.875,0.3"
    page_has '<h2>square b</h2>' '<th>UV set</th><td>2</td>' '<th>UV</th><td>0.87500  0.30000</td>' \
        '<th>texel</th><td>3  0 of 4 × 2</td>' '<th>lightmap / 255</th><td>160  170  180</td>' \
        '<th>occlusion / 255</th><td>200</td>' '<th>position</th><td>0.75  0.4  0</td>'
    page_has '>2 charts<'
    look squares.html "ui=1&$FRONT&pick=0.125,0.75"
    page_has '<th>material</th><td>dim</td>' '<th>texel</th><td>0  1 of 4 × 2</td>'
}

# A floor of 2 × 2 seen from above, its UVs the left half of the lightmap, and a wall at its right border.
write_corner() {
    {
        printf 'o floor\n'
        printf 'v %s %s %s\n' -1 -1 0 1 -1 0 1 1 0 -1 1 0
        printf 'vt %s %s\n' 0 0 0.5 0 0.5 1 0 1
        printf 'f 1/1 2/2 3/3\nf 1/1 3/3 4/4\no wall\n'
        printf 'v %s %s %s\n' 1 -1 0 1 -1 1 1 1 1 1 1 0
        printf 'vt %s %s\n' 0.6 0 1 0 1 1 0.6 1
        printf 'f 5/5 6/6 7/7\nf 5/5 7/7 8/8\n'
    } >corner.obj
}

BAKE=(--sun 1,0.2,1 --sun-angle 20 --ao 1 --size 64 --max-error 0.05 --bent-normals world --quiet)

# texels_are FILE.png CHANNELS I,J …: texels of the floor are seen as those channels of the picture, such as 111. 32 × 64 texels are
# over 400 × 400 pixels, so the middle of texel (i, j) is at ((i + 1/2) 12.5, (j + 1/2) 6.25).
texels_are() {
    local texel
    for texel in "${@:3}"; do
        pixel_is $((${texel%,*} * 25 / 2 + 6)) $((${texel#*,} * 25 / 4 + 3)) $(picture get "$1" ${texel/,/ } |
            awk -v c="$2" '{ print $substr(c, 1, 1), $substr(c, 2, 1), $substr(c, 3, 1) }')
    done
}

@test "the page shows each texel as the file has it, interpolates them, and shows bent normals as (1 + n) / 2" {
    write_corner
    "$VDBSHADE" bake corner.obj "${BAKE[@]}" -o corner.exr
    "$VDBSHADE" bake corner.obj "${BAKE[@]}" --pack R=ao,G=shadow.sun,B=0 --bits 8 -o corner.png
    "$VDBSHADE" bake corner.obj "${BAKE[@]}" --pack R=bent.X,G=bent.Y,B=bent.Z --bits 8 -o bent.png
    succeed view corner.obj --planes corner.exr -o corner.html --quiet
    look corner.html "$FRONT&texels=1&mode=ao"
    texels_are corner.png 111 4,10 16,33 28,20 30,60 31,5
    [ "$(picture get corner.png 31 5 | cut -d' ' -f1)" -lt 180 ] || fail "the wall hides nothing"
    look corner.html "$FRONT&texels=1&mode=light&channel=shadow.sun"
    texels_are corner.png 222 4,10 16,33 24,20 30,60
    [ "$(picture get corner.png 30 60 | cut -d' ' -f2)" -lt 30 ] || fail "the wall throws no shadow"
    [ "$(picture get corner.png 4 10 | cut -d' ' -f2)" -gt 200 ] || fail "nothing is lit"
    look corner.html "$FRONT&texels=1&mode=bent"
    texels_are bent.png 123 4,10 28,20 30,60
    [ "$(picture get bent.png 30 60 | cut -d' ' -f1)" -lt 120 ] || fail "the wall bends nothing"
    look corner.html "$FRONT&mode=bent"
    # pixel 375 is where texels 29 and 30 meet, and 206 where rows 32 and 33 do
    pixel_is 375 206 $(picture get bent.png 29 32 30 32 29 33 30 33 |
        awk '{ for (i = 1; i <= 3; ++i) s[i] += $i / 4 } END { print s[1], s[2], s[3] }')
}

@test "UVs that a packer made integers are shown as they are baked" {
    write_packed plain.gltf 5126 1
    write_packed packed.gltf 5123 4096 '{"scale": [0.000244140625, 0.000244140625]}'
    local kind x shown=()
    for kind in plain packed; do
        "$VDBSHADE" bake $kind.gltf --sun 0.2,1,1 --size 64 --unwrap never --quiet -o $kind.exr
        succeed view $kind.gltf --planes $kind.exr -o $kind.html --quiet
        look $kind.html "fov=90&camera=0,3,1,0,0,0&ui=0&mode=light&channel=shadow.sun"
        shown+=("$(for x in 70 110 150 190 230 330; do picture get page.png $x 155; done)")
    done
    [ "${shown[0]}" = "${shown[1]}" ] || fail "plain: ${shown[0]}; packed: ${shown[1]}"
    [ "$(sort -u <<<"${shown[0]}" | wc -l)" -ge 2 ] || fail "one colour: ${shown[0]}"
}

@test "the page shows light, shadow and AO at the vertices of a scene's surface, and picks them" {
    sed 's/"voxel_size": 0.02/"voxel_size": 0.05/' "$ASSETS/seeds.json" >seeds.json
    succeed view seeds.json -o seeds.html --quiet
    # 4 × 4 of the floor from above: x and z from -2 to 2, a pixel is 0.01 at y = 0. What is higher is nearer the border.
    local above="fov=90&camera=0,2,0.0001,0,0,0&ui=0"
    look seeds.html "$above&mode=light&channel=shadow.sun"
    pixel_is 20 20 255 255 255
    pixel_is 267 280 0 0 0 # the middle of the sphere's shadow
    look seeds.html "$above&mode=lit"
    pixel_is 20 20 $(lit 255 255 255 0.8 0.8 0.8 0.909)
    look seeds.html "$above&mode=ao"
    pixel_is 20 20 255 255 255
    look seeds.html "ui=1&$above&pick=0.05,0.05"
    page_has '<h2>surface</h2>' '<th>UV set</th><td>none</td>' '<th>shadow.sun</th><td>1</td>' '<th>ao</th><td>1</td>'
}

@test "keys choose the mode, and the mouse turns the view and picks" {
    show_squares
    look squares.html "$FRONT&texels=1" key:2
    pixel_is 150 100 128 128 128
    look squares.html "$FRONT&texels=1" key:9 key:2 key:1
    pixel_is 350 100 $(lit 160 170 180 1 1 1 "$(over_pi '200 / 255')")
    look squares.html "$FRONT&texels=1&mode=light" key:+ key:+
    pixel_is 350 300 $(lit 90 0 190 1 1 1 "$(over_pi 2)")
    look squares.html "$FRONT&mode=light" key:t
    pixel_is 350 100 $(lit 160 170 180 1 1 1 "$(over_pi 1)")
    look squares.html "ui=1&$FRONT" click:350,100
    page_has '<h2>square b</h2>'
    look squares.html "ui=1&$FRONT" click:350,100 key:Escape
    grep -q '<section id="picked".*hidden=""' page.dom || fail "Escape leaves it"
    look squares.html "ui=1&$FRONT" key:ArrowRight key:ArrowRight key:Enter
    page_has '<th>position</th><td>0  0  0</td>'
    look squares.html "$FRONT&mode=base" drag:200,200,300,200
    picture get page.png 20 200 >seen
    look squares.html "$FRONT&mode=base" drag:200,200,202,200
    [ "$(picture get page.png 20 200)" != "$(cat seen)" ] || fail "dragging turns nothing"
}

@test "the slider shows the first bake on the left and the second on the right" {
    write_corner
    "$VDBSHADE" bake corner.obj "${BAKE[@]}" -o near.exr
    "$VDBSHADE" bake corner.obj "${BAKE[@]}" --ao 0.1 -o far.exr
    for name in near far; do
        "$VDBSHADE" bake corner.obj "${BAKE[@]}" $([ $name = far ] && echo --ao 0.1) --pack R=ao,G=ao,B=ao --bits 8 -o $name.png
    done
    succeed view corner.obj --planes near.exr --other-planes far.exr -o two.html --quiet
    look two.html "$FRONT&texels=1&mode=ao&split=0.9"
    pixel_is 356 203 $(picture get near.png 28 32)
    pixel_is 369 203 $(picture get far.png 29 32)
    [ "$(picture get near.png 29 32)" != "$(picture get far.png 29 32)" ] || fail "the bakes are alike"
    look two.html "$FRONT&texels=1&mode=ao&split=1"
    pixel_is 369 203 $(picture get near.png 29 32)
    look two.html "ui=1&$FRONT&mode=ao&split=0.9&pick=0.7,0.5"
    page_has '<th>bake</th><td>corner.obj</td>' '<th>bake</th><td>far.exr</td>'
    # two models
    write_squares
    succeed view squares.gltf corner.obj -o models.html --quiet
    look models.html "$FRONT&mode=base&split=0.5"
    pixel_is 100 100 $(lit 255 255 255 0.8 0.4 0.2 1)
    pixel_is 300 100 $(lit 255 255 255 0.8 0.8 0.8 1)
}

# Whether a tap on the middle of an element hits it.
ON_TOP='const onTop = e => { const r = e.getBoundingClientRect();
    return r.width > 0 && e.contains(document.elementFromPoint(r.x + r.width / 2, r.y + r.height / 2)); }'

@test "labels are whole where there is room; on a phone buttons are 44 pixels large, the panel covers a third, and Show undoes Hide" {
    write_squares
    write_corner
    mv corner.obj "a corner with a rather long name.obj"
    succeed view squares.gltf "a corner with a rather long name.obj" -o models.html --quiet
    WIDE=390x844m look models.html "mode=light" \
        "tell:[...document.querySelectorAll('button, select, input[type=range], label:has([type=checkbox])')].map(e => [e.id, e.getBoundingClientRect()])
            .filter(([id, r]) => r.width > 0 && (r.width < 44 || r.height < 44)).map(([id, r]) => id + ' ' + r.width + ' ' + r.height).join()" \
        "tell:{ const r = document.getElementById('tools').getBoundingClientRect(); String(r.width * r.height / innerWidth / innerHeight) }" \
        "tell:$ON_TOP; document.getElementById('hide').click(); String([...document.querySelectorAll('button')].filter(onTop).map(e => e.textContent))" \
        "tell:document.getElementById('show').click(); String(onTop(document.getElementById('hide')))" >told
    [ "$(sed 2d told)" = $'\nShow\ntrue' ] || fail "small, or not to be shown again: $(cat told)"
    holds "$(sed -n 2p told) > 0.1 && $(sed -n 2p told) <= 1 / 3"
    WIDE=1440x900 look models.html "" \
        "tell:[...document.querySelectorAll('span, label, button, h1')].filter(e => e.scrollWidth > e.clientWidth && e.clientWidth > 0).map(e => e.textContent).join()" \
        "tell:String(document.getElementById('right').clientWidth > 100)" >told
    [ "$(cat told)" = $'\ntrue' ] || fail "cut: $(cat told)"
}

@test "the page shows texel density, checker and charts of a mesh without a bake" {
    write_corner
    succeed view corner.obj -o corner.html --quiet
    # floor: 512 × 1024 texels over 2 × 2; wall: 410 × 1024 over 1 × 2; no lightmap: 1024² is taken
    look corner.html "ui=1&$FRONT&mode=density"
    page_has '</span><span>texels a unit' ">$(awk 'BEGIN { printf "%.3g", sqrt((0.5 + 0.4) * 1024 * 1024 / 6) }')</span>"
    look corner.html "$FRONT&mode=checker"
    # squares of 8 texels are 6.25 pixels wide and 3.125 high there
    [ "$(picture get page.png 100 101)" != "$(picture get page.png 107 101)" ] || fail "no squares"
    [ "$(picture get page.png 100 101)" != "$(picture get page.png 100 104)" ] || fail "no squares"
    look corner.html "ui=1&$FRONT&mode=charts"
    page_has '>2 charts<'
}

@test "every mesh format shows its triangles" {
    for file in scene.obj scene.ply scene.stl scene.fbx scene.dae scene.gltf scene.glb scene_draco.glb figure.glb; do
        succeed view "$MODELS/$file" -o page.html --quiet
        look page.html "ui=0&mode=base&theme=dark"
        # something else than the back is in the middle third
        picture get page.png 150 200 200 150 200 200 250 200 200 250 170 230 230 170 | sort -u >seen
        grep -qv '^23 25 29$' seen || fail "$file: nothing is seen"
    done
}

@test "names and texts of strangers stay texts, and nothing that they name is asked for" {
    NAME_A='</script><script>document.title=\"gone\"</script><img src=x onerror=\"document.title=1\">' LIGHT=http://127.0.0.1:9/light.png write_squares
    evil='<img src=x onerror=document.title=1>&quot;.gltf'
    mv squares.gltf "$evil"
    succeed view "$evil" -o squares.html --quiet
    ! grep -q '<img' squares.html || fail "a tag came through"
    look squares.html "ui=1&$FRONT&pick=0.25,0.3" -- --log-net-log="$PWD/net.json"
    page_has '&lt;/script&gt;&lt;script&gt;document.title="gone"'
    page_has "<title>&lt;img src=x onerror=document.title=1&gt;&amp;quot;.gltf</title>"
    page_has 'is not shown'
    ! grep -q '127.0.0.1:9' net.json || fail "something was asked for"
    echo '<html data-state="ready"><img src="http://127.0.0.1:9/light.png">' >asks.html
    look asks.html "" -- --log-net-log="$PWD/asks.json"
    grep -q '127.0.0.1:9' asks.json || fail "the log does not show what is asked for"
}

@test "without WebGL, and with a file that its script cannot take, the page says so" {
    show_squares
    ENDS=failed look squares.html "" -- --disable-3d-apis
    page_has 'shows no WebGL 2'
    sed 's/"POSITION": 1,/"POSITION": 1, "JOINTS_0": 99,/' squares.gltf >joints.gltf
    succeed view joints.gltf -o joints.html --quiet
    look joints.html "$FRONT&texels=1"
    page_has 'square a is not shown: accessor 99 is not there'
    pixel_is 350 100 $(lit 160 170 180 1 1 1 "$(over_pi '200 / 255')")
    sed -i 's/{"source": 0}/{"source": 7}/' squares.gltf
    succeed view squares.gltf -o squares.html --quiet
    look squares.html ""
    page_has 'squares.gltf: image 7 is not shown'
}

@test "the page shows EXT_texture_webp, and names textures of other formats" {
    write_squares
    # decoders look at the bytes, so a PNG can stand in for a WebP here
    sed 's/"textures": \[{"source": 0}, {"source": 1}\]/"textures": [{"extensions": {"EXT_texture_webp": {"source": 0}}}, {"extensions": {"KHR_texture_basisu": {"source": 1}}}]/
         s/"extensionsUsed": \[/"extensionsUsed": ["EXT_texture_webp", "KHR_texture_basisu", /' squares.gltf >webp.gltf
    grep -q EXT_texture_webp.*source webp.gltf
    succeed view webp.gltf -o webp.html --quiet
    look webp.html ""
    page_has 'texture 1 is not shown: browsers do not read the images of KHR_texture_basisu'
    ! grep -q 'undefined\|texture 0\|image 0' <(grep -o 'id="problems".*' page.dom | head -c 400)
}

@test "docs/tutorial.md leads from Blender to a lit page, and to shadows in a C program" {
    command -v blender >/dev/null || skip "there is no Blender"
    cmake --install "$(dirname "$VDBSHADE")" --prefix "$PWD/opt" >/dev/null
    sed "s|/opt/vdbshade|$PWD/opt|" "$DOCS/tutorial.md" >tutorial.md
    blocks_of python tutorial.md >court.py
    DOCS=. VDBSHADE=opt/bin/vdbshade run_commands tutorial.md 6
    [[ $(xargs <out.txt) == 0\ 0.[4-6]*\ 1 && -s game/lit.lightmap.png ]] || fail "$(cat out.txt)"
    WIDE=640x400 look lit.html "ui=0&camera=4.5,3.4,6,-0.6,0.6,0&fov=40"
    [ "$(picture get page.png 265 190 | cut -d' ' -f1)" -gt 120 ] || fail "the crate is dark"
}
