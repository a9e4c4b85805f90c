#!/usr/bin/env bash
# Runs a test that a sanitizer watches: watched.sh COMMAND [ARGUMENTS …]. Once more, and twice, where LeakSanitizer's own
# tracer crashed: it walks through the threads of a process that is ending while other libraries (OpenImageIO's pool,
# log4cplus' pool, x265) end theirs. That says nothing of leaks, so that the test is to run until it does; all else, a leak
# too, is told as it is.
set -uo pipefail
output=$(mktemp)
trap 'rm -f "$output"' EXIT
for attempt in 1 2 3; do
    "$@" 2>&1 | tee "$output"
    code=${PIPESTATUS[0]}
    if [ "$code" -eq 0 ] || ! grep -qa "LeakSanitizer has encountered a fatal error" "$output"; then
        exit "$code"
    fi
    echo "watched: LeakSanitizer gave up: run $attempt of 3"
done
exit "$code"
