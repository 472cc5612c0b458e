"""Writes the pictures of the scenes here: scenes/pictures. They are in the repository; run this to change them.

    python pictures.py
"""

from pathlib import Path

import numpy as np
import OpenImageIO as oiio

FOLDER = Path(__file__).parent / "scenes" / "pictures"


def write(name, pixels, kind):
    """Rows from the top, three channels."""
    height, width, channels = pixels.shape
    spec = oiio.ImageSpec(width, height, channels, kind)
    output = oiio.ImageOutput.create(str(FOLDER / name))
    assert output.open(str(FOLDER / name), spec), output.geterror()
    assert output.write_image(pixels), output.geterror()
    output.close()


def sky():
    """Latitude and longitude: brighter to the top, with a soft sun and a coloured glow."""
    y, x = np.mgrid[0:32, 0:64]
    theta, phi = np.pi * (y + 0.5) / 32, 2 * np.pi * (x + 0.5) / 64
    direction = np.stack([np.sin(theta) * np.sin(phi), np.cos(theta), -np.sin(theta) * np.cos(phi)], axis=-1)
    pixels = 0.25 + 0.5 * np.clip(direction[..., 1:2], 0, 1) * np.array([0.6, 0.8, 1.2])
    for towards, width, colour in [((0.5, 0.6, -0.4), 0.35, (9, 8, 6)), ((-0.7, 0.1, 0.6), 0.6, (0.3, 0.8, 1.5))]:
        towards = np.array(towards) / np.linalg.norm(towards)
        cosine = direction @ towards
        pixels = pixels + np.exp((cosine - 1) / width**2)[..., None] * np.array(colour)
    write("sky.exr", pixels.astype(np.float32), oiio.HALF)


def tiles():
    """Coloured tiles with joints, unlike in every direction."""
    y, x = np.mgrid[0:24, 0:32]
    pixels = np.stack([60 + 6 * x, 230 - 7 * y, 90 + 4 * ((x // 8 + y // 6) % 3) * 20], axis=-1)
    pixels[(x % 8 == 0) | (y % 6 == 0)] = [235, 225, 210]
    write("tiles.png", pixels.astype(np.uint8), oiio.UINT8)


sky()
tiles()
