#!/usr/bin/env bash
# `pip install .` works offline in a virtual environment, with and without OpenVDB, OpenImageIO and Assimp. `mypy --strict` passes on
# the module and its documents, and finds wrong words. Usage: pip.sh
set -euo pipefail

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
/usr/bin/python3 -m venv --system-site-packages venv

install_with() { # [CMAKE_OPTION …]
    CMAKE_ARGS=$* venv/bin/pip install --no-index "$root" >log 2>&1 || { cat log && exit 1; }
}
check_types() {
    mypy --strict --python-executable venv/bin/python --enable-incomplete-feature=Unpack --ignore-missing-imports "$@"
}
install_with
sed -n '/^```python/,/^```$/{/^```/!p}' "$root/docs/python.md" >docs.py
check_types -p vdbshade
check_types docs.py "$root/examples/error_over_time.py"
for wrong in 'Light("pointy")' 'Light(falloff="cubic")' 'Light(radios=2.0)' 'Run(isa="avx")' 'ao_method_traits("cone")'; do
    echo "import vdbshade; vdbshade.$wrong" >wrong.py
    ! check_types wrong.py >log || { echo "mypy accepts $wrong" && exit 1; }
    grep -E '\[(arg-type|call-arg)\]$' log || { cat log && exit 1; }
done

install_with -DVSH_OPENVDB=OFF -DVSH_OPENIMAGEIO=OFF -DVSH_ASSIMP=OFF
venv/bin/python - "$root/assets/cloister" <<'PY'
import sys, vdbshade
for end in ".glb", ".obj":
    model = vdbshade.Model(sys.argv[1] + end)
    lightmap = vdbshade.bake_lightmap(vdbshade.Occluders(model), vdbshade.Charts(model, width=64, height=64), ao=True, ao_distance=0.6)
    for name in "ao.exr", "ao.png":
        lightmap.write(name)
        assert 0.2 < vdbshade.image_read(name)["ao" if name == "ao.exr" else "R"].mean() < 0.9
try:
    vdbshade.Grid.from_meshes(model)
except vdbshade.UnsupportedError as error:
    assert "need OpenVDB" in str(error), error
else:
    sys.exit("a level set without OpenVDB")
PY
