# The confined reader: code that a file has taken over can do no harm from there.
load helper

setup() {
    cd "$BATS_TEST_TMPDIR" || return 1
    unless_sanitized "sanitized readers are not confined"
    write_box box.obj
    echo kept >kept
    (trap 'touch signalled; exit' USR1; while :; do sleep 0.1; done) 3>&- &
    VICTIM=$!
}

teardown() {
    [ -z "${VICTIM:-}" ] || kill "$VICTIM" 2>/dev/null || true
}

# taken_over HOW [FILE]: vdbshade with a reader whose parser, and threads from before its main, are hostile.
taken_over() {
    run --separate-stderr env LD_PRELOAD="$HOSTILE" VSH_TEST_HOSTILE="$1" VSH_TEST_FOLDER="$PWD" \
        VSH_TEST_VICTIM="$VICTIM" "$VDBSHADE" info "${2:-box.obj}"
}

unharmed() {
    [ ! -e marker ] || fail "a file was written, or a process started"
    [ "$(cat kept)" = kept ] || fail "a file was changed"
    [ ! -e signalled ] || fail "a signal was sent"
    kill -0 "$VICTIM" || fail "a signal was sent"
}

@test "a reader that is taken over in every thread writes nothing, starts nothing and signals nobody" {
    taken_over calls
    refused 2 'taken over: 4 threads, 248 calls, let through: none'
    unharmed
}

@test "x32 and 32-bit calls end the reader at once, with all of its threads" {
    [ "$(uname -m)" = x86_64 ] || skip "x32 and 32 bit are x86-64's"
    local how
    for how in x32 i386; do
        SECONDS=0
        taken_over "$how"
        case $how:$stderr in
            i386:*SIGSEGV*) refused 3 'the reader crashed (SIGSEGV)' ;; # a kernel without 32-bit calls
            *) refused 3 'the reader crashed (SIGSYS)' ;;
        esac
        [ "$SECONDS" -lt 10 ] || fail "$how: it hung"
    done
    unharmed
}

@test "a reader that is taken over reads nothing of its parent, and no file but those it was asked for" {
    can files || skip "no Landlock here"
    mkdir outside model
    echo secret >outside/secret
    mv box.obj model/box.obj
    export VSH_TEST_OUTSIDE=$PWD/outside/secret TOKEN_OF_THE_HOST=secret
    taken_over reads model/box.obj
    refused 2 'taken over: 4 threads, 48 calls, let through: none'
}

# can PART: whether this system supports that part of a reader's confinement.
can() {
    "$VDBSHADE" bake box.obj -o probe.exr "${SMALL[@]}" --quiet --stats probe.json
    grep -A 4 '"confined": {' probe.json | grep -q "\"$1\": true"
}

@test "missing confinements give one warning and appear in --stats; --sandbox require makes them an error" {
    local what part
    for what in "limits limits of resources" "seccomp seccomp (system calls)" "landlock Landlock (files)"; do
        part=${what#* }
        "$REFUSE" "${what%% *}" -- true || skip "no seccomp here"
        run --separate-stderr "$REFUSE" "${what%% *}" -- "$VDBSHADE" bake box.obj -o out.exr "${SMALL[@]}" \
            --stats stats.json
        [ "$status" -eq 0 ] || fail "it is no error"
        local told=1
        [ "${what%% *}" != landlock ] || told=0 # many systems have none
        [ "$(grep -c "warning: .*confined in part only: .*$part" <<<"$stderr")" -eq "$told" ] || fail "not $told warnings of it"
        run --separate-stderr "$REFUSE" "${what%% *}" -- "$VDBSHADE" info box.obj --sandbox require
        refused 2 "box.obj: not read: its reader is to be confined, and this system refuses it"
        [[ $stderr == *"$part"* ]] || fail "which is not said"
    done
    grep -A 4 '"confined": {' stats.json | grep -q '"files": false' || fail "not in --stats"
    run --separate-stderr "$REFUSE" limits seccomp landlock -- "$VDBSHADE" info box.obj
    [[ $stderr == *"limits of resources, seccomp (system calls), Landlock (files)"* ]] || fail "not all are said"
    refuses 2 "--sandbox 'on': expected one of auto|require|off" -- info box.obj --sandbox on
    "$VDBSHADE" bake box.obj -o out.exr "${SMALL[@]}" --quiet --sandbox off --stats stats.json
    grep -q '"confined": null' stats.json || fail "nothing is confined with --sandbox off"
}

@test "--sandbox require reads where all is had, without a word" {
    can files && can calls && can limits || skip "not all is had here"
    succeed info box.obj --sandbox require
    [ -z "$stderr" ] || fail "it says something"
}
