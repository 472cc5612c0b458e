"""`trimray diff` beside OpenImageIO's comparison and NVIDIA's FLIP, on pictures made here.

    python difference.py

Mean, RMS, maximum and counts must be those of ImageBufAlgo.compare, FLIP and HDR-FLIP those of flip-evaluator. Pictures that
idiff passes, though they are not the same, must fail.
"""

import json
import subprocess
import tempfile
from pathlib import Path

import flip_evaluator
import numpy as np
import OpenImageIO as oiio
from deformed import binary, fail_unless

# Greatest difference from OpenImageIO, relative: it subtracts in single precision, as trimray does.
RELATIVE = 1e-6
# Greatest difference of mean FLIP: flip-evaluator works in single precision.
FLIP = 1e-5

FAIL, WARN, FAIL_RELATIVE = 0.02, 0.004, 0.05


def write(path, pixels, names=("R", "G", "B"), kind=oiio.FLOAT):
    """Writes an (h, w, c) array."""
    height, width, count = pixels.shape
    spec = oiio.ImageSpec(width, height, count, kind)
    spec.channelnames = tuple(names)
    out = oiio.ImageOutput.create(str(path))
    fail_unless(out is not None and out.open(str(path), spec), f"OpenImageIO writes {path}: {oiio.geterror()}")
    fail_unless(out.write_image(np.ascontiguousarray(pixels, dtype=np.float32)), f"{path}: {out.geterror()}")
    out.close()


def smooth(width, height):
    """Waves of three colours, from 0 to 1."""
    y, x = np.mgrid[:height, :width] / 24.0
    waves = [np.sin(3 * x + y), np.cos(2 * y - x), np.sin(x * y)]
    return (0.5 + 0.45 * np.stack(waves, axis=-1)).astype(np.float32)


def pairs(random):
    """Name: reference, test, names of the channels, type of the samples, ending."""
    rgb = ("R", "G", "B")
    base = smooth(61, 47)

    def noise(amount, like=base):
        return like + (amount * random.standard_normal(like.shape)).astype(np.float32)

    yield "smooth", base, base + 0.03 * base[::-1], rgb, oiio.FLOAT, "exr"
    yield "noise", noise(0.1), noise(0.1), rgb, oiio.FLOAT, "exr"
    yield "shifted", base, np.roll(base, 1, axis=1), rgb, oiio.FLOAT, "exr"
    bright = 100 * base**4 + 0.01
    yield "HDR", bright, np.abs(noise(0.02) / base) * bright, rgb, oiio.FLOAT, "exr"
    yield "dark", 1e-4 * base, 1.01e-4 * np.abs(noise(0.02)), rgb, oiio.FLOAT, "exr"
    small = smooth(3, 2)
    yield "tiny", small, small[::-1], rgb, oiio.FLOAT, "exr"
    hole = np.where(base[:, :, :1] > 0.9, np.float32(np.nan), base)
    yield "NaN in both", hole, hole + 0.05, rgb, oiio.FLOAT, "exr"
    layers = ("R", "G", "B", "A", "depth.T", "normal.X", "normal.Y", "normal.Z", "object.I")
    many = np.concatenate([base, np.ones_like(base[:, :, :1]), 5 * base[:, :, :2], base], axis=-1)
    changed = noise(0.01, many)
    changed[:, :, 8] = many[:, :, 8]
    yield "layers", many, changed, layers, oiio.FLOAT, "exr"
    yield "grey", base[:, :, :1], noise(0.03)[:, :, :1], ("Y",), oiio.FLOAT, "exr"
    yield "halves", base, noise(0.01), rgb, oiio.HALF, "exr"
    yield "negative", base - 0.5, noise(0.2) - 0.5, rgb, oiio.FLOAT, "exr"
    yield "PNG", base, noise(0.05), rgb, oiio.UINT8, "png"


def diff(*arguments):
    """Runs `trimray diff`; returns its exit code and what it prints."""
    command = [str(binary()), "diff", *map(str, arguments)]
    done = subprocess.run(command, stdin=subprocess.DEVNULL, capture_output=True, text=True, check=False)
    fail_unless("panicked" not in done.stderr, done.stderr)
    return done.returncode, done.stdout


def near(got, want, tolerance, what):
    """Demands a relative difference of at most the tolerance; returns it."""
    off = abs(got - want) / max(abs(want), 1e-30)
    fail_unless(off <= tolerance, f"{what}: {got}, want {want}")
    return off


def check_numbers(name, found, paths):
    """Mean, RMS, maximum and counts against OpenImageIO's; returns the greatest relative difference."""
    images = [oiio.ImageBuf(str(path)) for path in paths]
    want = oiio.ImageBufAlgo.compare(*images, FAIL, WARN, FAIL_RELATIVE, FAIL_RELATIVE)
    # OpenImageIO leaves what is not finite in both out of the sum, but not out of the count
    values, left_out = found["values"], found["non_finite"]["equal"]
    share = values / (values + left_out)
    off = [
        near(found["mean_error"] * share, want.meanerror, RELATIVE, f"{name}: mean error"),
        near(found["rms_error"] * share**0.5, want.rms_error, RELATIVE, f"{name}: RMS error"),
        near(found["max_error"]["value"], want.maxerror, RELATIVE, f"{name}: max error"),
    ]
    place = found["max_error"]
    names = images[0].spec().channelnames
    got = (place["x"], place["y"], place["channel"])
    fail_unless(got == (want.maxx, want.maxy, names[want.maxc]), f"{name}: max error at {got}")
    counts = (found["failing"], found["warning"])
    fail_unless(counts == (want.nfail, want.nwarn), f"{name}: {counts} pixels, want {want.nfail, want.nwarn}")
    return max(off)


def check_flip(name, found, paths):
    """FLIP and HDR-FLIP against flip-evaluator's; returns the greatest difference."""
    colours = []
    for path in paths:
        pixels = oiio.ImageBuf(str(path)).get_pixels(oiio.FLOAT)[:, :, :3]
        colours.append(np.array(np.broadcast_to(pixels, (*pixels.shape[:2], 3)), order="C"))
    encoded = paths[0].suffix == ".png"
    metrics = {metric["name"]: metric["mean"] for metric in found["metrics"]}
    screen = [np.clip(pixels, 0, 1) for pixels in colours]
    error, _, _ = flip_evaluator.evaluate(*screen, "LDR", inputsRGB=encoded, applyMagma=False)
    off = [abs(metrics["flip"] - error.mean(dtype=np.float64))]
    fail_unless(off[0] <= FLIP, f"{name}: FLIP {metrics['flip']}, want {error.mean(dtype=np.float64)}")
    # of negative radiance the tool makes what it likes
    if not encoded and min(pixels.min() for pixels in colours) >= 0:
        error, _, _ = flip_evaluator.evaluate(*colours, "HDR", applyMagma=False)
        off.append(abs(metrics["hdrflip"] - error.mean(dtype=np.float64)))
        fail_unless(off[1] <= FLIP, f"{name}: HDR-FLIP {metrics['hdrflip']}, want {error.mean(dtype=np.float64)}")
    return max(off)


def check_what_idiff_passes(folder):
    """NaN, other channels and other windows."""
    base = smooth(20, 10)
    names = ["reference", "nan", "names"]
    reference, nan, renamed = (Path(folder) / f"{name}.exr" for name in names)
    write(reference, base)
    write(nan, np.full_like(base, np.nan))
    write(renamed, base, ("X", "Y", "Z"))
    fail_unless(diff(reference, nan, "--fail", "9", "--warn", "9")[0] == 2, "a picture of NaN fails")
    fail_unless(diff(nan, nan)[0] == 0, "the same NaN passes")
    fail_unless(diff(reference, renamed)[0] == 3, "other channels are another kind of picture")
    write(renamed, base[:, :, ::-1], ("B", "G", "R"))
    fail_unless(diff(reference, renamed)[0] == 0, "channels are matched by name")


def main():
    """Runs all checks."""
    random = np.random.default_rng(4711)
    with tempfile.TemporaryDirectory() as folder:
        for name, *pictures, channels, kind, ending in pairs(random):
            paths = [Path(folder) / f"{which}.{ending}" for which in ("reference", "test")]
            for path, pixels in zip(paths, pictures, strict=True):
                write(path, pixels, channels, kind)
            flags = ["--fail", FAIL, "--warn", WARN, "--failrelative", FAIL_RELATIVE, "--warnrelative", FAIL_RELATIVE]
            code, printed = diff(*paths, *flags, "--json", "--metric", "flip", "--metric", "hdrflip")
            fail_unless(code in (0, 1, 2), f"{name}: exit {code}")
            found = json.loads(printed)
            off = check_numbers(name, found, paths)
            said = f"{name}: {found['failing']} of {found['pixels']} pixels fail as in OpenImageIO, figures to {off:.1e}"
            if not np.isnan(pictures[0]).any():
                said += f", FLIP to {check_flip(name, found, paths):.1e}"
            print(said)
        check_what_idiff_passes(folder)
        print("what idiff passes wrongly fails")


if __name__ == "__main__":
    main()
