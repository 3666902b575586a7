"""A stroke alphabet of our own: capitals and figures as polylines on a grid 4 wide and 6 high."""

# Each stroke is a run of points, two digits (x, y) each with y down; strokes are parted by a blank.
STROKES = {
    "A": "062046 1434", "B": "06003041423303 3344453606", "C": "4130100105163645",
    "D": "00063645413000", "E": "40000646 0333", "F": "400006 0333", "G": "41301001051636454323",
    "H": "0006 4046 0343", "I": "2026", "J": "4045361605", "K": "0006 4003 1346", "L": "000646",
    "M": "0600234046", "N": "06004640", "O": "100105163645413010", "P": "06003041423303",
    "Q": "100105163645413010 2446", "R": "06003041423303 2346", "S": "4130100102134344361605",
    "T": "0040 2026", "U": "000516364540", "V": "002640", "W": "0016233640", "X": "0046 4006",
    "Y": "002340 2326", "Z": "00400646", "0": "100105163645413010 3214", "1": "112026",
    "2": "011030414206 0646", "3": "0110304142334445361605", "4": "36300444",
    "5": "400002334445361605", "6": "4130100105163645443303", "7": "004016",
    "8": "133241301001021333 1304051636454433", "9": "4313020110304145361605",
    "&": "46210110213105163644", ".": "2526", "-": "1333", "'": "2021", " ": "",
}


def strokes(letter):
    """The polylines of `letter` in grid units."""
    for run in STROKES[letter].split():
        yield [(int(run[i]), int(run[i + 1])) for i in range(0, len(run), 2)]


def width_of(text, size, gap=0.32):
    """How wide `text` runs at a capital height of `size` pixels."""
    return len(text) * size * (4 / 6 + gap) - size * gap


def write(canvas, text, x, y, size, colour, weight=None, gap=0.32, bend=None):
    """Writes `text` with its top left at (x, y); `bend` maps a point to its place on the page."""
    unit = size / 6
    for letter in text:
        for line in strokes(letter):
            points = [(x + u * unit, y + v * unit) for u, v in line]
            canvas.stroke([bend(*p) for p in points] if bend else points,
                          weight or size / 7, colour)
        x += size * (4 / 6 + gap)


def centred(canvas, text, x, y, size, colour, weight=None, gap=0.32):
    """Writes `text` about x."""
    write(canvas, text, x - width_of(text, size, gap) / 2, y, size, colour, weight, gap)
