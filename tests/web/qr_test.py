"""The page's QR codes, read by zbar."""
import ctypes
import ctypes.util
import json
import pathlib
import subprocess
import unittest

QR = pathlib.Path(__file__).resolve().parents[2] / "runtime" / "extensions" / "web" / "qr.js"
ZBAR = ctypes.util.find_library("zbar")
CODES = """const { qrOf } = await import(process.argv[1]);
console.log(JSON.stringify(JSON.parse(process.argv[2]).map(qrOf)));"""
# Bytes that versions 1 to 20 hold at level M (ISO/IEC 18004, table 7).
CAPACITIES = [14, 26, 42, 62, 84, 106, 122, 152, 180, 213, 251, 287, 331, 362, 412, 450, 504, 560, 624, 666]
PIXELS, MARGIN = 3, 4


def codes_of(texts):
    done = subprocess.run(["node", "--input-type=module", "-e", CODES, str(QR), json.dumps(texts)], capture_output=True, text=True)
    if done.returncode != 0:
        raise AssertionError(done.stderr)
    return json.loads(done.stdout)


def read(rows):
    """The texts that zbar finds in a picture of the code."""
    zbar = ctypes.CDLL(ZBAR)
    for name in ("zbar_image_scanner_create", "zbar_image_create", "zbar_image_first_symbol", "zbar_symbol_next"):
        getattr(zbar, name).restype = ctypes.c_void_p
    zbar.zbar_symbol_get_data.restype = ctypes.c_char_p
    side = PIXELS * (len(rows) + 2 * MARGIN)
    line = lambda row: b"\xff" * PIXELS * MARGIN + b"".join((b"\0" if dark else b"\xff") * PIXELS for dark in row) + b"\xff" * PIXELS * MARGIN
    light = b"\xff" * side * PIXELS * MARGIN
    pixels = light + b"".join(line(row) * PIXELS for row in rows) + light
    handle = ctypes.c_void_p
    scanner, image = handle(zbar.zbar_image_scanner_create()), handle(zbar.zbar_image_create())
    zbar.zbar_image_set_format(image, int.from_bytes(b"Y800", "little"))
    zbar.zbar_image_set_size(image, side, side)
    zbar.zbar_image_set_data(image, pixels, ctypes.c_ulong(len(pixels)), None)
    zbar.zbar_scan_image(scanner, image)
    texts, symbol = [], zbar.zbar_image_first_symbol(image)
    while symbol:
        texts.append(zbar.zbar_symbol_get_data(handle(symbol)).decode())
        symbol = zbar.zbar_symbol_next(handle(symbol))
    zbar.zbar_image_destroy(image)
    zbar.zbar_image_scanner_destroy(scanner)
    return texts


class Codes(unittest.TestCase):
    def test_each_version_is_filled_before_the_next(self):
        texts = [text for capacity in CAPACITIES for text in ("a" * capacity, "a" * (capacity + 1))]
        sizes = [None if rows is None else (len(rows) - 17) // 4 for rows in codes_of(texts)]
        self.assertEqual(sizes, [version for i in range(1, 21) for version in (i, i + 1 if i < 20 else None)])

    @unittest.skipUnless(ZBAR, "no libzbar0")
    def test_zbar_reads_them(self):
        address = "https://museum.example/ar/?lang=de&q=%C3%BC#R%C3%A4ume-"
        cut = lambda length: (address + "0123456789abcdefghijklmnopqrstuvwxyz" * 20)[:length]
        texts = ["https://a.eu/"] + [cut(capacity) for capacity in CAPACITIES]
        for text, rows in zip(texts, codes_of(texts)):
            with self.subTest(len(text)):
                self.assertEqual(read(rows), [text])


if __name__ == "__main__":
    unittest.main()
