# Shared by the command-line tests: VDBSHADE is the binary, ASSETS and DOCS are the folders of sample assets and documents.
bats_require_minimum_version 1.5.0

: "${VDBSHADE:?is to name the vdbshade binary}"
: "${ASSETS:=$BATS_TEST_DIRNAME/../../assets}"
: "${DOCS:=$BATS_TEST_DIRNAME/../../docs}"

MODELS=$BATS_TEST_DIRNAME/../models FONT=/usr/share/fonts/truetype/dejavu/DejaVuSans.ttf

# Each test starts in an empty folder with a cube that can be baked, and calls prepare() of its file.
setup() {
    cd "$BATS_TEST_TMPDIR" || return 1
    write_box box.obj
    ! declare -F prepare >/dev/null || prepare
}

# write_scene FILE.json MESH [KEYS [KEYS OF THE RECEIVER [DIRECTION]]]: a scene in which a mesh casts and receives, with a sun.
write_scene() {
    local sun='{"name": "sun", "type": "directional", "angle_deg": 5, "direction": ['${5:-0.3, 1, 0.2}']}'
    printf '{"casters": [{"mesh": "%s"}]%s, "lights": [%s], "receivers": [{"mesh": "%s", "output": "out.exr"%s}]}\n' \
        "$2" "${3:+, $3}" "$sun" "$2" "${4:+, $4}" >"$1"
}

# write_bake NAME.json CASTERS [KEYS [RECEIVER]]: a scene that bakes the casters' shadow under a sun onto the receiver, the cube if none
# is given, into NAME.exr.
write_bake() {
    printf '{"casters": [%s], "lights": [{"name": "sun", "type": "directional", "direction": [0, 1, 0.2], "angle_deg": 5}],
        "receivers": [{%s, "output": "%s.exr"}]%s}\n' "$2" "${4:-\"mesh\": \"box.obj\", \"size\": 16}" "$(basename "$1" .json)" "${3:+, $3}" >"$1"
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

# write_boxes FILE NAME…: cubes in a row, two units from one to the next, each with its faces in all of the unit square.
write_boxes() {
    local file=$1
    shift
    printf '%s\n' "$@" | awk '
        BEGIN {
            split("0 0 0 1 0 0 1 1 0 0 1 0 0 0 1 1 0 1 1 1 1 0 1 1", p, " ")
            split("1 4 3 2 5 6 7 8 1 2 6 5 4 8 7 3 1 5 8 4 2 3 7 6", f, " ")
        }
        {
            print "o " $0
            for (i = 0; i < 8; ++i) print "v", p[3 * i + 1] + 2 * (NR - 1), p[3 * i + 2], p[3 * i + 3]
            for (i = 0; i < 6; ++i) {
                u = (i % 3) / 3 + 0.02; v = int(i / 3) / 2 + 0.02
                print "vt", u, v "\nvt", u + 0.29, v "\nvt", u + 0.29, v + 0.46 "\nvt", u, v + 0.46
                line = "f"
                for (k = 1; k <= 4; ++k)
                    line = line " " f[4 * i + k] + 8 * (NR - 1) "/" 4 * i + k + 24 * (NR - 1)
                print line
            }
        }' >"$file"
}

# write_floor FILE: a square of 6 × 6 at y = -1 that faces up, with the whole of the UV square.
write_floor() {
    printf '%s\n' 'v -3 -1 3' 'v 3 -1 3' 'v 3 -1 -3' 'v -3 -1 -3' 'vt 0 0' 'vt 1 0' 'vt 1 1' 'vt 0 1' \
        'f 1/1 2/2 3/3' 'f 1/1 3/3 4/4' >"$1"
}

# write_gltf FILE [BUFFER.bin]: the document on standard input, see gltf.py.
write_gltf() {
    python3 "$BATS_TEST_DIRNAME/gltf.py" write "$@"
}

# show_gltf FILE EXPRESSION…: prints Python expressions of the file.
show_gltf() {
    python3 "$BATS_TEST_DIRNAME/gltf.py" show "$@"
}

# A small bake of box.obj: quick, and right in every respect. COARSE goes with scenes, which have a sun of their own.
COARSE=(--size 32 --resolution 24)
SMALL=(--sun 0.3,1,0.2 --sun-angle 5 "${COARSE[@]}")

shade() {
    run --separate-stderr "$VDBSHADE" "$@"
}

# An output that a failing run must leave as it is.
old_output() {
    printf 'old' >"$1"
}

# Whether two images or level sets hold the same values, whatever their metadata.
same_values() {
    "$VDBSHADE" compare "$1" "$2" --max-difference 0 --max-coverage 0 --quiet
}

same() {
    same_values "$1" "$2" || fail "$1 and $2 are not the same"
}

differ() {
    ! same_values "$1" "$2" || fail "$1 and $2 are the same"
}

# values_of FILE CHANNEL: "MIN MEAN MAX" as info prints them.
values_of() {
    "$VDBSHADE" info "$1" | sed -n "s/^channel '$2': min \(.*\), mean \(.*\), max \(.*\)$/\1 \2 \3/p"
}

# mean_of FILE CHANNEL
mean_of() {
    values_of "$@" | cut -d' ' -f2
}

# number_in STATS.json KEY: the first number of that key.
number_in() {
    grep -o "\"$2\": [0-9.e+-]*" "$1" | head -1 | cut -d' ' -f2
}

# holds CONDITION: a condition of awk on numbers.
holds() {
    awk "BEGIN { exit !($1) }" || fail "not so: $1"
}

# Prints why, and what the last run did. A function of several checks returns after each that fails: in a list such as `A || B` the
# shell goes on.
fail() {
    echo "$*"
    [ -z "${CASE:-}" ] || echo "case: $CASE"
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
    [ "$(cat "$1")" = old ] || fail "$1 was changed" || return
    no_leftovers
}

# refused CODE WORD …: the last run ended with CODE and one line on standard error that holds every WORD.
refused() {
    local code=$1 word
    shift
    [ "$status" -eq "$code" ] || fail "expected exit code $code" || return
    [ -z "$output" ] || fail "expected nothing on standard output" || return
    [ "${#stderr_lines[@]}" -eq 1 ] || fail "expected one line on standard error" || return
    [[ $stderr == "vdbshade: "* ]] || fail "expected 'vdbshade: …'" || return
    for word in "$@"; do
        [[ $stderr == *"$word"* ]] || fail "expected '$word'" || return
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

# compile NAME: makes NAME.c a program with the library beside VDBSHADE.
compile() {
    local build
    build=$(dirname "$(realpath "$VDBSHADE")")
    "${CC:-cc}" -std=gnu11 -O1 ${CFLAGS-} -I"$BATS_TEST_DIRNAME/../../include" "$1.c" -L"$build" -lvdbshade -Wl,-rpath,"$build" -o "$1"
}

# in_order STREAM CONTENT TEXT …: the content has the texts in this order.
in_order() {
    local stream=$1 rest=$2 text
    for text in "${@:3}"; do
        [[ $rest == *"$text"* ]] || fail "expected '$text' on $stream" || return
        rest=${rest#*"$text"}
    done
}

# says TEXT …: standard error of the last run has the texts in this order.
says() {
    in_order "standard error" "$stderr" "$@"
}

# prints TEXT …: standard output of the last run has them.
prints() {
    in_order "standard output" "$output" "$@"
}

# checked CODE CHECK TEXT … -- ARG …: runs the program, which must end with CODE and pass the check with the texts.
checked() {
    local code=$1 check=$2 texts=()
    shift 2
    while [ "$1" != -- ]; do
        texts+=("$1")
        shift
    done
    ends "$code" "${@:2}" && "$check" "${texts[@]}"
}

# succeed_saying TEXT … -- ARG …: runs the program, which succeeds and has the texts on standard error, in this order.
succeed_saying() {
    checked 0 says "$@"
}

# succeed_printing TEXT … -- ARG …: likewise for standard output.
succeed_printing() {
    checked 0 prints "$@"
}

# differ_printing TEXT … -- ARG …: likewise for the output of `compare` and `regress` if there are differences.
differ_printing() {
    checked 1 prints "$@"
}

# info_tells FILE TEXT …: what info prints of the file has the texts in this order.
info_tells() {
    succeed info "$1" && prints "${@:2}"
}

# refuse_each WORD …: runs the program once for each line "CODE WORD … | ARG …" of standard input, with the ARGs behind the given
# words. Each run must end as refused() says.
refuse_each() {
    local -a cases said more
    local CASE
    mapfile -t cases
    for CASE in "${cases[@]}"; do
        eval "said=(${CASE%%|*}) more=(${CASE#*|})"
        shade "$@" "${more[@]}"
        refused "${said[@]}" || return
    done
}

# limited LIMIT ARG …: runs the program with a limit of ulimit, such as "-f 4".
limited() {
    run --separate-stderr bash -c 'ulimit $1; shift; exec "$@"' bash "$1" "$VDBSHADE" "${@:2}"
}

# unless_sanitized REASON: skips the test if the program is built with a sanitizer.
unless_sanitized() {
    case ${CFLAGS:-} in *-fsanitize*) skip "$1" ;; esac
}

# write_packed FILE TYPE FACTOR TRANSFORM: a floor under a smaller floor. Their UVs are of that type of component, times the
# factor. The texture has the transform.
write_packed() {
    uvs() {
        printf '"attributes": {"TEXCOORD_0": {"VEC2": %s, "componentType": %s, "times": %s}}' "$3" "$1" "$2"
    }
    write_gltf "$1" <<JSON
{"nodes": [{"name": "floor", "mesh": 0}, {"name": "above", "mesh": 1}],
 "meshes": [{"primitives": [{"plate": [-2, 0, -2, 2, 2], $(uvs "$2" "$3" '[0, 1, 0.75, 1, 0.75, 0.25, 0, 0.25]'), "material": 0}]},
            {"primitives": [{"plate": [-1, 1, 0, 0, 1], $(uvs "$2" "$3" '[0.75, 0.25, 1, 0.25, 1, 0, 0.75, 0]'), "material": 0}]}],
 "materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0${4:+, \"extensions\": {\"KHR_texture_transform\": $4\}}}}}],
 "textures": [{"source": 0}], "images": [{"uri": "none.png"}], "extensionsUsed": ["KHR_mesh_quantization", "KHR_texture_transform"]}
JSON
}

# blocks_of KIND FILE [N]: prints the code blocks of a Markdown file that are of this kind, or the Nth alone.
blocks_of() {
    awk -v begin="\`\`\`$1" -v only="${3:-0}" '$1 == begin { inside = !only || ++n == only; next } $1 == "```" { inside = 0 } inside' "$2"
}

# run_commands FILE LEAST: every command of docs/FILE runs; there are LEAST at least. Lines that a backslash ends are continued. The last
# command's output is in out.txt.
run_commands() {
    blocks_of sh "$DOCS/$1" | sed -e ':a' -e '/\\$/N; s/\\\n//; ta' | sed 's/^ *//' | grep -E "${ONLY:-.}" >commands
    [ "$(grep -c vdbshade commands)" -ge "$2" ]
    while read -r command; do
        PATH=$(dirname "$(realpath "$VDBSHADE")"):$PATH bash -c "set -o pipefail; $command" >out.txt 2>err.txt </dev/null ||
            fail "$command: $(cat err.txt)"
    done <commands
}
