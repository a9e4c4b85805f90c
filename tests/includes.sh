#!/usr/bin/env bash
# Rooms include only rooms below them, and tools/includes finds violations. Usage: includes.sh
set -euo pipefail

here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
includes=$here/../tools/includes
"$includes"

# docs/architecture.md lists the same order.
while read -r room _ rooms; do
    rooms=${rooms// /, }
    grep -q "^| $room | .* | $rooms |\$" "$here/../docs/architecture.md" ||
        { echo "docs/architecture.md: room $room: expected '$rooms' in the last column" && exit 1; }
done < <(grep -E '^[a-z_]+ -> ' "$here/../tools/includes.txt")

# A small tree, with one violation at a time.
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
mkdir -p "$work"/{src/low,src/high,include/api,tools}

make() {
    printf '#include <stdio.h>\n' >"$work/src/low/low.h"
    printf '#include "low/low.h"\n#include <api/high.h>\n' >"$work/src/high/high.c"
    printf '\n' >"$work/include/api/high.h"
    printf 'room low: src/low/*\nroom high: src/high/*\nhigh -> low\n' >"$work/tools/includes.txt"
}
expect() { # CODE TEXT
    local code=0
    "$includes" "$work" >"$work/log" 2>&1 || code=$?
    if [ "$code" -ne "$1" ] || ! grep -qF -- "$2" "$work/log"; then
        echo "expected code $1 and: $2; got code $code and:" && cat "$work/log" && exit 1
    fi
}

make && expect 0 "high      -> low 1"
printf '#include "../high/high.h"\n' >"$work/src/low/low.c"
printf '\n' >"$work/src/high/high.h"
expect 1 "src/low/low.c includes src/high/high.h: low may not include high"
rm "$work/src/low/low.c"
make && printf 'low -> high\n' >>"$work/tools/includes.txt"
expect 1 "low -> high: not a room that is declared above it"
make && mkdir "$work/src/new" && printf '#include "low/low.h"\n' >"$work/src/new/new.c"
expect 1 "src/new/new.c: in no room"
echo "includes: violations are found"
