"""The one environment of all renders: a sky without edges, bright from one side, of another colour towards each axis, as a Radiance file."""

import numpy as np

WIDTH, HEIGHT = 1024, 512
# Lobes: direction (y up), how narrow, and radiance.
LOBES = [((0.45, 0.6, 0.66), 24.0, (6.0, 5.2, 4.2)), ((-1.0, 0.1, 0.2), 6.0, (0.2, 0.5, 1.4)), ((1.0, -0.2, -0.3), 6.0, (0.9, 0.3, 0.1)),
         ((0.0, 0.3, -1.0), 3.0, (0.1, 0.6, 0.3))]
SKY, GROUND = np.array((0.45, 0.6, 0.9)), np.array((0.2, 0.17, 0.14))


def radiance(lobes=LOBES, sky=SKY, ground=GROUND):
    """Rows from +y down; +x in the middle, +z to the right of it."""
    theta = (np.arange(HEIGHT) + 0.5) / HEIGHT * np.pi
    phi = (np.arange(WIDTH) + 0.5 - WIDTH / 2) / WIDTH * 2 * np.pi
    sin, cos = np.sin(theta)[:, None], np.cos(theta)[:, None]
    d = np.stack(np.broadcast_arrays(sin * np.cos(phi), cos, sin * np.sin(phi)), -1)
    up = (0.5 + 0.5 * np.tanh(3 * d[..., 1:2]))
    image = ground + (sky - ground) * up
    for towards, narrow, colour in lobes:
        a = np.array(towards) / np.linalg.norm(towards)
        image = image + np.exp(narrow * (d @ a - 1))[..., None] * np.array(colour)
    return image


def encoded(image):
    """Three mantissas and an exponent for each pixel."""
    _, exponent = np.frexp(image.max(-1))
    scale = (256 / np.exp2(exponent))[..., None]
    return np.concatenate([np.floor(image * scale).astype(np.uint8), (exponent + 128).astype(np.uint8)[..., None]], -1)


def stored():
    """The radiance that the file has."""
    pixels = encoded(radiance()).astype(np.float64)
    return pixels[..., :3] * np.exp2(pixels[..., 3:] - 136)


def write(path, image=None):
    """That one, or another image of its size, without run lengths."""
    with open(path, "wb") as out:
        out.write(f"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {HEIGHT} +X {WIDTH}\n".encode() + encoded(radiance() if image is None else image).tobytes())
