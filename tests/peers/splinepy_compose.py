"""Composition time beside splinepy's, alternating in one run.

    python splinepy_compose.py [MESH.obj]

Both compose planes in general position with a Bézier volume of degree 2×2×2 and 3×3×3, one thread, best of many. splinepy
composes the volume with a bilinear rectangle, which gives degree 6×6 and 9×9; trimray's patches have the lowest degrees,
4×4 and 6×6. That difference is part of the comparison, as users get either; beside it stand trimray's figures for the
rectangle of Feng et al. and for their interpolation. With a mesh, subdivision and composition of all of it is timed too.
"""

import json
import os
import subprocess
import sys
import time

import numpy as np
import splinepy
from deformed import ROOT, fail_unless

# Turns of each; the least time of all counts, for both. With 6, a busy machine hid the least time now and then (46 for 68).
ROUNDS = 24

# How many times as fast trimray has to be.
RATIO = 50

SPLINEPY_REPEATS, SPLINEPY_BATCH = 60, 10


def bench_binary():
    """Builds benches/compose.rs; returns the path of the program."""
    command = ["cargo", "bench", "--bench", "compose", "--no-run", "--message-format=json"]
    done = subprocess.run(command, cwd=ROOT, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, text=True, check=True)
    built = [json.loads(line) for line in done.stdout.splitlines()]
    found = [m["executable"] for m in built if m.get("executable") and m["target"]["name"] == "compose"]
    fail_unless(len(found) == 1, "cargo names the bench's program")
    return found[0]


def bench(program, *flags):
    """The lines that the bench prints."""
    done = subprocess.run([program, "--json", *flags], stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, text=True, check=True)
    return [json.loads(line) for line in done.stdout.splitlines()]


def splinepy_time(degree, random):
    """Least seconds of composing a rectangle with a volume, and the degrees of the result."""
    line = np.linspace(0, 1, degree + 1)
    points = np.array([[x, y, z] for z in line for y in line for x in line])
    volume = splinepy.Bezier([degree] * 3, points + random.uniform(-0.05, 0.05, points.shape))
    # a splinepy inner function must stay in the unit cube
    corner, along, across = random.uniform(0.1, 0.3, (3, 3))
    rectangle = splinepy.Bezier([1, 1], np.array([corner, corner + along, corner + across, corner + along + across]))
    best = np.inf
    for _ in range(SPLINEPY_REPEATS):
        started = time.perf_counter()
        for _ in range(SPLINEPY_BATCH):
            composed = volume.compose(rectangle)
        best = min(best, (time.perf_counter() - started) / SPLINEPY_BATCH)
    at = random.uniform(0, 1, (5, 2))
    off = np.abs(composed.evaluate(at) - volume.evaluate(rectangle.evaluate(at))).max()
    fail_unless(off < 1e-10, "splinepy's result is the composition")
    return best, composed.degrees.tolist()


def main():
    """Times both in turns; fails below the ratio."""
    os.environ["OMP_NUM_THREADS"] = "1"
    program = bench_binary()
    random = np.random.default_rng(1)
    failed = False
    for degree in (2, 3):
        theirs, ours = np.inf, {}
        for _ in range(ROUNDS):
            seconds, degrees = splinepy_time(degree, random)
            theirs = min(theirs, seconds)
            for line in bench(program, "--degree", str(degree)):
                key = (line["frame"], line["way"], tuple(line["patch_degree"]))
                ours[key] = min(ours.get(key, np.inf), line["nanoseconds_per_patch"] * 1e-9)
        name = "×".join([str(degree)] * 3)
        print(f"{name}: splinepy {splinepy.__version__} {theirs * 1e6:.1f} µs (degree {degrees[0]}×{degrees[1]})")
        for (frame, way, (m, n)), seconds in ours.items():
            print(f"  trimray {way:<14} {frame:<14} {m}×{n}: {seconds * 1e6:7.3f} µs, {theirs / seconds:6.1f} times as fast")
        best = next(seconds for (frame, way, _), seconds in ours.items() if (frame, way) == ("parallelogram", "direct"))
        failed |= theirs / best < RATIO
    for path in sys.argv[1:]:
        (line,) = bench(program, "--mesh", path)
        print(f"{path}: {line['polygons']} polygons, {line['patches']} patches, median {line['median_ms']:.1f} ms", end=" ")
        print(f"(subdivide {line['median_subdivide_ms']:.1f}, compose {line['median_compose_ms']:.1f}), limit {line['limit_ms']}")
        failed |= not line["within_limit"]
    fail_unless(not failed, f"trimray must be {RATIO} times as fast, and meshes within their limit")


if __name__ == "__main__":
    main()
