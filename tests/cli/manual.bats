# Man pages, completions and `vdbshade help`, all made from the tables that --help is made from.
load helper

# A folder to complete in.
complete_in() {
    mkdir -p "$1/folder"
    (cd "$1" && : >scene.json && : >mesh.OBJ && : >image.exr && : >level.vdb && : >points.csv && : >notes.txt && : >"two words.glb")
}

# The options that --help of command $1 names, one a line.
options_of() {
    "$VDBSHADE" "$1" --help | grep -oE '^ {2,6}(-., )?--[a-z0-9-]+' | grep -oE -- '--[a-z0-9-]+' | sort
}

commands() {
    "$VDBSHADE" --help | sed -n '/^Commands:/,/^$/s/^  \([a-z]*\) .*/\1/p'
}

# answers WORD …: what a completion printed, in any order.
answers() {
    [ "$(sort <<<"$output")" = "$(printf '%s\n' "$@" | sort)" ] || fail "expected: $*"
}

@test "help prints what --help of a command prints, and pages of the manual" {
    for command in $(commands); do
        "$VDBSHADE" "$command" --help >expected.txt
        shade help "$command"
        done_well
        [[ $output == "$(cat expected.txt)"* ]] || fail "$command"
    done
    docs=$BATS_TEST_DIRNAME/../../docs
    for topic in scene docs/query.md Security warnings.md; do
        "$VDBSHADE" help "$topic" >page.txt
        name=$(basename "$topic" .md)
        cmp page.txt "$(find "$docs" -iname "$name.md")"
    done
    shade help
    done_well
    for page in "$docs"/*.md; do
        name=$(basename "$page" .md)
        [ "$name" = architecture ] || [[ $output == *"$name "* ]] || fail "$name is missing"
    done
    [[ $output == *"docs/query "* && $output == *"  scene "* ]] || fail "a command's name hides its page"
}

@test "an unknown topic suggests the nearest, and what does not go together is refused" {
    shade help seen
    refused 2 seen 'did you mean scene?'
    shade help bakke
    refused 2 'did you mean bake?'
    shade help zzzzzzzzz
    refused 2 "vdbshade help"
    shade help --completion tcsh
    refused 2 tcsh bash zsh fish
    shade help bake --completion bash
    refused 2 TOPIC
    shade help --man scene
    refused 2 scene
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

@test "bash completes commands, options, values, and files by their endings" {
    complete_in files
    "$VDBSHADE" help --completion bash >bash.txt
    # completes the words given, the last being the one to complete; without what bash adds of its own
    bash_completes() {
        run --separate-stderr bash --norc -c 'cd files && source ../bash.txt || exit
            COMP_WORDS=("$@") COMP_CWORD=$(($# - 1))
            _vdbshade; ((${#COMPREPLY[@]} == 0)) || printf "%s\n" "${COMPREPLY[@]}"' bash vdbshade "$@"
        [ -z "$stderr" ] || fail "something on standard error"
    }
    bash_completes vo
    answers voxelize volume
    bash_completes bake scene.json --out
    answers --output --output-folder
    for command in $(commands); do
        bash_completes "$command" --
        answers $(options_of "$command")
    done
    bash_completes bake --method a
    answers adaptive auto
    bash_completes bake --method = a
    answers adaptive auto
    bash_completes bake --bits =
    answers 8 16 32
    bash_completes flat --method ''
    answers hard classic exact
    bash_completes query --normals ''
    answers yes no
    bash_completes bake --rays ''
    answers ''
    bash_completes bake ''
    answers folder mesh.OBJ scene.json 'two words.glb'
    bash_completes bake 'two\ w'
    answers 'two words.glb'
    bash_completes query --points ''
    answers folder points.csv notes.txt
    bash_completes bake -o im
    answers image.exr
    bash_completes bake --output-folder ''
    answers folder
    bash_completes help ren
    answers render
    bash_completes help sce
    answers scene
    # and as readline asks
    run bash --norc -ic 'source bash.txt; complete -p vdbshade'
    [[ $output == *"complete -F _vdbshade vdbshade"* ]] || fail "not registered"
}

@test "fish completes commands, options, values, and files by their endings" {
    command -v fish >/dev/null || skip "no fish"
    complete_in files
    "$VDBSHADE" help --completion fish >fish.txt
    fish_completes() {
        HOME=$PWD run --separate-stderr fish --no-config -c "cd files; source ../fish.txt; complete -C '$1' | string split -f 1 \t"
        [ -z "$stderr" ] || fail "something on standard error"
    }
    fish_completes 'vdbshade vo'
    answers voxelize volume
    fish_completes 'vdbshade bake scene.json --out'
    answers --output --output-folder
    for command in $(commands); do
        fish_completes "vdbshade $command --"
        answers $(options_of "$command")
    done
    fish_completes 'vdbshade bake --method a'
    answers adaptive auto
    fish_completes 'vdbshade bake --method=a'
    answers --method=adaptive --method=auto
    fish_completes 'vdbshade flat --method '
    answers hard classic exact
    fish_completes 'vdbshade bake --rays '
    answers ''
    fish_completes 'vdbshade bake '
    answers folder/ mesh.OBJ scene.json 'two words.glb'
    fish_completes 'vdbshade query --points '
    answers folder/ points.csv notes.txt
    fish_completes 'vdbshade bake -o im'
    answers image.exr
    fish_completes 'vdbshade bake --output-folder '
    answers folder/
    fish_completes 'vdbshade help sce'
    answers scene
}

@test "zsh completes commands, options, values, and files by their endings" {
    command -v zsh >/dev/null || skip "no zsh"
    complete_in files
    mkdir functions
    "$VDBSHADE" help --completion zsh >functions/_vdbshade
    # an interactive shell on a terminal of its own, which notes what is offered
    cat >ask.zsh <<'ZSH'
zmodload zsh/zpty
zpty shell zsh -f -i
zpty -w shell "cd $PWD/files; fpath=($PWD/functions \$fpath); autoload -Uz compinit; compinit -u -D"
zpty -w shell 'compadd() { local -a offered; [[ "$*" == *-(O|A|D)\ * ]] || { builtin compadd -A offered "$@"; print -rl -- $offered >>../offered; }; builtin compadd "$@" }'
zpty -w shell "comppostfuncs=(tell); tell() { : >../asked }; : >../ready"
until [[ -e ready ]]; do zpty -rt shell >/dev/null; done
zpty -wn shell "$1"$'\t'
for i in {1..500}; do [[ -e asked ]] && break; zpty -rt shell >/dev/null; sleep 0.01; done
[[ -e asked ]] && zpty -d shell
ZSH
    zsh_completes() {
        rm -f offered asked ready
        : >offered
        timeout 20 zsh -f ask.zsh "$1" || fail "zsh did not answer"
        output=$(sort -u offered | tr -d '\\')
    }
    zsh_completes 'vdbshade vo'
    answers voxelize volume
    zsh_completes 'vdbshade bake scene.json --out'
    answers --output --output-folder
    zsh_completes 'vdbshade volume scene.json --'
    answers $(options_of volume)
    zsh_completes 'vdbshade bake --method=a'
    answers adaptive auto
    zsh_completes 'vdbshade flat --method '
    answers hard classic exact
    zsh_completes 'vdbshade bake '
    answers folder mesh.OBJ scene.json 'two words.glb'
    zsh_completes 'vdbshade query --points '
    answers folder points.csv notes.txt
    zsh_completes 'vdbshade bake --output-folder '
    answers folder
    zsh_completes 'vdbshade view a.glb b.g'
    answers ''
    zsh_completes 'vdbshade help sce'
    answers scene
}
