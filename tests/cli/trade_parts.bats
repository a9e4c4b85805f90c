# Error against time in parts.
load helper

setup() {
    cd "$BATS_TEST_TMPDIR" || return 1
    write_box box.obj
}

TINY=(--sun 0.3,1,0.2 --sun-angle 20 --size 24 --resolutions 12,24 --truth-rays 64 --budget 3600 --threads 1)

# All parts of a trade in out.html, and what they come to in out.csv.
parts() { # N INPUT [options]
    local n=$1 i
    shift
    for ((i = 1; i <= n; ++i)); do
        "$VDBSHADE" trade "$@" -o out.html --shard "$i/$n" --quiet
    done
    "$VDBSHADE" merge out.html --csv out.csv --quiet
}

# Whether they are the rows of one trade, in one.csv.
alike() {
    diff <(untimed one.csv) <(untimed out.csv) || fail "the rows are others"
}

@test "parts of a trade come to its rows, with the front of all of them" {
    "$VDBSHADE" trade box.obj "${TINY[@]}" --ao 0.5 -o one.html --csv one.csv --quiet
    parts 3 box.obj "${TINY[@]}" --ao 0.5
    alike
    # none on the front is beaten in both; each other one is by some, or is as good
    awk -F, 'NR > 1 && $2 != "embree" { n = ++count[$1]; rate[$1, n] = $7; rmse[$1, n] = $13; front[$1, n] = $21 }
             END { for (s in count) for (i = 1; i <= count[s]; ++i) {
                       beaten = matched = 0
                       for (k = 1; k <= count[s]; ++k) if (k != i) {
                           beaten += rate[s, k] < rate[s, i] && rmse[s, k] < rmse[s, i]
                           matched += rate[s, k] <= rate[s, i] && rmse[s, k] <= rmse[s, i]
                       }
                       if (front[s, i] ? beaten : !matched) exit 1 } }' out.csv || fail "$(cat out.csv)"
    for word in 'each of the machine that took it' 'data:image/png;base64,' 'Ambient occlusion' '</html>'; do
        grep -q -- "$word" out.html || fail "no $word"
    done
    # each row has the time of the part that took it: none is measured again
    cp out.csv first.csv
    "$VDBSHADE" merge out.html --csv out.csv --plot out.svg --quiet
    cmp first.csv out.csv
    grep -q '</svg>' out.svg
    # the work is spread: no part has most of the runs, and one alone has the truth
    for i in 1 2 3; do
        size=$(stat -c %s "out.html.$i-of-3.part")
        [ "$size" -gt 50000 ] && [ "$size" -lt 500000 ] || fail "part $i: $size bytes"
    done
    no_leftovers
}

@test "a level set, several receivers and lights: parts of whatever is measured are alike, to the page of runs" {
    "$VDBSHADE" voxelize box.obj -o box.vdb --resolution 24 --quiet
    cat >scene.json <<'JSON'
{"casters": [{"vdb": "box.vdb"}],
 "lights": [{"name": "sun", "type": "directional", "direction": [0, 1, 0], "angle_deg": 20},
            {"name": "lamp", "type": "sphere", "position": [0, 3, 0], "radius": 0.5}],
 "receivers": [{"mesh": "box.obj", "output": "a.exr"}, {"mesh": "box.obj", "output": "b.exr"}]}
JSON
    local options=(scene.json --size 25x23 --resolutions 12 --truth-rays 16 --budget 3600 --threads 1)
    "$VDBSHADE" trade "${options[@]}" -o one.html --csv one.csv --quiet
    parts 2 "${options[@]}"
    alike
    rm ./*.part
    # what does not fit into a part's budget is left out of all of them
    options=(box.obj --sun 0,1,0 --size 16 --resolutions 8 --truth-rays 16 --budget 0.000001 --threads 1)
    "$VDBSHADE" trade "${options[@]}" -o one.html --csv one.csv --view view.html --quiet
    parts 2 "${options[@]}"
    alike
    diff <(grep -o '[0-9]* runs did not fit' one.html) <(grep -o '[0-9]* runs did not fit' out.html)
    "$VDBSHADE" merge out.html --view out_view.html --quiet
    [ "$(grep -c . out_view.html)" = "$(grep -c . view.html)" ]
    shade merge out.html --view view.png
    refused 2 --view
}

@test "parts of other options, threads or inputs are refused, as are damaged and forged ones" {
    old_output out.html
    local options=(box.obj --sun 0,1,0 --size 32 --resolutions 8 --truth-rays 16) i
    part() { # I OPTIONS …
        i=$1
        shift
        "$VDBSHADE" trade "${options[@]}" -o out.html --shard "$i/2" --quiet "$@"
    }
    part 1 --threads 1
    shade merge out.html
    refused 3 "out.html: a part is missing: 2 of 2"
    part 2 --threads 2
    shade merge out.html
    refused 2 "out.html.2-of-2.part: is of other inputs or options: its number of threads is '2'"
    part 2 --threads 1 --truth-rays 32
    shade merge out.html
    refused 2 "out.html.2-of-2.part: is of other inputs or options: its vdbshade_command is"
    part 2 --threads 1
    for option in stats=x.json exr=x.exr invalid=x.png; do
        shade merge out.html "--${option%=*}" "${option#*=}"
        refused 2 "--${option%=*}: out.html is a trade"
    done
    "$VDBSHADE" bake box.obj --sun 0,1,0 --size 16 -o x.exr --shard 1/1 --quiet
    shade merge x.exr --csv x.csv
    refused 2 "--csv: x.exr is a lightmap"
    for option in csv=x.csv plot=x.svg view=x.html; do
        shade trade "${options[@]}" -o out.html --shard 1/2 "--${option%=*}" "${option#*=}"
        refused 2 "--${option%=*}: not together with --shard"
    done
    cp out.html.2-of-2.part good
    local size at
    size=$(stat -c %s good)
    for at in 0 20 40 60 200 $((size / 2)) $((size - 1)); do
        cp good out.html.2-of-2.part
        printf '\xfe' | dd of=out.html.2-of-2.part bs=1 seek="$at" conv=notrunc status=none
        shade merge out.html
        refused 2 "out.html.2-of-2.part: "
    done
    # its sum is right, and what it says cannot be: a record's task, bake time, valid texels; one record less; other masks
    for forged in 'task 9999' 'task 0' 'bake nan' 'bake -1' 'bake 0' 'certified 2' 'valid 100000' 'count 1' 'mask'; do
        python3 - good out.html.2-of-2.part "$forged" <<'PY'
import struct, sys
data = bytearray(open(sys.argv[1], "rb").read())[:-8]
what, *value = sys.argv[3].split()
head_end = 48 + struct.unpack_from("<Q", data, 24)[0]
for pad in range(8):
    at = head_end - pad - 48
    task, build, bake, certified, _, valid = struct.unpack_from("<QdddQQ", data, at)
    if 0 < task < 1000 and 0 < bake < 100 and 0 < valid < 1000:
        break
else:
    sys.exit("no record")
first = at
while struct.unpack_from("<Q", data, first - 8)[0] != (at - first) // 48 + 1:
    first -= 48
if what in ("task", "valid"):
    struct.pack_into("<Q", data, at + {"task": 0, "valid": 40}[what], int(value[0]))
elif what in ("bake", "certified"):
    struct.pack_into("<d", data, at + {"bake": 16, "certified": 24}[what], float(value[0]))
elif what == "count":
    struct.pack_into("<Q", data, first - 8, int(value[0]))
else:
    data[head_end + 4 * 40] ^= 1
total = 0xcbf29ce484222325
for (word,) in struct.iter_unpack("<I", data):
    total = (total ^ word) * 0x100000001b3 & (1 << 64) - 1
open(sys.argv[2], "wb").write(data + struct.pack("<Q", total))
PY
        shade merge out.html
        refused 2 "out.html.2-of-2.part: "
    done
    cp good out.html.2-of-2.part
    untouched out.html
    "$VDBSHADE" merge out.html --quiet
    echo "# again" >>box.obj
    shade merge out.html
    refused 2 "out.html.1-of-2.part: is of other inputs or options: its vdbshade_input_0 is"
}
