"""Least steps: the shortest corrections that linear rows ask for, inside the joint limits."""

import numpy as np

from coverable.kernels import allocating, kernel


@kernel
def cholesky_solve(a, b, m):
    """Solve the m x m symmetric a y = b in place; False when a is not positive definite."""
    for i in range(m):
        for j in range(i + 1):
            total = a[i, j]
            for k in range(j):
                total -= a[i, k] * a[j, k]
            if i == j:
                if not total > 0.0:
                    return False
                a[i, i] = np.sqrt(total)
            else:
                a[i, j] = total / a[j, j]
    for i in range(m):
        for k in range(i):
            b[i] -= a[i, k] * b[k]
        b[i] /= a[i, i]
    for i in range(m - 1, -1, -1):
        for k in range(i + 1, m):
            b[i] -= a[k, i] * b[k]
        b[i] /= a[i, i]
    return True


@kernel
def least_step(arrays, work, q, m, damping):
    """The step nearest to `work.secondary_step` with rows @ step = rhs, inside the limits.

    Only the first m rows count. Joints that would pass a limit are held at it, the furthest first,
    and the others take over. Returns False when too few joints are left. With a larger `damping`
    (a share of the rows' squares) the step is shorter, and the rows hold as nearly as they can.
    """
    # To hand over all of `arrays` and `work` would take longer than the step.
    return step_within(
        arrays.lower, arrays.upper, work.rows, work.rhs, work.secondary_step, work.step, work.held,
        work.stop_reason, q, m, damping,
    )  # fmt: skip


@allocating
def step_within(lower, upper, rows, rhs, secondary_step, step, held, stop_reason, q, m, damping):
    """See `least_step`; its arguments one by one."""
    n = q.shape[0]
    a = np.empty((6, 6))
    y = np.empty(6)
    for j in range(n):
        held[j] = False
        step[j] = 0.0
    for _ in range(n + 1):
        trace = 0.0
        for i in range(m):
            y[i] = rhs[i]
            for j in range(n):
                y[i] -= rows[i, j] * (step[j] if held[j] else secondary_step[j])
            for k in range(i + 1):
                total = 0.0
                for j in range(n):
                    if not held[j]:
                        total += rows[i, j] * rows[k, j]
                a[i, k] = total
            trace += a[i, i]
        if not trace > 1e-14:
            return False
        for i in range(m):
            a[i, i] += damping * trace
        if not cholesky_solve(a, y, m):
            return False
        worst, furthest = -1, 1e-14
        for j in range(n):
            if held[j]:
                continue
            s = secondary_step[j]
            for i in range(m):
                s += rows[i, j] * y[i]
            step[j] = s
            over = max(q[j] + s - upper[j], lower[j] - q[j] - s)
            if over > furthest:
                worst, furthest = j, over
        if worst < 0:
            return True
        stop_reason[1] = worst
        limit = upper[worst] if step[worst] > 0.0 else lower[worst]
        step[worst] = limit - q[worst]
        held[worst] = True
    return False
