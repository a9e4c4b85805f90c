# bake --tile-size: worlds in tiles, on the command line.
load helper

# Three floors in a row with a post by each; the post before darkens a floor.
write_row() {
    local i
    printf 'o floor\nv -2 0 -2\nv 2 0 -2\nv 2 0 2\nv -2 0 2\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 4/4 3/3 2/2\n' >floor.obj
    write_box box.obj
    {
        echo '{"casters": ['
        for i in 0 4 8; do
            echo "{\"mesh\": \"box.obj\", \"transform\": {\"translate\": [$i.8, 0.01, -0.3], \"scale\": [0.3, 2, 0.6]}},"
        done
        echo '{"mesh": "floor.obj"}], "lights": [{"name": "sun", "type": "directional", "direction": [-1, 0.6, 0.1], "angle_deg": 4}],'
        echo '"ao": {"distance": 1}, "receivers": ['
        for i in 0 4 8; do
            echo "{\"mesh\": \"floor.obj\", \"transform\": {\"translate\": [$i, 0, 0]}, \"size\": 64, \"output\": \"floor$i.exr\"}"
            [ $i = 8 ] || echo ,
        done
        echo ']}'
    } >row.json
}

@test "tiles bake what the whole scene does, and tell of themselves" {
    write_row
    "$VDBSHADE" bake row.json --quiet
    run -0 "$VDBSHADE" bake row.json --tile-size 4 --output-folder tiles --stats stats.json
    [[ "$output" == *"3 of 3 tiles: 12288 texels"* ]]
    for i in 0 4 8; do
        "$VDBSHADE" compare "floor$i.exr" "tiles/floor$i.exr"
    done
    grep -q '"world_tiles": 3' stats.json
    grep -q '"texels": 12288' stats.json
    run -0 "$VDBSHADE" bake row.json --tile-size 4 --output-folder again --verbose
    [[ "$output" == *"tile 1 of 3: 1 receiver; 2 of 4 objects cast, 14 triangles"* ]]
    [[ "$output" == *"tile 3 of 3"* ]]
    for i in 0 4 8; do
        cmp "tiles/floor$i.exr" "again/floor$i.exr"
    done
}

@test "a tile's output names the inputs that cast in it, and no others" {
    write_row
    cp box.obj far.obj
    sed -i 's|{"mesh": "floor.obj"}|{"mesh": "far.obj", "transform": {"translate": [500, 0, 0]}}, &|' row.json
    "$VDBSHADE" bake row.json --tile-size 4 --quiet
    run -0 "$VDBSHADE" info floor0.exr
    [[ "$output" == *box.obj* ]]
    [[ "$output" != *far.obj* ]]
}

@test "shards take whole tiles, each one once, and there is nothing to merge" {
    write_row
    "$VDBSHADE" bake row.json --tile-size 4 --output-folder one --quiet
    for i in 1 2; do
        "$VDBSHADE" bake row.json --tile-size 4 --output-folder two --shard $i/2 --quiet
    done
    for i in 0 4 8; do
        cmp "one/floor$i.exr" "two/floor$i.exr"
    done
    [ -z "$(ls two/*.part 2>/dev/null)" ]
    run -0 "$VDBSHADE" bake row.json --tile-size 4 --output-folder many --shard 5/7
    for i in 1 2 3 4 6 7; do
        "$VDBSHADE" bake row.json --tile-size 4 --output-folder many --shard $i/7 --quiet
    done
    [ "$(ls many | wc -l)" = 3 ]
}

@test "receivers much larger than a tile are noted, as they are not cut" {
    write_row
    shade bake row.json --tile-size 2 --dry-run
    done_well
    [ -z "$stderr" ] || fail "$stderr"
    shade bake row.json --tile-size 1.5 --dry-run --verbose
    done_well
    [[ "$stderr" == *"note: 3 of 3 receivers are larger than two tiles of 1.5 ('floor0.exr' is the largest, with 4 units)"* ]]
}

@test "objects of several receivers in one folder are refused, as tiles would name them alike" {
    write_row
    run -2 "$VDBSHADE" bake row.json --tile-size 4 --per-object -o maps/
    [[ "$output" == *"the output of two receivers"* ]]
    "$VDBSHADE" bake row.json --tile-size 4 --per-object --quiet
    [ -e floor0.floor.exr ] && [ -e floor8.floor.exr ]
}

@test "--dry-run lists tiles and forecasts the largest" {
    write_row
    run -0 "$VDBSHADE" bake row.json --tile-size 4 --dry-run
    [[ "$output" == *"tile 1 of 3: 1 receiver"* ]]
    [[ "$output" == *"the tile of the most triangles:"* ]]
    [[ "$output" == *"memory        about"* ]]
    [ ! -e floor0.exr ]
}

@test "what tiles do not go with is refused" {
    write_row
    for option in "--view page.html" "--invalid i.png" "--field x.field" "--shard-least 1"; do
        run -2 "$VDBSHADE" bake row.json --tile-size 4 $option
        [[ "$output" == *"${option%% *}: not together with --tile-size"* ]]
    done
    run -2 "$VDBSHADE" bake row.json --tile-size 0
    run -2 "$VDBSHADE" bake row.json --tile-size nan
    sed -i 's/"mesh": "box.obj"/"mesh": "none.obj"/' row.json
    run -3 "$VDBSHADE" bake row.json --tile-size 4
    [[ "$output" == *none.obj* ]]
}

@test "a bake that is ended in a tile keeps what is done, whole" {
    write_row
    sed -i 's/"size": 64/"size": 1024/' row.json
    "$VDBSHADE" bake row.json --tile-size 4 --output-folder two --quiet --max-error 0.004 &
    local pid=$! i
    for ((i = 0; i < 600; ++i)); do
        [ -e two/floor0.exr ] && break
        sleep 0.02
    done
    kill -INT $pid
    run wait $pid
    [ ! -e two/floor8.exr ]
    [ "$(ls two/*.exr | wc -l)" = "$(ls two | wc -l)" ]
    run -0 "$VDBSHADE" info two/floor0.exr
    [[ "$output" == *"1024 × 1024"* ]]
}
