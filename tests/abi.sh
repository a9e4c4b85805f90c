#!/usr/bin/env bash
# The library's interface is that of its minor version (tools/abi), and what would break a program is noticed.
# Usage: abi.sh BUILD_FOLDER
set -euo pipefail

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
"$root/tools/abi" --build "${1:?usage: abi.sh BUILD_FOLDER}"

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

# after CODE FILE SED: what tools/abi ends with when a header is changed so.
after() {
    rm -rf "$work/include"
    cp -r "$root/include" "$work/include"
    sed -i "$3" "$work/include/vdbshade/$2"
    ! cmp -s "$root/include/vdbshade/$2" "$work/include/vdbshade/$2" || { echo "nothing changed: $3" && exit 1; }
    local code=0
    "$root/tools/abi" --headers "$work/include" >"$work/log" 2>&1 || code=$?
    [ "$code" -eq "$1" ] || { echo "ended with $code: $3" && cat "$work/log" && exit 1; }
}
after 1 base.h '/^VSH_API int32_t vsh_isa(/d'                                    # a function is gone
after 1 base.h 's/^VSH_API int32_t vsh_isa(/VSH_API int64_t vsh_isa(/'           # gives another type
after 1 base.h 's/VSH_ERROR_READ = 3/VSH_ERROR_READ = 13/'                       # a constant is another
after 1 base.h 's/    double reader_seconds;/    float reader_seconds;/'         # a member is narrower
after 1 settings.h 's/^    int32_t group;/    int32_t more; int32_t group;/'     # one is between others
after 1 base.h 's/^} vsh_error;/    int32_t more;\n} vsh_error;/'                # one is behind the caller's size
after 0 base.h 's/^} vsh_run;/    int32_t more;\n} vsh_run;/'                    # one is where struct_size tells
after 0 settings.h 's/^} vsh_setting;/    int32_t more;\n} vsh_setting;/'        # or an argument
after 0 base.h 's/^VSH_API int32_t vsh_isa(.*/&\nVSH_API int32_t vsh_new(void);/' # a function is new
echo "abi: what breaks a program is noticed"
