#!/usr/bin/env bats
# Settings: what a scene's file and options say stands in one table; the documents and --help say the same.
load helper

# The help of option $1 as one line.
help_of() {
    awk -v option="--$1" '$1 ~ /^-/ || /^$/ { here = $1 == option } here { printf "%s ", $0 }' help.txt | tr -s ' '
}

# Holds help.txt against the tables of options on standard input, of which at least $1 are in both.
expect_ranges() {
    local checked=0 key default range option text
    while IFS='|' read -r _ key _ default range _; do
        key=$(tr -d ' `' <<<"$key") range=$(xargs <<<"$range") default=$(tr -d '` "' <<<"$default")
        option=${key//_/-}
        [[ $range =~ ^([0-9.]+)\ …\ ([0-9.]+)$ ]] || continue
        [ "$option" != lights ] || continue # an array of the scene; --lights names a file that has some
        text=$(help_of "$option")
        [ -n "$text" ] || continue
        [[ $text == *" ${BASH_REMATCH[1]} to ${BASH_REMATCH[2]} "* ]] || fail "$key: $range; $text"
        [[ ! $default =~ ^[0-9.]+$ ]] || [[ $text == *"($default"* ]] || [[ $text == *"($default)"* ]] ||
            [[ $text == *"($default:"* ]] || fail "$key: $default; $text"
        checked=$((checked + 1))
    done
    [ "$checked" -ge "$1" ] || fail "only $checked"
}

# tables PAGE: the rows of a page's keys of a scene.
tables() {
    sed -n '/^## The scene/,/^## Casters/p' "$BATS_TEST_DIRNAME/../../docs/$1" | grep '^| `'
}

@test "--help of bake and flat has the ranges and the defaults that the documents have" {
    "$VDBSHADE" bake --help >help.txt
    expect_ranges 3 < <(tables scene.md)
    "$VDBSHADE" flat --help >help.txt
    expect_ranges 3 < <(tables flat.md)
    # what the document has as a list, or for each of two numbers
    [[ $(help_of size) == *"each from 1 to 65536 texels (512)"* ]] || fail "$(help_of size)"
    [[ $(help_of method) == *": hard, classic, exact (exact)"* ]] || fail "$(help_of method)"
}

@test "an option that is refused names itself, its value and what is expected" {
    refuses 2 "--rays '5000': expected a whole number from 1 to 4096" -- bake box.obj --sun 1,1,1 -o out.exr --rays 5000
    refuses 2 "--size '64x': expected W or WxH, each from 1 to 65536 texels" -- bake box.obj --sun 1,1,1 -o out.exr --size 64x
    refuses 2 "--method 'soft': expected one of hard," -- volume box.obj --sun 1,1,1 -o out.vdb --method soft
    refuses 2 "--resolution '1': expected a whole number from 2 to 65536" -- query box.obj --points p.csv -o out.csv --resolution 1
    refuses 2 "--padding '5000': expected a whole number from 0 to 4096" -- flat flat.json -o out.exr --padding 5000
}
