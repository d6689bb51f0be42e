"""Reference solutions: Radau IIA with any number of stages, in multiple precision.

Solves M dy/dt = f(t, y, u, p), M = diag(1 or 0) of index 1 at most, and its sensitivities
S = dy/dp by the same formula (so that S is the exact derivative of the discrete solution):

    M (Y_i - y0) = h sum_j a_ij f(Y_j)               Newton, then with the same matrix
    M (Z_i - S0) = h sum_j a_ij (f_y Z_j + f_p)

Derivatives of f are central differences with steps of 10^(-digits/3), which leaves about two
thirds of the digits: f is written once and no derivative by hand. A step is accepted when the
method with two stages fewer comes to the same y and S within `tolerance`.

Source: Hairer and Wanner, Solving Ordinary Differential Equations II (1996), IV.5 and VI.1.
"""

from mpmath import mp, mpf

DIGITS = 40
mp.dps = DIGITS


def solve(matrix, right):
    """X of matrix X = right (lists of rows), by elimination with partial pivoting."""
    n, a = len(matrix), [row + list(extra) for row, extra in zip(matrix, right)]
    for k in range(n):
        pivot = max(range(k, n), key=lambda i: abs(a[i][k]))
        a[k], a[pivot] = a[pivot], a[k]
        top = a[k]
        for i in range(k + 1, n):
            row = a[i]
            if row[k]:
                factor = row[k] / top[k]
                for j in range(k + 1, len(row)):
                    if top[j]:
                        row[j] -= factor * top[j]
    for k in reversed(range(n)):
        for j in range(n, len(a[k])):
            a[k][j] = (a[k][j] - sum(a[k][i] * a[i][j] for i in range(k + 1, n))) / a[k][k]
    return [row[n:] for row in a]


def tableau(s):
    """Nodes c and matrix a of Radau IIA with s stages: c_s = 1, order 2 s - 1."""
    with mp.workdps(2 * DIGITS):
        # The nodes are the zeros of P_s(x) - P_{s-1}(x) on -1 .. 1.
        legendre = [[mpf(1)], [mpf(0), mpf(1)]]
        for n in range(1, s):
            up = [mpf(0)] + [(2 * n + 1) * x for x in legendre[n]]
            down = [n * x for x in legendre[n - 1]] + [mpf(0)] * 2
            legendre.append([(x - y) / (n + 1) for x, y in zip(up, down)])
        lower = legendre[s - 1] + [mpf(0)]
        polynomial = [x - y for x, y in zip(legendre[s], lower)]
        roots = mp.polyroots(polynomial[::-1], maxsteps=500, extraprec=500)
        c = sorted((1 + mp.re(x)) / 2 for x in roots)
        c[-1] = mpf(1)
        # sum_j a_ij c_j^k = c_i^(k+1) / (k+1),  k = 0 .. s-1
        vandermonde = [[x**k for x in c] for k in range(s)]
        moments = [[x ** (k + 1) / (k + 1) for x in c] for k in range(s)]
        columns = solve(vandermonde, moments)
    return c, [[+columns[j][i] for j in range(s)] for i in range(s)]


def derivative(f, x):
    """Columns of df/dx by central differences."""
    columns = []
    for j, value in enumerate(x):
        delta = mpf(10) ** (-(DIGITS // 3)) * (abs(value) or 1)
        up, down = list(x), list(x)
        up[j], down[j] = value + delta, value - delta
        columns.append([(a - b) / (2 * delta) for a, b in zip(f(up), f(down))])
    return columns


class Problem:
    """f(t, y, u, p) with `mass` (1 or 0 per unknown), parameters p, sizes of y for tolerances."""

    def __init__(self, f, mass, p, nominal, tolerance="1e-20", stages=9):
        self.f, self.mass = f, mass
        self.p = [mpf(x) for x in p]
        self.nominal = [mpf(x) for x in nominal]
        self.tolerance = mpf(tolerance)
        self.stages = stages
        self.tableaux = {s: tableau(s) for s in (stages, stages - 2)}

    def consistent(self, t, y, s, u):
        """y and S with the algebraic unknowns solved for; the others are kept."""
        algebraic = [i for i, m in enumerate(self.mass) if not m]
        if not algebraic:
            return y, s
        y = list(y)
        for _ in range(100):
            f = self.f(t, y, u, self.p)
            f_y = derivative(lambda x: self.f(t, x, u, self.p), y)
            matrix = [[f_y[j][i] for j in algebraic] for i in algebraic]
            change = solve(matrix, [[-f[i]] for i in algebraic])
            for i, (d,) in zip(algebraic, change):
                y[i] += d
            if all(
                abs(d) < self.nominal[i] * mpf(10) ** (8 - DIGITS)
                for i, (d,) in zip(algebraic, change)
            ):
                break
        else:
            raise ArithmeticError(f"no consistent values at t = {t}")
        # f_a,ya S_a = -(f_a,yd S_d + f_a,p)
        f_y = derivative(lambda x: self.f(t, x, u, self.p), y)
        f_p = derivative(lambda x: self.f(t, y, u, x), self.p)
        matrix = [[f_y[j][i] for j in algebraic] for i in algebraic]
        kept = [j for j, m in enumerate(self.mass) if m]
        right = [
            [-f_p[k][i] - sum(f_y[j][i] * s[j][k] for j in kept) for k in range(len(self.p))]
            for i in algebraic
        ]
        s = [list(row) for row in s]
        for i, row in zip(algebraic, solve(matrix, right)):
            s[i] = row
        return y, s

    def step(self, stages, t, h, y0, s0, u):
        """y and S at t + h; u(t) gives the inputs."""
        c, a = self.tableaux[stages]
        n, at = len(y0), [(t + x * h, u(t + x * h)) for x in c]
        y = [list(y0) for _ in c]
        for _ in range(40):
            f = [self.f(t_j, y_j, u_j, self.p) for y_j, (t_j, u_j) in zip(y, at)]
            f_y = [
                derivative(lambda x: self.f(t_j, x, u_j, self.p), y_j)
                for y_j, (t_j, u_j) in zip(y, at)
            ]
            matrix = [
                [
                    (self.mass[i] if (i, k) == (j, m) else 0) - h * a[k][m] * f_y[m][j][i]
                    for m in range(stages)
                    for j in range(n)
                ]
                for k in range(stages)
                for i in range(n)
            ]
            right = [
                [
                    h * sum(a[k][m] * f[m][i] for m in range(stages))
                    - self.mass[i] * (y[k][i] - y0[i])
                ]
                for k in range(stages)
                for i in range(n)
            ]
            change = solve(matrix, right)
            for k in range(stages):
                for i in range(n):
                    y[k][i] += change[k * n + i][0]
            size = max(abs(d) / self.nominal[q % n] for q, (d,) in enumerate(change))
            # Newton converges quadratically: after this change the error is that small.
            if size < mpf(10) ** (-2 * DIGITS // 3):
                break
        else:
            return None
        f_p = [
            derivative(lambda x: self.f(t_j, y_j, u_j, x), self.p) for y_j, (t_j, u_j) in zip(y, at)
        ]
        right = [
            [
                self.mass[i] * s0[i][q] + h * sum(a[k][m] * f_p[m][q][i] for m in range(stages))
                for q in range(len(self.p))
            ]
            for k in range(stages)
            for i in range(n)
        ]
        s = solve(matrix, right)
        return y[-1], s[-n:]

    def error(self, one, other):
        """Largest difference in y and S, relative to the sizes of unknowns and parameters."""
        errors = []
        for i, size in enumerate(self.nominal):
            errors.append(abs(one[0][i] - other[0][i]) / size)
            for q, p in enumerate(self.p):
                errors.append(abs(one[1][i][q] - other[1][i][q]) * abs(p) / size)
        return max(errors)

    def advance(self, t, end, y, s, u, h=None):
        """y, S at `end`, and the step that the error allows next."""
        h = h or end - t
        while True:
            # Equal steps to the end, none longer than h.
            taken = (end - t) / max(1, mp.ceil((end - t) / h))
            fine = self.step(self.stages, t, taken, y, s, u)
            coarse = fine and self.step(self.stages - 2, t, taken, y, s, u)
            if not coarse:
                h = taken / 4
                continue
            # The coarse method's local error goes with h to the power 2 (stages - 2).
            error = self.error(fine, coarse)
            factor = mpf(4)
            if error:
                factor = (self.tolerance / error) ** (mpf(1) / (2 * (self.stages - 2)))
            proposed = taken * min(mpf(4), max(mpf("0.1"), mpf("0.9") * factor))
            if error > self.tolerance:
                h = proposed
                continue
            y, s = fine
            if taken == end - t:
                return y, s, max(h, proposed)
            h, t = proposed, t + taken


def simulate(problem, y0, rows, linear=(), first_step=None):
    """Solutions at `rows` = [(t, u), ...], each with the inputs of its own row.

    An input holds from its row to the next, or goes there in a straight line if its position is
    in `linear`. Of two rows with one time the second is the right value of a jump.
    """
    rows = [(mpf(t), [mpf(x) for x in u]) for t, u in rows]
    t, u = rows[0]
    h = None if first_step is None else mpf(first_step)
    y = [mpf(x) for x in y0]
    s = [[mpf(0)] * len(problem.p) for _ in y0]
    y, s = problem.consistent(t, y, s, u)
    solutions = [(y, s)]
    for (t0, u0), (t1, u1) in zip(rows, rows[1:]):
        if t1 > t0:

            def inputs(t, t0=t0, u0=u0, t1=t1, u1=u1):
                x = (t - t0) / (t1 - t0)
                return [
                    a + x * (b - a) if i in linear else a for i, (a, b) in enumerate(zip(u0, u1))
                ]

            y, s, h = problem.advance(t0, t1, y, s, inputs, h)
        y, s = problem.consistent(t1, y, s, u1)
        solutions.append((y, s))
    return solutions
