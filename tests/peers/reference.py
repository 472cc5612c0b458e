"""Reference pictures by Mitsuba 3 of the scenes in refs/scenes, from trimray's own exports.

    python reference.py [NAME...]            writes refs/NAME.exr (all scenes without names); refs/make.sh calls this
    python reference.py --check [NAME...]    compares trimray's pictures with Mitsuba's, both rendered now

A scene is exported by the program with triangles within 1e-6 of the smallest object's diagonal, and Mitsuba renders it
several times with independent random numbers. The reference is the mean of these pictures, with the variance of that mean.
tests/references.rs compares trimray's pictures with the references, by the same tests as --check: those of mitsuba_peer.py.
The samples that a scene asks for are trimray's in these tests: as many as it takes for the variance that they show to be
true, which in shadows that light reaches by rare paths is more than for the noise to be low.
"""

import json
import re
import sys
import tempfile
import time
import tomllib
from pathlib import Path

import mitsuba as mi
import numpy as np
import OpenImageIO as oiio
from deformed import ROOT, fail_unless, trimray
from mitsuba_peer import compare_means, compare_pixels

# 32-bit floats, one ray at a time: needs nothing that is not in the package.
mi.set_variant("scalar_rgb")

REFS = ROOT / "refs"

# Samples of a picture, and pictures: the variance between pictures is that of a mean of SPP samples.
SPP = 32
SEEDS = 64

# The same for --check.
CHECK_SPP = 16
CHECK_SEEDS = 32

# Of the triangles, in parts of the smallest object's diagonal.
TOLERANCE = 1e-6

LAYERS = ["R", "G", "B", "variance.R", "variance.G", "variance.B"]


def fnv(scene):
    """FNV-1a (64 bits) of a scene file and of the files that it names, in the order of the objects."""
    description = tomllib.loads(scene.read_text(encoding="utf-8"))
    state = 0xCBF29CE484222325
    for path in [scene, *(scene.parent / entry["mesh"] for entry in description["object"] if "mesh" in entry)]:
        for byte in path.read_bytes():
            state = (state ^ byte) * 0x100000001B3 % 2**64
    return f"{state:016x}"


def export(scene, folder):
    """Exports a scene to a folder; returns the tolerance in world units."""
    objects = json.loads(trimray("info", scene, "--json"))["objects"]
    diagonals = [np.linalg.norm(np.subtract(*entry["bounds"])) for entry in objects]
    tolerance = TOLERANCE * min(diagonals)
    trimray("export", scene, "--format", "mitsuba", "--tolerance", tolerance, "-o", folder, "--quiet")
    return tolerance


def render(scene, spp, seeds):
    """Radiance and the variance of its mean, (h, w, 3) each, by Mitsuba from the export; and the tolerance."""
    with tempfile.TemporaryDirectory() as folder:
        tolerance = export(scene, Path(folder) / "scene")
        loaded = mi.load_file(str(Path(folder) / "scene" / "scene.xml"))
        count = 0
        mean = squares = 0.0
        # Welford (1962)
        for seed in range(seeds):
            picture = np.array(mi.render(loaded, spp=spp, seed=seed), float)[:, :, :3]
            count += 1
            before = picture - mean
            mean = mean + before / count
            squares = squares + before * (picture - mean)
    return mean, squares / (count - 1) / count, tolerance


def write(scene):
    """Writes the reference of a scene."""
    started = time.time()
    mean, variance, tolerance = render(scene, SPP, SEEDS)
    height, width, _ = mean.shape
    spec = oiio.ImageSpec(width, height, len(LAYERS), oiio.FLOAT)
    spec.channelnames = LAYERS
    spec.attribute("compression", "zip")
    spec.attribute("reference/mitsuba", f"{mi.__version__} {mi.variant()}")
    spec.attribute("reference/spp", SPP * SEEDS)
    spec.attribute("reference/seeds", f"0 to {SEEDS - 1}, {SPP} samples each")
    spec.attribute("reference/tolerance", f"{tolerance:.3e}")
    spec.attribute("reference/scene", fnv(scene))
    spec.attribute("reference/command", f"refs/make.sh {scene.stem}")
    path = REFS / f"{scene.stem}.exr"
    output = oiio.ImageOutput.create(str(path))
    fail_unless(output.open(str(path), spec), f"{path}: {output.geterror()}")
    pixels = np.concatenate([mean, variance], axis=2).astype(np.float32)
    fail_unless(output.write_image(pixels), f"{path}: {output.geterror()}")
    output.close()
    noise = np.sqrt(variance.mean()) / mean.mean()
    print(f"{path.name}: mean {mean.mean((0, 1)).round(5)}, noise {100 * noise:.2f} %, {time.time() - started:.0f} s")


def render_ours(scene):
    """The same by trimray; the scene's copy asks for the variance."""
    text = scene.read_text(encoding="utf-8")
    for folder in ["meshes", "pictures"]:
        text = text.replace(f'"{folder}/', f'"{scene.parent.resolve()}/{folder}/')
    text, count = re.subn(r"(?m)^\[render\]\n", '[render]\naovs = ["variance"]\n', text)
    fail_unless(count == 1, "the scene has one [render] table and asks for no AOVs")
    with tempfile.TemporaryDirectory() as folder:
        copy, output = Path(folder) / scene.name, Path(folder) / "out.exr"
        copy.write_text(text, encoding="utf-8")
        trimray("render", copy, "-o", output, "--seed", 4711, "--quiet")
        file = oiio.ImageInput.open(str(output))
        names = list(file.spec().channelnames)
        pixels = file.read_image(0, 0, 0, len(names), oiio.FLOAT).astype(float)
        file.close()
    return [pixels[:, :, [names.index(name) for name in layers]] for layers in (LAYERS[:3], LAYERS[3:])]


def check(scene):
    """Compares trimray's picture of a scene with Mitsuba's; returns whether they agree."""
    theirs, their_variance, tolerance = render(scene, CHECK_SPP, CHECK_SEEDS)
    print(f"{scene.name}, {CHECK_SPP * CHECK_SEEDS} samples, triangles within {tolerance:.1e}:")
    ours, our_variance = render_ours(scene)
    pictures = (ours, our_variance, theirs, their_variance)
    return all([compare_means(*pictures), compare_pixels(*pictures)])


def main():
    """Does what the command line says."""
    names = sys.argv[1:]
    only_check = "--check" in names
    names = [name for name in names if name != "--check"] or sorted(p.stem for p in REFS.glob("scenes/*.toml"))
    scenes = [REFS / "scenes" / f"{name}.toml" for name in names]
    for scene in scenes:
        fail_unless(scene.is_file(), f"there is no {scene}")
    if only_check:
        results = {scene: check(scene) for scene in scenes}
        for scene, passed in results.items():
            fail_unless(passed, f"{scene.name}: not the picture that Mitsuba renders")
    else:
        for scene in scenes:
            write(scene)


if __name__ == "__main__":
    main()
