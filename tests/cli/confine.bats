# The process that parses files of strangers: what code that a file has taken over can do from there.
load helper

setup() {
    cd "$BATS_TEST_TMPDIR" || return 1
    case ${CFLAGS:-} in *-fsanitize*) skip "sanitized readers are not confined" ;; esac
    write_box box.obj
    echo kept >kept
    (trap 'touch signalled; exit' USR1; while :; do sleep 0.1; done) 3>&- &
    VICTIM=$!
}

teardown() {
    [ -z "${VICTIM:-}" ] || kill "$VICTIM" 2>/dev/null || true
}

# taken_over HOW [ARGUMENT…]: vdbshade with a reader whose parser, and threads from before its main, are hostile.
taken_over() {
    run --separate-stderr env LD_PRELOAD="$HOSTILE" VSH_TEST_HOSTILE="$1" VSH_TEST_FOLDER="$PWD" \
        VSH_TEST_VICTIM="$VICTIM" "$VDBSHADE" info box.obj "${@:2}"
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

@test "calls of another kind of machine end the reader at once, all of its threads" {
    [ "$(uname -m)" = x86_64 ] || skip "x32 and 32 bit are x86-64's"
    local how
    for how in x32 i386; do
        SECONDS=0
        taken_over "$how"
        refused 3 'the reader crashed (SIGSYS)'
        [ "$SECONDS" -lt 10 ] || fail "$how: it hung"
    done
    unharmed
}
