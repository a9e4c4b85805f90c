"""Error over time: what each method and each max_error costs on a mesh, and how far it is from the truth.

A notebook in a file: each `# %%` is a cell. Usage: error_over_time.py [MODEL] [-o PICTURE] [--size TEXELS] [--truth RAYS]
Needs python3-matplotlib."""

# %% The command line
import argparse
import pathlib
import statistics
import time
import typing

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402
import numpy as np  # noqa: E402

import vdbshade  # noqa: E402

ask = argparse.ArgumentParser(description="plots error over time")
ask.add_argument("model", nargs="?", default=pathlib.Path(__file__).parent.parent / "assets/smooth.glb")
ask.add_argument("-o", "--output", default="error_over_time.png")
ask.add_argument("--size", type=int, default=256, help="texels of the lightmap's side")
ask.add_argument("--truth", type=int, default=4096, help="rays a texel for the truth")
ask.add_argument("--resolution", type=int, default=512, help="voxels along the casters' longest side")
ask.add_argument("--rounds", type=int, default=3, help="bakes of each kind; their median time counts")
given = ask.parse_args()

# %% Casters with triangles and voxels, texels, a sun of three degrees
model = vdbshade.Model(given.model)
occluders = vdbshade.Occluders(model, resolution=given.resolution)
charts = vdbshade.Charts(model, width=given.size, height=given.size)
sun = vdbshade.Light("directional", direction=(0.6, 0.75, 0.5), angle=np.radians(3))
run = vdbshade.Run(threads=1, warning=lambda message: None)

# %% The truth: rays against the triangles, of another frame than the bakes that are compared with it
truth = vdbshade.bake_lightmap(occluders, charts, sun, method="exact", max_error=1e-4, rays=given.truth, frame=7, run=run)
valid = truth["A"] > 0.5


def measured(**options: typing.Any) -> typing.Tuple[float, float]:
    """Seconds of processor time of a bake, and its RMSE over valid texels."""
    seconds = []
    for _ in range(given.rounds):
        begin = time.process_time()
        baked = vdbshade.bake_lightmap(occluders, charts, sun, run=run, **options)
        seconds.append(time.process_time() - begin)
    both = valid & (baked["A"] > 0.5)
    difference = baked["shadow.sun"][both] - truth["shadow.sun"][both]
    return statistics.median(seconds), float(np.sqrt(np.mean(difference**2)))


# %% Methods that keep an error, at some; those that march once, as they are
errors = [0.1, 0.05, 0.02, 0.01, 0.005]
curves = {method: [measured(method=method, max_error=error) for error in errors] for method in ("exact", "adaptive")}
curves["rays"] = [measured(method="rays", rays=rays) for rays in (4, 16, 64)]
previews = {method: measured(method=method) for method in ("hard", "classic", "improved", "smooth", "cone")}

# %% The picture
figure, axes = plt.subplots(figsize=(8, 5), constrained_layout=True)
for method, points in curves.items():
    axes.plot(*zip(*points), "o-", label=method)
for marker, (method, (seconds, rmse)) in zip("sDv^*", previews.items()):
    axes.plot(seconds, rmse, marker, color="0.35", label=method)
axes.set(xscale="log", yscale="log", xlabel="seconds of processor time", ylabel="RMSE of the shadow over valid texels",
         title=f"{pathlib.Path(given.model).stem}, {given.size}² texels, {given.resolution} voxels, sun of 3°, against {given.truth} rays a texel")
axes.grid(which="both", alpha=0.3)
axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0))
figure.savefig(given.output, dpi=120)
for method, points in {**curves, **{m: [p] for m, p in previews.items()}}.items():
    print(f"{method:9}", "  ".join(f"{seconds:.3f} s: {rmse:.4f}" for seconds, rmse in points))
