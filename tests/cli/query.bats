# vdbshade query: points in files and pipes.
load helper

# The seeds' scene, coarse, and points over its floor.
prepare() {
    sed 's/"voxel_size": 0.02/"voxel_size": 0.05/' "$ASSETS/seeds.json" >scene.json
    ln -s "$(cd "$ASSETS" && pwd)/seeds_floor.obj" .
    QUERY=(query scene.json --ao-method taps --quiet)
}

# points N: raw floats on standard output, a spiral over the floor, normals up or leaning.
points() {
    perl -e 'my $count = shift;
        for my $i (0 .. $count - 1) {
            my ($r, $a) = (2.4 * sqrt(($i + 0.5) / $count), 2.399963 * $i);
            print pack("f<6", $r * cos($a), 0.001, $r * sin($a), 0, 1, $i % 3 == 1 ? 0.1 : 0);
        }' "$1"
}

ANSWERS=(--distance --gradient --answers-only)

@test "files and pipes of every format give the same bits" {
    points 40000 >p.raw # enough to be put in order
    QUERY+=(--method adaptive)
    succeed "${QUERY[@]}" "${ANSWERS[@]}" --points p.raw --normals yes -o file.raw
    [ "$(wc -c <file.raw)" -eq 960000 ]
    "$VDBSHADE" "${QUERY[@]}" "${ANSWERS[@]}" --points - --points-format raw --normals yes -o - <p.raw | cmp - file.raw
    # the points through CSV and PLY, and the answers back
    for format in csv ply; do
        "$VDBSHADE" "${QUERY[@]}" --distance --points p.raw --normals yes -o "p.$format"
        "$VDBSHADE" "${QUERY[@]}" "${ANSWERS[@]}" --points "p.$format" -o "$format.raw"
        cmp "$format.raw" file.raw
        # and by text: a CSV of answers, read as positions, is the answers
        "$VDBSHADE" "${QUERY[@]}" "${ANSWERS[@]}" --points - --points-format "$format" --format csv -o - <"p.$format" >"$format.csv"
        [ "$(head -1 "$format.csv")" = "shadow.sun,ao,distance,gradient.x,gradient.y,gradient.z" ] || fail "head"
        cmp "$format.csv" csv.csv
    done
    perl -F, -ne 'print pack("f<6", @F) if $. > 1' csv.csv | cmp - file.raw
}

@test "threads, batches and memory change no bit" {
    points 40000 >p.raw
    QUERY+=(--method rays --rays 4) # rows are told apart by their numbers
    succeed "${QUERY[@]}" "${ANSWERS[@]}" --points p.raw --normals yes -o whole.raw
    for options in "--threads 1" "--batch 1000" "--batch 7" "--memory-limit 24M"; do
        succeed "${QUERY[@]}" "${ANSWERS[@]}" --points p.raw --normals yes $options -o part.raw
        cmp part.raw whole.raw || fail "$options"
    done
    refuses 4 "memory limit" -- "${QUERY[@]}" "${ANSWERS[@]}" --points p.raw --normals yes --memory-limit 4M -o part.raw
}

@test "keeping rows does not change the length of batches" {
    points 4000 >p.raw
    QUERY+=(--method adaptive --batch 1000 --points p.raw --normals yes) # whose rays depend on the batch
    succeed "${QUERY[@]}" --answers-only -o alone.raw
    succeed "${QUERY[@]}" -o kept.raw
    perl -ne 'BEGIN { $/ = \32 } print substr $_, 24' kept.raw | cmp - alone.raw
}

@test "answers are appended to the columns of a CSV, which stay as they are" {
    printf 'id;nz;Y;x;z;note;nx;ny\r\n7;0;0.001;0.5;0.5;"a b";0;1\r\n\r\n# a comment\r\n8;0; 0.001 ;"2.1";2;;0;1' >p.csv
    succeed "${QUERY[@]}" --points p.csv -o out.csv
    [ "$(cut -d';' -f1-8 out.csv)" = "$(printf 'id;nz;Y;x;z;note;nx;ny\n7;0;0.001;0.5;0.5;"a b";0;1\n8;0; 0.001 ;"2.1";2;;0;1')" ]
    [ "$(head -1 out.csv)" = 'id;nz;Y;x;z;note;nx;ny;shadow.sun;ao' ]
    [[ $(sed -n 2p out.csv) == *';0;0.7054'* ]] || fail "$(cat out.csv)"
    [[ $(sed -n 3p out.csv) == *';1;1' ]] || fail "$(cat out.csv)"
    # blanks and tabs, no header: none out
    printf ' 0.5  0.001 0.5 0 1 0\n2.1 0.001\t2 0 1 0\n' >p.xyz
    succeed "${QUERY[@]}" --points p.xyz -o out.xyz
    [ "$(cut -d' ' -f9- <out.xyz | head -1)" = "$(sed -n 2p out.csv | cut -d';' -f9- | tr ';' ' ')" ] || fail "$(cat out.xyz)"
    [ "$(wc -l <out.xyz)" -eq 2 ]
}

@test "without normals there is no ao, and no horizon; nothing but answers goes to standard output" {
    printf 'x,y,z\n0.5,0.001,0.5\n' >p.csv
    succeed_saying "the points have no normals, so AO is left out" -- query scene.json --points p.csv -o out.csv
    [ "$(head -1 out.csv)" = x,y,z,shadow.sun ]
    refuses 2 p.csv normals --ao -- "${QUERY[@]}" --ao 0.5 --points p.csv -o other.csv
    printf '{"casters": [{"sdf": {"shape": "sphere", "radius": 1}}], "voxel_size": 0.1}' >bare.json
    refuses 2 "nothing to answer" -- query bare.json --points p.csv -o other.csv --quiet
    succeed query bare.json --points p.csv --distance -o other.csv --quiet
    [ "$(head -1 other.csv)" = x,y,z,distance ]
    printf 'x,y,z\n0.5,0.001,0.5\n' >p.csv
    succeed query scene.json --points p.csv --progress -o -
    [ "${#lines[@]}" -eq 2 ] && [ "${lines[0]}" = x,y,z,shadow.sun ]
    [[ $stderr == *voxelize* ]] || fail "no progress"
}

@test "bad rows are reported by number and answered nan, and change no other row" {
    cat >good.csv <<'CSV'
x,y,z,nx,ny,nz
0.5,0.001,0.5,0,1,0
2.1,0.001,2,0,1,0
0.1,0.001,0.4,0,1,0
CSV
    cat >bad.csv <<'CSV'
x,y,z,nx,ny,nz
0.5,0.001,0.5,0,1,0
0.5,0.001
0.5,"0,001",0.5,0,1,0
2.1,0.001,2,0,1,0
inf,0,0,0,1,0
1,0.001,1,0,0,0
0.1,0.001,0.4,0,1,0
1,,1,0,1,0
1,0x1,1,0,1,0
CSV
    succeed "${QUERY[@]}" --method cone --points good.csv -o good.out --format csv
    [ -z "$stderr" ] || fail "a clean input is nothing to speak of"
    succeed "${QUERY[@]}" --method cone --points bad.csv -o bad.out --format csv --stats stats.json
    says "bad.csv: row 2: 2 columns" "bad.csv: row 3: column 2 is '0,001'" "bad.csv: row 5: x is not finite" \
        "bad.csv: row 6: the normal is zero" "bad.csv: row 8: column 2 is ''" "bad.csv: 6 of 9 rows are bad"
    [[ $stderr != *"row 9"* ]] || fail "more than five are told"
    grep -q '"bad_rows": 6' stats.json && grep -q '"points": 9' stats.json
    [ "$(wc -l <bad.out)" -eq 10 ]
    diff <(sed -n '2p;5p;8p' bad.out) <(sed 1d good.out)
    [ "$(sed -n 3p bad.out)" = "0.5,0.001,,,,,nan,nan" ] # in its columns
    [ "$(grep -c ',nan,nan$' bad.out)" -eq 6 ]
    # raw and PLY
    perl -e 'print pack("f<6", @$_, 0.5, 0, 1, 0) for [0.5, 0.001], [9**9**9, 1], [0.5, 0.001];
        print pack("f<6", 1, 2, 3, 0, 0, 0), pack("f<6", 1, 2, 3, 0, -sin(9**9**9), 0)' >bad.raw
    succeed "${QUERY[@]}" --points bad.raw --normals yes -o bad.ply
    says "bad.raw: row 2: x is not finite" "bad.raw: row 4: the normal is zero" "bad.raw: row 5: ny is not finite" \
        "bad.raw: 3 of 5 rows are bad"
    succeed_saying "bad.ply: 3 of 5 rows are bad" -- "${QUERY[@]}" --points bad.ply --answers-only -o again.csv
    [ "$(grep -c '^nan,nan$' again.csv)" -eq 3 ]
    old_output strict.csv
    refuses 2 "row 2: 2 columns" -- "${QUERY[@]}" --points bad.csv -o strict.csv --strict
    untouched strict.csv
}

# ply FORMAT: a mesh of two triangles, properties in an odd order.
ply_head() {
    printf 'ply\nformat %s 1.0\ncomment of ours\nelement vertex 4\nproperty uchar red\nproperty float x\nproperty double y\n' "$1"
    printf 'property float z\nproperty float nx\nproperty float ny\nproperty float nz\nelement face 2\n'
    printf 'property list uchar int vertex_indices\nend_header\n'
}

write_ascii_ply() {
    ply_head ascii
    printf '9 0.5 0.001 0.5 0 1 0\n8 2.1 0.001 2 0 1 0\n7 0 0.001 0 0 1 0\n6 1 0.001 1 0 1 0\n3 0 1 2\n3 0 2 3\n'
}

# The same as little (<) or big (>) endian bytes.
write_binary_ply() {
    ply_head "$1"
    perl -e 'my $o = shift; for ([9, 0.5, 0.001, 0.5], [8, 2.1, 0.001, 2], [7, 0, 0.001, 0], [6, 1, 0.001, 1]) {
        print pack("C f$o d$o f$o f$o f$o f$o", @$_, 0, 1, 0) }
        print pack("C l$o l$o l$o", 3, 0, 1, 2), pack("C l$o l$o l$o", 3, 0, 2, 3)' "$2"
}

@test "a PLY keeps its properties and faces, ascii and binary of both orders" {
    write_ascii_ply >ascii.ply
    write_binary_ply binary_little_endian '<' >little.ply
    write_binary_ply binary_big_endian '>' >big.ply
    for kind in ascii little big; do
        succeed "${QUERY[@]}" --points "$kind.ply" -o "$kind-out.ply"
        succeed "${QUERY[@]}" --points "$kind.ply" --answers-only -o "$kind.raw"
        cmp "$kind.raw" ascii.raw
        grep -aq '^property float shadow.sun$' "$kind-out.ply" && grep -aq '^comment of ours$' "$kind-out.ply"
        info_tells "$kind-out.ply" "triangles: 2"
        # what was written is read: its answers are named already
        refuses 2 shadow.sun --answers-only -- "${QUERY[@]}" --points "$kind-out.ply" -o again.ply
        shade "${QUERY[@]}" --points "$kind-out.ply" -o again.raw --answers-only
        cmp again.raw ascii.raw
    done
    [ "$(wc -c <ascii.raw)" -eq 32 ]
    # rows of 29 bytes, two answers behind each, in the file's own order of bytes
    for order in little:f\< big:f\>; do
        tail -c $((4 * 37 + 26)) "${order%:*}-out.ply" |
            perl -e 'local $/; my $d = <STDIN>; for (0 .. 3) { print pack("f<2", unpack($ARGV[0] . "2", substr($d, 37 * $_ + 29, 8))) }' \
                "${order#*:}" | cmp - ascii.raw || fail "$order"
    done
    tail -2 ascii-out.ply | cmp - <(printf '3 0 1 2\n3 0 2 3\n')
    tail -c 26 big-out.ply | cmp - <(tail -c 26 big.ply)
}

@test "a PLY from rows that are not counted beforehand is the same in a file and a pipe" {
    points 1000 >p.raw
    succeed "${QUERY[@]}" --points p.raw --normals yes -o out.ply
    "$VDBSHADE" "${QUERY[@]}" --points - --points-format raw --normals yes --format ply -o - <p.raw | cmp - out.ply
    grep -aq '^element vertex 1000$' out.ply
    shade "${QUERY[@]}" --points out.ply --normals yes --answers-only -o a.raw
    shade "${QUERY[@]}" --points p.raw --normals yes --answers-only -o b.raw
    cmp a.raw b.raw
}

@test "files that are cut short or are no PLY are refused, and the output is left" {
    write_binary_ply binary_little_endian '<' >whole.ply
    old_output out.ply
    local head size
    head=$(ply_head binary_little_endian | wc -c)
    size=$(wc -c <whole.ply)
    for length in $((head + 1)) $((head + 30)) $((head + 4 * 29 - 1)) $((head + 4 * 29)) $((size - 1)); do
        head -c "$length" whole.ply >cut.ply
        refuses 3 cut.ply "cut short" -- "${QUERY[@]}" --points cut.ply -o out.ply
        untouched out.ply
    done
    head -c 40 whole.ply >head.ply
    write_ascii_ply | head -n -3 >rows.ply
    printf 'plx\n' >magic.ply
    ply_head binary_middle_endian >middle.ply
    printf 'ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nend_header\n1 2\n' >flat.ply
    points 3 | head -c 50 >cut.raw
    printf 'a,b,c\n1,2,3\n' >none.csv
    refuse_each "${QUERY[@]}" --normals yes -o out.ply --points <<'CASES'
3 head.ply end_header | head.ply
3 rows.ply 'vertex 3 of 4' | rows.ply
2 magic.ply 'line 1' | magic.ply
2 middle.ply binary_middle_endian | middle.ply
2 flat.ply "'z'" | flat.ply
3 cut.raw 'row 3' | cut.raw
2 none.csv 'column x' | none.csv
CASES
    untouched out.ply
}

@test "no points are no error" {
    : >empty.csv
    : >empty.raw
    printf 'x,y,z,nx,ny,nz\n' >head.csv
    write_ascii_ply | sed 's/^element vertex 4/element vertex 0/; s/^element face 2/element face 0/; /^end_header/q' >empty.ply
    for points in empty.csv empty.raw head.csv empty.ply; do
        for format in csv ply raw; do
            succeed "${QUERY[@]}" --points "$points" --normals yes -o "out.$format"
        done
    done
    grep -aq '^element vertex 0$' out.ply
    [ ! -s out.raw ]
    shade "${QUERY[@]}" --points head.csv -o out.csv
    [ "$(cat out.csv)" = "x,y,z,nx,ny,nz,shadow.sun,ao" ]
    : >empty.ply
    refuses 2 empty.ply "empty" -- "${QUERY[@]}" --points empty.ply -o out.ply
}

@test "one row at a time is answered before the next is there" {
    mkfifo in out
    "$VDBSHADE" "${QUERY[@]}" --batch 1 --points - --points-format csv -o - <in >out 2>err.txt &
    exec 7>in 8<out
    printf 'x,y,z,nx,ny,nz\n0.5,0.001,0.5,0,1,0\n' >&7
    local line
    read -r -t 60 line <&8 && [ "$line" = x,y,z,nx,ny,nz,shadow.sun,ao ]
    read -r -t 60 line <&8 && [[ $line == 0.5,0.001,0.5,0,1,0,0,* ]]
    printf '2.1,0.001,2,0,1,0\n' >&7
    read -r -t 60 line <&8 && [ "$line" = 2.1,0.001,2,0,1,0,1,1 ]
    exec 7>&-
    wait
    exec 8<&-
    [ ! -s err.txt ]
}

@test "a pipe or device that takes no more ends the run" {
    points 40000 >p.raw
    QUERY+=(--points p.raw --normals yes)
    run bash -c '"$0" "${@}" --format csv -o - 2>err.txt | head -1; exit "${PIPESTATUS[0]}"' "$VDBSHADE" "${QUERY[@]}"
    [ "$status" -eq 141 ] || [ "$status" -eq 3 ] || fail "status"
    [ "${lines[0]}" = "x,y,z,nx,ny,nz,shadow.sun,ao" ]
    [ ! -e /dev/full ] || {
        run bash -c '"$0" "${@}" -o - 2>err.txt >/dev/full' "$VDBSHADE" "${QUERY[@]}"
        [ "$status" -eq 3 ]
        grep -q 'standard output: cannot be written: No space left' err.txt
    }
    run bash -c '"$0" "${@}" -o - 2>err.txt >&-' "$VDBSHADE" "${QUERY[@]}"
    [ "$status" -eq 3 ]
}

@test "wrong options are refused by name" {
    printf 'x,y,z\n0.5,0.001,0.5\n' >p.csv
    refuse_each query scene.json <<'CASES'
2 --points | -o out.csv
2 --points-format | --points - -o -
2 out.dat --format | --points p.csv -o out.dat
2 exr csv | --points p.csv --format exr -o out.dat
2 p.csv | --points p.csv -o p.csv
3 none.csv | --points none.csv -o out.csv
3 folder | --points . --points-format csv -o out.csv
2 --error | --points p.csv --method cone --ao-method cones --error -o out.csv
CASES
    [ ! -e out.csv ]
}

@test "--error answers the estimated error" {
    points 500 >p.raw
    succeed "${QUERY[@]}" --points p.raw --normals yes --method adaptive --max-error 0.05 --error -o out.csv
    [ "$(head -1 out.csv)" = x,y,z,nx,ny,nz,shadow.sun,ao,error.sun ]
    awk -F, 'NR > 1 && !($9 >= 0 && $9 <= 0.3) { bad = 1 } NR > 1 && $9 > 0 { some = 1 } END { exit bad || !some }' out.csv
}
