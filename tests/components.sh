#!/usr/bin/env bash
# Each installed file belongs to one component, of which tools/package makes packages. Usage: components.sh BUILD_FOLDER
set -euo pipefail

build=${1:?usage: components.sh BUILD_FOLDER}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

installed() { # FOLDER [OPTION…]
    cmake --install "$build" --prefix "$work/$1" "${@:2}" >"$work/log" || { cat "$work/log" && exit 1; }
    [ ! -d "$work/$1" ] || (cd "$work/$1" && find . ! -type d -printf '%P\n')
}
installed whole | sort >"$work/whole.txt"
for component in library development program documentation python; do
    installed "$component" --component "$component"
done | sort >"$work/components.txt"
diff "$work/whole.txt" "$work/components.txt" || { echo "components: files in no component (<) or in several (>)" && exit 1; }

has() { # COMPONENT FILE …
    local file
    for file in "${@:2}"; do
        [ -n "$(find "$work/$1" -path "$work/$1/$file" -print -quit)" ] || { echo "components: $1 has no $file" && exit 1; }
    done
}
has library '*/libvdbshade.so.*' '*/vdbshade/libvdbshade_openvdb.so.*' '*/vdbshade/libvdbshade_oiio.so.*' '*/vdbshade/libvdbshade_importers.so.*' 'libexec/vdbshade/vdbshade-reader'
has development '*/libvdbshade.so' '*/libvdbshade.a' include/vdbshade/vdbshade.h '*/vdbshade.pc' '*/vdbshade-config.cmake'
has program bin/vdbshade share/man/man1/vdbshade.1
has documentation share/doc/vdbshade/docs/scene.md share/doc/vdbshade/examples/points.c
echo "components: $(wc -l <"$work/whole.txt") files, each in one"
