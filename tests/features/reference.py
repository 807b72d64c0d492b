#!/usr/bin/env python3
"""Reference solutions of orthogonal least squares in 50 digits: writes reference.tsv beside this file.

    python3 -m venv /tmp/v && /tmp/v/bin/pip install mpmath==1.3.0 && /tmp/v/bin/python reference.py

Points come from whole numbers by +, -, *, / and square roots alone, which every language rounds alike, so that
tests make the same points and the table need not hold them (points.rs is its twin). What is minimised is written
down here a second time, without the product: distances straight from their definition, derivatives by differences
in 50 digits, Gauss and Newton's steps from the feature that the points were made of until they are below 1e-30.
"""
import os, sys
from math import sqrt
from mpmath import mp, mpf, matrix, lu_solve

mp.dps = 50
MASK = (1 << 64) - 1
KINDS = ["plane", "sphere", "cylinder", "cone", "elliptic_cylinder", "ellipsoid", "torus", "circle", "line"]
COUNT = 36


class Random:
    def __init__(self, seed):
        self.state = seed

    def next(self):
        self.state = (self.state + 0x9E3779B97F4A7C15) & MASK
        z = self.state
        z = ((z ^ (z >> 30)) * 0xBF58476D1CE4E5B9) & MASK
        z = ((z ^ (z >> 27)) * 0x94D049BB133111EB) & MASK
        return float((z ^ (z >> 31)) >> 11) / 9007199254740992.0

    def noise(self):
        """Nearly normal, of deviation 1: four numbers of variance 1/12 each."""
        s = self.next() + self.next() + self.next() + self.next()
        return (s - 2.0) * 1.7320508075688772


def turn(a):
    """Cosine and sine of about `a` quarter turns."""
    k = int(a)
    t = a - float(k)
    d = 1.0 + t * t
    c, s = (1.0 - t * t) / d, (t + t) / d
    for _ in range(k % 4):
        c, s = -s, c
    return c, s


def rotation(a, b, c, d):
    """The rotation of a quaternion of whole numbers, row by row."""
    n = a * a + b * b + c * c + d * d
    return [
        [(a * a + b * b - c * c - d * d) / n, 2.0 * (b * c - a * d) / n, 2.0 * (b * d + a * c) / n],
        [2.0 * (b * c + a * d) / n, (a * a - b * b + c * c - d * d) / n, 2.0 * (c * d - a * b) / n],
        [2.0 * (b * d - a * c) / n, 2.0 * (c * d + a * b) / n, (a * a - b * b - c * c + d * d) / n],
    ]


class Case:
    """Feature `index` of a kind: its points and the parameters that they were made of."""

    def __init__(self, kind, index):
        self.kind, self.index = kind, index
        code = KINDS.index(kind)
        random = Random(1000 * code + index)
        self.size = [1.0, 1e-3, 1e3, 1e6, 25.0, 0.125][index % 6]
        self.offset = [0.0, 1.0, 1e3, 1e6][(index // 3) % 4]
        if self.size < 1.0:
            # nearer to what the coordinates resolve there would be no feature left
            self.offset = min(self.offset, 1000.0 * self.size)
        quarters = [4.0, 2.0, 1.0, 4.0][index % 4]
        n = [12, 20, 60, 8, 100, 30, 200, 40, 9][index % 9]
        most = {"cone": 10, "elliptic_cylinder": 14, "ellipsoid": 18, "torus": 14}.get(kind, 8)
        n = max(n, most if quarters == 4.0 else 2 * most)
        sigma = [0.0, 1e-5, 1e-4, 1e-3, 5e-3][(index // 2) % 5]
        lobe = [0.0, 0.0, 3e-3, 0.0, 1e-3][index % 5]
        if quarters < 4.0:
            sigma, lobe = sigma * quarters / 16.0, lobe * quarters / 16.0
        self.rows = rotation(*[float(int(random.next() * 9.0) + 1) for _ in range(4)])
        self.place = [self.offset * (random.next() - 0.5) for _ in range(3)]
        self.sizes = {
            "plane": [0.0, 0.0, 0.0], "sphere": [1.0, 0.0, 0.0], "cylinder": [1.0, 0.0, 0.0],
            "cone": [1.0, [0.125, 0.5, 0.75][index % 3], 0.0],  # radius, tangent of the half angle
            "elliptic_cylinder": [1.0, 0.625, 0.0], "ellipsoid": [1.0, 0.75, 0.5],
            "torus": [1.0, [0.25, 0.5][index % 2], 0.0], "circle": [1.0, 0.0, 0.0], "line": [0.0, 0.0, 0.0],
        }[kind]
        self.points = []
        for k in range(n):
            # uneven: half of the points in a quarter of the range
            u = random.next()
            if index % 5 == 2:
                u = u * u
            v = random.next()
            bump = lobe * (4.0 * (u - 0.5) * (u - 0.5) - 0.5) + sigma * random.noise()
            other = sigma * random.noise()
            q = self.local(quarters, u, v, bump, other)
            q = [self.size * c for c in q]
            p = [self.rows[i][0] * q[0] + self.rows[i][1] * q[1] + self.rows[i][2] * q[2] + self.place[i] for i in range(3)]
            self.points.append(p)

    def local(self, quarters, u, v, bump, other):
        c, s = turn(quarters * u)
        a, b, _ = self.sizes
        kind = self.kind
        if kind == "plane":
            return [2.0 * u - 1.0, v - 0.5, bump]
        if kind == "line":
            return [bump, other, 2.0 * u - 1.0]
        if kind == "circle":
            return [(1.0 + bump) * c, (1.0 + bump) * s, other]
        h = 2.0 * v - 1.0
        if kind == "cylinder":
            return [(1.0 + bump) * c, (1.0 + bump) * s, h]
        if kind == "cone":
            r = a + b * h + bump
            return [r * c, r * s, h]
        if kind == "elliptic_cylinder":
            return [(a + bump) * c, (b + bump) * s, h]
        if kind == "torus":
            d, e = turn(4.0 * v)
            r = a + (b + bump) * d
            return [r * c, r * s, (b + bump) * e]
        z = h if quarters == 4.0 else 0.5 * h
        r = sqrt(1.0 - z * z)
        x, y = r * c, r * s
        if kind == "sphere":
            return [(1.0 + bump) * x, (1.0 + bump) * y, (1.0 + bump) * z]
        return [(self.sizes[0] + bump) * x, (self.sizes[1] + bump) * y, (self.sizes[2] + bump) * z]


# the nine places of a step, as in the product: three translations, three rotations, three sizes
SLOTS = {
    "plane": [2, 3, 4], "sphere": [0, 1, 2, 6], "cylinder": [0, 1, 3, 4, 6], "cone": [0, 1, 3, 4, 6, 7],
    "elliptic_cylinder": [0, 1, 3, 4, 5, 6, 7], "ellipsoid": list(range(9)), "torus": [0, 1, 2, 3, 4, 6, 7],
    "circle": [0, 1, 2, 3, 4, 6], "line": [0, 1, 3, 4],
}


def foot(axes, q):
    """Distance from an ellipse or ellipsoid."""
    def value(t):
        return sum((a * x / (a * a + t)) ** 2 for a, x in zip(axes, q)) - 1
    # the root in double precision, then Newton's steps that double its digits
    fa, fq = [float(a) for a in axes], [float(x) for x in q]
    s = max(a * abs(x) - a * a for a, x in zip(fa, fq))
    for _ in range(100):
        f = sum((a * x / (a * a + s)) ** 2 for a, x in zip(fa, fq)) - 1.0
        slope = -2.0 * sum((a * x) ** 2 / (a * a + s) ** 3 for a, x in zip(fa, fq))
        s -= f / slope
        if abs(f / slope) < 1e-14:
            break
    t = mpf(s)
    for _ in range(20):
        slope = -2 * sum((a * x) ** 2 / (a * a + t) ** 3 for a, x in zip(axes, q))
        step = value(t) / slope
        t = t - step
        if abs(step) < mpf(10) ** -26:
            break
    return t * sqrt_mp(sum((x / (a * a + t)) ** 2 for a, x in zip(axes, q)))


def sqrt_mp(x):
    return mp.sqrt(x)


class Pose:
    def __init__(self, kind, origin, axes, sizes):
        self.kind, self.origin, self.axes, self.sizes = kind, origin, axes, sizes

    def distances(self, points):
        out = []
        for p in points:
            d = [p[i] - self.origin[i] for i in range(3)]
            x, y, z = [sum(d[i] * a[i] for i in range(3)) for a in self.axes]
            s, kind = self.sizes, self.kind
            if kind == "plane":
                out.append(z)
            elif kind == "line":
                out += [x, y]
            elif kind == "sphere":
                out.append(sqrt_mp(x * x + y * y + z * z) - s[0])
            elif kind == "ellipsoid":
                out.append(foot(s, [x, y, z]))
            elif kind == "elliptic_cylinder":
                out.append(foot(s[:2], [x, y]))
            else:
                r = sqrt_mp(x * x + y * y)
                if kind == "cylinder":
                    out.append(r - s[0])
                elif kind == "circle":
                    out += [r - s[0], z]
                elif kind == "cone":
                    out.append((r - s[0]) * mp.cos(s[1]) - z * mp.sin(s[1]))
                else:
                    out.append(sqrt_mp((r - s[0]) ** 2 + z * z) - s[1])
        return out

    def stepped(self, step):
        """Moved along and turned about its own axes, one after the other."""
        origin = [self.origin[i] + sum(step[k] * self.axes[k][i] for k in range(3)) for i in range(3)]
        axes = self.axes
        for k in range(3):
            if step[3 + k] == 0:
                continue
            c, s = mp.cos(step[3 + k]), mp.sin(step[3 + k])
            i, j = (k + 1) % 3, (k + 2) % 3
            a, b = axes[i], axes[j]
            axes = list(axes)
            axes[i] = [c * a[m] + s * b[m] for m in range(3)]
            axes[j] = [c * b[m] - s * a[m] for m in range(3)]
        sizes = [self.sizes[k] + step[6 + k] for k in range(3)]
        return Pose(self.kind, origin, axes, sizes)


def solve(case):
    """The least-squares pose of a case about its place, its lengths over its size."""
    size = mpf(case.size)
    points = [[(mpf(p[i]) - mpf(case.place[i])) / size for i in range(3)] for p in case.points]
    rows = [[mpf(v) for v in row] for row in case.rows]
    axes = [[rows[i][k] for i in range(3)] for k in range(3)]
    # rounding left the rows not quite orthonormal
    def unit(v):
        n = sqrt_mp(sum(c * c for c in v))
        return [c / n for c in v]
    w = unit(axes[2])
    u = axes[0]
    d = sum(a * b for a, b in zip(u, w))
    u = unit([a - d * b for a, b in zip(u, w)])
    v = [w[1] * u[2] - w[2] * u[1], w[2] * u[0] - w[0] * u[2], w[0] * u[1] - w[1] * u[0]]
    sizes = [mpf(s) for s in case.sizes]
    if case.kind == "cone":
        sizes[1] = mp.atan(sizes[1])
    pose = Pose(case.kind, [mpf(0)] * 3, [u, v, w], sizes)
    slots, h = SLOTS[case.kind], mpf(10) ** -20
    for iteration in range(400):
        r = pose.distances(points)
        columns = []
        for slot in slots:
            step = [mpf(0)] * 9
            step[slot] = h
            ahead = pose.stepped(step).distances(points)
            step[slot] = -h
            behind = pose.stepped(step).distances(points)
            columns.append([(a - b) / (2 * h) for a, b in zip(ahead, behind)])
        p = len(slots)
        a = matrix(p, p)
        b = matrix(p, 1)
        for i in range(p):
            b[i] = sum(x * y for x, y in zip(columns[i], r))
            for j in range(i + 1):
                a[i, j] = sum(x * y for x, y in zip(columns[i], columns[j]))
                a[j, i] = a[i, j]
        delta = lu_solve(a, b)
        step = [mpf(0)] * 9
        for k, slot in enumerate(slots):
            step[slot] = -delta[k]
        pose = pose.stepped(step)
        if max(abs(x) for x in delta) < mpf(10) ** -30:
            return pose, sum(x * x for x in r)
    raise SystemExit(f"{case.kind} {case.index} does not converge")


def main():
    if sys.argv[1:] == ["points"]:
        for kind in KINDS:
            for index in range(COUNT):
                for p in Case(kind, index).points:
                    print(kind, index, *p)
        return
    here = os.path.dirname(os.path.abspath(__file__))
    kinds = sys.argv[1:] or KINDS
    from concurrent.futures import ProcessPoolExecutor
    with open(os.path.join(here, "reference.tsv" if kinds == KINDS else "part.tsv"), "w") as out:
        out.write("# kind index | sum of squares, then origin, w, u about the place, over the size; sizes (reference.py)\n")
        jobs = [(kind, index) for kind in kinds for index in range(COUNT)]
        with ProcessPoolExecutor(2) as pool:
            for line in pool.map(row, jobs):
                out.write(line)


def row(job):
    case = Case(*job)
    pose, cost = solve(case)
    values = [cost, *pose.origin, *pose.axes[2], *pose.axes[0], *pose.sizes]
    return "\t".join([case.kind, str(case.index)] + [mp.nstr(v, 20) for v in values]) + "\n"


if __name__ == "__main__":
    main()
