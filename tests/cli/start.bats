# A start is short because a command loads only the libraries that it needs.
load helper

@test "a bake of triangles into an EXR or PNG loads no library that it does not need" {
    unless_sanitized "with a sanitizer all is in the program"
    local out
    for out in out.exr out.png; do
        LD_DEBUG=libs LD_DEBUG_OUTPUT=loaded shade bake box.obj --sun 0.3,1,0.2 --size 64 --quiet -o "$out"
        done_well
        cat loaded.* >all.txt
        rm loaded.*
        grep -q 'calling init.*libvdbshade.so' all.txt
        ! grep -qE 'calling init.*(openvdb|OpenImageIO|libboost|assimp|draco)' all.txt || fail "$out"
    done
    LD_DEBUG=libs LD_DEBUG_OUTPUT=other shade info out.png
    done_well
    grep -q 'calling init.*libpng' other.*
    ! grep -q 'calling init.*OpenImageIO' other.* || fail "to read a PNG"
    LD_DEBUG=libs LD_DEBUG_OUTPUT=image shade bake box.obj --sun 0.3,1,0.2 --size 64 --quiet -o out.tif
    done_well
    grep -q 'calling init.*OpenImageIO' image.* # which is how it is told
    printf 'solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid a\n' >a.stl
    LD_DEBUG=libs LD_DEBUG_OUTPUT=model shade info a.stl --sandbox off
    done_well
    grep -q 'calling init.*assimp' model.* # the same
    LD_DEBUG=libs LD_DEBUG_OUTPUT=voxels shade bake box.obj --sun 0.3,1,0.2 --size 64 --method cone --quiet -o out.exr
    done_well
    grep -q 'calling init.*openvdb' voxels.* # which is how it is told
}
