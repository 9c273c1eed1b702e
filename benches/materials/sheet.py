"""Means of blocks, and contact sheets."""

import struct
import zlib

import numpy as np

BLOCKS = 8


def blocks(image):
    side = image.shape[0] // BLOCKS
    return image.reshape(BLOCKS, side, BLOCKS, side, 3).mean((1, 3))


def differences(ours, theirs):
    """Per block, |ours − theirs| over theirs, of the mean over channels of the absolute differences; and their signed mean."""
    a, b = blocks(ours), blocks(theirs)
    level = np.maximum(b.mean(-1), 0.05 * b.mean())
    return abs(a - b).mean(-1) / level, (a - b).mean(-1) / level


def write_png(path, pixels):
    height, width, _ = pixels.shape
    chunk = lambda kind, data: struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    rows = np.concatenate([np.zeros((height, 1), np.uint8), pixels.reshape(height, -1)], 1)
    with open(path, "wb") as out:
        out.write(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)))
        out.write(chunk(b"IDAT", zlib.compress(rows.tobytes(), 9)) + chunk(b"IEND", b""))


def shown(image, exposure):
    x = np.clip(image * exposure, 0, 1)
    return (np.where(x <= 0.0031308, 12.92 * x, 1.055 * x ** (1 / 2.4) - 0.055) * 255 + 0.5).astype(np.uint8)


def red_and_blue(ours, theirs):
    """White where both are equal, red where ours is brighter, blue where theirs is; full colour from a difference of half on."""
    level = np.maximum(theirs.mean(-1), 0.1 * theirs.mean())
    d = np.clip(2 * (ours - theirs).mean(-1) / level, -1, 1)
    faded = lambda x: 1 - np.clip(x, 0, 1)
    return (np.stack([faded(-d), faded(abs(d)), faded(d)], -1) * 255 + 0.5).astype(np.uint8)


def write(path, ours, theirs, scale=1):
    """ours | theirs | difference."""
    exposure = 0.9 / np.quantile(theirs.max(-1), 0.97)
    row = np.concatenate([shown(ours, exposure), shown(theirs, exposure), red_and_blue(ours, theirs)], 1)
    write_png(path, row.repeat(scale, 0).repeat(scale, 1))
