# Shared by the command-line tests: VDBSHADE is the binary, ASSETS the folder of sample assets.
bats_require_minimum_version 1.5.0

: "${VDBSHADE:?is to name the vdbshade binary}"
: "${ASSETS:=$BATS_TEST_DIRNAME/../../assets}"

# Each test starts in an empty folder, but for a cube that can be baked.
setup() {
    cd "$BATS_TEST_TMPDIR" || return 1
    write_box box.obj
}

# write_scene FILE.json MESH [KEYS [KEYS OF THE RECEIVER [DIRECTION]]]: a scene in which a mesh casts and receives, with a sun.
write_scene() {
    local sun='{"name": "sun", "type": "directional", "angle_deg": 5, "direction": ['${5:-0.3, 1, 0.2}']}'
    printf '{"casters": [{"mesh": "%s"}]%s, "lights": [%s], "receivers": [{"mesh": "%s", "output": "out.exr"%s}]}\n' \
        "$2" "${3:+, $3}" "$sun" "$2" "${4:+, $4}" >"$1"
}

# Sets rest to options without those of a sun.
no_sun() {
    rest=()
    while [ $# -gt 0 ]; do
        case $1 in
        --sun | --sun-angle) shift 2 ;;
        *) rest+=("$1") && shift ;;
        esac
    done
}

# A unit cube, closed, each face with its own sixth of the UV square.
write_box() {
    {
        printf 'o box\n'
        printf 'v %s %s %s\n' 0 0 0 1 0 0 1 1 0 0 1 0 0 0 1 1 0 1 1 1 1 0 1 1
        # shellcheck disable=SC2086 # pairs of numbers
        for rows in '0.02 0.47' '0.52 0.97'; do
            for columns in '0.02 0.31' '0.35 0.64' '0.68 0.97'; do
                printf "vt %s ${rows% *}\n" $columns
                printf "vt %s ${rows#* }\n" ${columns#* } ${columns% *}
            done
        done
        printf 'f %s %s %s\n' 1/1 4/2 3/3 1/1 3/3 2/4 5/5 6/6 7/7 5/5 7/7 8/8 1/9 2/10 6/11 1/9 6/11 5/12 \
            4/13 8/14 7/15 4/13 7/15 3/16 1/17 5/18 8/19 1/17 8/19 4/20 2/21 3/22 7/23 2/21 7/23 6/24
    } >"$1"
}

# A small bake of box.obj, which is there: quick, and right in every respect.
SMALL=(--sun 0.3,1,0.2 --sun-angle 5 --size 32 --resolution 24)

shade() {
    run --separate-stderr "$VDBSHADE" "$@"
}

# An output that a failing run must leave as it is.
old_output() {
    printf 'old' >"$1"
}

# Whether two images or level sets hold the same values, whatever they tell of where they come from.
same_values() {
    "$VDBSHADE" compare "$1" "$2" --max-difference 0 --max-coverage 0 --quiet
}

fail() {
    echo "$*"
    echo "status: $status"
    echo "stdout: $output"
    echo "stderr: $stderr"
    return 1
}

# no_leftovers: no temporary file in the folder.
no_leftovers() {
    local left
    left=$(find . -name '*.tmp*')
    [ -z "$left" ] || fail "left behind: $left"
}

# untouched FILE: it still holds what old_output() wrote.
untouched() {
    [ "$(cat "$1")" = old ] || fail "$1 was changed"
    no_leftovers
}

# refused CODE WORD …: the last run ended with CODE and one line on standard error that holds every WORD.
refused() {
    local code=$1 word
    shift
    [ "$status" -eq "$code" ] || fail "expected exit code $code"
    [ -z "$output" ] || fail "expected nothing on standard output"
    [ "${#stderr_lines[@]}" -eq 1 ] || fail "expected one line on standard error"
    [[ $stderr == "vdbshade: "* ]] || fail "expected 'vdbshade: …'"
    for word in "$@"; do
        [[ $stderr == *"$word"* ]] || fail "expected '$word'"
    done
}

# refuses CODE WORD … -- ARG …: runs the program with the ARGs, which it refuses as refused() says.
refuses() {
    local expected=()
    while [ "$1" != -- ]; do
        expected+=("$1")
        shift
    done
    shift
    shade "$@"
    refused "${expected[@]}"
}

done_well() {
    [ "$status" -eq 0 ] || fail "expected success"
}

# ends CODE ARG …: runs the program, which must end with CODE.
ends() {
    shade "${@:2}"
    [ "$status" -eq "$1" ] || fail "expected exit code $1"
}

succeed() {
    ends 0 "$@"
}

# info_tells FILE TEXT …: what info prints of the file has every text.
info_tells() {
    local text
    succeed info "$1"
    for text in "${@:2}"; do
        [[ $output == *"$text"* ]] || fail "not told: $text"
    done
}

# refuse_each WORD …: runs the program once for each line "CODE WORD … | ARG …" of standard input, with the ARGs behind the given
# words. Each run must end as refused() says.
refuse_each() {
    local -a cases said more
    local case
    mapfile -t cases
    for case in "${cases[@]}"; do
        eval "said=(${case%%|*}) more=(${case#*|})"
        shade "$@" "${more[@]}"
        refused "${said[@]}" || fail "$case"
    done
}

# unless_sanitized REASON: skips the test if the program is built with a sanitizer.
unless_sanitized() {
    case ${CFLAGS:-} in *-fsanitize*) skip "$1" ;; esac
}

# write_packed FILE TYPE TRANSFORM: a floor under a smaller floor. Their UVs have one layout, as integers or floats. The texture has
# the TRANSFORM.
write_packed() {
    python3 - "$@" <<'PY'
import base64, json, struct, sys
path, kind, transform = sys.argv[1], sys.argv[2], sys.argv[3]
floor = [((-2, 0, 2), (.0, 1.)), ((2, 0, 2), (.75, 1.)), ((2, 0, -2), (.75, .25)), ((-2, 0, -2), (.0, .25))]
above = [((-1, 1, 1), (.75, .25)), ((0, 1, 1), (1., .25)), ((0, 1, 0), (1., .0)), ((-1, 1, 0), (.75, .0))]
places = b"".join(struct.pack("<3f", *p) for p, _ in floor + above)
uvs = b"".join(struct.pack("<2f", *uv) if kind == "float" else struct.pack("<2H", *(int(4096 * c) for c in uv)) for _, uv in floor + above)
order = struct.pack("<6H", 0, 1, 2, 0, 2, 3)
body = places + uvs + order
step = 8 if kind == "float" else 4
def uv(first):
    return {"bufferView": 1, "byteOffset": first * step, "componentType": 5126 if kind == "float" else 5123, "count": 4, "type": "VEC2"}
def place(first):
    return {"bufferView": 0, "byteOffset": first * 12, "componentType": 5126, "count": 4, "type": "VEC3"}
info = {"index": 0}
if transform:
    info["extensions"] = {"KHR_texture_transform": json.loads(transform)}
root = {"asset": {"version": "2.0"}, "scenes": [{"nodes": [0, 1]}], "nodes": [{"name": "floor", "mesh": 0}, {"name": "above", "mesh": 1}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 2 * i, "TEXCOORD_0": 2 * i + 1}, "indices": 4, "material": 0}]} for i in (0, 1)],
        "accessors": [place(0), uv(0), place(4), uv(4), {"bufferView": 2, "componentType": 5123, "count": 6, "type": "SCALAR"}],
        "bufferViews": [{"buffer": 0, "byteLength": 96}, {"buffer": 0, "byteOffset": 96, "byteLength": len(uvs), "byteStride": step},
                        {"buffer": 0, "byteOffset": 96 + len(uvs), "byteLength": 12}],
        "materials": [{"pbrMetallicRoughness": {"baseColorTexture": info}}], "textures": [{"source": 0}], "images": [{"uri": "none.png"}],
        "extensionsUsed": ["KHR_mesh_quantization", "KHR_texture_transform"],
        "buffers": [{"byteLength": len(body), "uri": "data:;base64," + base64.b64encode(body).decode()}]}
json.dump(root, open(path, "w"))
PY
}
