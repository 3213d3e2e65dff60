"""Ways in which a log breaks. Each takes a file's bytes and a random.Random; returns bytes."""
HUGE = ["1e308", "-1e308", "1e30", "-1e18", "1e-308", "inf", "-inf", "1e9", "-7e8", "1e5"]
NOT_NUMBERS = ["nan", "NaN", "-nan", "", "--", "0x10", "1,5", "1e", "\0"]


def table(data):
    """Header, rows of cells."""
    lines = data.decode("utf-8", "surrogateescape").splitlines()
    return lines[0], [line.split(",") for line in lines[1:]]


def text_of(header, rows):
    lines = [header] + [",".join(row) for row in rows]
    return ("\n".join(lines) + "\n").encode("utf-8", "surrogateescape")


def span(draw, count, share):
    """A random range of rows, up to this share of them."""
    length = max(1, int(count * share * draw.random()))
    start = draw.randrange(max(1, count - length))
    return start, min(count, start + length)


def column(draw, header):
    """Of a value, not of the time stamp."""
    return draw.randrange(1, max(2, header.count(",") + 1))


def cut(data, draw):
    return data[:draw.randrange(len(data) + 1)]


def leave_out(data, draw):
    header, rows = table(data)
    start, end = span(draw, len(rows), 0.5)
    return text_of(header, rows[:start] + rows[end:])


def shift_time(data, draw):
    """A clock that jumps, by 0.1 ms up to the years from 1970."""
    header, rows = table(data)
    start, by = draw.randrange(len(rows)), draw.choice([-1, 1]) * 10 ** draw.choice(
        [draw.uniform(-4, 1), draw.uniform(-4, 1), draw.uniform(1, 10)])
    return text_of(header, rows[:start] +
                   [[f"{float(row[0]) + by:.9f}"] + row[1:] for row in rows[start:]])


def shift_bytes(data, draw):
    at, count = draw.randrange(len(data)), draw.randrange(1, 64)
    return data[:at] + bytes(draw.randrange(256) for _ in range(count)) + data[at:]


def repeat(data, draw):
    header, rows = table(data)
    start, end = span(draw, len(rows), 0.2)
    return text_of(header, rows[:end] + rows[start:end] + rows[end:])


def replace_cells(data, draw, values):
    header, rows = table(data)
    where = column(draw, header)
    start, end = span(draw, len(rows), draw.choice([0.0, 0.0, 0.01, 0.3]))
    value = draw.choice(values)
    for row in rows[start:end]:
        row[min(where, len(row) - 1)] = value
    return text_of(header, rows)


def not_a_number(data, draw):
    return replace_cells(data, draw, NOT_NUMBERS)


def huge(data, draw):
    return replace_cells(data, draw, HUGE)


def spike(data, draw):
    """Values that a sensor could have written, and the vehicle can't have done."""
    return replace_cells(data, draw, [f"{draw.choice([-1, 1]) * 10 ** draw.uniform(1, 6):.3f}"])


def stuck(data, draw):
    """A value that stops changing."""
    header, rows = table(data)
    where, (start, end) = column(draw, header), span(draw, len(rows), 0.5)
    for row in rows[start:end]:
        row[where] = rows[start][where]
    return text_of(header, rows)


def swap_columns(data, draw):
    header, rows = table(data)
    one, other = column(draw, header), column(draw, header)
    for row in rows:
        row[one], row[other] = row[other], row[one]
    return text_of(header, rows)


def swap_rows(data, draw):
    header, rows = table(data)
    one, other = draw.randrange(len(rows)), draw.randrange(len(rows))
    rows[one], rows[other] = rows[other], rows[one]
    return text_of(header, rows)


def scale_column(data, draw):
    """Another unit than the header states."""
    header, rows = table(data)
    where, factor = column(draw, header), draw.choice([1e-3, 1e3, 9.81, 57.29578, -1.0, 100.0])
    for row in rows:
        row[where] = repr(float(row[where]) * factor)
    return text_of(header, rows)


def flip_bits(data, draw):
    flipped = bytearray(data)
    for _ in range(draw.choice([1, 1, 1, 8, 64])):
        flipped[draw.randrange(len(flipped))] ^= 1 << draw.randrange(8)
    return bytes(flipped)


def empty(data, draw):
    return draw.choice([b"", b"\n", b"\0" * 64, data.split(b"\n", 1)[0] + b"\n", b" ,\n" * 9])


def line_ends(data, draw):
    ends = [draw.choice([b"\n", b"\r\n", b"\r\n", b"\r", b"\n\n"]) for _ in range(7)]
    lines = data.splitlines()
    return b"".join(line + ends[k % len(ends)] for k, line in enumerate(lines))


OF_TABLES = [leave_out, shift_time, repeat, not_a_number, huge, spike, stuck, swap_columns,
             swap_rows, scale_column]
OF_BYTES = [cut, shift_bytes, flip_bits, empty, line_ends]


def mutate(data, draw, is_table):
    """One mutation: (its name, the bytes)."""
    how = draw.choice(OF_TABLES + OF_BYTES if is_table else OF_BYTES)
    return how.__name__, how(data, draw)
