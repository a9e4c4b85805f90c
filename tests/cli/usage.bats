# Help, version, and bad command lines of every command. Help and documents agree on settings and formats.
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

@test "every command has help within 100 columns, wrapped as late as possible" {
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

@test "the help of bake begins with the twelve most used options, and has all stable ones" {
    succeed bake --help
    [ "$(grep -oE '^ {2,6}(-., )?--[a-z-]+' <<<"$output" | head -12 | sed 's/.*--//' | tr '\n' ' ')" = \
        "output sun sun-angle lights ao irradiance size unwrap per-object max-error view dry-run " ] || fail "others come first"
    for option in sun sun-angle ao size resolution voxel-size uv-set method padding threads memory-limit stats quiet; do
        [[ $output == *"--$option "* ]] || fail "--$option is missing"
    done
}

@test "unknown commands and options, missing values and extra words are usage errors" {
    shade
    refused 2 'no command'
    # abbreviations are refused, because the next version may have another option that begins so
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
2 "--size '64x': expected W or WxH, each from 1 to 65536 texels" | bake box.obj --sun 1,1,1 -o out.exr --size 64x
2 "--padding '5000': expected a whole number from 0 to 4096" | flat flat.json -o out.exr --padding 5000
LIST
}

@test "every command refuses values that are no numbers or out of range" {
    local command option values value
    while read -r command option values; do
        for value in $values; do
            refuses 2 "$option" "$value" -- "$command" box.obj "$option" "$value" -o out.exr || fail "$command"
        done
    done <<'LIST'
bake --ao 0 -1 nan 1m 0x10
bake --ao-method ray
bake --rays 0 4097
bake --max-error 0 2
bake --sun 1,2 0,0,0 1,2,3,4 1,nan,3
bake --sun-angle 180 -1 inf
bake --voxel-size 0 -0.1 nan inf
bake --resolution 1 65537 24.5 99999999999999999999
bake --size 0 1000000 64x 64x0 -64
bake --uv-set -1 8
bake --supersample 0 17
bake --padding -1 4097 all
bake --seams stitch
bake --bits 12
bake --threads 0 1025
bake --memory-limit -5 5T many
compare --noise 1.5
compare --reach 17
flat --size 70000
flat --supersample 0
query --batch 0
query --normals maybe
render --camera nan,0,0 1,2
render --fov 180
render --up 0,0,0
trade --budget 0
trade --resolutions 1 64, 64;128
trade --truth-rays 15
unwrap --atlas each
unwrap --density 3
unwrap --max-stretch 1
unwrap --padding -1
view --uv-set -1 8 x
volume --box 0,0,0,1,1 0,0,0,1,0,1 0,0,0,1,-1,1 0,0,nan,1,1,1 0,0,0,1,1,1,1 a
volume --box-voxel-size 0 -1 nan 1x
voxelize --voxel-size 0
LIST
    refuses 2 --ao -- bake box.obj -o out.exr "${SMALL[@]}" --ao ''
    [ ! -e out.exr ] || fail "an output beside the error"
}

@test "every command refuses outputs that are missing, misplaced, of another format or an input, and missing inputs" {
    printf '{"region": [-2, -2, 2, 2], "casters": [], "lights": [{"name": "sun", "type": "directional", "direction": [0, 1]}]}' >flat.json
    printf '0,2,0,0,1,0\n' >points.csv
    local command input ending options other
    while read -r command input ending options; do
        # shellcheck disable=SC2206 # words
        options=($options)
        refuses 2 '-o' -- "$command" "$input" "${options[@]}" || fail "$command: none"
        refuses 2 out.what -- "$command" "$input" "${options[@]}" -o out.what || fail "$command: another format"
        refuses 3 "none/out.$ending" -- "$command" "$input" "${options[@]}" -o "none/out.$ending" || fail "$command: no folder"
        other=none.${input#*.}
        old_output "out.$ending"
        refuses 3 "$other" -- "$command" "$other" "${options[@]}" -o "out.$ending" || fail "$command: no input"
        untouched "out.$ending"
        ln -sf "$input" "link.$ending"
        refuses 2 "link.$ending" "an input" -- "$command" "$input" "${options[@]}" -o "link.$ending" || fail "$command: its input"
    done <<LIST
bake box.obj exr ${SMALL[*]}
flat flat.json exr
query box.obj csv ${COARSE[*]:2} --sun 0,1,0 --points points.csv
render box.obj png --sun 0,1,0 --size 8x8
trade box.obj html --sun 0,1,0 --budget 1
unwrap box.obj obj --size 64
view box.obj html
volume box.obj vdb --sun 0,1,0 --resolution 16
voxelize box.obj vdb --resolution 16
LIST
    cp box.obj copy.obj
    ln -sf copy.obj link.exr
    refuses 2 link.exr "an input" -- bake box.obj "${SMALL[@]}" -o link.exr --caster copy.obj
    refuses 2 box.obj "an input" -- bake box.obj "${SMALL[@]}" -o out.exr --stats box.obj
    cmp box.obj <(write_box /dev/stdout) || fail "an input was replaced"
}

@test "an unknown method is refused with the list of methods, and options that exclude or need others are named" {
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

@test "-q and -v are --quiet and --verbose, letters combine, and -- ends the options" {
    succeed bake box.obj "${SMALL[@]}" -qo out.exr
    [ -z "$stderr" ]
    succeed bake box.obj "${SMALL[@]}" -v -o told.exr
    [ -n "$stderr" ]
    cmp out.exr told.exr
    write_box ./-box.obj
    succeed bake "${SMALL[@]}" --quiet -o out.exr -- -box.obj
    [ -s out.exr ]
}

# The help of option $1 as one line.
help_of() {
    awk -v option="--$1" '$1 ~ /^-/ || /^$/ { here = $1 == option } here { printf "%s ", $0 }' help.txt | tr -s ' '
}

# Compares help.txt with the tables of options on standard input. At least $1 options must be in both.
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

@test "help prints a command's --help, and pages of the manual" {
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

@test "bake writes every format of docs/formats.md, and its help names the first ending of each" {
    local written=0 help endings ending
    help=$("$VDBSHADE" bake --help)
    while read -ra endings; do
        [[ $help == *".${endings[0]}"* ]] || fail "no ${endings[0]} in the help"
        for ending in "${endings[@]}"; do
            succeed bake box.obj "${SMALL[@]}" --ao 1 --quiet -o "out.$ending"
            [ -s "out.$ending" ] && [ -z "$stderr" ] || fail "$ending"
            written=$((written + 1))
        done
    done < <(awk -F'|' '/^[|] ending [|] bits/ { inside = 1 } inside && /^$/ { exit } inside && /^[|] `/ { gsub(/[`,]/, "", $2); print $2 }' "$DOCS/formats.md")
    [ "$written" -ge 11 ] || fail "only $written endings found"
    [[ $help == *docs/formats.md* ]] || fail "no reference"
    no_leftovers
}

@test "light in a PNG is sRGB unless a scene asks for linear, and light over 1 gets one warning" {
    local light=(--irradiance --size 32 --resolution 24 --bits 8)
    local bake=(bake box.obj --sun 0,3,4 "${light[@]}")
    succeed "${bake[@]}" -o light.png
    [[ $stderr != *"brighter than 1"* ]] || fail "nothing is"
    info_tells light.png 'vdbshade_color_space: sRGB'
    succeed "${bake[@]}" --pack R=shadow.sun,A=A -o data.png --quiet
    info_tells data.png 'vdbshade_color_space: linear'
    write_scene linear.json box.obj '' '"color_space": "linear"' '0, 3, 4'
    succeed bake linear.json "${light[@]}" -o linear.png --quiet
    differ light.png linear.png
    write_scene srgb.json box.obj '' '"color_space": "srgb"'
    refuses 2 srgb -- bake srgb.json "${light[@]}" -o x.tif --bits 32
    succeed "${bake[@]}" --ambient 0.5,0.5,2.25 --ao 1 -o light.png
    [ "$(grep -c 'texels are brighter than 1, up to 3.05, and cut to 1' <<<"$stderr")" -eq 1 ] || fail "no warning"
    succeed "${bake[@]}" --ambient 0.5,0.5,2.25 --ao 1 --bits 32 -o light.exr
    [[ $stderr != *"brighter than 1"* ]] || fail "EXR holds it"
}
