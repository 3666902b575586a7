"""Writes and reads 8-bit RGB PNG files with zlib alone."""
import struct
import zlib

MAGIC = b"\x89PNG\r\n\x1a\n"


class Picture:
    """An RGB image: `pixels` is a bytearray of width * height * 3, rows from the top."""

    def __init__(self, width, height, pixels=None):
        self.width = width
        self.height = height
        self.pixels = pixels if pixels is not None else bytearray(width * height * 3)

    def at(self, x, y):
        """The colour of pixel (x, y), clamped to the border."""
        x = min(max(int(x), 0), self.width - 1)
        y = min(max(int(y), 0), self.height - 1)
        i = (y * self.width + x) * 3
        return tuple(self.pixels[i : i + 3])


def _chunk(kind, body):
    return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))


# What a filtered byte costs: its distance from zero, as a signed number.
_COST = bytes(min(v, 256 - v) for v in range(256))


def _minus(a, b, high):
    """a - b, byte by byte: long integers, `high` being the highest bit of every byte."""
    return ((a | high) - (b & ~high)) ^ ((a ^ ~b) & high)


def _filtered(picture):
    """Each row under the filter (none, sub, up or average) whose sum of absolute values is least."""
    stride = picture.width * 3
    high, even = (int.from_bytes(bytes([v]) * stride, "little") for v in (0x80, 0xFE))
    all_bits = (1 << 8 * stride) - 1
    above = 0
    out = bytearray()
    for y in range(picture.height):
        row = int.from_bytes(picture.pixels[y * stride : (y + 1) * stride], "little")
        left = row << 24 & all_bits
        mean = (left & above) + (((left ^ above) & even) >> 1)
        trials = [v.to_bytes(stride, "little") for v in (row, *(_minus(row, v, high) for v in (left, above, mean)))]
        costs = [sum(t.translate(_COST)) for t in trials]
        best = costs.index(min(costs))
        out.append(best)
        out += trials[best]
        above = row
    return bytes(out)


def write(path, picture, level=9):
    """Writes `picture` to `path`."""
    header = struct.pack(">IIBBBBB", picture.width, picture.height, 8, 2, 0, 0, 0)
    with open(path, "wb") as file:
        file.write(MAGIC + _chunk(b"IHDR", header))
        file.write(_chunk(b"IDAT", zlib.compress(_filtered(picture), level)))
        file.write(_chunk(b"IEND", b""))


def _paeth(a, b, c):
    p = a + b - c
    pa, pb, pc = abs(p - a), abs(p - b), abs(p - c)
    return a if pa <= pb and pa <= pc else b if pb <= pc else c


def _unfilter(kind, row, above, bpp):
    row = bytearray(row)
    for i, value in enumerate(row):
        a = row[i - bpp] if i >= bpp else 0
        b = above[i]
        if kind == 1:
            row[i] = (value + a) & 255
        elif kind == 2:
            row[i] = (value + b) & 255
        elif kind == 3:
            row[i] = (value + ((a + b) >> 1)) & 255
        elif kind == 4:
            c = above[i - bpp] if i >= bpp else 0
            row[i] = (value + _paeth(a, b, c)) & 255
    return row


def read(path):
    """Reads an 8-bit, non-interlaced PNG (grey, RGB, palette, with or without alpha) as RGB."""
    with open(path, "rb") as file:
        data = file.read()
    if data[:8] != MAGIC:
        raise ValueError(f"{path}: not a PNG file")
    at, body, palette = 8, b"", b""
    while at + 8 <= len(data):
        size, kind = struct.unpack(">I4s", data[at : at + 8])
        content = data[at + 8 : at + 8 + size]
        if kind == b"IHDR":
            width, height, depth, colour, _, _, interlace = struct.unpack(">IIBBBBB", content)
        elif kind == b"PLTE":
            palette = content
        elif kind == b"IDAT":
            body += content
        at += 12 + size
    if depth != 8 or interlace:
        raise ValueError(f"{path}: only 8-bit PNG files without interlace are read")
    bpp = {0: 1, 2: 3, 3: 1, 4: 2, 6: 4}[colour]
    raw, stride = zlib.decompress(body), width * bpp
    picture, above = Picture(width, height), bytearray(stride)
    for y in range(height):
        start = y * (stride + 1)
        above = _unfilter(raw[start], raw[start + 1 : start + 1 + stride], above, bpp)
        line = memoryview(picture.pixels)[y * width * 3 : (y + 1) * width * 3]
        for c in range(3):
            if colour == 3:
                line[c::3] = bytes(palette[3 * v + c] for v in above)
            else:
                line[c::3] = bytes(above[(c if bpp >= 3 else 0) :: bpp])
    return picture
