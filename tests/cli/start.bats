# A start is short because a command loads only the libraries that it needs.
load helper

# loads PATTERN ARG …: the program with the ARGs loads a library that the pattern fits.
loads() {
    LD_DEBUG=libs LD_DEBUG_OUTPUT=loaded shade "${@:2}"
    done_well
    cat loaded.* >all.txt
    rm loaded.*
    grep -qE "calling init.*($1)" all.txt
}

@test "a bake of triangles into an EXR or PNG loads no library that it does not need" {
    unless_sanitized "with a sanitizer all is in the program"
    local bake=(bake box.obj --sun 0.3,1,0.2 --size 64 --quiet) others='openvdb|OpenImageIO|libboost|assimp|draco' out
    for out in out.exr out.png; do
        loads libvdbshade.so "${bake[@]}" -o $out
        ! grep -qE "calling init.*($others)" all.txt || fail "$out"
    done
    loads libpng info out.png
    ! grep -q 'calling init.*OpenImageIO' all.txt || fail "to read a PNG"
    # what needs a library does load it
    loads OpenImageIO "${bake[@]}" -o out.tif
    loads assimp info "$MODELS/scene.stl" --sandbox off
    loads openvdb "${bake[@]}" --method cone -o out.exr
}
