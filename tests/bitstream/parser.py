#!/usr/bin/env python3
"""A minimal parser of .tetv streams, written from docs/format.md alone and sharing nothing with the crate.

    parser.py STREAM...    one line a packet: frame, numbers of vertices, wedges and tets, duration, checksum of what is new

It is made to be read beside the specification and to agree with it, not to be fast or to survive damage.
"""

import struct
import sys
import zlib
from collections import deque
from math import floor, sqrt

FAR_EXTENT = 1 << 19
SCAN = 24
FACES = ((1, 2, 3), (0, 3, 2), (0, 1, 3), (0, 2, 1))


def log2(value):
    """floor(log2) of a positive integer."""
    return value.bit_length() - 1


# Section 3: entropy coding


class Bit:
    """A model of a decision."""

    def __init__(self):
        self.average = 1 << 21
        self.seen = 0


class RangeDecoder:
    def __init__(self, payload):
        self.payload = payload
        self.at = 0
        self.range = 0xFFFFFFFF
        self.code = 0
        for _ in range(4):
            self.shift()

    def shift(self):
        byte = self.payload[self.at] if self.at < len(self.payload) else 0
        self.at += 1
        self.code = (self.code << 8 | byte) & 0xFFFFFFFF

    def normalize(self):
        while self.range < 1 << 24:
            self.range <<= 8
            self.shift()

    def bit(self, model):
        p = max(32, min(65504, model.average >> 6))
        bound = self.range * p >> 16
        bit = self.code < bound
        rate = 131072 // (2 * model.seen + 3)
        if bit:
            self.range = bound
            model.average += ((1 << 22) - model.average) * rate >> 16
        else:
            self.code -= bound
            self.range -= bound
            model.average -= model.average * rate >> 16
        model.seen = min(model.seen + 1, 255)
        self.normalize()
        return int(bit)

    def raw(self, count):
        value = 0
        for _ in range(count):
            self.range >>= 1
            bit = self.code < self.range
            if not bit:
                self.code -= self.range
            value = value << 1 | bit
            self.normalize()
        return value

    def check_end(self):
        assert len(self.payload) <= self.at <= len(self.payload) + 4, "payload read to its end and not beyond"


class Models:
    """Models by name and indices, made when they are first used."""

    def __init__(self):
        self.bits = {}

    def of(self, *name):
        if name not in self.bits:
            self.bits[name] = Bit()
        return self.bits[name]


class Coder:
    """Numbers under models (section 3)."""

    def __init__(self, decoder, models):
        self.decoder = decoder
        self.models = models

    def bit(self, *name):
        return self.decoder.bit(self.models.of(*name))

    def uint(self, *name):
        e = 0
        while e < 30 and self.bit(*name, "more", min(e, 19)):
            e += 1
        number = 1
        for _ in range(min(e, 2)):
            number = 2 * number + self.bit(*name, "mantissa", min(e, 19), number)
        rest = e - min(e, 2)
        return (number << rest | self.decoder.raw(rest)) - 1

    def int(self, *name):
        if self.bit(*name, "zero"):
            return 0
        negative = self.bit(*name, "negative")
        magnitude = self.uint(*name) + 1
        return -magnitude if negative else magnitude


# Geometry


def sub(a, b):
    return tuple(p - q for p, q in zip(a, b))


def cross(u, v):
    return (u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0])


def dot(u, v):
    return u[0] * v[0] + u[1] * v[1] + u[2] * v[2]


def volume6(a, b, c, d):
    return dot(cross(sub(b, a), sub(c, a)), sub(d, a))


def unit_normal(a, b, c, e):
    n = cross(tuple(map(float, sub(b, a))), tuple(map(float, sub(c, a))))
    n = tuple(component * scale for component, scale in zip(n, e))
    length = sqrt(dot(n, n))
    return tuple(component / length for component in n)


class Face:
    def __init__(self, corners, tet, normal):
        self.corners = corners
        self.tet = tet
        self.normal = normal


class Slope:
    def __init__(self):
        self.p, self.q = 0, 64

    def at(self, f):
        return (2 * self.p * f + self.q) // (2 * self.q)

    def learn(self, f, r):
        f, r = max(-255, min(255, f)), max(-255, min(255, r))
        self.p += f * r - self.p // 1024
        self.q += f * f - self.q // 1024


class Slab:
    def __init__(self, header, step, size):
        self.header, self.step, self.size = header, step, size
        self.unit = 1 << header["subpixel_bits"]
        self.duration = None
        self.models = Models()
        self.packets = 0
        # Mesh
        self.positions, self.pinned, self.extents = [], [], []
        self.wedges, self.colors, self.misses = [], [], []
        self.tets, self.tet_wedges, self.tet_labels = [], [], []
        self.labels = 0
        # Per vertex: open faces, tets and wedges, oldest first
        self.open, self.stars, self.wedges_at = [], [], []
        self.by_corners = {}
        # Hops
        self.hops = []
        self.rings = 2 if header["levels"] else 0
        self.queues = tuple(deque() for _ in range(self.rings + 1))
        self.passed_on = {}
        self.slopes = {name: Slope() for name in ("rg", "bg", "br")}

    # Section 5: order

    def parse_payload(self, payload, last):
        self.coder = Coder(RangeDecoder(payload), self.models)
        self.low = None if last else (self.packets + 1) * self.unit
        newly_low = [v for v in range(len(self.positions)) if self.is_low(v) and self.hops[v] > 0]
        for v in sorted(newly_low, key=lambda v: (self.positions[v][2] // self.unit, v)):
            self.lower(v, 0)
        while True:
            while (found := self.next_vertex()) is not None:
                v, hop = found
                while self.open[v]:
                    self.close_gate(v)
                self.pass_hop_on(v, hop)
            if not self.coder.bit("seed"):
                break
            self.parse_seed()
        for wedge in range(len(self.colors), len(self.wedges)):
            self.parse_color(wedge)
        self.coder.decoder.check_end()
        self.packets += 1

    def is_low(self, v):
        return self.low is None or self.positions[v][2] < self.low

    def lower(self, v, hop):
        if hop <= self.rings and hop < self.hops[v]:
            self.hops[v] = hop
            self.queues[hop].append(v)

    def next_vertex(self):
        for hop, queue in enumerate(self.queues):
            while queue:
                v = queue.popleft()
                if self.hops[v] == hop:
                    return v, hop
        return None

    def pass_hop_on(self, v, hop):
        if hop == self.rings:
            return
        told, count = self.passed_on.get(v, (None, 0))
        start = count if told == hop else 0
        for tet in reversed(self.stars[v][start:]):
            for corner in self.tets[tet]:
                self.lower(corner, hop + 1)
        self.passed_on[v] = (hop, len(self.stars[v]))

    def far(self):
        width, height = self.header["width"], self.header["height"]
        top = FAR_EXTENT if self.duration is None else self.duration * self.unit
        return (width * self.unit, height * self.unit, top)

    def parse_seed(self):
        corners = []
        for _ in range(4):
            if self.coder.bit("seed known"):
                corners.append(self.coder.decoder.raw(len(self.positions).bit_length()))
            else:
                position = tuple(self.coder.decoder.raw(side.bit_length()) for side in self.far())
                corners.append(self.push_vertex(position))
        self.attach(tuple(corners), None)
        for v in corners:
            if self.hops[v] <= self.rings:
                self.queues[self.hops[v]].append(v)

    def push_vertex(self, position):
        assert all(0 <= p <= side for p, side in zip(position, self.far())), "inside the box"
        v = len(self.positions)
        self.positions.append(position)
        self.pinned.append(self.coder.bit("pinned"))
        self.extents.append((0, 0, 0))
        for lists in (self.open, self.stars, self.wedges_at):
            lists.append([])
        self.hops.append(9)
        if self.is_low(v):
            self.lower(v, 0)
        return v

    def is_walled(self, corners):
        far = self.far()
        at = [self.positions[v] for v in corners]
        sides = [(axis, 0) for axis in range(3)] + [(0, far[0]), (1, far[1])]
        if self.duration is not None:
            sides.append((2, far[2]))
        return any(all(p[axis] == side for p in at) for axis, side in sides)

    # Section 4: extents

    def extent(self, corners):
        return tuple(max(48, sum(self.extents[v][axis] for v in corners)) for axis in range(3))

    def learn_extents(self, corners):
        at = [self.positions[v] for v in corners]
        for v, own in zip(corners, at):
            here = tuple(16 * sum(abs(p[axis] - own[axis]) for p in at) // 3 for axis in range(3))
            old = self.extents[v]
            self.extents[v] = here if old == (0, 0, 0) else tuple(o + (h - o) // 4 for o, h in zip(old, here))

    # Section 6: gate and apex

    def fan(self, v):
        faces = []
        for face in reversed(self.open[v][-SCAN:]):
            turn = face.corners.index(v)
            faces.append((face, face.corners[turn:] + face.corners[:turn]))
        return faces

    def is_positive(self, gate, apex):
        return volume6(*(self.positions[v] for v in gate), self.positions[apex]) > 0

    def close_gate(self, v):
        fan = self.fan(v)

        def next_of(corners):
            return next((found for found in fan if found[1][1] == corners[2]), None)

        def cosine(face, other):
            return -dot(face.normal, other.normal)

        best, best_cos = fan[0], -2.0
        for face, corners in fan:
            following = next_of(corners)
            if following is not None:
                cos = cosine(face, following[0])
                if cos > best_cos and self.is_positive(corners, following[1][2]):
                    best, best_cos = (face, corners), cos
        gate, corners = best
        if self.is_walled(corners):
            self.take_out(gate)
            return
        across = [None, None, self.across_third_edge(corners)]
        if (found := next_of(corners)) is not None:
            across[0] = (found[1][2], found[0])
        if (found := next((f for f in fan if f[1][2] == corners[1]), None)) is not None:
            across[1] = (found[1][1], found[0])
        candidates = []
        for vertex, face in filter(None, across):
            if not self.is_positive(corners, vertex):
                continue
            same = next((c for c in candidates if c[0] == vertex), None)
            if same:
                same[1] += 1
                same[2] = max(same[2], cosine(gate, face))
            else:
                candidates.append([vertex, 1, cosine(gate, face)])
        candidates.sort(key=lambda c: (-c[1], -c[2]))
        apex = self.parse_apex(gate, corners, candidates)
        if apex == "new":
            apex = self.push_vertex(self.parse_position(gate, corners, [found and found[0] for found in across]))
        if apex is None:
            self.take_out(gate)
        else:
            self.attach(corners + (apex,), gate)

    def across_third_edge(self, corners):
        _, second, third = corners
        from_second = len(self.open[second]) <= len(self.open[third])
        for face, (_, after, before) in self.fan(second if from_second else third):
            # The face has the edge the other way: from third to second.
            if from_second and before == third:
                return after, face
            if not from_second and after == second:
                return before, face
        return None

    def distance2(self, corners, vertex):
        a, b, c = (self.positions[v] for v in corners)
        p = self.positions[vertex]
        extent = self.extent(corners)
        d = tuple(float(3 * p[i] - (a[i] + b[i] + c[i])) / float(extent[i]) for i in range(3))
        return 256.0 * dot(d, d)

    def parse_apex(self, gate, corners, candidates):
        first = (0, 0)
        for place, (vertex, edges, cos) in enumerate(candidates):
            distance = self.distance2(corners, vertex)
            classes = (
                min(floor((cos + 1.0) * 8.0), 15),
                sum(distance > limit for limit in (0.75, 1.25, 1.75, 2.75, 4.0, 6.0, 9.0)),
            )
            if self.coder.bit("join", place, edges - 1, *classes):
                return vertex
            if place == 0:
                first = classes
        if self.coder.bit("new", len(candidates), *first):
            return "new"
        known = {c[0] for c in candidates}
        near = self.ring(corners)
        far = self.ring(near) - near
        if rank := self.coder.uint("near"):
            return self.ranked(corners, near - known)[rank - 1]
        if self.coder.bit("nothing"):
            if self.coder.bit("top"):
                self.end_at(self.positions[corners[0]][2] // self.unit)
            return None
        if rank := self.coder.uint("far"):
            return self.ranked(corners, far - known)[rank - 1]
        return self.coder.decoder.raw(len(self.positions).bit_length())

    def ring(self, vertices):
        return {corner for v in vertices for _, corners in self.fan(v) for corner in corners[1:]}

    def ranked(self, corners, vertices):
        positive = [v for v in vertices if self.is_positive(corners, v)]
        return sorted(positive, key=lambda v: (self.distance2(corners, v), v))

    def end_at(self, duration):
        assert self.duration in (None, duration), "the duration is known once"
        self.duration = duration

    # Section 7: tets

    def attach(self, corners, gate):
        assert volume6(*(self.positions[v] for v in corners)) > 0, "positive volume"
        tet = len(self.tets)
        facing = [self.by_corners.get(self.key(tuple(reversed([corners[i] for i in face])))) for face in FACES]
        if gate is not None:
            facing[3] = gate
        label = self.parse_label(corners, gate, facing)
        wedges = []
        for v in corners:
            wedge = next((w for w in self.wedges_at[v] if self.wedges[w][1] == label), None)
            if wedge is None:
                wedge = len(self.wedges)
                self.wedges.append((v, label))
                self.wedges_at[v].append(wedge)
            wedges.append(wedge)
        self.tets.append(corners)
        self.tet_wedges.append(wedges)
        self.tet_labels.append(label)
        for v in corners:
            self.stars[v].append(tet)
        self.learn_extents(corners)
        for face, closed in zip(FACES, facing):
            face = tuple(corners[i] for i in face)
            if closed is not None:
                self.take_out(closed)
            elif not self.is_walled(face):
                scale = tuple(float(e) / 48.0 for e in self.extent(face))
                added = Face(face, tet, unit_normal(*(self.positions[v] for v in face), scale))
                assert self.key(face) not in self.by_corners, "one open face with these corners"
                self.by_corners[self.key(face)] = added
                for v in face:
                    self.open[v].append(added)

    @staticmethod
    def key(corners):
        turn = corners.index(min(corners))
        return corners[turn:] + corners[:turn]

    def take_out(self, face):
        del self.by_corners[self.key(face.corners)]
        for v in face.corners:
            self.open[v].remove(face)

    def parse_label(self, corners, gate, facing):
        before, agree, differ = None, 0, 0
        if gate is not None:
            before = self.tet_labels[gate.tet]
        for face in facing:
            if face is not None and face is not gate:
                if self.tet_labels[face.tet] == before:
                    agree = min(agree + 1, 3)
                else:
                    differ = min(differ + 1, 3)
        youngest = [[self.wedges[w][1] for w in self.wedges_at[v][-8:]] for v in corners]
        if gate is not None:
            boundary = sum(len(labels) > 1 for labels in youngest[:3])
            if self.coder.bit("same", boundary, agree, differ):
                return before
        counts = {}
        for labels in youngest:
            for label in labels:
                if label != before:
                    counts[label] = counts.get(label, 0) + 1
        for place, label in enumerate(sorted(counts, key=lambda label: (-counts[label], label))):
            if self.coder.bit("candidate", min(place, 5)):
                return label
        if self.labels and not self.coder.bit("new label"):
            return self.labels - 1 - self.coder.uint("label")
        self.labels += 1
        return self.labels - 1

    def parse_color(self, wedge):
        around = []
        for tet in reversed(self.stars[self.wedges[wedge][0]][-256:]):
            if wedge in self.tet_wedges[tet]:
                around += [w for w in self.tet_wedges[tet] if w < wedge]
        known = [(self.colors[w], self.misses[w]) for w in around]
        if not known and wedge:
            known = [(self.colors[wedge - 1], (0, 0))]
        n = len(known)
        channels = [[(g, r - g, b - g)[i] for (r, g, b), _ in known] for i in range(3)]
        sums = [sum(values) for values in channels]
        variance = [n * sum(x * x for x in values) - s * s for values, s in zip(channels, sums)]
        step = self.step_of(self.wedges[wedge][0])
        prediction = [(2 * s + n * step) // (2 * n * step) if n else 0 for s in sums]
        missed = [sum(misses[i] for _, misses in known) for i in range(2)]

        def class_of(v, m):
            return 16 + n if n < 2 else min(15, log2(4 * (v + m * m) // (n * n * step * step) + 1))

        a, c = class_of(variance[0], missed[0]), class_of(variance[1] + variance[2], missed[1])
        rg, bg, br = (self.slopes[name] for name in ("rg", "bg", "br"))
        green = self.coder.int("green", a)
        context = log2(min(abs(green), 7) + 1)
        along = rg.at(green)
        red = self.coder.int("red", c, context)
        rg.learn(green, along + red)
        along2, along3 = br.at(red), bg.at(green)
        blue = self.coder.int("blue", c, context)
        bg.learn(green, along3 + along2 + blue)
        br.learn(red, along2 + blue)
        g = prediction[0] + green
        color = (g + prediction[1] + along + red, g, g + prediction[2] + along3 + along2 + blue)
        self.colors.append(tuple(channel * step for channel in color))
        self.misses.append((min(abs(green) * step, 65535), min((abs(red) + abs(blue)) * step, 65535)))

    def step_of(self, vertex):
        x, y, t = (max(extent, 1) for extent in self.extents[vertex])
        octaves = (self.size - log2(x * y * t)) // 2
        return self.step << min(max(octaves, -3), 2) + 3

    # Section 8: vertices

    def parse_position(self, gate, corners, across):
        a, b, c = points = [self.positions[v] for v in corners]
        e = self.positions[next(v for v in self.tets[gate.tet] if v not in corners)]
        extent = tuple(float(x) / 48.0 for x in self.extent(corners))
        n = unit_normal(a, b, c, extent)
        predicted = []
        for i in range(3):
            s = a[i] + b[i] + c[i]
            ahead = 3 * (6 * b[i] - 3 * a[i] - e[i]) - 2 * s
            for weight, vertex in zip((4, 2, 1), across):
                if vertex is not None:
                    ahead += weight * (3 * self.positions[vertex][i] - s)
            predicted.append(floor(((s / 3.0 + ahead / 48.0) + (0.625 * extent[i]) * n[i]) + 0.5))
        last = max(range(3), key=lambda i: abs(n[i]))
        position = [None, None, None]
        for axis in [i for i in range(3) if i != last] + [last]:
            side = self.parse_side(axis, points, predicted[axis], extent[axis])
            if side is not None:
                position[axis] = side
            elif axis != last:
                position[axis] = predicted[axis] + self.coder.int("free", axis, scale_class(extent[axis]))
            else:
                position[axis] = self.parse_height(points, position, axis, (predicted[axis], extent[axis], n[axis]))
        return tuple(position)

    def parse_side(self, axis, points, predicted, extent):
        high = self.far()[axis] if axis < 2 or self.duration is not None else None
        for side, place in enumerate((0, high)):
            if place is None:
                continue
            beyond = predicted if side == 0 else high - predicted
            nearness = 0 if beyond <= 0 else 1 if beyond <= extent else 2
            if self.coder.bit("on side", axis, side, sum(p[axis] == place for p in points), nearness):
                return place
        return None

    def parse_height(self, points, position, axis, expectation):
        predicted, extent, n = expectation
        a, b, c = points
        plane = cross(sub(b, a), sub(c, a))
        direction = 1 if n > 0 else -1
        rest = sum(plane[i] * (position[i] - a[i]) for i in range(3) if i != axis)
        # The first with plane * (coordinate - a) > -rest.
        nearest = a[axis] + direction * (-rest // abs(plane[axis]) + 1)
        w = extent / abs(n)
        m = floor(max(0.0, min(4.0, (predicted - nearest) * direction / w * 4.0)))
        return nearest + direction * self.coder.uint("height", axis, scale_class(w), m)


def scale_class(length):
    return min(39, log2(floor(max(1.0, length * length))))


# Sections 1 and 2: packets


def parse_header(data):
    fields = []
    at = 0

    def varint():
        nonlocal at
        first = data[at]
        size = {251: 2, 252: 4, 253: 8}.get(first)
        at += 1
        if size is None:
            return first
        at += size
        return int.from_bytes(data[at - size : at], "little")

    for name in ("width", "height", "rate", "rate_base", "aspect", "aspect_base"):
        fields.append((name, varint()))
    for name in ("subpixel_bits", "levels"):
        fields.append((name, data[at]))
        at += 1
    assert at == len(data), "the header ends where its length says"
    return dict(fields)


def packets(stream):
    at = 0
    while at < len(stream):
        keyframe = stream[at : at + 8] == b"\x89TETV\r\n\x03"
        assert keyframe or stream[at : at + 4] == b"\x89TVP", "a start code of version 3"
        start = at + (8 if keyframe else 4)
        flags, length, frame, check = struct.unpack_from("<BIQH", stream, start)
        packet = stream[at : at + length]
        body = start + 15 - at
        assert zlib.crc32(packet[: body - 2]) & 0xFFFF == check, "the header check"
        assert zlib.crc32(packet[:-4]) == struct.unpack("<I", packet[-4:])[0], "the CRC"
        yield flags, frame, packet[body:-4]
        at += length


def parse(stream):
    slab = None
    for flags, frame, body in packets(stream):
        if flags & 4:
            continue
        if flags & 1:
            (length,) = struct.unpack_from("<H", body)
            step, size = body[2 + length : 4 + length]
            assert 1 <= step <= 128 and size <= 69, "colour steps in range"
            slab = Slab(parse_header(body[2 : 2 + length]), step, size)
            body = body[4 + length :]
        if flags & 2:
            slab.end_at(struct.unpack_from("<I", body)[0])
            body = body[4:]
        before = (len(slab.positions), len(slab.wedges), len(slab.tets))
        slab.parse_payload(body, bool(flags & 2))
        yield frame, slab, before


def checksum(slab, before):
    """CRC-32 of what a packet brought: little-endian 32-bit integers."""
    new = b""
    for position, pinned in list(zip(slab.positions, slab.pinned))[before[0] :]:
        new += struct.pack("<4i", *position, pinned)
    for (vertex, label), color in list(zip(slab.wedges, slab.colors))[before[1] :]:
        new += struct.pack("<5i", vertex, label, *color)
    for wedges in slab.tet_wedges[before[2] :]:
        new += struct.pack("<4i", *wedges)
    return zlib.crc32(new)


def main():
    for path in sys.argv[1:]:
        with open(path, "rb") as file:
            stream = file.read()
        for frame, slab, before in parse(stream):
            counts = (len(slab.positions), len(slab.wedges), len(slab.tets))
            print(frame, *counts, slab.duration or 0, f"{checksum(slab, before):08x}")


if __name__ == "__main__":
    main()
