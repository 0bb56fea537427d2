#!/usr/bin/env python3
"""A minimal parser of .tetv streams, written from docs/format.md alone and sharing nothing with the crate.

    parser.py STREAM...    one line a packet: frame, numbers of vertices, wedges and tets, duration, checksum of what is new

It is made to be read beside the specification and to agree with it, not to be fast or to survive damage.
"""

import struct
import sys
import zlib
from collections import deque
from math import floor, frexp, sqrt

FAR_EXTENT = 1 << 19
SCAN = 24
MEET_SCAN = 128
SHARP = 150
FACES = ((1, 2, 3), (0, 3, 2), (0, 1, 3), (0, 2, 1))


def f32(value):
    """A number rounded to IEEE 754 binary32: of one operation on such numbers the same as if it had been made in them."""
    return struct.unpack("f", struct.pack("f", value))[0]


def log2(value):
    """floor(log2) of a number that is at least 1."""
    return frexp(value)[1] - 1


# Section 3: entropy coding


class Bit:
    """A model of a decision."""

    def __init__(self):
        self.average = 1 << 21
        self.seen = 0


class Symbols:
    """A model of a symbol."""

    def __init__(self, weights):
        assert sum(weights) == 128
        self.below = [256 * sum(weights[:i]) for i in range(17)]
        self.seen = 0


class Decoder:
    """Decisions, symbols and raw numbers of a payload."""

    def __init__(self, payload):
        length, at = parse_varint(payload, 0)
        assert at + length <= len(payload), "raw bits within the payload"
        self.raw_bytes = payload[at : at + length]
        self.raw_bits = int.from_bytes(self.raw_bytes, "little")
        self.raw_at = 0
        self.coded = payload[at + length :]
        self.at = 0
        self.range = 0xFFFFFFFF
        self.code = 0
        for _ in range(4):
            self.shift()

    def shift(self):
        byte = self.coded[self.at] if self.at < len(self.coded) else 0
        self.at += 1
        self.code = (self.code << 8 | byte) & 0xFFFFFFFF

    def normalize(self):
        while self.range < 1 << 24:
            self.range <<= 8
            self.shift()

    def bit(self, model):
        bound = self.range * (model.average >> 6) >> 16
        bit = self.code < bound
        if bit:
            self.range = bound
        else:
            self.code -= bound
            self.range -= bound
        end = (1 << 22) - 256 if bit else 256
        model.average += (end - model.average) * (131072 // (2 * model.seen + 3)) >> 16
        model.seen = min(model.seen + 1, 255)
        self.normalize()
        return int(bit)

    def symbol(self, model):
        self.range >>= 15
        place = min(self.code // self.range, 32767)
        symbol = max(s for s in range(16) if model.below[s] <= place)
        self.code -= self.range * model.below[symbol]
        self.range *= model.below[symbol + 1] - model.below[symbol]
        rate = 65536 // (model.seen + 3)
        for s in range(1, 16):
            end = 32752 + s if s > symbol else s
            model.below[s] += (end - model.below[s]) * rate + 32768 >> 16
        model.seen = min(model.seen + 1, 253)
        self.normalize()
        return symbol

    def raw(self, count):
        value = self.raw_bits >> self.raw_at & (1 << count) - 1
        self.raw_at += count
        return value

    def check_end(self):
        assert len(self.coded) <= self.at <= len(self.coded) + 4, "coded bytes read to their end and not beyond"
        assert (self.raw_at + 7) // 8 == len(self.raw_bytes), "raw bits read to their end and not beyond"


class Models:
    """Models by name and indices, made when they are first used."""

    def __init__(self):
        self.models = {}

    def of(self, make, *name):
        if name not in self.models:
            self.models[name] = make()
        return self.models[name]


SMALL = (24, 20, 16, 13, 11, 9, 7, 6, 5, 4, 3, 3, 2, 2, 1, 2)
SIGNED = (1, 1, 2, 3, 5, 9, 14, 19, 21, 18, 13, 9, 6, 3, 2, 2)
RESIDUAL = (18, 12, 12, 9, 9, 8, 8, 8, 8, 8, 8, 6, 6, 3, 3, 2)
CLASSES = ((1, 0), (2, 0), (3, 0), (4, 1), (6, 2), (10, 3), (18, 4))


class Coder:
    """Numbers under models (section 3)."""

    def __init__(self, decoder, models):
        self.decoder = decoder
        self.models = models

    def bit(self, *name):
        return self.decoder.bit(self.models.of(Bit, *name))

    def symbol(self, weights, *name):
        return self.decoder.symbol(self.models.of(lambda: Symbols(weights), *name))

    def uint(self, *name):
        e = 0
        while e < 30 and self.bit(*name, "more", min(e, 19)):
            e += 1
        number = 1
        for _ in range(min(e, 2)):
            number = 2 * number + self.bit(*name, "mantissa", min(e, 19), number)
        rest = e - min(e, 2)
        return (number << rest | self.decoder.raw(rest)) - 1

    def small(self, escape, *name):
        symbol = self.symbol(SMALL, *name)
        return symbol if symbol < 15 else 15 + self.uint(*escape)

    def signed(self, escape, *name):
        symbol = self.symbol(SIGNED, *name)
        if symbol == 0:
            return -8 - self.uint(*escape)
        return symbol - 8 if symbol < 15 else 7 + self.uint(*escape)

    def residual(self, escape, *name):
        symbol = self.symbol(RESIDUAL, *name)
        if symbol == 0:
            return 0
        if symbol == 15:
            negative = self.decoder.raw(1)
            magnitude = 34 + self.uint(*escape)
        else:
            negative = symbol % 2 == 0
            least, digits = CLASSES[(symbol - 1) // 2]
            magnitude = least + self.decoder.raw(digits)
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


def dot32(u, v):
    return f32(f32(f32(u[0] * v[0]) + f32(u[1] * v[1])) + f32(u[2] * v[2]))


def cross32(u, v):
    return tuple(f32(f32(u[i] * v[j]) - f32(v[i] * u[j])) for i, j in ((1, 2), (2, 0), (0, 1)))


def unit_normal(plane, extent):
    n = tuple(f32(f32(p) * e) for p, e in zip(plane, extent))
    length = max(f32(sqrt(dot32(n, n))), 1.0)
    return tuple(f32(component / length) for component in n)


class Face:
    def __init__(self, corners, tet, normal):
        self.corners = corners
        self.tet = tet
        self.normal = normal
        self.across = [None] * 3
        self.wide = [False] * 3

    def place(self, vertex):
        return self.corners.index(vertex)


class Edge:
    """A corner of an open face, and the edge from it to the next."""

    def __init__(self, face, place):
        self.face, self.at = face, place % 3

    def __eq__(self, other):
        return other is not None and self.face is other.face and self.at == other.at

    @property
    def vertex(self):
        return self.face.corners[self.at]

    @property
    def next(self):
        return Edge(self.face, self.at + 1)

    @property
    def previous(self):
        return Edge(self.face, self.at + 2)

    @property
    def partner(self):
        return self.face.across[self.at]

    @property
    def corners(self):
        return self.vertex, self.next.vertex, self.previous.vertex

    @property
    def vertex_across(self):
        return self.partner and self.partner.previous.vertex


def pair(one, other, wide=False):
    for edge, partner in ((one, other), (other, one)):
        if edge is not None:
            edge.face.across[edge.at] = partner
            edge.face.wide[edge.at] = wide


class Slope:
    def __init__(self):
        self.p, self.q = 0, 64

    def at(self, f):
        return floor(f32(f32(f32(self.p * f32(f)) / f32(self.q)) + 0.5))

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
        self.neighbours = {}
        # Hops
        self.hops = []
        self.rings = 2 if header["levels"] else 0
        self.queues = tuple(deque() for _ in range(self.rings + 1))
        self.passed_on = {}
        self.slopes = {name: Slope() for name in ("rg", "bg", "br")}

    # Section 5: order

    def parse_payload(self, payload, last):
        self.coder = Coder(Decoder(payload), self.models)
        self.low = None if last else (self.packets + 1) * self.unit
        newly_low = [v for v in range(len(self.positions)) if self.is_low(v) and self.hops[v] > 0]
        for v in sorted(newly_low, key=lambda v: (self.place(v), v)):
            self.lower(v, 0)
        self.uniform = self.coder.bit("uniform")
        self.pins = self.coder.bit("pins")
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
        self.neighbours = {}
        self.coder.decoder.check_end()
        self.packets += 1

    def place(self, v):
        x, y = (min(65535, self.positions[v][axis] // self.unit // 8) for axis in range(2))
        return sum((x >> bit & 1) << 2 * bit | (y >> bit & 1) << 2 * bit + 1 for bit in range(16))

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
        self.attach(tuple(corners), None, None)
        for v in corners:
            if self.hops[v] <= self.rings:
                self.queues[self.hops[v]].append(v)

    def push_vertex(self, position):
        assert all(0 <= p <= side for p, side in zip(position, self.far())), "inside the box"
        v = len(self.positions)
        self.positions.append(position)
        self.pinned.append(self.coder.bit("pinned") if self.pins else 0)
        self.extents.append((0.0, 0.0, 0.0))
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
        a, b, c = (self.extents[v] for v in corners)
        return tuple(max(3.0, f32(f32(a[axis] + b[axis]) + c[axis])) for axis in range(3))

    def learn_extents(self, corners):
        at = [self.positions[v] for v in corners]
        edges = [tuple(float(abs(p - q)) for p, q in zip(at[3], own)) for own in at[:3]]
        for v, here in zip(corners, edges):
            old = self.extents[v]
            if any(old):
                self.extents[v] = tuple(f32(o + f32(f32(h - o) * 0.125)) for o, h in zip(old, here))
            else:
                self.extents[v] = here
        if not any(self.extents[corners[3]]):
            sums = [f32(f32(a + b) + c) for a, b, c in zip(*edges)]
            self.extents[corners[3]] = tuple(f32(s / 3.0) for s in sums)

    # Section 6: gate and apex

    def corners_at(self, v, scan=SCAN):
        return [Edge(face, face.place(v)) for face in reversed(self.open[v][-scan:])]

    def is_positive(self, gate, apex):
        a, b, c = (self.positions[v] for v in gate)
        plane = cross32(sub(b, a), sub(c, a))
        return dot32(plane, sub(self.positions[apex], a)) > 0.0

    def sharpness(self, edge):
        if edge.partner is None or edge.face.wide[edge.at]:
            return 0
        n, m = edge.face.normal, edge.partner.face.normal
        along = sub(self.positions[edge.partner.vertex], self.positions[edge.vertex])
        if not dot32(cross32(n, m), along) < 0.0:
            return 0
        return 1 + min(253, floor(max(0.0, f32(f32(1.0 - dot32(n, m)) * 126.5))))

    def choose_gate(self, v):
        corners = self.corners_at(v)
        best, sharpest = corners[0], 0
        for corner in corners:
            sharpness = self.sharpness(corner.previous)
            if sharpness > sharpest:
                best, sharpest = corner, sharpness
            if sharpest >= SHARP:
                break
        return best

    def close_gate(self, v):
        gate = self.choose_gate(v)
        corners = gate.corners
        if self.is_walled(corners):
            self.give_up(gate.face)
            return
        edges = (gate.previous, gate, gate.next)
        apex = self.parse_apex(corners, edges)
        if apex is None:
            self.give_up(gate.face)
            return
        met = None
        if apex == "new":
            apex = self.push_vertex(self.parse_position(gate.face, corners, [edge.vertex_across for edge in edges]))
        else:
            met = self.meet(gate, corners + (apex,))
        self.attach(corners + (apex,), gate, met)

    def distance2(self, corners, vertex):
        a, b, c = (self.positions[v] for v in corners)
        p = self.positions[vertex]
        inverse = tuple(f32(1.0 / e) for e in self.extent(corners))
        d = tuple(f32(float(3 * p[i] - (a[i] + b[i] + c[i])) * inverse[i]) for i in range(3))
        return dot32(d, d)

    def parse_apex(self, corners, edges):
        across = [edge.vertex_across for edge in edges]
        first, count = (0, 0), 0
        for i, edge in enumerate(edges):
            if across[i] is None or across[i] in across[:i] or not (sharpness := self.sharpness(edge)):
                continue
            distance = self.distance2(corners, across[i])
            classes = (sharpness // 16, sum(distance >= limit for limit in (1, 1.5, 2, 3, 4, 6, 8)))
            if self.coder.bit("join", count, across[i + 1 :].count(across[i]), *classes):
                return across[i]
            if count == 0:
                first = classes
            count += 1
        if self.coder.bit("new", count, *first):
            return "new"
        asked = {v for v, edge in zip(across, edges) if v is not None and self.sharpness(edge)}
        asked.update(corners)
        near = self.ring(corners)
        if rank := self.coder.uint("near"):
            return self.ranked(corners, near - asked)[rank - 1]
        if self.coder.bit("nothing"):
            if self.coder.bit("top"):
                self.end_at(self.positions[corners[0]][2] // self.unit)
            return None
        if rank := self.coder.uint("far"):
            far = self.ring(near) - set(self.ranked(corners, near))
            return self.ranked(corners, far - asked)[rank - 1]
        return self.coder.decoder.raw(len(self.positions).bit_length())

    def ring(self, vertices):
        corners = [corner for v in vertices for corner in self.corners_at(v)]
        seconds = {corner.next.vertex for corner in corners}
        return seconds | {corner.previous.vertex for corner in corners if corner.previous.partner is None}

    def ranked(self, corners, vertices):
        positive = [v for v in vertices if self.is_positive(corners, v)]
        return sorted(positive, key=lambda v: (self.distance2(corners, v), v))

    def end_at(self, duration):
        assert self.duration in (None, duration), "the duration is known once"
        self.duration = duration

    # Section 7: tets

    def attach(self, corners, gate, met):
        assert volume6(*(self.positions[v] for v in corners)) > 0, "positive volume"
        closed, is_there, spokes = met or ([None] * 3, [False] * 3, [None] * 3)
        tet = len(self.tets)
        before = gate and self.tet_labels[gate.face.tet]
        label = self.parse_label(corners, before, closed)
        wedges = []
        for v in corners:
            wedge = next((w for w in self.wedges_at[v] if self.wedges[w][1] == label), None)
            if wedge is None:
                wedge = len(self.wedges)
                self.wedges.append((v, label))
                self.wedges_at[v].append(wedge)
            wedges.append(wedge)
        self.note_neighbours(wedges, label, [c and self.tet_labels[c.face.tet] for c in closed] + [before])
        self.tets.append(corners)
        self.tet_wedges.append(wedges)
        self.tet_labels.append(label)
        for v in corners:
            self.stars[v].append(tet)
        self.learn_extents(corners)
        if gate is None:
            gate = self.sow(corners[:3], tet)
        self.cover(corners, gate, tet, (closed, is_there, spokes))

    def note_neighbours(self, wedges, label, labels):
        # Faces 0 to 2, and the gate, opposite corner 3.
        for i in range(4):
            for j in range(i):
                if not any(known == label for face, known in enumerate(labels) if face not in (i, j)):
                    older, younger = sorted((wedges[i], wedges[j]))
                    if younger >= len(self.colors):
                        self.neighbours.setdefault(younger, []).append(older)

    # Section 4: the front moves over a tet

    def meet(self, gate, corners):
        apex = corners[3]
        closed, is_there, spokes = [None] * 3, [False] * 3, [None] * 3
        far = []
        for face, edge in enumerate((gate.next, gate.previous, gate)):
            if edge.vertex_across == apex:
                closed[face] = edge.partner.previous
                far.append(corners[face])
        if len(far) > 1:
            return closed, is_there, spokes
        for corner in self.corners_at(far[0] if far else apex, MEET_SCAN):
            if apex not in corner.corners:
                continue
            corner = Edge(corner.face, corner.face.place(apex))
            _, after, before = corner.corners
            for place, vertex in enumerate(corners[:3]):
                if vertex == after and spokes[place] is None:
                    spokes[place] = corner
                if vertex == before and spokes[place] is None:
                    spokes[place] = corner.previous
            for face in range(3):
                start, end = corners[(face + 1) % 3], corners[(face + 2) % 3]
                if (after, before) == (end, start) and closed[face] is None:
                    closed[face] = corner
                is_there[face] |= (after, before) == (start, end)
        return closed, is_there, spokes

    def sow(self, corners, tet):
        a, b, c = corners
        gate = Edge(self.open_face(corners, tet), 0)
        if not self.is_walled(corners):
            back = Edge(self.open_face((a, c, b), tet), 0)
            pair(gate, back.previous)
            pair(gate.next, back.next)
            pair(gate.previous, back)
        return gate

    def open_face(self, corners, tet):
        a, b, c = (self.positions[v] for v in corners)
        normal = unit_normal(cross32(sub(a, c), sub(b, c)), self.extent(corners))
        face = Face(corners, tet, normal)
        for v in corners:
            self.open[v].append(face)
        return face

    def cover(self, corners, gate, tet, met):
        closed, is_there, spokes = met
        gate_beyond = [edge.partner for edge in (gate.next, gate.previous, gate)]
        beyond = []
        self.take_out(gate.face)
        for corner in filter(None, closed):
            self.take_out(corner.face)
        for face, corner in enumerate(closed):
            face_corners = corners[(face + 1) % 3], corners[(face + 2) % 3], corners[3]
            if corner is not None:
                beyond.append([edge.partner for edge in (corner.next, corner, corner.previous)])
            elif self.is_walled(face_corners):
                beyond.append([None] * 3)
            else:
                assert not is_there[face], "one open face with these corners"
                opened = self.open_face(face_corners, tet)
                beyond.append([Edge(opened, place) for place in range(3)])
        for face, corner in enumerate(closed):
            if corner is None or gate_beyond[face] != corner.next:
                pair(gate_beyond[face], beyond[face][0])
        for place in range(3):
            towards, back = (place + 1) % 3, (place + 2) % 3
            one, other = beyond[towards][1], beyond[back][2]
            if closed[towards] is None and closed[back] is None and spokes[place] is not None:
                known, partner = spokes[place], spokes[place].partner
                along = known.vertex == corners[place]
                pair(one, partner if along else known)
                pair(other, known if along else partner)
            elif closed[towards] is None and closed[back] is None:
                pair(one, other, wide=True)
            elif closed[towards] is None or closed[back] is None or one != closed[back].previous:
                pair(one, other)

    def take_out(self, face):
        for v in face.corners:
            self.open[v].remove(face)

    def give_up(self, face):
        for partner in face.across:
            pair(partner, None)
        self.take_out(face)

    def parse_label(self, corners, before, closed):
        youngest = [[self.wedges[w][1] for w in self.wedges_at[v][-8:]] for v in corners]
        if before is not None:
            if self.uniform:
                return before
            agreeing = [self.tet_labels[corner.face.tet] == before for corner in closed if corner is not None]
            boundary = sum(len(labels) > 1 for labels in youngest[:3])
            if self.coder.bit("same", boundary, sum(agreeing), len(agreeing) - sum(agreeing)):
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
        around = self.neighbours.get(wedge, [])[-256:]
        known = [(self.colors[w], self.misses[w]) for w in around]
        if not known and wedge:
            known = [(self.colors[wedge - 1], (0, 0))]
        n = len(known)
        channels = [[(g, r - g, b - g)[i] for (r, g, b), _ in known] for i in range(3)]
        sums = [sum(values) for values in channels]
        variance = [n * sum(x * x for x in values) - s * s for values, s in zip(channels, sums)]
        step = self.step_of(self.wedges[wedge][0])
        scale = f32(1.0 / f32(max(n, 1) * step))
        prediction = [floor(f32(f32(f32(s) * scale) + 0.5)) for s in sums]
        missed = [sum(misses[i] for _, misses in known) for i in range(2)]

        def class_of(v, m):
            spread = f32(f32(v + m * m) * f32(f32(4.0 * scale) * scale))
            return 16 + n if n < 2 else min(15, log2(f32(spread + 1.0)))

        a, c = class_of(variance[0], missed[0]), class_of(variance[1] + variance[2], missed[1])
        rg, bg, br = (self.slopes[name] for name in ("rg", "bg", "br"))
        green = self.coder.residual(("color",), "green", a)
        context = log2(min(abs(green), 7) + 1)
        along = rg.at(green)
        red = self.coder.residual(("color",), "red", c, context)
        rg.learn(green, along + red)
        along2, along3 = br.at(red), bg.at(green)
        blue = self.coder.residual(("color",), "blue", c, context)
        bg.learn(green, along3 + along2 + blue)
        br.learn(red, along2 + blue)
        g = prediction[0] + green
        color = (g + prediction[1] + along + red, g, g + prediction[2] + along3 + along2 + blue)
        self.colors.append(tuple(channel * step for channel in color))
        self.misses.append((min(abs(green) * step, 65535), min((abs(red) + abs(blue)) * step, 65535)))

    def step_of(self, vertex):
        x, y, t = (max(16.0 * extent, 1.0) for extent in self.extents[vertex])
        octaves = (self.size - log2(f32(f32(x * y) * t))) // 2
        return self.step << min(max(octaves, -3), 2) + 3

    # Section 8: vertices

    def parse_position(self, gate, corners, across):
        a, b, c = points = [self.positions[v] for v in corners]
        e = self.positions[next(v for v in self.tets[gate.tet] if v not in corners)]
        n = unit_normal(cross(sub(b, a), sub(c, a)), self.extent(corners))
        extent = tuple(f32(x / 3.0) for x in self.extent(corners))
        predicted = []
        for i in range(3):
            s = a[i] + b[i] + c[i]
            ahead = f32(f32(3.0 * f32(f32(6.0 * b[i] - 3.0 * a[i]) - e[i])) - 2.0 * s)
            for weight, vertex in zip((4.0, 2.0, 1.0), across):
                if vertex is not None:
                    ahead = f32(ahead + weight * (3 * self.positions[vertex][i] - s))
            center = f32(f32(s / 3.0) + f32(ahead / 48.0))
            predicted.append(floor(f32(f32(center + f32(f32(0.625 * extent[i]) * n[i])) + 0.5)))
        last = max(range(3), key=lambda i: abs(n[i]))
        position = [None, None, None]
        for axis in [i for i in range(3) if i != last] + [last]:
            side = self.parse_side(axis, points, predicted[axis], extent[axis])
            if side is not None:
                position[axis] = side
            elif axis != last:
                scale = scale_class(extent[axis])
                position[axis] = predicted[axis] + self.low_digits(self.coder.signed((axis,), "free", axis, context(axis, scale)), scale)
            else:
                position[axis] = self.parse_height(points, position, axis, (predicted[axis], extent[axis], n[axis]))
        return tuple(position)

    def low_digits(self, high, scale):
        digits = max(0, scale // 2 - 1)
        return (high << digits) + self.coder.decoder.raw(digits)

    def parse_side(self, axis, points, predicted, extent):
        high = self.far()[axis] if axis < 2 or self.duration is not None else None
        for side, place in enumerate((0, high)):
            if place is None:
                continue
            beyond = predicted if side == 0 else high - predicted
            nearness = 0 if beyond <= 0 else 1 if f32(beyond) <= extent else 2
            corners = sum(p[axis] == place for p in points)
            if corners == 0 and nearness == 2:
                continue
            if self.coder.bit("on side", axis, side, corners, nearness):
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
        w = f32(extent / abs(n))
        m = floor(max(0.0, min(4.0, f32(f32(f32((predicted - nearest) * direction) / w) * 4.0))))
        scale = scale_class(w)
        return nearest + direction * self.low_digits(self.coder.small((axis,), "height", axis, context(axis, scale), m), scale)


def scale_class(length):
    return min(39, log2(max(1.0, f32(length * length))))


def context(axis, scale):
    return 8 + scale % 2 if axis < 2 and scale >= 8 else scale


# Sections 1 and 2: packets


def parse_header(data):
    fields = []
    at = 0
    for name in ("width", "height", "rate", "rate_base", "aspect", "aspect_base"):
        value, at = parse_varint(data, at)
        fields.append((name, value))
    for name in ("subpixel_bits", "levels"):
        fields.append((name, data[at]))
        at += 1
    assert at == len(data), "the header ends where its length says"
    return dict(fields)


def parse_varint(data, at):
    """A number of the variable-length code, and where it ends."""
    size = {251: 2, 252: 4, 253: 8}.get(data[at])
    at += 1
    if size is None:
        return data[at - 1], at
    return int.from_bytes(data[at : at + size], "little"), at + size


def packets(stream):
    at = 0
    while at < len(stream):
        keyframe = stream[at : at + 8] == b"\x89TETV\r\n\x05"
        assert keyframe or stream[at : at + 4] == b"\x89TVP", "a start code of version 5"
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
