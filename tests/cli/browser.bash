# Pages in Chromium, without a window and without a network; loaded after helper.bash.

setup_file() {
    command -v chromium >/dev/null || return 0
    "${CC:-cc}" -std=gnu11 -O1 "$BATS_TEST_DIRNAME/picture.c" -o "$BATS_FILE_TMPDIR/picture" -lpng
}

setup() {
    command -v chromium >/dev/null || skip "there is no chromium"
    cd "$BATS_TEST_TMPDIR" || return 1
}

picture() {
    "$BATS_FILE_TMPDIR/picture" "$@"
}

# The size of the window for browser.py, an even number.
WIDE=400

# look PAGE STATE [ACTION …] [-- OPTION …]: opens PAGE#STATE and does what browser.py can do. Its picture is in page.png, its
# document in page.dom, whose state is $ENDS.
look() {
    local page=$1 state=$2
    shift 2
    local words=("$@")
    [[ " $* " == *" -- "* ]] || words+=(--)
    timeout 200 python3 "$BATS_TEST_DIRNAME/browser.py" "file://$PWD/$page#$state" $WIDE page.png page.dom "${words[@]}" \
        --user-data-dir="$BATS_FILE_TMPDIR/profile" 2>page.log || fail "$(tail -5 page.log)"
    page_has "data-state=\"${ENDS:-ready}\""
}

# page_has TEXT …: the document of the last page has them.
page_has() {
    local text
    for text; do
        grep -qF -- "$text" page.dom || fail "no $text: $(grep -oE '(<div id="message"|<section|id="problems"|id="legend").*' page.dom)"
    done
}

# pixel_is X Y R G B: a pixel of the last picture, to one of 255.
pixel_is() {
    local seen
    seen=$(picture get page.png "$1" "$2")
    awk -v seen="$seen" -v wanted="$3 $4 $5" 'BEGIN {
        split(seen, a); split(wanted, b)
        for (i = 1; i <= 3; ++i) if (a[i] - b[i] > 1.01 || b[i] - a[i] > 1.01) exit 1 }' ||
        fail "pixel $1 $2: $seen, not $3 $4 $5"
}
