#!/usr/bin/env bash
# Every file and heading that the documents link to exists, and every path of the project that they name in backquotes.
# Usage: links.sh
set -euo pipefail

cd "$(dirname "${BASH_SOURCE[0]}")/.."
export LC_ALL=C.UTF-8
files=(*.md docs/*.md assets/README.md bench/README.md)
bad=0 links=0 paths=0

# anchors FILE: prints the anchors of its headings
anchors() {
    sed -nE 's/^#+ +//p' "$1" | sed -E 's/`//g; s/\[([^]]*)\]\([^)]*\)/\1/g; s/[^[:alnum:] _-]//g; s/ /-/g' | tr '[:upper:]' '[:lower:]'
}

for file in "${files[@]}"; do
    while IFS= read -r link; do
        case $link in
        *://* | mailto:*) continue ;;
        esac
        links=$((links + 1))
        path=${link%%#*}
        [ -n "$path" ] && path=$(dirname "$file")/$path || path=$file
        if [ ! -e "$path" ]; then
            echo "$file: links to $link, which is not there" && bad=$((bad + 1))
        elif [[ $link == *#* ]] && ! anchors "$path" | grep -qxF -- "${link#*#}"; then
            echo "$file: links to $link: no such heading" && bad=$((bad + 1))
        fi
    done < <(grep -oE '\]\([^) ]+\)' "$file" | sed -E 's/^\]\(//; s/\)$//')
    while IFS= read -r path; do
        paths=$((paths + 1))
        compgen -G "${path//NAME/*}" >/dev/null || { echo "$file: names $path, which is not there" && bad=$((bad + 1)); }
    done < <(grep -oE '`(src|include|tests|tools|docs|cmake|assets|bench)/[^` ]*`' "$file" | tr -d '`')
done
echo "$links links and $paths paths, $bad bad"
[ "$links" -gt 0 ] && [ "$paths" -gt 0 ] && [ "$bad" -eq 0 ]
