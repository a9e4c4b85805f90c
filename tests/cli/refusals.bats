# Errors name what the system refuses: descriptors, threads, memory, places. Outputs are synced before they are renamed.
load helper

setup_file() {
    "${CC:-cc}" -shared -fPIC -O1 "$BATS_TEST_DIRNAME/../preload/calls.c" -o "$BATS_FILE_TMPDIR/calls.so" -ldl
}

prepare() {
    unless_sanitized "a sanitizer must be loaded before the library that refuses"
    calls=$BATS_FILE_TMPDIR/calls.so
    bake=(bake box.obj "${SMALL[@]}" --quiet -o out.exr)
}

@test "too few file descriptors are an error that suggests --sandbox off" {
    old_output out.exr
    local most
    for most in 10 12 14 16; do
        limited "-n $most" "${bake[@]}"
        [ "$status" -eq 4 ] || [ "$status" -eq 0 ] || fail "$most"
        [ "$status" -eq 0 ] || refused 4 "box.obj: cannot start the process that reads it, " "Too many open files" --sandbox off
        [ "$status" -eq 0 ] || untouched out.exr
    done
    limited "-n 16" "${bake[@]}" --sandbox off
    done_well
}

@test "the error names a missing memfd_create, and too few threads for OpenVDB's libraries" {
    old_output out.exr
    LD_PRELOAD=$calls REFUSE_MEMFD=1 shade "${bake[@]}"
    refused 4 "box.obj: cannot start the process that reads it, " "Function not implemented" --sandbox off
    untouched out.exr
    local most
    for most in 1 3; do
        LD_PRELOAD=$calls REFUSE_THREADS=$most shade "${bake[@]}"
        refused 4 "threads: the system refuses the 4 that OpenVDB's libraries begin"
        untouched out.exr
    done
}

@test "with fewer threads than asked the bake is the same, with a note" {
    "$VDBSHADE" "${bake[@]}" --threads 1
    mv out.exr one.exr
    local most
    for most in 5 6 8 10; do # four are liblog4cplus' (OpenVDB's); a reader counts for itself
        LD_PRELOAD=$calls REFUSE_THREADS=$most shade bake box.obj "${SMALL[@]}" -o out.exr \
            --threads 12 --verbose
        done_well
        says "the system gives this process fewer threads than asked for (" " at a time)"
        same_values one.exr out.exr
        LD_PRELOAD=$calls REFUSE_THREADS=$most shade volume box.obj --sun 0,1,0 \
            --resolution 24 -o out.vdb --threads 12
        done_well
    done
}

@test "a bake waits for joined threads that the system still counts" {
    local most
    for most in 6 8 16; do
        LD_PRELOAD=$calls REFUSE_THREADS=$most LINGER=200 succeed "${bake[@]}" --threads 8
    done
}

@test "without memory for OpenVDB or OpenImageIO the error names the library" {
    local most refused=0
    for most in 40 60 80 100 120 140 160 200; do
        for what in "voxelize --resolution 16 -o out.vdb" "render --sun 1,2,1 --size 16 -o out.tif"; do
            limited "-d $((most * 1000))" ${what%% *} box.obj ${what#* } --sandbox off --threads 1 --quiet
            [ "$status" -eq 0 ] || [ "$status" -eq 4 ] || fail "$most MB, $what"
            [[ $stderr != *"the system refused the "*" MB that libvdbshade_"* ]] || refused=$((refused + 1))
        done
    done
    [ "$refused" -gt 4 ] || fail "$refused refused"
}

@test "any allocation may fail: the error says so and the old output stays" {
    local what out n program words refused=0
    echo "0.5,1.2,0.5" >points.csv
    "$VDBSHADE" voxelize box.obj --resolution 6 --quiet -o made.vdb
    for what in "view box.obj -o out.html" "bake box.obj ${SMALL[*]} --ao 1 -o out.exr" "bake box.obj ${SMALL[*]} -o out.tif" \
        "bake $ASSETS/thin.glb --sun 0,1,0 --size 8 --resolution 12 -o out.glb" "voxelize box.obj --resolution 6 -o out.vdb" \
        "query made.vdb --sun 0,1,0 --points points.csv -o out.csv" "unwrap box.obj --size 64 -o out.obj"; do
        out=out.${what##*.}
        for program in vdbshade vdbshade-reader; do
            read -ra words <<<"$what --threads 1 --quiet"
            [ $program = vdbshade-reader ] || words+=(--sandbox off)
            "$VDBSHADE" "${words[@]}"
            mv "$out" "whole.${out##*.}"
            for ((n = 1; n < 3000; n += 1 + n)); do
                old_output "$out"
                LD_PRELOAD=$calls VSH_TEST_PROGRAM=$program VSH_TEST_MALLOC=$n shade "${words[@]}"
                if [ "$status" -eq 0 ]; then
                    cmp -s "$out" "whole.${out##*.}" || same_values "$out" "whole.${out##*.}" || fail "$n of $program $what"
                    continue
                fi
                [[ $stderr == *"the system "@(refused|gives)* || $stderr == *memory* ]] || fail "$n of $program $what"
                refused 4 && untouched "$out" || fail "$n of $program $what"
                refused=$((refused + 1))
            done
        done
    done
    [ "$refused" -gt 100 ] || fail "$refused refused"
}

@test "statistics that cannot be written are an error before an image is replaced" {
    old_output out.exr
    local name
    mkdir closed
    for name in "$(printf 'x%.0s' {1..256})" /proc/stats.json closed; do
        shade "${bake[@]}" --stats "$name"
        refused 3 "$name: cannot be written: "
        untouched out.exr
    done
}

# synced NAME: it was synced under its temporary name before it was renamed, and its folder after that.
synced() {
    awk -v name="$1" '$1 == "rename" && $2 ~ "(^|/)" name "$" { renamed = before; after = 1; next }
        $1 == "rename" { before = 0; next }
        after && $2 ~ "/there$" { folder = 1 }
        $2 ~ "/there/[.]" { before = 1 }
        END { exit !(renamed && folder) }' syncs || fail "$1: $(cat syncs)"
    rm syncs
}

@test "every output is synced before it is renamed, and its folder after" {
    mkdir there
    export LD_PRELOAD=$calls TELL_SYNCS=$PWD/syncs
    "$VDBSHADE" bake box.obj "${SMALL[@]}" --quiet -o there/out.exr
    synced out.exr
    "$VDBSHADE" bake box.obj "${SMALL[@]}" --quiet -o there/out.png --stats there/s.json
    synced s.json
    "$VDBSHADE" voxelize box.obj --resolution 16 --quiet -o there/out.vdb
    synced out.vdb
    printf '0,2,0,0,1,0\n' >points.csv
    local ending
    for ending in csv ply; do
        "$VDBSHADE" query box.obj --points points.csv --resolution 16 --sun 0,1,0 --sun-angle 5 --quiet -o there/out.$ending
        synced out.$ending
    done
    "$VDBSHADE" compare there/out.exr there/out.exr --html there/page.html --junit there/page.xml --quiet
    synced page.html
}

@test "an error ends with its reason however long the path is" {
    local part long ending
    part=$(printf 'd%.0s' {1..200})/$(printf 'd%.0s' {1..200})/$(printf 'd%.0s' {1..200})/
    for long in "begin/$part$part" "begin/$part$part$part$part$part$part"; do
        for ending in obj exr vdb json; do
            refuses 3 "begin/ddd" "x.$ending: " "No such file or directory" -- info "${long}x.$ending"
        done
        refuses 3 "begin/ddd" "x.exr: cannot be written: " -- bake box.obj "${SMALL[@]}" --quiet -o "${long}x.exr"
        refuses 3 "begin/ddd" "x.json: cannot be written: " -- "${bake[@]}" --stats "${long}x.json"
    done
}
