# docs/formats.md: what it says is written is written, what it says is not is refused, and the help names the same.
load helper

: "${DOCS:=$BATS_TEST_DIRNAME/../../docs}"

setup() {
    cd "$BATS_TEST_TMPDIR" || return 1
    write_box box.obj
}

# endings_after TEXT: the endings in the first column of the table whose head holds the text.
endings_after() {
    awk -F'|' -v text="$1" 'index($0, text) { inside = 1 }
                            inside && /^$/ { exit }
                            inside && /^\| `/ { gsub(/[`,]/, "", $2); print $2 }' "$DOCS/formats.md"
}

@test "every format of the first table is written" {
    local written=0 ending
    for ending in $(endings_after '| ending | bits'); do
        shade bake box.obj "${SMALL[@]}" --ao 1 --quiet -o "out.$ending"
        done_well || fail "$ending"
        [ -s "out.$ending" ] || fail "$ending: no file"
        [ -z "$stderr" ] || fail "$ending: said something"
        written=$((written + 1))
    done
    [ "$written" -ge 34 ] || fail "only $written endings found"
    no_leftovers
}

@test "every format of the second table is refused with a reason" {
    local refusals=0 ending
    for ending in $(endings_after '| ending | why'); do
        shade bake box.obj "${SMALL[@]}" -o "out.$ending"
        refused 2 "out.$ending" "'$ending' is not written: "
        refusals=$((refusals + 1))
    done
    [ "$refusals" -ge 8 ] || fail "only $refusals endings found"
}

@test "the help names the first ending of every row" {
    shade bake --help
    done_well
    local ending
    for ending in $(endings_after '| ending | bits' | while read -r first _; do echo "$first"; done); do
        case $ending in
        heic) [[ $output == *".heic .avif"* ]] ;;
        *) [[ $output == *".$ending"* ]] ;;
        esac || fail "$ending"
    done
    [[ $output == *docs/formats.md* ]] || fail "no reference"
}
