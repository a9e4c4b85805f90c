#!/usr/bin/env bash
# Installs a build to a temporary prefix, moves the prefix, and uses the package there: through CMake, through pkg-config, and
# from C++. Usage: run.sh BUILD_FOLDER
set -euo pipefail

build=$(cd "${1:?usage: run.sh BUILD_FOLDER}" && pwd)
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cc=${CC:-cc}
cxx=${CXX:-c++}

say() { printf '\n== %s\n' "$*"; }

say "install"
cmake --install "$build" --prefix "$work/first" >"$work/install.log" || { cat "$work/install.log"; exit 1; }
mv "$work/first" "$work/moved here" # nothing may remember where it was installed
prefix="$work/moved here"
library=$(dirname "$(find "$prefix" -name libvdbshade.so)")
"$prefix/bin/vdbshade" --version
"$here/../runpath.sh" "$prefix"
cmp "$here/../../LICENSE" "$prefix/share/doc/vdbshade/LICENSE"
grep -q 'License, version 2.0' "$prefix/share/doc/vdbshade/docs/install.md"

say "files are read by the reader beside it, or not at all"
printf 'v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n' >"$work/a.obj"
"$prefix/bin/vdbshade" info "$work/a.obj" >/dev/null
mv "$prefix/libexec" "$work/libexec"
if "$prefix/bin/vdbshade" info "$work/a.obj" 2>"$work/missing.log"; then
    echo "it read without its reader" && exit 1
fi
grep "vdbshade-reader.*--sandbox off" "$work/missing.log"
"$prefix/bin/vdbshade" info "$work/a.obj" --sandbox off >/dev/null
mv "$work/libexec" "$prefix/libexec"

say "every header alone, as C and as C++"
for header in "$prefix"/include/vdbshade/*.h; do
    name=vdbshade/$(basename "$header")
    printf '#include <%s>\ntypedef int some_declaration;\n' "$name" >"$work/alone.c"
    "$cc" -std=c11 -pedantic -Wall -Wextra -Werror -fsyntax-only -I"$prefix/include" "$work/alone.c"
    "$cxx" -std=c++11 -pedantic -Wall -Wextra -Werror -fsyntax-only -I"$prefix/include" -x c++ "$work/alone.c"
done

say "the examples on top of the headers"
for header in "$prefix"/include/vdbshade/*.h; do
    [ "$(basename "$header")" != vdbshade.h ] || continue # examples/lightmap.c
    printf '#include "examples.h"\nvoid example(void) {\n' >"$work/example.c"
    sed -n '/\*\//q; s/^ \*     //p' "$header" >>"$work/example.c"
    printf '}\n' >>"$work/example.c"
    [ "$(wc -l <"$work/example.c")" -gt 5 ] || { echo "$header: no example" && exit 1; }
    "$cc" -std=c11 -pedantic -Wall -Wextra -Werror -Wno-unused-variable -Wno-unused-but-set-variable -fsyntax-only -I"$here" \
        -I"$prefix/include" "$work/example.c"
done

say "CMake: find_package(vdbshade)"
cmake -S "$here" -B "$work/cmake" -DCMAKE_PREFIX_PATH="$prefix" -DCMAKE_BUILD_TYPE=Release >"$work/cmake.log" ||
    { cat "$work/cmake.log"; exit 1; }
cmake --build "$work/cmake" >"$work/cmake.log" || { cat "$work/cmake.log"; exit 1; }
mkdir "$work/output"
"$work/cmake/consumer" "$work/output"
"$work/cmake/grids"
sed 's/OPTIONAL_COMPONENTS moon/moon/' "$here/CMakeLists.txt" >"$work/CMakeLists.txt"
cp "$here"/*.c "$here"/*.cpp "$work"
if cmake -S "$work" -B "$work/moon" -DCMAKE_PREFIX_PATH="$prefix" >"$work/cmake.log" 2>&1; then
    echo "a component that there is not was found" && exit 1
fi
grep -q 'component moon' "$work/cmake.log"

say "the static library: the same, and no shared one beside it"
mkdir "$work/alone"
"$work/cmake/consumer_static" "$work/alone"
"$prefix/bin/vdbshade" compare "$work/output/sphere.vdb" "$work/alone/sphere.vdb" --max-difference 0 --quiet
if ldd "$work/cmake/consumer_static" | grep libvdbshade; then
    echo "it is linked with the shared library" && exit 1
fi

say "pkg-config"
export PKG_CONFIG_PATH="$library/pkgconfig"
grep -qx 'License: Apache-2.0' "$library/pkgconfig/vdbshade.pc"
# pkg-config escapes spaces in paths; eval reads them as the shell that a makefile calls would.
eval "$cc -std=c11 -pedantic -Wall -Wextra -Werror '$here/consumer.c' -o '$work/plain' \
    $(pkg-config --cflags --libs vdbshade) -lm"
LD_LIBRARY_PATH=$library "$work/plain" "$work/output" >"$work/plain.log" || { cat "$work/plain.log"; exit 1; }
echo "the same values"
# --static names what the archive needs
eval "$cc -std=c11 -DOWN_READER=1 '$here/consumer.c' -o '$work/plain_static' $(pkg-config --cflags vdbshade) \
    '$library/libvdbshade.a' $(pkg-config --libs --static vdbshade | sed 's/-lvdbshade//')"
"$work/plain_static" "$work/alone" >"$work/plain.log" || { cat "$work/plain.log"; exit 1; }

say "a host with a sanitizer, whose dlopen() is not libc's"
eval "$cc -std=c11 -g -fsanitize=address '$here/consumer.c' -o '$work/watched' \
    $(pkg-config --cflags --libs vdbshade) -lm -Wl,-rpath,'$library'"
ASAN_OPTIONS=detect_leaks=0 "$work/watched" "$work/output" >"$work/watched.log" 2>&1 || { cat "$work/watched.log"; exit 1; }
echo "the same values"

packages=$(dirname "$(find "$prefix" -path '*-packages/vdbshade' -type d)")
if [ "$packages" != . ]; then
    say "Python: the module finds the library beside it"
    python=$(sed -n 's/^VSH_PYTHON_PROGRAM:FILEPATH=//p' "$build/CMakeCache.txt")
    (cd "$work" && PYTHONPATH=$packages "$python" -B -c '
import vdbshade
print(vdbshade.__version__, len(vdbshade.Model("a.obj")))
loaded = {line.split(maxsplit=5)[5].strip() for line in open("/proc/self/maps") if "libvdbshade.so" in line}
assert len(loaded) == 1 and "/moved here/" in loaded.pop(), loaded')
fi

say "the examples"
cmake -S "$here/../../examples" -B "$work/examples" -DCMAKE_PREFIX_PATH="$prefix" -DCMAKE_BUILD_TYPE=Release \
    -DCMAKE_C_FLAGS="-std=c11 -pedantic -Wall -Wextra -Werror" >"$work/cmake.log" &&
    cmake --build "$work/examples" >>"$work/cmake.log" || { cat "$work/cmake.log"; exit 1; }
(
    cd "$work/examples"
    [ "$(printf '%s\n' '-2 0.5 -1.8' '0 5 0' | ./points "$here/../../assets/cloister.glb" | xargs)" = '0 1' ] # under the roof, and above it
    ./lightmap | tee lightmap.log && grep -qx '0 under the box, 1 in the corner' lightmap.log
    "$prefix/bin/vdbshade" info floor.exr | grep -q "shadow.sun"
    # the program's own bytes, but for the command in them
    cp "$here"/../../assets/seeds.json "$here"/../../assets/seeds_floor.obj .
    sed -i 's/"size": 512/"size": 64/' seeds.json
    ./scene seeds.json | tee scene.log && grep -qx 'seeds.exr: 4096 texels' scene.log
    mkdir program && "$prefix/bin/vdbshade" bake seeds.json -o program/ --quiet
    "$prefix/bin/vdbshade" compare seeds.exr program/seeds.exr --max-difference 0 >/dev/null
    # of the sky over a point on the axis the tube hides a ring between two angles, the difference of their sines' squares
    ./callback | tee callback.log && awk '{ open = $NF == "open" ? $(NF - 1) : -1 }
        /^0.4 / { hidden = sin(1.4732)^2 - sin(0.9074)^2 } /^1 / { hidden = sin(0.9992)^2 - sin(0.5716)^2 }
        /^4 / { next } { n += open > 0.98 - hidden && open < 1.02 - hidden } END { exit n != 2 }' callback.log
    # the hole's part of the sun's disc: (tan 47.9° / tan 57.3°)²
    ./level_set torus.vdb | tee level_set.log && grep -qx 'a sun of 2 radians: 0.50' level_set.log
)

say "a host stays as it was, until it makes a level set"
eval "$cc -std=c11 -pedantic -Wall -Wextra -Werror '$here/quiet.c' -o '$work/quiet' \
    $(pkg-config --cflags --libs vdbshade)"
LD_LIBRARY_PATH=$library "$work/quiet"
mv "$library/vdbshade" "$work/modules"
LD_LIBRARY_PATH=$library "$work/quiet" without
"$prefix/bin/vdbshade" info "$work/a.obj" >/dev/null
! "$prefix/bin/vdbshade" info "$here/../models/scene.stl" 2>"$work/refused" || exit 1
grep "models of this kind: need Assimp and Draco.*libvdbshade_importers.so" "$work/refused"
mv "$work/modules" "$library/vdbshade"

say "a host with OpenVDB grids of its own"
eval "$cxx -std=c++17 -O1 '$here/grids.cpp' -o '$work/grids' $(pkg-config --cflags --libs vdbshade) -lopenvdb -ltbb \
    $(pkg-config --libs Imath)"
LD_LIBRARY_PATH=$library "$work/grids"

say "the library's name and versions say what may be mixed"
version=$(pkg-config --modversion vdbshade)
readelf -d "$library/libvdbshade.so" | grep "SONAME.*libvdbshade.so.${version%.*}\]"
readelf -W --dyn-syms "$work/plain" | grep -q "vsh_grid_free@VDBSHADE_${version%.*}"
printf '\nconsumer: all passed\n'
