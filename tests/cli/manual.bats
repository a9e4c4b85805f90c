# Man pages and `vdbshade help`, made from the tables that --help is made from.
load helper

# The options that --help of command $1 names, one a line.
options_of() {
    "$VDBSHADE" "$1" --help | grep -oE '^ {2,6}(-., )?--[a-z0-9-]+' | grep -oE -- '--[a-z0-9-]+' | sort
}

commands() {
    "$VDBSHADE" --help | sed -n '/^Commands:/,/^$/s/^  \([a-z]*\) .*/\1/p'
}

@test "help prints what --help of a command prints, and pages of the manual" {
    for command in $(commands); do
        "$VDBSHADE" "$command" --help >expected.txt
        succeed help "$command"
        [[ $output == "$(cat expected.txt)"* ]] || fail "$command"
    done
    docs=$BATS_TEST_DIRNAME/../../docs
    for topic in scene docs/query.md Security warnings.md; do
        "$VDBSHADE" help "$topic" >page.txt
        name=$(basename "$topic" .md)
        cmp page.txt "$(find "$docs" -iname "$name.md")"
    done
    succeed help
    for page in "$docs"/*.md; do
        name=$(basename "$page" .md)
        [[ $name == architecture || $name == README ]] || [[ $output == *"$name "* ]] || fail "$name is missing"
    done
    [[ $output == *"docs/query "* && $output == *"  scene "* ]] || fail "a command's name hides its page"
}

@test "an unknown topic suggests the nearest, and what does not go together is refused" {
    refuses 2 seen 'did you mean scene?' -- help seen
    refuses 2 'did you mean bake?' -- help bakke
    refuses 2 "vdbshade help" -- help zzzzzzzzz
    refuses 2 TOPIC -- help bake --write pages
    refuses 2 scene -- help --man scene
}

@test "there is a man page for the program and each command, with every option of its help" {
    "$VDBSHADE" help --write pages
    [ "$(ls pages/share/man/man1 | wc -l)" -eq $(($(commands | wc -l) + 1)) ]
    for command in $(commands); do
        page=pages/share/man/man1/vdbshade-$command.1
        "$VDBSHADE" help --man "$command" | cmp - "$page"
        man --warnings -l "$page" 2>&1 >plain.txt | tee troff.txt
        [ ! -s troff.txt ] || fail "$page"
        MANWIDTH=120 man -l "$page" | col -b >plain.txt
        grep -oE '^ {7}(-., )?--[a-z0-9-]+' plain.txt | grep -oE -- '--[a-z0-9-]+' | sort >there.txt
        options_of "$command" | diff - there.txt
        grep -q "vdbshade-$command - " plain.txt
        grep -qE '^ +vdbshade '"$command"' ' plain.txt
        grep -qE '^ +130 +interrupted' plain.txt
    done
    "$VDBSHADE" help --man | cmp - pages/share/man/man1/vdbshade.1
    # texts are there whole, whatever is in them
    MANWIDTH=1000 man -l pages/share/man/man1/vdbshade-bake.1 | col -b >plain.txt
    grep -qF -- "radius of its points and spots, scene units (0: hard)" plain.txt
    grep -qF -- "R=NAME,…" plain.txt
}

@test "mandoc finds nothing wrong with a man page, but that it has no date" {
    command -v mandoc >/dev/null || skip "no mandoc"
    "$VDBSHADE" help --write pages
    for page in pages/share/man/man1/*; do
        mandoc -Tlint "$page" | grep -v 'missing date, using ""' >lint.txt || true
        [ ! -s lint.txt ] || fail "$(cat lint.txt)"
    done
}
