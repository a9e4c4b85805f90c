# Help, version, and what is wrong with a command line.
load helper

fits() {
    local line
    for line in "${lines[@]}"; do
        [ "${#line}" -le 100 ] || fail "longer than 100 columns: $line"
    done
}

@test "the help names the commands and the exit codes" {
    for flag in --help -h; do
        succeed "$flag"
        [[ $output == *bake*voxelize*info*130* ]] || fail "commands or exit codes are missing"
        fits
    done
}

@test "the version is the library's" {
    succeed --version
    [[ $output =~ ^vdbshade\ [0-9]+\.[0-9]+\.[0-9]+$ ]] || fail "no version"
}

@test "every command has its own help, which fits 100 columns" {
    for command in bake voxelize info trade query volume flat render compare regress unwrap view merge help; do
        succeed "$command" --help
        [[ $output == "Usage: vdbshade $command "* ]] || fail "no usage line"
        [ -z "$stderr" ] || fail "something on standard error"
        fits
    done
}

@test "the help of options fills its column, counted in characters" {
    local LC_ALL=C.UTF-8 line text before
    for command in bake voxelize info trade query volume flat render compare regress unwrap view merge help; do
        succeed "$command" --help
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

@test "the help of bake names every option that holds for good" {
    shade bake --help
    for option in sun sun-angle ao size resolution voxel-size uv-set method padding threads memory-limit \
        stats quiet; do
        [[ $output == *"--$option "* ]] || fail "--$option is missing"
    done
}

@test "no command, an unknown command and an unknown option are usage errors" {
    shade
    refused 2 'no command'
    refuses 2 "did you mean bake?" -- backe
    refuses 2 --verson -- --verson
}

@test "an unknown option suggests the nearest" {
    refuse_each bake box.obj -o out.exr <<'LIST'
2 'did you mean --resolution?' | --resolutoin 5
2 'bake --help' | --zzzzzzzzzz
2 '-z' | -z
LIST
}

@test "an abbreviated option is refused, as the next version may have another of that beginning" {
    refuses 2 --resol -- bake box.obj -o out.exr --resol 24 --ao 1
}

@test "a missing value, a value too many and an operand too many are usage errors" {
    refuse_each bake <<'LIST'
2 '-o' value | box.obj -o
2 '--sun' value | box.obj -o out.exr --sun
2 '--quiet' | box.obj -o out.exr --quiet=yes
2 other.obj | box.obj other.obj -o out.exr --ao 1
2 'no INPUT' | -o out.exr
LIST
}

@test "numbers are taken strictly" {
    old_output out.exr
    while read -r option value; do
        refuses 2 "$option" "$value" -- bake box.obj -o out.exr "${SMALL[@]}" "$option" "$value"
    done <<'LIST'
--ao 0
--ao -1
--ao nan
--ao 1m
--ao 0x10
--ao-method ray
--rays 0
--rays 4097
--max-error 0
--max-error 2
--sun 1,2
--sun 0,0,0
--sun 1,2,3,4
--sun 1,nan,3
--sun-angle 180
--sun-angle -1
--sun-angle inf
--voxel-size 0
--voxel-size -0.1
--voxel-size nan
--voxel-size inf
--resolution 1
--resolution 65537
--resolution 24.5
--resolution 99999999999999999999
--size 0
--size 1000000
--size 64x
--size 64x0
--size -64
--uv-set -1
--uv-set 8
--supersample 0
--supersample 17
--padding -1
--padding 4097
--bits 12
--threads 0
--threads 1025
--memory-limit -5
--memory-limit 5T
--memory-limit many
LIST
    refuses 2 --ao -- bake box.obj -o out.exr "${SMALL[@]}" --ao ''
    untouched out.exr
}

@test "an unknown method is refused with the list of those there are" {
    old_output out.exr
    for method in magic ray; do
        shade bake box.obj -o out.exr "${SMALL[@]}" --method "$method"
        refused 2 "$method" 'hard, classic, practical, improved, smooth, cone, rays, adaptive, exact, auto'
    done
    untouched out.exr
}

@test "what a method does not use is refused beside it" {
    refuse_each bake box.obj -o out.exr "${SMALL[@]}" <<'LIST'
2 --rays cone 'rays, adaptive and exact' | --rays 8 --method cone
2 --error smooth | --error --method smooth
2 --max-error rays 'adaptive and exact' | --max-error 0.1 --method rays
LIST
}

@test "a mesh needs something to bake" {
    refuse_each bake box.obj <<'LIST'
2 --sun --ao | -o out.exr
2 --sun-angle | -o out.exr --ao 1 --sun-angle 5
2 --ao-method | -o out.exr --sun 0,1,0 --ao-method cones
2 --irradiance | -o out.exr --ao 1 --irradiance
2 '-o' | --ao 1
LIST
}

@test "voxel size and resolution exclude each other" {
    refuses 2 --resolution --voxel-size -- bake box.obj -o out.exr --ao 1 --resolution 24 --voxel-size 0.1
}

@test "-q and -v are --quiet and --verbose, together with other letters too" {
    succeed bake box.obj "${SMALL[@]}" -qo out.exr
    [ -z "$stderr" ]
    succeed bake box.obj "${SMALL[@]}" -v -o told.exr
    [ -n "$stderr" ]
    cmp out.exr told.exr
}

@test "a file whose name begins with a dash comes after --" {
    write_box ./-box.obj
    succeed bake "${SMALL[@]}" --quiet -o out.exr -- -box.obj
    [ -s out.exr ]
}
