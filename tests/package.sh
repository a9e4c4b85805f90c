#!/usr/bin/env bash
# Debian packages of a build pass lintian and work in a clean system with only their dependencies. Skipped if no such system can be
# made (tools/debian/try). Usage: package.sh BUILD_FOLDER
set -euo pipefail

build=${1:?usage: package.sh BUILD_FOLDER}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"$(dirname "${BASH_SOURCE[0]}")/../tools/package" --build "$build" --output "$work" --test
