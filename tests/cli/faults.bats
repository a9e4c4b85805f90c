# Runs that are killed, disks that are full at any byte, pipes that nobody reads.
load helper

setup() {
    cd "$BATS_TEST_TMPDIR" || return 1
    write_box box.obj
    printf 'x,y,z,nx,ny,nz\n' >points.csv
    for i in {1..200}; do
        echo "0.$i,1.01,0.5,0,1,0"
    done >>points.csv
}

QUERY=(query box.obj --sun 0.3,1,0.2 --sun-angle 5 --resolution 24 --points points.csv --quiet)

@test "what killed runs have left is taken away by the next, and nothing else" {
    local mine=(.out.99999999.tmp.exr .out.99999998-3.tmp.exr .stats.99999999.tmp.json)
    local other=(.out.99999999.tmp.png .out.tmp.exr .out2.99999999.tmp.exr .out.x.tmp.exr .stats.json.99999999.tmp)
    touch "${mine[@]}" "${other[@]}"
    touch .out.99999997.tmp.exr # of a process that another machine knows
    exec 9>.out.99999997.tmp.exr
    flock -n 9
    succeed bake box.obj "${SMALL[@]}" --quiet --stats stats.json -o out.exr 9>&-
    exec 9>&-
    for file in "${mine[@]}"; do
        [ ! -e "$file" ] || fail "$file is still there"
    done
    for file in "${other[@]}" .out.99999997.tmp.exr; do
        [ -e "$file" ] || fail "$file is gone"
    done
}

@test "kill -9 at points over a bake: the old output is intact, the next run tidies up" {
    run "$BATS_TEST_DIRNAME/../../tools/kill-bakes" "$VDBSHADE" 6
    echo "$output"
    [ "$status" -eq 0 ]
}

# full_at FILE SIZE COMMAND …: the command on a disk that takes SIZE bytes of a file, which are to be enough for the error.
full_at() {
    local file=$1 size=$2
    shift 2
    run --separate-stderr prlimit --fsize="$size" "$VDBSHADE" "$@" --sandbox off
    refused 3 "$file" "File too large"
    untouched "$file"
}

@test "a disk that is full at any byte leaves the old rows, statistics and pages" {
    local size whole
    shade "${QUERY[@]}" -o out.csv
    whole=$(stat -c %s out.csv)
    old_output out.csv
    for size in 256 4095 4096 4097 $((whole / 2)) $((whole - 1)); do
        full_at out.csv "$size" "${QUERY[@]}" -o out.csv
    done
    old_output out.ply
    for size in 256 4096; do
        full_at out.ply "$size" "${QUERY[@]}" -o out.ply
    done
    sed -i 3q points.csv # rows that the disk has room for
    shade "${QUERY[@]}" -o out.raw --stats stats.json
    whole=$(stat -c %s stats.json)
    old_output stats.json
    for size in 200 $((whole / 2)); do
        full_at stats.json "$size" "${QUERY[@]}" -o out.raw --stats stats.json
    done
}

@test "a pipe that nobody reads is an error that is told" {
    run bash -c '"$@" -o - 2>err.txt | true; exit "${PIPESTATUS[0]}"' - "$VDBSHADE" "${QUERY[@]}"
    [ "$status" -eq 3 ] || fail "status"
    grep -q 'standard output: cannot be written: Broken pipe' err.txt || fail "$(cat err.txt)"
}
