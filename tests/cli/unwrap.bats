# unwrap: lightmap UVs for meshes that have none.
load helper

setup() {
    cd "$BATS_TEST_TMPDIR" || return 1
    write_box box.obj
    grep -v '^vt' box.obj | sed 's#/[0-9]*##g' >bare.obj
}

@test "a mesh without UVs gets some that bake without a warning" {
    succeed unwrap bare.obj -o out.obj --size 64
    [[ $stderr == "vdbshade: out.obj: 6 charts on 1 page of 64 × 64, "*"texels a unit, stretch 1.0"* ]] || fail "no summary"
    shade info out.obj --size 64
    [[ $output == *"triangles: 12"*"UV sets: 1"* ]] || fail "no UVs"
    [[ $output != *problem* ]] || fail "a problem"
    succeed bake out.obj -o out.exr --sun 0.3,1,0.2 --size 64 --resolution 24
    [[ $stderr != *warning* ]] || fail "a warning"
}

@test "positions, normals and triangles are the input's" {
    succeed unwrap "$ASSETS/cloister.glb" -o out.obj --quiet
    [ -z "$stderr" ] || fail "not quiet"
    shade info "$ASSETS/cloister.glb"
    before=$(grep -o 'objects: .* triangles' <<<"$output")
    info_tells out.obj "$before"
    [ "$(grep -c '^vn' out.obj)" -gt 100 ] || fail "no normals"
}

@test "pages are materials, and a density that does not fit names one that does" {
    refuses 4 "texels a unit: " -- unwrap bare.obj -o out.obj --size 32 --texels-per-unit 20
    [ ! -e out.obj ] || fail "it was written"
    succeed unwrap bare.obj -o out.obj --size 32 --texels-per-unit 20 --pages 6
    grep -q '^usemtl page_1' out.obj || fail "no second page"
}

@test "objects have pages of their own, with their names as materials, as small as a density needs" {
    {
        cat bare.obj
        echo 'o second'
        sed -n 's/^v //p' bare.obj | awk '{print "v", 3 * $1 + 5, 3 * $2, 3 * $3}'
        sed -n 's/^f //p' bare.obj | awk '{ out = "f"; for (i = 1; i <= NF; ++i) out = out " " $i + 8; print out }'
    } >two.obj
    succeed unwrap two.obj -o out.obj --atlas objects --max-size 256 --texels-per-unit 8
    [[ $stderr == *"12 charts on 2 pages of up to 128 × 64"* ]] || fail "no summary"
    [ "$(grep '^usemtl' out.obj | tr '\n' ' ')" = "usemtl box usemtl second " ] || fail "$(grep usemtl out.obj)"
    refuse_each unwrap two.obj -o out.obj <<'LIST'
2 --pages | --atlas objects --pages 2
2 --atlas objects | --atlas each
2 --max-size --texels-per-unit | --max-size 64
2 --max-size --size | --max-size 64 --size 32 --texels-per-unit 1
LIST
}

@test "UVs that can serve are kept, and densities go by name" {
    succeed unwrap box.obj -o out.obj --size 128 --keep
    [[ $stderr == *"1 mesh kept their UVs"* ]] || fail "they were not kept"
    succeed unwrap box.obj -o out.obj --size 128 --density 'b*=0.5'
    refuses 2 none "'box'" -- unwrap box.obj -o out.obj --density none=2
    refuses 2 --density -- unwrap box.obj -o out.obj --density 3
}

@test "the same file for any number of threads" {
    for threads in 1 5; do
        succeed unwrap "$ASSETS/smooth.glb" -o "$threads.obj" --size 256 --threads "$threads" --quiet
    done
    cmp 1.obj 5.obj || fail "they differ"
}

@test "bad options and places are refused" {
    old_output out.obj
    refuse_each unwrap <<'LIST'
2 -o | box.obj
2 out.ply | box.obj -o out.ply
3 none/out.obj | box.obj -o none/out.obj
2 box.obj | box.obj -o box.obj
2 --padding | box.obj -o out.obj --padding -1
2 --max-stretch | box.obj -o out.obj --max-stretch 1
3 none.obj | none.obj -o out.obj
LIST
    untouched out.obj
}
