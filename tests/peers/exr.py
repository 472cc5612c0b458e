"""The EXR files as OpenImageIO reads them: channels, windows, attributes, values, and the same bytes for any threads.

    python exr.py
"""

import json
import re
import tempfile
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
from deformed import ROOT, fail_unless, trimray

SCENE = ROOT / "scenes" / "feng_fig07.toml"
SIZE = (96, 72)
CROP = (17, 11, 41, 29)
SPP = 4

# Every AOV with its channels.
AOVS = {
    "depth": ["depth.T"],
    "position": ["position.X", "position.Y", "position.Z"],
    "normal": ["normal.X", "normal.Y", "normal.Z"],
    "geo_normal": ["geo_normal.X", "geo_normal.Y", "geo_normal.Z"],
    "uv": ["uv.U", "uv.V"],
    "st": ["st.S", "st.T"],
    "rest": ["rest.X", "rest.Y", "rest.Z"],
    "object": ["object.I"],
    "face": ["face.I"],
    "patch": ["patch.I"],
    "albedo": ["albedo.R", "albedo.G", "albedo.B"],
    "variance": ["variance.R", "variance.G", "variance.B"],
}
IDS = {"object.I", "face.I", "patch.I"}
ATTRIBUTES = {
    "software": str,
    "trimray/version": str,
    "trimray/sceneHash": str,
    "trimray/seed": (str, int),
    "trimray/spp": int,
    "trimray/settings": str,
}
REC_709 = [0.64, 0.33, 0.30, 0.60, 0.15, 0.06, 0.3127, 0.3290]


def scene_with(folder, **settings):
    """A copy of the scene in a folder, with settings added to its [render] table; returns its path."""
    text = SCENE.read_text(encoding="utf-8").replace('"meshes/', f'"{SCENE.parent}/meshes/')
    added = "".join(f"{key} = {json.dumps(value)}\n" for key, value in settings.items())
    text, count = re.subn(r"(?m)^\[render\]\n", "[render]\n" + added, text)
    # wide enough that some rays miss the ground too
    text, views = re.subn(r"(?m)^fov = .*$", "fov = 90.0", text)
    fail_unless(count == 1 and views == 1, "the scene has one [render] table and one field of view")
    path = Path(folder) / "scene.toml"
    path.write_text(text, encoding="utf-8")
    return path


def render(scene, output, *flags):
    """Renders; returns the bytes, the specification and the pixels {channel: (h, w)}."""
    size = "x".join(map(str, SIZE))
    trimray("render", scene, "-o", output, "--size", size, "--spp", SPP, "--quiet", *flags)
    file = oiio.ImageInput.open(str(output))
    fail_unless(file is not None, f"OpenImageIO reads {output}: {oiio.geterror()}")
    spec = file.spec()
    pixels = file.read_image(0, 0, 0, spec.nchannels, oiio.FLOAT)
    fail_unless(not file.seek_subimage(1, 0), "the file has one part")
    file.close()
    channels = {name: pixels[:, :, index] for index, name in enumerate(spec.channelnames)}
    return Path(output).read_bytes(), spec, channels


def check_header(spec, data_window):
    """Windows, channel types and attributes."""
    fail_unless((spec.full_x, spec.full_y, spec.full_width, spec.full_height) == (0, 0, *SIZE), "display window")
    fail_unless((spec.x, spec.y, spec.width, spec.height) == data_window, "data window")
    fail_unless(spec.format == oiio.FLOAT and not spec.channelformats, "all channels are 32-bit floats")
    for name, kinds in ATTRIBUTES.items():
        value = spec.getattribute(name)
        fail_unless(isinstance(value, kinds), f"attribute {name}: {value!r}")
    fail_unless("trimray" in spec.getattribute("software"), "attribute software names the program")
    fail_unless(int(spec.getattribute("trimray/spp")) == SPP, "attribute trimray/spp")
    fail_unless(int(spec.getattribute("trimray/seed")) == 0, "attribute trimray/seed")
    settings = spec.getattribute("trimray/settings")
    json.loads(settings)
    fail_unless(str(ROOT) not in settings and "thread" not in settings, "settings name no paths and no threads")
    matrix = np.array(spec.getattribute("worldToCamera")).reshape(4, 4)
    # rows are the images of the axes: the origin of the camera goes to 0
    fail_unless(np.abs(np.array([2.6, -2.9, 2.1, 1]) @ matrix - [0, 0, 0, 1]).max() < 1e-5, "worldToCamera")
    chromaticities = np.array(spec.getattribute("chromaticities"))
    fail_unless(np.abs(chromaticities - REC_709).max() < 1e-6, "chromaticities are Rec. 709's")
    for name in ("DateTime", "capDate"):
        fail_unless(spec.getattribute(name) is None, f"no {name}: the same command gives the same bytes")


def check_values(channels):
    """Finite everywhere; misses 0 and -1; directions of length 1."""
    for name, pixels in channels.items():
        fail_unless(np.isfinite(pixels).all(), f"{name} is finite everywhere")
    hit = channels["object.I"] >= 0
    fail_unless(0.2 < hit.mean() < 1, f"the picture shows objects and background: {hit.mean():.2f} are hits")
    for names in AOVS.values():
        for name in names:
            if not name.startswith("variance"):
                miss = -1 if name in IDS else 0
                fail_unless((channels[name][~hit] == miss).all(), f"{name} is {miss} where nothing is hit")
    for name in IDS:
        whole = channels[name] == np.round(channels[name])
        fail_unless(whole.all() and (channels[name][hit] >= 0).all(), f"{name} are whole numbers from 0 at hits")
    for name in ("normal", "geo_normal"):
        length = np.sqrt(sum(channels[f"{name}.{axis}"][hit] ** 2 for axis in "XYZ"))
        fail_unless(np.abs(length - 1).max() < 1e-5, f"{name} has length 1")
    position = np.stack([channels[f"position.{axis}"][hit] for axis in "XYZ"], axis=-1)
    distance = np.linalg.norm(position - [2.6, -2.9, 2.1], axis=-1)
    fail_unless(np.abs(distance / channels["depth.T"][hit] - 1).max() < 1e-5, "depth is the distance from the camera")
    fail_unless(min(channels[f"variance.{c}"].min() for c in "RGB") >= 0, "variances are not negative")
    fail_unless(max(channels[f"variance.{c}"].max() for c in "RGB") > 0, "the picture has noise")


def main():
    """Runs all checks."""
    with tempfile.TemporaryDirectory() as folder:
        scene = scene_with(folder, aovs=list(AOVS))
        whole, spec, channels = render(scene, Path(folder) / "whole.exr")
        want = ["R", "G", "B", "A", *(name for names in AOVS.values() for name in names)]
        fail_unless(sorted(spec.channelnames) == sorted(want), f"channels are {sorted(want)}, not {spec.channelnames}")
        fail_unless(list(spec.channelnames[:4]) == ["R", "G", "B", "A"], "OpenImageIO sees R G B A first")
        check_header(spec, (0, 0, *SIZE))
        check_values(channels)
        print(f"all AOVs: {len(want)} channels, names, types, windows, attributes and values as they should be")

        for threads in (1, 2, 3):
            again, _, _ = render(scene, Path(folder) / "again.exr", "--threads", threads)
            fail_unless(again == whole, f"the same bytes with {threads} threads")
        print("the same bytes with 1, 2 and 3 threads")

        x, y, width, height = CROP
        _, spec, cropped = render(scene, Path(folder) / "crop.exr", "--crop", ",".join(map(str, CROP)))
        check_header(spec, CROP)
        for name, pixels in cropped.items():
            part = channels[name][y : y + height, x : x + width]
            same = np.array_equal(pixels.view(np.uint32), np.ascontiguousarray(part).view(np.uint32))
            fail_unless(same, f"{name}: the crop is the full frame's part, bit for bit")
        print("a crop is the full frame's part, bit for bit, in every channel")

        _, spec, _ = render(SCENE, Path(folder) / "plain.exr")
        fail_unless(list(spec.channelnames) == ["R", "G", "B", "A"], f"without AOVs: R G B A, not {spec.channelnames}")
        print("without AOVs: R G B A")


if __name__ == "__main__":
    main()
