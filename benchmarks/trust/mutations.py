"""Faults for files: bytes that are turned, cut and mixed, values of other kinds, archives that lie."""

from __future__ import annotations

import copy
import io
import json
import struct
import zipfile

import numpy as np

WORDS = (b"\x00", b"\xff" * 4, b"\x00" * 8, b"\x7f\xff\xff\xff", b"NaN", b"1e999", b"-1", b"[[[[", b"{", b'"')
"""What is put into bytes."""

DEEP = 3_000
"""Brackets in each other."""


def mutated_bytes(data, rng):
    """Return bytes with one to four faults in them."""
    data = bytearray(data)
    for _ in range(rng.integers(1, 5)):
        place = int(rng.integers(0, len(data) + 1))
        end = min(len(data), place + int(rng.integers(1, 40)))
        kind = rng.integers(0, 7)
        if kind == 0 and place < len(data):
            data[place] ^= 1 << int(rng.integers(0, 8))
        elif kind == 1:
            data[place:place] = WORDS[rng.integers(0, len(WORDS))]
        elif kind == 2:
            del data[place:end]
        elif kind == 3:
            del data[place:]
        elif kind == 4:
            data[place:place] = data[end : end + int(rng.integers(1, 200))]
        elif kind == 5:
            data[place:end] = rng.bytes(end - place)
        else:
            data[place:end] = WORDS[rng.integers(0, len(WORDS))]
    return bytes(data)


def strange(rng):
    """Return a value that hardly any reader wants."""
    kinds = [
        *(None, True, False, 0, -1, 1, 2**63, 10**400, 0.5, -0.0, 1e-320, 1e308, -1e308),
        *(float("nan"), float("inf"), -float("inf")),
        *("", "x", "a" * 5000, "\x00", "\ud800", "../../etc/passwd", "1e5", "nan", "\n\r\u2028"),
        *([], {}, [[]], [None], {"": None}, [0.0] * 2, [1e300] * 3, [[0, 0]] * 3),
    ]
    return copy.deepcopy(kinds[rng.integers(0, len(kinds))])


def places_of(value, found=None, parent=None, key=None):
    """Return all places in plain data, as (container, key)."""
    found = [] if found is None else found
    if parent is not None:
        found.append((parent, key))
    inner = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for name, each in inner:
        places_of(each, found, value, name)
    return found


def mutated_value(value, rng):
    """Return plain data with one to three places changed."""
    value = copy.deepcopy(value)
    for _ in range(rng.integers(1, 4)):
        places = places_of(value)
        if not places:
            return strange(rng)
        # Deep places are far more than shallow ones: draw the first half as often as the second.
        holder, key = places[int(len(places) * rng.random() ** 2)]
        kind = rng.integers(0, 6)
        if kind == 0:
            del holder[key]
        elif kind == 1 and isinstance(holder, list):
            holder.insert(int(key), copy.deepcopy(holder[key]))
        elif kind == 1:
            holder[str(strange(rng))[:50]] = strange(rng)
        elif kind == 2 and isinstance(holder[key], int | float) and not isinstance(holder[key], bool):
            if abs(holder[key]) < 1e300:
                holder[key] = holder[key] * float(rng.choice([-1.0, 0.0, 1e-9, 1e9, 1e200, 0.999]))
        elif kind == 3:
            other, its = places[rng.integers(0, len(places))]
            if its in other if isinstance(other, dict) else its < len(other):
                holder[key] = copy.deepcopy(other[its])
        else:
            holder[key] = strange(rng)
    return value if rng.random() < 0.98 else strange(rng)


def mutated_json(value, rng):
    """Return JSON with faults: in its values, in its text, or with brackets without end."""
    kind = rng.integers(0, 20)
    if kind == 0:
        bracket = [b"[", b'{"a":'][rng.integers(0, 2)]
        return bracket * DEEP * int(rng.choice([1, 50]))
    if kind == 1:
        return b"9" * 6000
    if kind < 6:
        return mutated_bytes(json.dumps(value).encode(), rng)
    return json.dumps(mutated_value(value, rng)).encode("utf-8", "surrogatepass")


# Archives


def npy(array, version=None):
    """Return an array as .npy; objects are pickled, as an attacker would."""
    file = io.BytesIO()
    np.lib.format.write_array(file, np.asarray(array), version=version, allow_pickle=True)
    return file.getvalue()


def claimed(header, data=b""):
    """Return an .npy with a header of one's own."""
    text = header.encode("latin1") + b" " * ((-len(header) - 11) % 64) + b"\n"
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(text)) + text + data


def packed(members, how=zipfile.ZIP_DEFLATED):
    """Return a zip file of members by name."""
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", how) as archive:
        for name, data in members.items():
            archive.writestr(name, data)
    return file.getvalue()


HEADERS = (
    "{'descr': '<f8', 'fortran_order': False, 'shape': (100000000000,), }",
    "{'descr': '<f8', 'fortran_order': False, 'shape': (-1,), }",
    "{'descr': '<f8', 'fortran_order': True, 'shape': (2, 99999999999999999999), }",
    "{'descr': '<f8', 'fortran_order': False, 'shape': (400000000,), }",
    "{'descr': [('a', '<f8'), ('b', 'O')], 'fortran_order': False, 'shape': (2,), }",
    "{'descr': '|O', 'fortran_order': False, 'shape': (1,), }",
    "{'descr': '<M8[s]', 'fortran_order': False, 'shape': (), }",
    "{'descr': ('<f8', (1000000, 1000000)), 'fortran_order': False, 'shape': (), }",
    "{'descr': '<U0', 'fortran_order': False, 'shape': (1000000000000,), }",
    "__import__('os').system('true')",
    "(" * 5000,
    "{" + "'a':[" * 900,
    "",
)


def strange_array(array, rng):
    """Return an .npy that is not what it should be."""
    array, kind = np.asarray(array), rng.integers(0, 12)
    if kind == 0:
        return claimed(HEADERS[rng.integers(0, len(HEADERS))], rng.bytes(64))
    if kind == 1:
        return npy(np.array([strange(rng), {}], dtype=object))
    if kind == 2:
        return mutated_bytes(npy(array), rng)
    if kind == 3:
        return b""
    if kind == 4:
        return npy(array.astype(str))
    if kind == 5:
        return npy(array.reshape(-1)[: int(rng.integers(0, array.size + 1))])
    if kind == 6:
        return npy(np.zeros((0, *array.shape[1:])))
    if kind == 7:
        return npy(array[None])
    if array.dtype.kind not in "fiu":
        return npy(np.array(str(array)[: int(rng.integers(0, 2000))]))
    if kind == 8:
        return npy(array.astype([np.float16, np.int8, np.complex128, bool, np.float32][rng.integers(0, 5)]))
    values = array.astype(np.float64)
    if values.size:
        with np.errstate(over="ignore", invalid="ignore"):
            if kind == 9:
                values.reshape(-1)[rng.integers(0, values.size)] = rng.choice(
                    [np.nan, np.inf, -1e308, 1e308, 1e-320, 0.0, 1e9, -1e9, 3.0]
                )
            elif kind == 10:
                values *= rng.choice([-1.0, 0.0, 1e-300, 1e-9, 1e9, 1e200])
            else:
                values += rng.normal(size=values.shape) * rng.choice([1e-12, 1e-3, 10.0, 1e6])
    return npy(values)


def mutated_archive(members, rng, bomb=None):
    """Return a zip file of .npy members (arrays by name, or bytes) with faults."""
    data = {f"{name}.npy": npy(array) for name, array in members.items()}
    kind = rng.integers(0, 14)
    names = list(members)
    if kind < 6:
        for name in rng.choice(names, size=min(len(names), int(rng.integers(1, 3))), replace=False):
            data[f"{name}.npy"] = strange_array(members[name], rng)
    elif kind == 6:
        del data[f"{names[rng.integers(0, len(names))]}.npy"]
    elif kind == 7:
        data[["extra.npy", "../up.npy", "/abs.npy", "extra", "a" * 3000][rng.integers(0, 5)]] = npy(
            np.zeros(3)
        )
    elif kind == 8 and bomb is not None:
        return bomb
    elif kind == 9:
        how = [zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA, zipfile.ZIP_STORED][rng.integers(0, 3)]
        return packed(data, how)
    whole = packed(data, zipfile.ZIP_STORED if rng.random() < 0.3 else zipfile.ZIP_DEFLATED)
    if kind in (10, 11):
        return mutated_bytes(whole, rng)
    if kind == 12:  # a header that says another size, packing or flag
        whole, place = bytearray(whole), whole.find(b"PK\x01\x02") + int(rng.integers(4, 46))
        whole[place] = int(rng.integers(0, 256))
        return bytes(whole)
    if kind == 13:
        files = {"a": b"", "dir/": b""} | {f"{k}.npy": b"" for k in range(int(rng.choice([3, 2000])))}
        return packed(files, zipfile.ZIP_STORED)
    return whole


def bomb_of(name, mebibytes=300):
    """Return an archive of a few hundred kilobytes that claims, truly, to hold very many zeros."""
    file, block = io.BytesIO(), bytes(2**20)
    with (
        zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive,
        archive.open(f"{name}.npy", "w", force_zip64=True) as member,
    ):
        size = mebibytes * 2**17
        member.write(claimed(f"{{'descr': '<f8', 'fortran_order': False, 'shape': ({size},), }}"))
        for _ in range(mebibytes):
            member.write(block)
    return file.getvalue()
