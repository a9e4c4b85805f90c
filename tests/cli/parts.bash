# Shared by the tests of `--shard` and `merge`: baking parts, and comparing what they come to with one bake.
load helper

setup() {
    cd "$BATS_TEST_TMPDIR" || return 1
    ln -s "$ASSETS/terrain.png" "$ASSETS/cloister.glb" .
}

CLOISTER=(cloister.glb --sun -0.5,0.8,-0.6 --sun-angle 10 --ao 2 --size 64x256)

# Bakes all parts, or those that are named.
parts() { # OUT N "I …" INPUT [options]
    local out=$1 n=$2 which=${3:-$(seq "$2")} i
    shift 3
    for i in $which; do
        "$VDBSHADE" bake "$@" -o "$out" --shard "$i/$n" --quiet
    done
}

# Whether the parts come to what one bake does, which is in one/.
merged() { # OUT N INPUT [options]
    local out=$1 n=$2
    shift 2
    parts "$out" "$n" "" "$@"
    "$VDBSHADE" merge "$out" --quiet "${MERGE[@]}"
    cmp "one/$out" "$out" || fail "$n parts of $* are not one bake"
    rm -- "$out" *.part
}

# The last rows and the statistics of a part, without its checksum.
values() { # OUT
    tail -c 50008 "$1.2-of-3.part" | head -c 50000
}

one() { # OUT INPUT [options]
    local out=$1
    shift
    mkdir -p one
    "$VDBSHADE" bake "$@" -o "one/$out" --quiet
}
