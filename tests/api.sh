#!/usr/bin/env bash
# Doxygen finds a comment for every symbol of the public headers and puts it on a page. Usage: api.sh DOXYFILE
set -euo pipefail

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
doxyfile=${1:?usage: api.sh DOXYFILE}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

# pages FOLDER: documents the headers of FOLDER; fails if a comment is missing
pages() {
    rm -rf "$work/pages"
    mkdir "$work/pages"
    { cat "$doxyfile" && printf 'INPUT = %s\nOUTPUT_DIRECTORY = %s\nWARN_AS_ERROR = FAIL_ON_WARNINGS\n' "$1" "$work/pages"; } |
        doxygen - >"$work/log" 2>&1
}
pages "$root/include/vdbshade" || { cat "$work/log" && exit 1; }

# Doxygen asks for no comments in unnamed enums, so look for functions and constants.
names=$(gcc -E -P -I"$root/include" -x c - <<<'#include <vdbshade/vdbshade.h>' |
    grep -oE '\b(vsh_[a-z0-9_]+\(|VSH_[A-Z0-9_]+ = )' | tr -d '( =' | sort -u)
[ "$(wc -l <<<"$names")" -gt 300 ]
cat "$work"/pages/html/*_8h.html >"$work/all"
missing=$(while read -r name; do grep -q ">$name *<" "$work/all" || echo "$name"; done <<<"$names")
[ -z "$missing" ] || { echo "api: on no page:" $missing && exit 1; }

# Missing comments of a function, a struct, members and a macro are noticed.
noticed() { # FILE SED WORD
    rm -rf "$work/headers"
    cp -r "$root/include/vdbshade" "$work/headers"
    sed -i "$2" "$work/headers/$1"
    ! cmp -s "$root/include/vdbshade/$1" "$work/headers/$1" || { echo "nothing changed: $2" && exit 1; }
    if pages "$work/headers" || ! grep -q "$3.*is not documented" "$work/log"; then
        echo "api: not noticed: $2" && cat "$work/log" && exit 1
    fi
}
noticed base.h 's|^/\* "0.2.0"; a static string. \*/$||' vsh_version
noticed base.h '/^\/\* Options of every call/d' vsh_run
noticed base.h 's|^\(    int32_t threads; *\)/\*.*|\1|' threads
noticed light.h 's|^\(    double radius; *\)/\*.*|\1|' radius
noticed lightmap.h '/^\/\* The chart of a triangle/d' VSH_NO_CHART
echo "api: every symbol is documented"
