#!/usr/bin/env bash
# Debian packages of a build: lintian finds no error in them, and they work in a clean system, into which nothing but them and
# what they depend on is installed (tools/package-test, which says when no such system can be made). Usage: package.sh BUILD_FOLDER
set -euo pipefail

build=${1:?usage: package.sh BUILD_FOLDER}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"$(dirname "${BASH_SOURCE[0]}")/../tools/package" --build "$build" --output "$work" --test
