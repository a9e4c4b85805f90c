# Help, version, and what is wrong with a command line; the documents of formats and settings say the same.
load helper

commands() {
    "$VDBSHADE" --help | sed -n '/^Commands:/,/^$/s/^  \([a-z]*\) .*/\1/p'
}

fits() {
    local line
    for line in "${lines[@]}"; do
        [ "${#line}" -le 100 ] || fail "longer than 100 columns: $line"
    done
}

@test "the help names the commands and the exit codes, and the version is the library's" {
    for flag in --help -h; do
        succeed_printing bake voxelize info 130 -- "$flag"
        fits
    done
    [ "$(commands | wc -l)" -eq 14 ] || fail "$(commands)"
    for flag in --version -V; do
        succeed "$flag"
        [[ $output =~ ^vdbshade\ [0-9]+\.[0-9]+\.[0-9]+$ ]] || fail "no version"
    done
}

@test "every command has its own help within 100 columns, whose options fill their column, counted in characters" {
    local LC_ALL=C.UTF-8 line text before
    for command in $(commands); do
        succeed_printing "Usage: vdbshade $command " -- "$command" --help
        [ -z "$stderr" ] || fail "something on standard error"
        fits
        before=
        for line in "${lines[@]}"; do
            text=${line:30}
            [[ $line == *: && $line != ' '* ]] && text= && before=
            if [[ $line == "$(printf '%30s' '')"* ]]; then # the option's help goes on
                word=${text%% *}
                [ -z "$before" ] || [ $((${#before} + 1 + ${#word})) -gt 56 ] ||
                    fail "$command: '$word' fits the line before: $before"
            elif [[ ${line:29:1} == ' ' ]]; then
                [[ $text != ' '* ]] || fail "$command: the help begins late: $line"
            elif [[ $line =~ ^\ +- ]]; then # a long name, whose help begins below
                [[ $line =~ [^\ ]\ \  ]] && fail "$command: the help begins early: $line"
                text=
            fi
            before=$text
        done
    done
}

@test "the help of bake begins with the twelve options that most need, and names every one that holds for good" {
    succeed bake --help
    [ "$(grep -oE '^ {2,6}(-., )?--[a-z-]+' <<<"$output" | head -12 | sed 's/.*--//' | tr '\n' ' ')" = \
        "output sun sun-angle lights ao irradiance size unwrap per-object max-error view dry-run " ] || fail "others come first"
    for option in sun sun-angle ao size resolution voxel-size uv-set method padding threads memory-limit stats quiet; do
        [[ $output == *"--$option "* ]] || fail "--$option is missing"
    done
}

@test "no command, an unknown command or option, a missing value and what is too many are usage errors" {
    shade
    refused 2 'no command'
    # an abbreviation is none, as the next version may have another option of that beginning
    refuse_each <<'LIST'
2 'did you mean bake?' | backe
2 --verson | --verson
2 'did you mean --resolution?' | bake box.obj -o out.exr --resolutoin 5
2 'bake --help' | bake box.obj -o out.exr --zzzzzzzzzz
2 '-z' | bake box.obj -o out.exr -z
2 --resol | bake box.obj -o out.exr --resol 24 --ao 1
2 '-o' value | bake box.obj -o
2 '--sun' value | bake box.obj -o out.exr --sun
2 '--quiet' | bake box.obj -o out.exr --quiet=yes
2 other.obj | bake box.obj other.obj -o out.exr --ao 1
2 'no INPUT' | bake -o out.exr
LIST
}

@test "numbers are read strictly" {
    old_output out.exr
    local option value values
    while read -r option values; do
        for value in $values; do
            refuses 2 "$option" "$value" -- bake box.obj -o out.exr "${SMALL[@]}" "$option" "$value"
        done
    done <<'LIST'
--ao 0 -1 nan 1m 0x10
--ao-method ray
--rays 0 4097
--max-error 0 2
--sun 1,2 0,0,0 1,2,3,4 1,nan,3
--sun-angle 180 -1 inf
--voxel-size 0 -0.1 nan inf
--resolution 1 65537 24.5 99999999999999999999
--size 0 1000000 64x 64x0 -64
--uv-set -1 8
--supersample 0 17
--padding -1 4097
--bits 12
--threads 0 1025
--memory-limit -5 5T many
LIST
    refuses 2 --ao -- bake box.obj -o out.exr "${SMALL[@]}" --ao ''
    untouched out.exr
}

@test "an unknown method is refused with the list of those there are, and what does not go together or lacks something is named" {
    old_output out.exr
    refuse_each bake box.obj <<'LIST'
2 magic 'hard, classic, practical, improved, smooth, cone, rays, adaptive, exact, auto' | -o out.exr "${SMALL[@]}" --method magic
2 ray 'hard, classic, practical, improved, smooth, cone, rays, adaptive, exact, auto' | -o out.exr "${SMALL[@]}" --method ray
2 --rays cone 'rays, adaptive or exact' | -o out.exr "${SMALL[@]}" --rays 8 --method cone
2 --error smooth | -o out.exr "${SMALL[@]}" --error --method smooth
2 --max-error rays 'adaptive or exact' | -o out.exr "${SMALL[@]}" --max-error 0.1 --method rays
2 --sun --ao | -o out.exr
2 --sun-angle | -o out.exr --ao 1 --sun-angle 5
2 --ao-method | -o out.exr --sun 0,1,0 --ao-method cones
2 --irradiance | -o out.exr --ao 1 --irradiance
2 '-o' | --ao 1
2 --resolution --voxel-size | -o out.exr --ao 1 --resolution 24 --voxel-size 0.1
LIST
    untouched out.exr
}

@test "-q and -v are --quiet and --verbose, together with other letters too; a name that begins with a dash comes after --" {
    succeed bake box.obj "${SMALL[@]}" -qo out.exr
    [ -z "$stderr" ]
    succeed bake box.obj "${SMALL[@]}" -v -o told.exr
    [ -n "$stderr" ]
    cmp out.exr told.exr
    write_box ./-box.obj
    succeed bake "${SMALL[@]}" --quiet -o out.exr -- -box.obj
    [ -s out.exr ]
}

@test "an option that is refused names itself, its value and what is expected" {
    refuse_each <<'LIST'
2 "--rays '5000': expected a whole number from 1 to 4096" | bake box.obj --sun 1,1,1 -o out.exr --rays 5000
2 "--size '64x': expected W or WxH, each from 1 to 65536 texels" | bake box.obj --sun 1,1,1 -o out.exr --size 64x
2 "--method 'soft': expected one of hard," | volume box.obj --sun 1,1,1 -o out.vdb --method soft
2 "--resolution '1': expected a whole number from 2 to 65536" | query box.obj --points p.csv -o out.csv --resolution 1
2 "--padding '5000': expected a whole number from 0 to 4096" | flat flat.json -o out.exr --padding 5000
LIST
}

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
    sed -n '/^## The scene/,/^## Casters/p' "$DOCS/$1" | grep '^| `'
}

@test "--help of bake and flat has the ranges and the defaults that the documents have" {
    "$VDBSHADE" bake --help >help.txt
    expect_ranges 3 < <(tables scene.md)
    "$VDBSHADE" flat --help >help.txt
    expect_ranges 2 < <(tables flat.md)
    # what the document has as a list, or for each of two numbers
    [[ $(help_of size) == *"each from 1 to 65536 texels (512)"* ]] || fail "$(help_of size)"
}

@test "help prints what --help of a command prints, and pages of the manual" {
    for command in $(commands); do
        "$VDBSHADE" "$command" --help >expected.txt
        succeed help "$command"
        [[ $output == "$(cat expected.txt)"* ]] || fail "$command"
    done
    for topic in scene docs/query.md Security warnings.md; do
        "$VDBSHADE" help "$topic" >page.txt
        name=$(basename "$topic" .md)
        cmp page.txt "$(find "$DOCS" -iname "$name.md")"
    done
    succeed help
    for page in "$DOCS"/*.md; do
        name=$(basename "$page" .md)
        [[ $name == architecture || $name == README ]] || [[ $output == *"$name "* ]] || fail "$name is missing"
    done
    [[ $output == *"docs/query "* && $output == *"  scene "* ]] || fail "a command's name hides its page"
}

@test "an unknown topic suggests the nearest" {
    refuse_each help <<'LIST'
2 seen 'did you mean scene?' | seen
2 'did you mean bake?' | bakke
2 'vdbshade help' | zzzzzzzzz
LIST
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
    [ "$written" -ge 11 ] || fail "only $written endings found"
    no_leftovers
}

@test "the help names the first ending of every row" {
    succeed bake --help
    local ending
    for ending in $(endings_after '| ending | bits' | while read -r first _; do echo "$first"; done); do
        [[ $output == *".$ending"* ]] || fail "$ending"
    done
    [[ $output == *docs/formats.md* ]] || fail "no reference"
}

@test "light in a PNG is sRGB, and light over 1 is told once with its share" {
    bake=(bake box.obj --sun 0,3,4 --irradiance --size 32 --resolution 24 --bits 8)
    succeed "${bake[@]}" -o light.png --quiet
    "$VDBSHADE" info light.png | grep -qx 'vdbshade_color_space: sRGB' || fail "it does not say sRGB"
    shade "${bake[@]}" --pack R=shadow.sun,A=A -o data.png --quiet
    "$VDBSHADE" info data.png | grep -qx 'vdbshade_color_space: linear' || fail "it does not say linear"
    write_scene linear.json box.obj '' '"color_space": "linear"' '0, 3, 4'
    no_sun "${bake[@]:2}"
    shade bake linear.json "${rest[@]}" -o linear.png --quiet
    ! same_values light.png linear.png || fail "color_space changes nothing"
    write_scene srgb.json box.obj '' '"color_space": "srgb"'
    refuses 2 srgb -- bake srgb.json "${rest[@]}" -o x.tif --bits 32
    shade "${bake[@]}" -o light.png
    [[ $stderr != *"brighter than 1"* ]] || fail "nothing is"
    succeed "${bake[@]}" --ambient 0.5,0.5,2.25 --ao 1 -o light.png
    [ "$(grep -c 'texels are brighter than 1, up to 3.05, and cut to 1' <<<"$stderr")" -eq 1 ] || fail "not told"
    shade "${bake[@]}" --ambient 0.5,0.5,2.25 --ao 1 --bits 32 -o light.exr
    [[ $stderr != *"brighter than 1"* ]] || fail "EXR holds it"
}
