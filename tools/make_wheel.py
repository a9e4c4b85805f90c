"""Builds a wheel for `pip install .`, which calls build_wheel() (PEP 517). The wheel serves every Python 3 on machines with the same
libraries as this one. CMAKE_ARGS holds more options for CMake, such as -DVSH_OPENVDB=OFF."""
import base64
import hashlib
import os
import pathlib
import re
import shlex
import shutil
import subprocess
import sys
import sysconfig
import tempfile
import zipfile

ROOT = pathlib.Path(__file__).resolve().parent.parent
METADATA = """Metadata-Version: 2.1
Name: vdbshade
Version: {version}
Summary: Soft shadows and ambient occlusion, baked from signed distance fields and triangles
License: Apache-2.0
Requires-Python: >=3.8
Requires-Dist: cffi
Requires-Dist: numpy>=1.21
"""
WHEEL = """Wheel-Version: 1.0
Generator: vdbshade
Root-Is-Purelib: false
Tag: {tag}
"""


def find_python():
    """Finds a Python with cffi, and its environment: this one, or the system's, whose packages pip hides by PYTHONPATH. None: neither has it."""
    system = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    for python, environment in ((sys.executable, os.environ), ("/usr/bin/python3", system)):
        if os.path.exists(python) and subprocess.run([python, "-c", "import cffi"], env=environment, stderr=subprocess.DEVNULL).returncode == 0:
            return python, environment
    return None


def get_requires_for_build_wheel(config_settings=None):
    return [] if find_python() else ["cffi"]


def install(stage, info):
    """Builds the library and the module in build-wheel, and installs them."""
    python, environment = find_python() or sys.exit("vdbshade: the module needs cffi to be built (python3-cffi)")
    build = ROOT / "build-wheel"
    options = {"CMAKE_BUILD_TYPE": "Release", "VSH_STATIC": "OFF", "VSH_PYTHON": "ON", "VSH_PYTHON_PROGRAM": python,
               "VSH_PYTHON_DIR": ".", "CMAKE_INSTALL_LIBDIR": "vdbshade/lib", "CMAKE_INSTALL_LIBEXECDIR": "vdbshade/lib",
               "CMAKE_INSTALL_DOCDIR": info}
    for command in (
        ["--fresh", "-S", ROOT, "-B", build, *(["-G", "Ninja"] if shutil.which("ninja") else []),
         *(f"-D{name}={value}" for name, value in options.items()), *shlex.split(os.environ.get("CMAKE_ARGS", ""))],
        ["--build", build, "--target", "vdbshade_python", "--parallel", str(os.cpu_count())],
        ["--install", build, "--prefix", stage, "--component", "library", "--strip"],
        ["--install", build, "--prefix", stage, "--component", "python"],
    ):
        subprocess.run(["cmake", *command], check=True, env=environment)


def build_wheel(wheel_directory, config_settings=None, metadata_directory=None):
    version = re.search(r"^project\(vdbshade VERSION ([\d.]+)", (ROOT / "CMakeLists.txt").read_text(), re.M)[1]
    tag = "py3-none-" + re.sub(r"\W", "_", sysconfig.get_platform())
    info = f"vdbshade-{version}.dist-info"
    name = f"vdbshade-{version}-{tag}.whl"
    record = []
    with tempfile.TemporaryDirectory() as folder, zipfile.ZipFile(
            os.path.join(wheel_directory, name), "w", zipfile.ZIP_DEFLATED) as wheel:
        stage = pathlib.Path(folder)
        install(stage, info)
        (stage / info / "METADATA").write_text(METADATA.format(version=version))
        (stage / info / "WHEEL").write_text(WHEEL.format(tag=tag))
        links = [path for path in stage.rglob("*") if path.is_symlink()]
        for link in links:  # a wheel has none
            link.resolve().replace(link)
        for path in sorted(path for path in stage.rglob("*") if path.is_file()):
            inside, content = path.relative_to(stage).as_posix(), path.read_bytes()
            digest = base64.urlsafe_b64encode(hashlib.sha256(content).digest()).decode().rstrip("=")
            record.append(f"{inside},sha256={digest},{len(content)}\n")
            wheel.write(path, inside)
        wheel.writestr(f"{info}/RECORD", "".join(record) + f"{info}/RECORD,,\n")
    return name
