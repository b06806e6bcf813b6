#!/usr/bin/env python3
"""Writes the worlds of worlds/*.sdf: closed buildings made of boxes, cylinders and spheres only.

Usage: scripts/make_worlds.py [FOLDER]      (default: worlds/ beside this script)

The same script always writes the same bytes. Metres, z up. Surfaces lie on odd multiples of 0.05 m where natural, so
that they fall inside the voxels of a 0.1 m map instead of on their faces.
"""
import math
import pathlib
import random
import sys


def number(value):
    text = f"{value:.4f}".rstrip("0").rstrip(".")
    return "0" if text in ("-0", "") else text


def numbers(values):
    return " ".join(number(v) for v in values)


class World:
    """Collects primitives and writes them as one static SDFormat model."""

    def __init__(self, name, idea, box, starts):
        self.name, self.idea, self.box, self.starts = name, idea, box, starts
        self.shapes = []  # (label, position, rpy, geometry xml)

    def _add(self, label, position, rpy, geometry):
        self.shapes.append((f"{label}_{len(self.shapes)}", position, rpy, geometry))

    def block(self, label, x, y, z, rpy=(0, 0, 0), size=None):
        """Box by spans x=(lo, hi), y, z; or by centre numbers and `size` when it is turned by `rpy`."""
        if size is None:
            size = [hi - lo for lo, hi in (x, y, z)]
            x, y, z = (0.5 * (lo + hi) for lo, hi in (x, y, z))
        self._add(label, (x, y, z), rpy, f"<box><size>{numbers(size)}</size></box>")

    def cylinder(self, label, x, y, z, radius, rpy=(0, 0, 0)):
        lo, hi = z
        self._add(label, (x, y, 0.5 * (lo + hi)), rpy,
                  f"<cylinder><radius>{number(radius)}</radius><length>{number(hi - lo)}</length></cylinder>")

    def sphere(self, label, x, y, z, radius):
        self._add(label, (x, y, z), (0, 0, 0), f"<sphere><radius>{number(radius)}</radius></sphere>")

    def slab(self, label, x, y, z, holes=()):
        """Horizontal plate with rectangular holes ((x0, x1), (y0, y1))."""
        for u, v in minus_holes(x, y, holes):
            self.block(label, u, v, z)

    def wall_x(self, label, x, y_center, thickness, z, openings=()):
        """Wall along x; openings ((x0, x1), (z0, z1))."""
        for u, v in minus_holes(x, z, openings):
            self.block(label, u, (y_center - 0.5 * thickness, y_center + 0.5 * thickness), v)

    def wall_y(self, label, x_center, y, thickness, z, openings=()):
        for u, v in minus_holes(y, z, openings):
            self.block(label, (x_center - 0.5 * thickness, x_center + 0.5 * thickness), u, v)

    def shell(self, x, y, z, thickness=0.2):
        """Outer walls, ground slab and roof around the given interior."""
        outer_x = (x[0] - thickness, x[1] + thickness)
        self.block("ground", outer_x, (y[0] - thickness, y[1] + thickness), (z[0] - thickness, z[0]))
        self.block("roof", outer_x, (y[0] - thickness, y[1] + thickness), (z[1], z[1] + thickness))
        self.block("outer_wall", outer_x, (y[0] - thickness, y[0]), z)
        self.block("outer_wall", outer_x, (y[1], y[1] + thickness), z)
        self.block("outer_wall", (x[0] - thickness, x[0]), y, z)
        self.block("outer_wall", (x[1], x[1] + thickness), y, z)

    def text(self):
        lines = ['<?xml version="1.0"?>', "<!--", f"  {self.name}: {self.idea}",
                 f"  Box to explore (x0,y0,z0,x1,y1,z1): {','.join(number(v) for v in self.box)}",
                 "  Start positions: " + "  ".join(",".join(number(v) for v in s) for s in self.starts),
                 "  Written by scripts/make_worlds.py; change it there.", "-->", '<sdf version="1.9">',
                 f'  <world name="{self.name}">', f'    <model name="{self.name}">', "      <static>true</static>",
                 '      <link name="structure">']
        for label, position, rpy, geometry in self.shapes:
            pose = f"<pose>{numbers(position)} {numbers(rpy)}</pose>"
            for kind in ("collision", "visual"):
                lines.append(f'        <{kind} name="{label}_{kind}">{pose}<geometry>{geometry}</geometry></{kind}>')
        lines += ["      </link>", "    </model>", "  </world>", "</sdf>", ""]
        return "\n".join(lines)


def minus_holes(u, v, holes):
    """Rectangle u x v minus rectangles, as few disjoint rectangles (strips along u are merged)."""
    def cuts(span, spans):
        return sorted({span[0], span[1], *(min(max(c, span[0]), span[1]) for s in spans for c in s)})

    vs = cuts(v, [h[1] for h in holes])
    us = cuts(u, [h[0] for h in holes])
    pieces = []
    for v0, v1 in zip(vs, vs[1:]):
        begin = None
        for u0, u1 in zip(us, us[1:]):
            inside = any(h[0][0] <= u0 and u1 <= h[0][1] and h[1][0] <= v0 and v1 <= h[1][1] for h in holes)
            if inside and begin is not None:
                pieces.append(((begin, u0), (v0, v1)))
                begin = None
            elif not inside and begin is None:
                begin = u0
        if begin is not None:
            pieces.append(((begin, us[-1]), (v0, v1)))
    return pieces


def door(center, floor, width=1.0, height=2.1):
    return (center - 0.5 * width, center + 0.5 * width), (floor, floor + height)


def desk(world, x, y, floor, along_x=True):
    """Table top on two side panels, 1.4 x 0.7 m."""
    dx, dy = (0.7, 0.35) if along_x else (0.35, 0.7)
    world.block("desk", (x - dx, x + dx), (y - dy, y + dy), (floor + 0.67, floor + 0.72))
    for side in (-1, 1):
        if along_x:
            end = x + side * (dx - 0.05)
            world.block("desk_side", (end - 0.05, end + 0.05), (y - dy, y + dy), (floor, floor + 0.67))
        else:
            end = y + side * (dy - 0.05)
            world.block("desk_side", (x - dx, x + dx), (end - 0.05, end + 0.05), (floor, floor + 0.67))


def half_turn_stairs(world, x, y, floor, rise, flight_width, landing):
    """Two flights with a landing half way; first flight along the low x side going +y, second back along the high
    x side. Between the flights an open eye stays."""
    steps = 8
    run = (y[1] - landing - y[0]) / steps
    up = 0.5 * rise / steps
    for i in range(steps):
        top = floor + (i + 1) * up
        y0 = y[0] + i * run
        world.block("step", (x[0], x[0] + flight_width), (y0, y0 + run), (max(floor, top - 0.3), top))
        top += 0.5 * rise
        y1 = y[1] - landing - i * run
        world.block("step", (x[1] - flight_width, x[1]), (y1 - run, y1), (top - 0.3, top))
    world.block("landing", x, (y[1] - landing, y[1]), (floor + 0.5 * rise - 0.2, floor + 0.5 * rise))


def office_tower():
    world = World("office_tower", "three storeys of offices around a corridor; a stairwell with half-turn stairs and "
                  "an open eye is the only way up; doors 1.0 m wide and 2.1 m high",
                  (-8.3, -6.3, -0.3, 8.3, 6.3, 9.1),
                  [(-6.5, 0, 0.95), (-4.5, 0, 0.95), (-2.5, 0, 0.95), (-0.5, 0, 0.95)])
    world.shell((-8.05, 8.05), (-6.05, 6.05), (-0.05, 8.75))
    stair_x, stair_y = (4.95, 8.05), (2.05, 6.05)
    south_splits = [(-4.05, 0.05, 4.05), (-2.65, 2.65), (-4.85, -0.85, 4.05)]
    north_splits = [(-3.75, 0.55), (-1.55,), (-3.75, 0.55)]
    for k in range(3):
        floor = 3.0 * k - 0.05
        z = (floor, floor + 2.8)
        if k > 0:
            world.slab("slab", (-8.05, 8.05), (-6.05, 6.05), (floor - 0.2, floor), [(stair_x, stair_y)])
        if k < 2:
            half_turn_stairs(world, stair_x, stair_y, floor, 3.0, 1.0, 1.2)
        south = [-8.05, *south_splits[k], 8.05]
        north = [-8.05, *north_splits[k], 4.95]
        south_rooms, north_rooms = list(zip(south, south[1:])), list(zip(north, north[1:]))
        south_doors = [door(0.5 * (a + b) + 0.4 * (-1) ** (i + k), floor) for i, (a, b) in enumerate(south_rooms)]
        north_doors = [door(0.5 * (a + b) - 0.3 * (-1) ** (i + k), floor) for i, (a, b) in enumerate(north_rooms)]
        world.wall_x("wall", (-8.05, 8.05), -1.1, 0.1, z, south_doors)
        world.wall_x("wall", (-8.05, 8.05), 1.1, 0.1, z, north_doors + [door(6.5, floor, 1.2)])
        world.wall_y("wall", 4.9, (1.15, 6.05), 0.1, z)
        for i, split in enumerate(south_splits[k]):
            world.wall_y("wall", split, (-6.05, -1.15), 0.1, z, [door(-4.5, floor)] if (i + k) % 2 == 0 else [])
        for i, split in enumerate(north_splits[k]):
            world.wall_y("wall", split, (1.15, 6.05), 0.1, z, [door(2.6, floor)] if (i + k) % 2 else [])
        for i, (a, b) in enumerate(south_rooms):
            desk(world, 0.5 * (a + b), -3.75, floor, along_x=(i + k) % 2 == 0)
            world.block("cabinet", (b - 0.95, b - 0.05), (-6.05, -5.6), (floor, floor + 1.85))
        for i, (a, b) in enumerate(north_rooms):
            desk(world, 0.5 * (a + b), 4.0, floor, along_x=(i + k) % 2 == 1)
            world.block("cabinet", (a + 0.05, a + 0.5), (4.75, 5.95), (floor, floor + 1.2))
        if k == 1:
            world.cylinder("column", -5.5, 3.2, z, 0.2)
    return world


def duplex():
    world = World("duplex", "a flat on two storeys, joined by a straight flight of stairs through one opening; low "
                  "ceilings, furniture", (-5.3, -4.3, -0.3, 5.3, 4.3, 5.7),
                  [(-3.5, -2.5, 0.95), (-3.5, -1, 0.95), (-2, -2.5, 0.95), (-2, -1, 0.95)])
    world.shell((-5.05, 5.05), (-4.05, 4.05), (-0.05, 5.35))
    opening = ((-1.45, 1.95), (1.85, 4.05))
    world.slab("slab", (-5.05, 5.05), (-4.05, 4.05), (2.55, 2.75), [opening])
    for i in range(14):
        top = -0.05 + 0.2 * (i + 1)
        x0 = -1.45 + 0.24 * i
        world.block("step", (x0, x0 + 0.24), (3.05, 4.05), (max(-0.05, top - 0.3), top))
    low, high = (-0.05, 2.55), (2.75, 5.35)
    # Ground floor: living room and hall, kitchen (east), bath (north-west).
    world.wall_y("wall", 2.45, (-4.05, 4.05), 0.1, low, [door(-0.8, -0.05, 1.2), door(1.2, -0.05)])
    world.wall_x("wall", (-5.05, -2.1), 1.15, 0.1, low, [door(-2.9, -0.05)])
    world.wall_y("wall", -2.15, (1.2, 4.05), 0.1, low)
    world.wall_x("wall", (2.5, 5.05), 0.35, 0.1, low)
    world.block("sofa", (-4.95, -4.05), (-3.6, -1.5), (-0.05, 0.75))
    world.block("kitchen_counter", (4.45, 5.05), (-4.05, -0.2), (-0.05, 0.85))
    desk(world, 0.3, -2.6, -0.05)
    world.block("bath", (-4.95, -4.2), (2.0, 3.8), (-0.05, 0.55))
    world.cylinder("lamp", 1.6, -3.6, (-0.05, 1.65), 0.12)
    # Upper floor: gallery, three rooms.
    world.wall_x("wall", (-5.05, 5.05), 0.05, 0.1, high, [door(-3.4, 2.75), door(0.6, 2.75), door(3.9, 2.75)])
    world.wall_y("wall", -1.75, (-4.05, 0.0), 0.1, high)
    world.wall_y("wall", 2.15, (-4.05, 0.0), 0.1, high, [door(-2.4, 2.75)])
    world.block("bed", (-4.95, -2.95), (-3.95, -2.35), (2.75, 3.25))
    world.block("wardrobe", (-0.9, 1.1), (-4.05, -3.45), (2.75, 4.85))
    desk(world, 4.3, -2.6, 2.75, along_x=False)
    world.block("parapet", (-1.45, 1.0), (1.75, 1.85), (2.75, 3.65))
    world.sphere("seat_ball", -3.9, 2.9, 3.1, 0.35)
    return world


def parking_garage():
    world = World("parking_garage", "four open parking levels on a column grid, joined by ramps on alternate sides; "
                  "cars, a lift core", (-12.3, -8.3, -0.3, 12.3, 8.3, 12.1),
                  [(-9, 0, 0.95), (-9, 2, 0.95), (-9, -2, 0.95), (-7, 0, 0.95)])
    world.shell((-12.05, 12.05), (-8.05, 8.05), (-0.05, 11.75))
    rng = random.Random(4)
    run, width, thickness = 9.0, 3.6, 0.25
    for k in range(4):
        floor = 3.0 * k - 0.05
        side = 1 if k % 2 == 0 else -1          # the ramp up from this level
        if k > 0:
            y = sorted((-side * 8.05, -side * (8.05 - width)))
            world.slab("slab", (-12.05, 12.05), (-8.05, 8.05), (floor - 0.25, floor), [((-4.5, 4.5), tuple(y))])
            world.block("parapet", (-4.5, 4.5), sorted((-side * (8.05 - width), -side * (7.9 - width))),
                        (floor, floor + 0.9))
        if k < 3:
            pitch = -side * math.atan2(3.0, run)
            length = math.hypot(3.0, run)
            normal = 0.5 * thickness
            y_center = side * (8.05 - 0.5 * width)
            world.block("ramp", side * normal * math.sin(abs(pitch)) , y_center,
                        floor + 1.5 - normal * math.cos(pitch), (0, pitch, 0), (length, width - 0.02, thickness))
        for x in (-8.0, 0.0, 8.0):
            for y in (-3.55, 3.55):
                world.block("column", (x - 0.25, x + 0.25), (y - 0.25, y + 0.25), (floor, floor + 2.75))
        world.block("lift_core", (10.05, 12.05), (-1.25, 1.25), (floor, floor + 2.75))
        for x in (-10.9, -8.5, 6.2, 8.6):
            for y in (-5.75, 5.75):
                if rng.random() < 0.55:
                    world.block("car", (x - 0.9, x + 0.9), (y - 2.1, y + 2.1), (floor + 0.15, floor + 0.85))
                    world.block("cabin", (x - 0.75, x + 0.75), (y - 1.1, y + 1.0), (floor + 0.85, floor + 1.45))
    return world


def warehouse():
    world = World("warehouse", "one hall, 10 m high, with four rows of 8.5 m racks; shelves partly filled; aisles of "
                  "2.5 m", (-12.3, -8.3, -0.3, 12.3, 8.3, 10.1),
                  [(-11, -3.6, 0.95), (-11, 0, 0.95), (-11, 3.6, 0.95), (-11, 5, 0.95)])
    world.shell((-12.05, 12.05), (-8.05, 8.05), (-0.05, 9.95))
    rng = random.Random(9)
    bays, bay, levels, rise = 6, 3.0, 5, 1.7
    for y in (-5.4, -1.8, 1.8, 5.4):
        x0 = -9.5
        depth = (y - 0.55, y + 0.55)
        for i in range(bays + 1):
            x = x0 + i * bay
            for side in (-0.5, 0.5):
                world.block("upright", (x - 0.05, x + 0.05), (y + side - 0.05, y + side + 0.05), (-0.05, 8.45))
        for level in range(1, levels + 1):
            top = -0.05 + rise * level
            world.block("shelf", (x0, x0 + bays * bay), depth, (top - 0.1, top))
        for level in range(levels):
            for i in range(bays):
                for pallet in range(2):
                    if rng.random() < 0.6:
                        x = x0 + i * bay + 0.8 + 1.4 * pallet
                        bottom = -0.05 + rise * level
                        height = 0.5 + 0.1 * int(8 * rng.random())
                        world.block("pallet", (x - 0.6, x + 0.6), (y - 0.5, y + 0.5), (bottom, bottom + height))
    world.block("conveyor", (10.85, 11.55), (-6.0, 3.0), (0.55, 0.85))
    for y in (-5.9, -3.0, 0.0, 2.9):
        world.block("conveyor_leg", (10.9, 11.5), (y - 0.05, y + 0.05), (-0.05, 0.55))
    for x, y in ((10.5, 6.0), (9.7, 6.6), (11.3, 6.9)):
        world.cylinder("drum", x, y, (-0.05, 0.85), 0.35)
    return world


def atrium():
    world = World("atrium", "five galleries around a void of 8 x 8 m over the whole height; parapets, kiosks with "
                  "doors, a sculpture in the void", (-8.3, -8.3, -0.3, 8.3, 8.3, 15.1),
                  [(-6, -6, 0.95), (6, -6, 0.95), (-6, 6, 0.95), (6, 6, 0.95)])
    world.shell((-8.05, 8.05), (-8.05, 8.05), (-0.05, 14.75))
    void = ((-4.05, 4.05), (-4.05, 4.05))
    for k in range(5):
        floor = 3.0 * k - 0.05
        z = (floor, floor + 2.8)
        if k > 0:
            world.slab("gallery", (-8.05, 8.05), (-8.05, 8.05), (floor - 0.2, floor), [void])
            rail = (floor, floor + 1.0)
            for side in (-1, 1):
                world.wall_x("parapet", (-4.05, 4.05), side * 4.1, 0.1, rail)
                world.wall_y("parapet", side * 4.1, (-4.15, 4.15), 0.1, rail)
        for x in (-4.6, 4.6):
            for y in (-4.6, 4.6):
                world.cylinder("column", x, y, z, 0.2)
        # One kiosk a level, turning around the void.
        turn = k % 4
        sign = 1 if turn < 2 else -1
        if turn % 2 == 0:
            world.wall_x("kiosk", (-2.55, 2.55), sign * 5.6, 0.1, z, [door(0.8, floor)])
            for x in (-2.5, 2.5):
                world.wall_y("kiosk", x, sorted((sign * 5.65, sign * 8.05)), 0.1, z)
            world.block("counter", (-2.0, -0.6), sorted((sign * 6.75, sign * 7.25)), (floor, floor + 0.95))
        else:
            world.wall_y("kiosk", sign * 5.6, (-2.55, 2.55), 0.1, z, [door(-0.8, floor)])
            for y in (-2.5, 2.5):
                world.wall_x("kiosk", sorted((sign * 5.65, sign * 8.05)), y, 0.1, z)
            world.block("counter", sorted((sign * 6.75, sign * 7.25)), (0.6, 2.0), (floor, floor + 0.95))
        world.block("bench", (-7.9, -7.4), (3.4, 5.2), (floor, floor + 0.45))
    world.cylinder("plinth", 0, 0, (-0.05, 1.05), 0.7)
    world.cylinder("mast", 0, 0, (1.05, 5.55), 0.15)
    world.sphere("sculpture", 0, 0, 6.35, 0.95)
    return world


def collapsed():
    world = World("collapsed", "a building after an earthquake: the upper slabs are broken, tilted and lean on rubble; "
                  "holes down to 0.9 m between the parts", (-7.3, -5.3, -0.3, 7.3, 5.3, 7.1),
                  [(-6, -4, 0.95), (-6, -2, 0.95), (-4.5, -4, 0.95), (-4.5, -3, 0.95)])
    world.shell((-7.05, 7.05), (-5.05, 5.05), (-0.05, 6.75))
    # First slab: a sound part in the west with a hole, tilted plates in the east.
    world.slab("slab", (-7.05, -1.55), (-5.05, 5.05), (2.85, 3.05), [((-6.5, -5.55), (3.0, 3.95)),
                                                                    ((-3.3, -2.2), (-3.9, -2.8))])
    world.block("tilted_slab", 0.95, -2.85, 2.35, (0, 0.22, 0), (4.6, 4.3, 0.2))
    world.block("tilted_slab", 0.75, 2.65, 2.15, (0, 0.28, 0.05), (4.6, 4.4, 0.2))
    world.block("tilted_slab", 5.35, -1.65, 3.35, (0.18, -0.12, 0), (3.2, 5.6, 0.2))
    world.block("tilted_slab", 5.35, 3.45, 1.95, (-0.15, 0.1, 0), (3.1, 3.0, 0.2))
    # Second slab: two plates that lean against each other.
    world.block("tilted_slab", -4.35, 0.0, 5.15, (0.1, 0.05, 0), (4.9, 6.2, 0.2))
    world.block("tilted_slab", 2.35, -0.5, 5.05, (-0.08, 0.1, 0), (5.6, 7.0, 0.2))
    # Walls that still stand, with holes of 0.9 to 1.1 m.
    world.wall_y("wall", -1.6, (-5.05, 5.05), 0.2, (-0.05, 2.85), [door(-1.7, -0.05, 0.95, 1.85),
                                                                  ((2.4, 3.4), (0.75, 1.75))])
    world.wall_x("wall", (-7.05, -1.7), 0.6, 0.15, (-0.05, 2.85), [door(-5.2, -0.05, 0.9, 2.0)])
    world.wall_x("wall", (-7.05, -1.55), -0.8, 0.15, (3.05, 4.55), [((-4.6, -3.5), (3.05, 4.55))])
    world.wall_y("wall", 3.65, (-5.05, 1.0), 0.15, (-0.05, 1.75), [((-3.0, -2.0), (0.35, 1.75))])
    for x, y, lean in ((2.9, 4.2, 0.12), (2.6, -4.3, -0.1), (6.3, 0.9, 0.08)):
        world.block("leaning_column", x, y, 1.0, (lean, lean, 0), (0.35, 0.35, 2.3))
    rng = random.Random(17)
    for _ in range(46):
        x, y = -6.4 + 12.8 * rng.random(), -4.4 + 8.8 * rng.random()
        size = [0.25 + 0.55 * rng.random() for _ in range(3)]
        turn = [0.8 * (rng.random() - 0.5), 0.8 * (rng.random() - 0.5), 3.1 * rng.random()]
        upper = rng.random() < 0.3 and x < -2.2 and not (-3.7 < x < -1.8 and y < -2.4) and not (x < -5.1 and y > 2.5)
        if not upper and (x < -3.6 and y < -1.2):
            continue                             # keeps the starts clear
        world.block("rubble", x, y, (3.05 if upper else -0.05) + 0.3 * size[2], turn, size)
    for x, y, radius in ((1.2, -0.4, 0.45), (4.6, 4.2, 0.4), (-3.2, 3.8, 0.35)):
        world.sphere("boulder", x, y, -0.05 + 0.7 * radius, radius)
    world.cylinder("pipe", 1.0, 0.3, (2.2, 6.2), 0.08, (0.5, 1.2, 0))
    return world


WORLDS = (office_tower, duplex, parking_garage, warehouse, atrium, collapsed)


def main():
    folder = pathlib.Path(sys.argv[1]) if len(sys.argv) > 1 else pathlib.Path(__file__).resolve().parent.parent / "worlds"
    folder.mkdir(parents=True, exist_ok=True)
    for make in WORLDS:
        world = make()
        (folder / f"{world.name}.sdf").write_text(world.text(), encoding="utf-8")


if __name__ == "__main__":
    main()
