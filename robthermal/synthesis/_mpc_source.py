"""C99 source of a predictive controller: an interior-point method over the stages, and what is done where it fails.

Prefix @. States z and controls c in the units of the terminal set, |z| <= 1 at the end; u = K z + c; limits
E z + H c <= 1. A Newton step is a Riccati recursion (Rao, Wright and Rawlings 1998), predictor and corrector as
Mehrotra (1992) has them; the limit of the end is a convex quadratic with a multiplier of its own.
"""

from __future__ import annotations

ABOUT = """\
Predictive controller: {n} states, {m} controls, {horizon} samples of {h:.17g} s ahead.

    {p}_start(&memory);                  once: no plan yet
    status = {p}_step(&memory, x, u);    in every sample: u from the measured states, both in deviations

Status 0: the best plan, which keeps every limit to 1e-6 of its size and ends in the terminal set. 1: such a plan, not
the best (at most {rounds} rounds), that costs no more than the rest of the plan before. 2: no such plan was found;
u = K x, moved to the limits of this sample. 3: a reading is not finite; the predicted states took their place.
A limit of the states alone that the measured states break already is no concern of the plan: no control changes it.
States: {states}. Controls: {controls}.
{outcome}"""

TYPES = """\
enum {{ {p}_n = {n}, {p}_m = {m}, {p}_horizon = {horizon}, {p}_rows = {rows}, {p}_rounds = {rounds} }};

typedef struct {{                     /* of one sample of the plan: rows, slacks, multipliers, and their steps */
    double miss[{p}_rows], slack[{p}_rows], force[{p}_rows], v[{p}_rows];
    double slack_step[{p}_rows], force_step[{p}_rows], target[{p}_rows];
    double gain[{p}_m][{p}_n], root[{p}_m][{p}_m], move[{p}_m], z_step[{p}_n], c_step[{p}_m], z[{p}_n], c[{p}_m];
}} {p}_stage;

typedef struct {{
    double plan[{p}_horizon][{p}_m], expected[{p}_n];
    {p}_stage at[{p}_horizon + 1]; /* work; the last one has the end, its limit in row 0 */
}} {p}_memory;
"""

SOLVER = r"""
/* The rows that a plan may change: of the first sample those with a control, at the end the one of the set. */
static inline int @_counts(int k, int r) { return k == @_horizon ? r == 0 : k > 0 || @_moved[r]; }

/* The state after one with its control. */
static inline void @_next(const double *z, const double *c, double *then)
{
    for (int i = 0; i < @_n; i++) {
        double sum = 0.0;
        for (int j = 0; j < @_n; j++) sum += @_A[i][j] * z[j];
        for (int j = 0; j < @_m; j++) sum += @_B[i][j] * c[j];
        then[i] = sum;
    }
}

/* E z + H c of a row. */
static inline double @_row(int r, const double *z, const double *c)
{
    double sum = 0.0;
    for (int j = 0; j < @_n; j++) sum += @_E[r][j] * z[j];
    for (int j = 0; j < @_m; j++) sum += @_H[r][j] * c[j];
    return sum;
}

/* Gradient of the cost of a stage. */
static inline void @_slope(const double *z, const double *c, double *by_z, double *by_c)
{
    for (int i = 0; i < @_n; i++) {
        by_z[i] = 0.0;
        for (int j = 0; j < @_n; j++) by_z[i] += @_Q[i][j] * z[j];
        for (int j = 0; j < @_m; j++) by_z[i] += @_S[j][i] * c[j];
    }
    for (int i = 0; i < @_m; i++) {
        by_c[i] = 0.0;
        for (int j = 0; j < @_n; j++) by_c[i] += @_S[i][j] * z[j];
        for (int j = 0; j < @_m; j++) by_c[i] += @_R[i][j] * c[j];
    }
}

/* States, rows and cost of the controls in at[]; returns the largest miss of a limit, infinite for no number. */
static inline double @_follow(@_memory *s, const double *z, double *cost)
{
    double worst = 0.0, by_z[@_n], by_c[@_m];
    @_stage *end = &s->at[@_horizon];
    for (int i = 0; i < @_n; i++) s->at[0].z[i] = z[i];
    *cost = 0.0;
    for (int k = 0; k < @_horizon; k++) {
        @_stage *a = &s->at[k];
        @_slope(a->z, a->c, by_z, by_c);
        for (int i = 0; i < @_n; i++) *cost += a->z[i] * by_z[i];
        for (int i = 0; i < @_m; i++) *cost += a->c[i] * by_c[i];
        for (int r = 0; r < @_rows; r++) {
            a->miss[r] = @_row(r, a->z, a->c) - 1.0;
            if (@_counts(k, r) && !(a->miss[r] <= worst)) worst = a->miss[r];
        }
        @_next(a->z, a->c, s->at[k + 1].z);
    }
    end->miss[0] = -1.0;
    for (int i = 0; i < @_n; i++) end->miss[0] += end->z[i] * end->z[i];
    *cost += end->miss[0] + 1.0;
    if (!(end->miss[0] <= worst)) worst = end->miss[0];
    return worst < INFINITY && *cost < INFINITY ? worst : INFINITY;
}

/* The Riccati recursion of the weights force / slack: gains and roots of every stage. 0: not positive definite. */
static inline int @_factor(@_memory *s)
{
    double F[@_n][@_n], FA[@_n][@_n], FB[@_n][@_m], X[@_n][@_n], U[@_m][@_n];
    const @_stage *end = &s->at[@_horizon];
    double own = 1.0 + 2.0 * end->force[0], across = 4.0 * end->force[0] / end->slack[0];
    for (int i = 0; i < @_n; i++)
        for (int j = 0; j < @_n; j++) F[i][j] = (i == j ? own : 0.0) + across * end->z[i] * end->z[j];
    for (int k = @_horizon - 1; k >= 0; k--) {
        @_stage *a = &s->at[k];
        for (int i = 0; i < @_n; i++) {
            for (int j = 0; j < @_n; j++) {
                FA[i][j] = 0.0;
                for (int l = 0; l < @_n; l++) FA[i][j] += F[i][l] * @_A[l][j];
            }
            for (int j = 0; j < @_m; j++) {
                FB[i][j] = 0.0;
                for (int l = 0; l < @_n; l++) FB[i][j] += F[i][l] * @_B[l][j];
            }
        }
        for (int i = 0; i < @_n; i++)
            for (int j = 0; j <= i; j++) {
                X[i][j] = @_Q[i][j];
                for (int l = 0; l < @_n; l++) X[i][j] += @_A[l][i] * FA[l][j];
            }
        for (int i = 0; i < @_m; i++) {
            for (int j = 0; j < @_n; j++) {
                U[i][j] = @_S[i][j];
                for (int l = 0; l < @_n; l++) U[i][j] += @_B[l][i] * FA[l][j];
            }
            for (int j = 0; j <= i; j++) {
                a->root[i][j] = @_R[i][j];
                for (int l = 0; l < @_n; l++) a->root[i][j] += @_B[l][i] * FB[l][j];
            }
        }
        for (int r = 0; r < @_rows; r++) {
            double weight = @_counts(k, r) ? a->force[r] / a->slack[r] : 0.0;
            for (int i = 0; i < @_n; i++)
                for (int j = 0; j <= i; j++) X[i][j] += weight * @_E[r][i] * @_E[r][j];
            for (int i = 0; i < @_m; i++) {
                for (int j = 0; j < @_n; j++) U[i][j] += weight * @_H[r][i] * @_E[r][j];
                for (int j = 0; j <= i; j++) a->root[i][j] += weight * @_H[r][i] * @_H[r][j];
            }
        }
        for (int i = 0; i < @_m; i++) /* Cholesky */
            for (int j = 0; j <= i; j++) {
                double sum = a->root[i][j];
                for (int l = 0; l < j; l++) sum -= a->root[i][l] * a->root[j][l];
                if (i == j && !(sum > 0.0)) return 0;
                a->root[i][j] = i == j ? sqrt(sum) : sum / a->root[j][j];
            }
        for (int j = 0; j < @_n; j++) { /* gain = -(root root')^-1 U; X + U' gain */
            for (int i = 0; i < @_m; i++) {
                double sum = U[i][j];
                for (int l = 0; l < i; l++) sum -= a->root[i][l] * U[l][j];
                U[i][j] = sum / a->root[i][i];
            }
            for (int i = @_m - 1; i >= 0; i--) {
                double sum = -U[i][j];
                for (int l = i + 1; l < @_m; l++) sum -= a->root[l][i] * a->gain[l][j];
                a->gain[i][j] = sum / a->root[i][i];
            }
        }
        for (int i = 0; i < @_n; i++)
            for (int j = 0; j <= i; j++) {
                for (int l = 0; l < @_m; l++) X[i][j] -= U[l][i] * U[l][j];
                F[i][j] = F[j][i] = X[i][j];
            }
    }
    return 1;
}

/* What the controls would move for the multipliers v, before the states answer; returns the largest of it. */
static inline double @_aim(@_memory *s)
{
    double f[@_n], by_z[@_n], by_c[@_m], largest = 0.0;
    const @_stage *end = &s->at[@_horizon];
    for (int i = 0; i < @_n; i++) f[i] = (1.0 + 2.0 * end->v[0]) * end->z[i];
    for (int k = @_horizon - 1; k >= 0; k--) {
        @_stage *a = &s->at[k];
        @_slope(a->z, a->c, by_z, by_c);
        for (int r = 0; r < @_rows; r++) {
            double v = @_counts(k, r) ? a->v[r] : 0.0;
            for (int i = 0; i < @_n; i++) by_z[i] += @_E[r][i] * v;
            for (int i = 0; i < @_m; i++) by_c[i] += @_H[r][i] * v;
        }
        for (int i = 0; i < @_n; i++)
            for (int l = 0; l < @_n; l++) by_z[i] += @_A[l][i] * f[l];
        for (int i = 0; i < @_m; i++)
            for (int l = 0; l < @_n; l++) by_c[i] += @_B[l][i] * f[l];
        for (int i = 0; i < @_n; i++) {
            f[i] = by_z[i];
            for (int l = 0; l < @_m; l++) f[i] += a->gain[l][i] * by_c[l];
        }
        for (int i = 0; i < @_m; i++) {
            for (int l = 0; l < i; l++) by_c[i] -= a->root[i][l] * by_c[l];
            by_c[i] /= a->root[i][i];
        }
        for (int i = @_m - 1; i >= 0; i--) {
            double sum = -by_c[i];
            for (int l = i + 1; l < @_m; l++) sum -= a->root[l][i] * a->move[l];
            a->move[i] = sum / a->root[i][i];
            largest = fmax(largest, fabs(a->move[i]));
        }
    }
    return largest;
}

/* The Newton step for slack force = target; returns how far it may be taken, at most 1. */
static inline double @_newton(@_memory *s)
{
    double far = 1.0;
    for (int k = 0; k <= @_horizon; k++) {
        @_stage *a = &s->at[k];
        for (int r = 0; r < @_rows; r++)
            if (@_counts(k, r)) a->v[r] = (a->force[r] * (a->miss[r] + a->slack[r]) + a->target[r]) / a->slack[r];
    }
    (void)@_aim(s);
    for (int i = 0; i < @_n; i++) s->at[0].z_step[i] = 0.0;
    for (int k = 0; k <= @_horizon; k++) {
        @_stage *a = &s->at[k];
        for (int i = 0; k < @_horizon && i < @_m; i++) {
            a->c_step[i] = a->move[i];
            for (int j = 0; j < @_n; j++) a->c_step[i] += a->gain[i][j] * a->z_step[j];
        }
        if (k < @_horizon) @_next(a->z_step, a->c_step, s->at[k + 1].z_step);
        for (int r = 0; r < @_rows; r++) {
            double change = 0.0;
            if (!@_counts(k, r)) continue;
            if (k < @_horizon) change = @_row(r, a->z_step, a->c_step);
            else for (int i = 0; i < @_n; i++) change += 2.0 * a->z[i] * a->z_step[i];
            a->slack_step[r] = -(a->miss[r] + a->slack[r]) - change;
            a->force_step[r] = (a->target[r] - a->force[r] * a->slack_step[r]) / a->slack[r] - a->force[r];
            if (a->slack_step[r] < 0.0) far = fmin(far, -a->slack[r] / a->slack_step[r]);
            if (a->force_step[r] < 0.0) far = fmin(far, -a->force[r] / a->force_step[r]);
        }
    }
    return far;
}

/* Improve the controls in at[]; 1: they are the best (to 1e-9, in the last turn 1e-6). */
static inline int @_solve(@_memory *s, const double *z)
{
    double cost;
    if (!(@_follow(s, z, &cost) < INFINITY)) return 0;
    for (int k = 0; k <= @_horizon; k++)
        for (int r = 0; r < @_rows; r++) {
            if (!@_counts(k, r)) continue;
            s->at[k].slack[r] = fmax(-s->at[k].miss[r], 0.1);
            s->at[k].force[r] = 0.1 / s->at[k].slack[r];
        }
    for (int turn = 0; turn < @_rounds; turn++) {
        double gap = 0.0, then = 0.0, worst = 0.0, far, count = 0.0, loose = turn + 1 < @_rounds ? 1.0 : 1e3;
        for (int k = 0; k <= @_horizon; k++)
            for (int r = 0; r < @_rows; r++) {
                @_stage *a = &s->at[k];
                if (!@_counts(k, r)) continue;
                a->target[r] = 0.0;
                a->v[r] = a->force[r];
                gap += a->slack[r] * a->force[r];
                worst = fmax(worst, fabs(a->miss[r] + a->slack[r]));
                count += 1.0;
            }
        if (!@_factor(s)) return 0;
        if (@_aim(s) <= 1e-9 * loose && worst <= 1e-9 * loose && gap <= 1e-10 * loose * (1e-6 + cost)) return 1;
        far = @_newton(s);
        for (int k = 0; k <= @_horizon; k++)
            for (int r = 0; r < @_rows; r++) {
                @_stage *a = &s->at[k];
                if (!@_counts(k, r)) continue;
                then += (a->slack[r] + far * a->slack_step[r]) * (a->force[r] + far * a->force_step[r]);
            }
        then = then / gap;
        for (int k = 0; k <= @_horizon; k++)
            for (int r = 0; r < @_rows; r++) {
                @_stage *a = &s->at[k];
                if (!@_counts(k, r)) continue;
                a->target[r] = then * then * then * gap / count - a->slack_step[r] * a->force_step[r];
            }
        far = @_newton(s);
        far = fmin(1.0, 0.99 * far);
        for (int k = 0; k <= @_horizon; k++) {
            @_stage *a = &s->at[k];
            for (int r = 0; r < @_rows; r++) {
                if (!@_counts(k, r)) continue;
                a->slack[r] += far * a->slack_step[r];
                a->force[r] += far * a->force_step[r];
            }
            for (int i = 0; k < @_horizon && i < @_m; i++) a->c[i] += far * a->c_step[i];
        }
        if (!(@_follow(s, z, &cost) < INFINITY)) return 0;
    }
    return 0;
}

/* u = K x moved to the limits of this sample, in turn; those of the controls alone are kept in the end. */
static inline void @_fall_back(const double *z, double *c)
{
    double law[@_m], share = 1.0;
    for (int i = 0; i < @_m; i++) c[i] = 0.0;
    for (int sweep = 0; sweep < 10; sweep++)
        for (int r = 0; r < @_rows; r++) {
            double over = @_row(r, z, c) - 1.0, square = 0.0;
            for (int i = 0; i < @_m; i++) square += @_H[r][i] * @_H[r][i];
            if (!(over > 0.0 && square > 0.0)) continue;
            for (int i = 0; i < @_m; i++) c[i] -= @_H[r][i] * over / square;
        }
    for (int r = 0; r < @_rows; r++)
        if (@_moved[r] == 2) share = fmin(share, 1.0 / fmax(@_row(r, z, c), 1.0));
    for (int i = 0; i < @_m; i++) {
        law[i] = 0.0;
        for (int j = 0; j < @_n; j++) law[i] += @_K[i][j] * z[j];
        c[i] = share * (law[i] + c[i]) - law[i];
    }
}

static inline void @_start(@_memory *s)
{
    for (int k = 0; k < @_horizon; k++)
        for (int i = 0; i < @_m; i++) s->plan[k][i] = 0.0;
    for (int i = 0; i < @_n; i++) s->expected[i] = 0.0;
}

static inline int @_step(@_memory *s, const double x[@_n], double u[@_m])
{
    double z[@_n], first[@_m], before = INFINITY, after = INFINITY;
    int finite = 1, kept, best, status;
    for (int i = 0; i < @_n; i++) {
        z[i] = 0.0;
        for (int j = 0; j < @_n; j++) z[i] += @_scaled[i][j] * x[j];
        finite = finite && fabs(z[i]) < INFINITY;
    }
    for (int i = 0; !finite && i < @_n; i++) z[i] = s->expected[i];
    for (int k = 0; k < @_horizon; k++) /* the rest of the plan before, then the law of the terminal set: c = 0 */
        for (int i = 0; i < @_m; i++) {
            s->plan[k][i] = k + 1 < @_horizon ? s->plan[k + 1][i] : 0.0;
            s->at[k].c[i] = s->plan[k][i];
        }
    kept = @_follow(s, z, &before) <= 1e-6;
    for (int k = 0; !kept && k < @_horizon; k++)
        for (int i = 0; i < @_m; i++) s->at[k].c[i] = 0.0;
    best = @_solve(s, z);
    if (@_follow(s, z, &after) <= 1e-6 && (best || !kept || after <= before)) {
        status = best ? 0 : 1;
        for (int k = 0; k < @_horizon; k++)
            for (int i = 0; i < @_m; i++) s->plan[k][i] = s->at[k].c[i];
    } else {
        status = kept ? 1 : 2;
    }
    for (int i = 0; i < @_m; i++) first[i] = s->plan[0][i];
    if (status == 2) {
        @_start(s);
        @_fall_back(z, first);
    }
    for (int i = 0; i < @_m; i++) {
        u[i] = first[i];
        for (int j = 0; j < @_n; j++) u[i] += @_K[i][j] * z[j];
        u[i] *= @_unit[i];
    }
    @_next(z, first, s->expected);
    return finite ? status : 3;
}
"""
