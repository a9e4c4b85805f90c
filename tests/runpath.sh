#!/usr/bin/env bash
# No program or library has an empty or relative entry in its RUNPATH, which would make the loader search the current folder.
# Usage: runpath.sh FOLDER …
set -euo pipefail

count=0 bad=0
while IFS= read -r -d '' file; do
    [ "$(head -c 4 "$file" | tr -d '\0')" = $'\177ELF' ] || continue
    dynamic=$(readelf -d "$file" 2>/dev/null) || true
    count=$((count + 1))
    while IFS= read -r path; do
        IFS=: read -ra entries <<<"$path:end" # keeps a trailing empty entry
        for entry in "${entries[@]:0:${#entries[@]}-1}"; do
            case $entry in
            /* | '$ORIGIN' | '$ORIGIN'/*) ;;
            *)
                echo "$file: RUNPATH '$path' has the entry '$entry'"
                bad=$((bad + 1))
                ;;
            esac
        done
    done < <(sed -n 's/.*(R\(UN\)\?PATH).*\[\(.*\)\]$/\2/p' <<<"$dynamic")
done < <(find "$@" -type f \( -perm -u+x -o -name '*.so' -o -name '*.so.*' \) -print0)
[ "$count" -gt 0 ] || { echo "no program or library in $*"; exit 1; }
echo "$count programs and libraries, $bad bad entries"
[ "$bad" -eq 0 ]
