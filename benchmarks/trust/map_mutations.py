"""Faults for map files: bytes that are turned, cut and mixed, odd numbers and words, nesting without end.

Everything is drawn from a NumPy generator: the same seed gives the same faults. Only NumPy is needed.
"""

from __future__ import annotations

import re

NUMBERS = (
    *(b"0", b"-0.0", b"-1", b"1", b"0.5", b"1e308", b"-1e308", b"1e999", b"1e-320", b"1e100", b"1e-9"),
    *(b"nan", b"NaN", b".nan", b"inf", b"-Infinity", b".inf", b"1e5", b"0x10", b"1_000", b"1:30", b"1,5"),
    *(b"2147483648", b"-9223372036854775809", b"4294967295", b"9" * 400, b"9" * 5000, b"", b"x", b"1.1.1"),
)
"""What is put in the place of a number."""

WORDS = (
    *(b"\x00", b"\xff\xfe", b"\xef\xbb\xbf", b"\x1b[2J", b"\r\n", b"\xed\xa0\x80", b"\xe2\x80\xae", b"[/b]"),
    *(b"../../../../etc/passwd", b"/etc/passwd", b"/dev/zero", b"a" * 3000, b"[" * 2000, b"{" * 2000),
    *(
        b'"',
        b"'",
        b"<",
        b">",
        b"&",
        b"*a",
        b"&a ",
        b"<<: ",
        b"null",
        b"true",
        b"[]",
        b"{}",
        b"%s",
        b"\\ud800",
    ),
)
"""What is put anywhere."""

NUMBER = re.compile(rb"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")
WORD = re.compile(rb"[A-Za-z_$#][A-Za-z0-9_$#-]*")


def mutated(data, rng, others=(), gentle=False):
    """Return a file with one to four faults in it.

    Parameters
    ----------
    data : bytes
    rng : numpy.random.Generator
    others : sequence of bytes
        Files of the same kind, to take parts from.
    gentle : bool
        Change numbers, words and lines alone, so that most readers go on.
    """
    changes = GENTLE if gentle else CHANGES
    for _ in range(int(rng.integers(1, 5))):
        change = changes[int(rng.integers(0, len(changes)))]
        data = change(data, rng, others)
    return data[:300_000]


def _place(data, rng):
    return int(rng.integers(0, len(data) + 1))


def _one_of(things, rng):
    return things[int(rng.integers(0, len(things)))]


def _span(data, rng, most=60):
    start = _place(data, rng)
    return start, min(len(data), start + int(rng.integers(1, most)))


def turned_bit(data, rng, others):
    """Turn one bit."""
    if not data:
        return data
    place = int(rng.integers(0, len(data)))
    return data[:place] + bytes([data[place] ^ (1 << int(rng.integers(0, 8)))]) + data[place + 1 :]


def other_bytes(data, rng, others):
    """Write random bytes over some."""
    start, end = _span(data, rng)
    return data[:start] + rng.bytes(end - start) + data[end:]


def other_header(data, rng, others):
    """Write a random byte into the first 64, where sizes and kinds are."""
    if not data:
        return data
    place = int(rng.integers(0, min(64, len(data))))
    return data[:place] + rng.bytes(1) + data[place + 1 :]


def less(data, rng, others):
    """Take some bytes out."""
    start, end = _span(data, rng, most=400)
    return data[:start] + data[end:]


def cut_off(data, rng, others):
    """Leave the end out."""
    return data[: _place(data, rng)]


def again(data, rng, others):
    """Repeat a part, some times."""
    start, end = _span(data, rng, most=300)
    return data[:end] + data[start:end] * int(rng.integers(1, 30)) + data[end:]


def word_in(data, rng, others):
    """Put something odd in."""
    place = _place(data, rng)
    return data[:place] + _one_of(WORDS, rng) + data[place:]


def part_of_other(data, rng, others):
    """Put a part of another file in."""
    if not others:
        return data
    other = _one_of(others, rng)
    start, end = _span(other, rng, most=500)
    place = _place(data, rng)
    return data[:place] + other[start:end] + data[place:]


def _changed(data, rng, pattern, new):
    """Return data with one to three places that fit a pattern changed."""
    found = list(pattern.finditer(data))
    for _ in range(int(rng.integers(1, 4))):
        if not found:
            break
        match = found.pop(int(rng.integers(0, len(found))))
        if data[match.start() : match.end()] == match.group():
            data = data[: match.start()] + new(match.group()) + data[match.end() :]
            found = [each for each in found if each.end() <= match.start()]
    return data


def other_numbers(data, rng, others):
    """Put odd numbers in the place of numbers."""
    return _changed(data, rng, NUMBER, lambda _: _one_of(NUMBERS, rng))


def near_numbers(data, rng, others):
    """Change numbers, and keep them numbers."""

    def near(text):
        factor = float(rng.choice([-1.0, 0.0, 0.1, 10.0, 1e-6, 1e6, 1.0 + 1e-12]))
        return repr(float(text[:300]) * factor).encode()

    return _changed(data, rng, NUMBER, near)


def other_words(data, rng, others):
    """Put a word of this file, or of another, in the place of a word."""
    words = WORD.findall(data) + [word for other in others[:3] for word in WORD.findall(other)[:500]]
    if not words:
        return data
    return _changed(data, rng, WORD, lambda _: _one_of(words, rng))


def moved_line(data, rng, others):
    """Move, repeat or leave out a line."""
    lines = data.split(b"\n")
    line = lines.pop(int(rng.integers(0, len(lines))))
    for _ in range(int(rng.integers(0, 4))):
        lines.insert(int(rng.integers(0, len(lines) + 1)), line)
    return b"\n".join(lines)


def nested_deeply(data, rng, others):
    """Put brackets, or another thing that nests, around a place."""
    opening, closing = _one_of(
        ((b"[", b"]"), (b"{", b"}"), (b'{"a":', b"}"), (b"<g>", b"</g>"), (b"[[", b"")), rng
    )
    n, place = int(rng.choice([3, 50, 1000, 100_000 // len(opening)])), _place(data, rng)
    return data[:place] + opening * n + closing * n + data[place:]


GENTLE = (other_numbers, near_numbers, near_numbers, other_words)

CHANGES = (
    *(turned_bit, other_bytes, other_header, less, cut_off, again, word_in, part_of_other),
    *(other_numbers, other_numbers, other_numbers, near_numbers, near_numbers, other_words, other_words),
    *(moved_line, nested_deeply),
)
"""The more often it is here, the more often it is drawn."""
