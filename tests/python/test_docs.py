"""The code in the documents runs as it stands there: docs/python.md, the README's lightmap, the example that plots."""
import io
import os
import re
import subprocess
import sys
import unittest
from contextlib import redirect_stdout

import vdbshade
from common import ROOT, VDBSHADE, Case


def blocks(path):
    return re.findall(r"^```python\n(.*?)^```$", path.read_text(encoding="utf-8"), re.S | re.M)


class Documents(Case):
    def setUp(self):
        super().setUp()
        os.symlink(ROOT / "assets", self.folder / "assets")
        self.addCleanup(os.chdir, os.getcwd())
        os.chdir(self.folder)

    def run_blocks(self, path):
        space, out = {}, io.StringIO()
        for number, block in enumerate(blocks(path)):
            with redirect_stdout(out):
                exec(compile(block, f"{path.name}, block {number}", "exec"), space)
        return space, out.getvalue()

    def test_every_block_of_docs_python_md(self):
        space, out = self.run_blocks(ROOT / "docs/python.md")
        self.assertGreaterEqual(len(blocks(ROOT / "docs/python.md")), 8)
        self.assertIn("VSH_ERROR_READ no-such.vdb: cannot be read", out)
        self.assertIn("bake 100%", out)
        self.assertLess(space["lightmap"].errors["ao"], 0.01)
        for name in ("cloister.exr", "torus.vdb", "out.exr", "lit.glb", "lit.html", "band.vdb"):
            self.assertGreater((self.folder / name).stat().st_size, 1000, name)

    def test_the_lightmap_of_the_readme_is_ten_lines_and_the_command_lines(self):
        (block,) = blocks(ROOT / "README.md")
        lines = [line for line in block.split("\n") if line]
        self.assertLessEqual(len(lines), 10)
        space, out = self.run_blocks(ROOT / "README.md")
        self.assertTrue(out.startswith("(512, 512) {'shadow.sun': 0."), out)
        subprocess.run([VDBSHADE, "bake", "assets/cloister.glb", "--sun", "0.6,0.75,0.5", "--sun-angle", "3", "--ao", "0.6", "--size", "512",
                        "-o", "cli.exr", "--quiet"], check=True)
        self.assertTrue(vdbshade.compare_files("cli.exr", "cloister.exr", limits=dict(max=0.0)))

    def test_the_example_plots_error_over_time(self):
        script = ROOT / "examples/error_over_time.py"
        arguments = ["assets/smooth.glb", "--size", "48", "--truth", "256", "--rounds", "1", "--resolution", "64", "-o", "plot.png"]
        result = subprocess.run([sys.executable, script, *arguments], check=True, capture_output=True, text=True)
        rows = {line.split()[0]: [float(v) for v in re.findall(r"s: ([0-9.]+)", line)] for line in result.stdout.split("\n") if line}
        self.assertEqual(set(rows), {"exact", "adaptive", "rays", "hard", "classic", "improved", "smooth", "cone"})
        self.assertGreater(rows["exact"][0], rows["exact"][-1])
        self.assertLess(rows["exact"][-1], 0.01)
        picture = vdbshade.image_read("plot.png")
        self.assertEqual(next(iter(picture.values())).shape, (600, 960))
        self.assertGreater(len({round(float(v), 2) for v in picture["B"].flat}), 20)


if __name__ == "__main__":
    unittest.main()
