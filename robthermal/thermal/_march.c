/* One segment of exponential collocation after the other, for small systems: what _exponential.py does with numpy; and
 * the derivatives of many samples, what _sensitivity.py does.
 *
 * Called through _march.py, which checks sizes. The heats of a sample are found by the fixed point T = base + M q(T) at
 * its nodes; a sample whose fixed point does not converge, or whose heats are not smooth, is left to the caller. The
 * build compiles this file once for every kind of processor, with vectors of LANES numbers; the names of what is called
 * from outside end with LANES.
 */
#include <math.h>
#include <string.h>

#include "../_lanes.h"

#define COLDEST 1.0 /* K, as in _terms.py */
#define PIVOT 1e-2 /* in size, from which a row is divided by it; every diagonal entry is about 1 */
enum { DEGREE = 5, NODES = DEGREE + 1, ITERATIONS = 20, NUMBERS = 8, MOST = 64, MOST_PORTS = 12, MOST_PAIRS = 64 };
enum { ROWS = DEGREE * MOST + MOST + 2 * LANES, HEATS = NODES * MOST + LANES };
#define INLINE inline __attribute__((always_inline))
enum { MODULE, NATURAL, RADIATION, STEP, FOLLOW, HEATER, LEAD, CONDENSATION, POWER }; /* as numbered in _march.py */

/* The same fields, in the same order, as `_Problem` of _march.py; matrices row by row. */
typedef struct {
    int64_t n_z, n_w, n_ports, n_q, n_pairs, count;
    const double *K, *Ku, *M;             /* (rows, n_z), (rows, n_w), (rows, NODES n_q); rows = DEGREE n_ports + n_z */
    const double *Kt, *Kut, *Mt;          /* transposed, each row filled up with zeros to `padded` numbers */
    int64_t padded;
    const int64_t *ports;                 /* (n_ports,) */
    const int64_t *pairs;                 /* (n_pairs, 4): kind of a heat, ends and drive in [ports, w], -1 for none */
    const double *numbers;                /* (n_pairs, NUMBERS) of every heat */
    const double *scatter;                /* (2 n_pairs, padded_q): what flows into both ends of a pair, by target */
    int64_t padded_q;                     /* numbers of a row, of which those after the first n_q are 0 */
    const double *gain, *tail;            /* (n_q,) and (2, NODES) */
    double goal, roughest, hottest;       /* all [K]; nothing at the ports is as hot as the last */
    const double *w;                      /* (count, n_w) */
    double *z;                            /* (count + 1, n_z), the first given; for derivatives (count, n_z), all */
    int64_t n_free;                       /* states that are differentiated, the first */
    double *V, *q;                        /* (count, NODES, n_ports + n_w) and (count, NODES, n_q), of every node */
    double *F, *through;                  /* (count, n_free, n_free) and (count, n_free, DEGREE n_ports) */
} problem;

/* Mean of both ends by the temperature at which a conductance holds. */
static double power_ratio(const double *p, double total)
{
    return fmax(0.5 * (total + p[3] + p[4]), COLDEST) / p[2];
}

/* Heat into both ends of a pair, as `heat` of the terms in numpy. */
static void flow(int64_t kind, const double *p, double a, double b, double drive, double *into)
{
    const double total = a + b, away = a - b;
    double q;
    switch (kind) {
    case MODULE: {
        const double pump = (p[0] - p[1] * p[5] + 0.5 * p[1] * total) * drive;
        const double joule = (p[2] - p[3] * p[5] + 0.5 * p[3] * total) * (0.5 * drive * drive);
        const double leak = p[4] * (0.5 * total - p[5]) * away + 2.0 * p[7] * joule;
        const double rest = joule - 0.5 * p[6] * drive * away;
        into[0] = pump * a + rest - leak;
        into[1] = rest - pump * b + leak;
        return;
    }
    case NATURAL:
        q = p[2] - away;
        q = p[0] * pow(fabs(q), p[1]) * q;
        break;
    case RADIATION: {
        const double hot = (b + p[2]) * (b + p[2]), cold = (a + p[1]) * (a + p[1]);
        q = p[0] * (hot * hot - cold * cold);
        break;
    }
    case STEP:
        q = p[0] * drive * (p[1] - away);
        break;
    case FOLLOW:
        q = p[0] * fabs(drive) * (p[1] - away);
        break;
    case HEATER:
        q = p[0] * (a - p[1]) * drive;
        into[0] = (1.0 - p[2]) * q;
        into[1] = p[2] * q;
        return;
    case LEAD:
        into[0] = p[0] * drive * drive;
        into[1] = 0.0;
        return;
    case POWER:
        q = p[4] - p[3] - away;
        q = p[0] * (pow(power_ratio(p, total), p[1]) - 1.0) * q;
        break;
    default: /* CONDENSATION */
        into[0] = a < p[1] ? p[0] * (p[1] - a) : 0.0;
        into[1] = 0.0;
        return;
    }
    into[0] = q;
    into[1] = -q;
}

/* Derivatives of the heats into both ends by a, b and the drive, as `slopes` of the terms in numpy. */
static void slopes(int64_t kind, const double *p, double a, double b, double drive, double (*by)[3])
{
    const double away = a - b;
    double g, driven = 0.0;
    switch (kind) {
    case MODULE: {
        const double above = 0.5 * (a + b) - p[5], S = p[0] + p[1] * above, R = p[2] + p[3] * above;
        const double half = 0.5 * p[1] * drive, joule = 0.25 * p[3] * drive * drive, uneven = 2.0 * p[7];
        const double hot = (1.0 - uneven) * joule, cold = (1.0 + uneven) * joule, leak = p[4] * above;
        const double bend = 0.5 * p[4] * away, own = 0.5 * p[6] * drive, along = 0.5 * p[6] * away;
        by[0][0] = S * drive + half * a + hot - leak - bend - own;
        by[0][1] = half * a + hot + leak - bend + own;
        by[0][2] = S * a + (1.0 - uneven) * R * drive - along;
        by[1][0] = -half * b + cold + leak + bend - own;
        by[1][1] = -S * drive - half * b + cold - leak + bend + own;
        by[1][2] = -S * b + (1.0 + uneven) * R * drive - along;
        return;
    }
    case NATURAL:
        g = p[0] * (1.0 + p[1]) * pow(fabs(p[2] - away), p[1]);
        by[0][0] = -g;
        by[0][1] = g;
        break;
    case RADIATION: {
        const double hot = b + p[2], cold = a + p[1];
        by[0][0] = -4.0 * p[0] * cold * cold * cold;
        by[0][1] = 4.0 * p[0] * hot * hot * hot;
        break;
    }
    case STEP:
    case FOLLOW:
        g = p[0] * (kind == STEP ? drive : fabs(drive));
        driven = p[0] * (p[1] - away) * (kind == STEP ? 1.0 : (drive > 0.0) - (drive < 0.0));
        by[0][0] = -g;
        by[0][1] = g;
        break;
    case HEATER:
        for (int side = 0; side < 2; side++) {
            const double share = side ? p[2] : 1.0 - p[2];
            by[side][0] = share * p[0] * drive;
            by[side][1] = 0.0;
            by[side][2] = share * p[0] * (a - p[1]);
        }
        return;
    case POWER: {
        const double ratio = power_ratio(p, a + b), factor = pow(ratio, p[1]);
        const double bend = 0.5 * p[0] * p[1] * factor / (ratio * p[2]) * (p[4] - p[3] - away);
        g = p[0] * (factor - 1.0);
        by[0][0] = bend - g;
        by[0][1] = bend + g;
        break;
    }
    default: /* LEAD, CONDENSATION */
        memset(by, 0, 2 * sizeof(*by));
        by[0][kind == LEAD ? 2 : 0] = kind == LEAD ? 2.0 * p[0] * drive : a < p[1] ? -p[0] : 0.0;
        return;
    }
    by[0][2] = driven;
    for (int k = 0; k < 3; k++)
        by[1][k] = -by[0][k];
}

static INLINE vec load(const double *from)
{
    vec out;
    memcpy(&out, from, sizeof(vec));
    return out;
}

/* y += A x of LANES rows, or of twice as many, from the first of A on, which is given by columns `apart` numbers from
 * one to the next: even and odd ones are summed up by themselves, for sums that do not wait for each other. */
static INLINE void add_some(int vectors, const double *A, int64_t apart, const double *x, int64_t columns, double *y)
{
    vec even[2], odd[2];
    for (int v = 0; v < vectors; v++) {
        even[v] = load(y + LANES * v);
        odd[v] = (vec){0.0};
    }
    int64_t j = 0;
    for (; j + 2 <= columns; j += 2, A += 2 * apart)
        for (int v = 0; v < vectors; v++) {
            even[v] += load(A + LANES * v) * x[j];
            odd[v] += load(A + apart + LANES * v) * x[j + 1];
        }
    for (int v = 0; v < vectors; v++) {
        if (j < columns)
            even[v] += load(A + LANES * v) * x[j];
        even[v] += odd[v];
        memcpy(y + LANES * v, &even[v], sizeof(vec));
    }
}

/* y += A x for A (rows, columns) given by columns, `apart` numbers from one to the next: up to LANES - 1 numbers of y
 * after the last row are written too. */
static INLINE void add(const double *A, int64_t apart, const double *x, int64_t rows, int64_t columns, double *y)
{
    int64_t i = 0;
    for (; i + LANES < rows; i += 2 * LANES)
        add_some(2, A + i, apart, x, columns, y + i);
    if (i < rows)
        add_some(1, A + i, apart, x, columns, y + i);
}

/* Heats by target at one node, V = [ports, w]; up to LANES - 1 numbers after them are written too. */
static INLINE void heats(const problem *at, const double *V, double *q)
{
    double into[2 * MOST_PAIRS];
    memset(q, 0, sizeof(double) * (at->n_q + LANES - 1));
    for (int64_t pair = 0; pair < at->n_pairs; pair++) {
        const int64_t *place = at->pairs + 4 * pair;
        flow(place[0], at->numbers + NUMBERS * pair, V[place[1]], V[place[2]], place[3] < 0 ? 0.0 : V[place[3]],
             into + 2 * pair);
    }
    add(at->scatter, at->padded_q, into, at->n_q, 2 * at->n_pairs, q);
}

/* What the last coefficients of the heats of a sample are worth [K]: little where the heats are smooth. */
static double roughness(const problem *at, const double *q)
{
    double worst = 0.0;
    for (int64_t j = 0; j < at->n_q; j++) {
        double sum = 0.0;
        for (int row = 0; row < 2; row++) {
            double coefficient = 0.0;
            for (int64_t node = 0; node < NODES; node++)
                coefficient += at->tail[NODES * row + node] * q[at->n_q * node + j];
            sum += fabs(coefficient);
        }
        worst = fmax(worst, sum * at->gain[j]);
    }
    return worst;
}

/* Heats q at all nodes of a sample from z, where the temperatures there are V; 0 where the fixed point is not found.
 * base: what rows of K and Ku make of state and drives. */
static int fixed_point(const problem *at, const double *z, const double *w, double *V, double *q, double *base)
{
    const int64_t n_ports = at->n_ports, n_q = at->n_q, width = n_ports + at->n_w, nodes = DEGREE * n_ports;
    double now[DEGREE * MOST + LANES], before = HUGE_VAL;
    memset(base, 0, sizeof(double) * (nodes + at->n_z + LANES));
    add(at->Kt, at->padded, z, nodes + at->n_z, at->n_z, base);
    add(at->Kut, at->padded, w, nodes + at->n_z, at->n_w, base);
    for (int64_t node = 0; node < NODES; node++) {
        for (int64_t i = 0; i < n_ports; i++)
            V[width * node + i] = z[at->ports[i]];
        memcpy(V + width * node + n_ports, w, sizeof(double) * at->n_w);
    }
    heats(at, V, q);
    for (int64_t node = 1; node < NODES; node++)
        memcpy(q + n_q * node, q, sizeof(double) * n_q);
    for (int k = 0; k < ITERATIONS; k++) {
        double change = 0.0;
        memcpy(now, base, sizeof(double) * (nodes + LANES));
        add(at->Mt, at->padded, q, nodes, NODES * n_q, now);
        for (int64_t node = 1; node < NODES; node++)
            for (int64_t i = 0; i < n_ports; i++) {
                const double T = now[n_ports * (node - 1) + i];
                if (!(fabs(T) < at->hottest)) /* or not a number */
                    return 0;
                change = fmax(change, fabs(T - V[width * node + i]));
                V[width * node + i] = T;
            }
        if (k > 1 && !(change < before) && !(change < at->goal))
            return 0;
        for (int64_t node = 1; node < NODES; node++)
            heats(at, V + width * node, q + n_q * node);
        if (change < at->goal)
            return 1;
        before = change;
    }
    return 0;
}

/* One sample from z to the n_z numbers after it; 0 where it is left to the caller. worst: its roughness, if larger. */
static INLINE int sample(const problem *at, const double *z, const double *w, double *end, double *worst)
{
    const int64_t nodes = DEGREE * at->n_ports, columns = NODES * at->n_q;
    double V[NODES * MOST], q[HEATS], base[ROWS];
    if (!fixed_point(at, z, w, V, q, base))
        return 0;
    const double rough = roughness(at, q);
    if (!(rough <= at->roughest))
        return 0;
    *worst = fmax(*worst, rough);
    add(at->Mt + nodes, at->padded, q, at->n_z, columns, base + nodes);
    memcpy(end, base + nodes, sizeof(double) * at->n_z);
    return 1;
}

/* Rows of M times the derivatives of the heats by the ports, node by node: out (rows, NODES n_ports). */
static INLINE void by_ports(const problem *at, int64_t n_ports, const double *M, int64_t rows, const vec *G, vec *out)
{
    const int64_t n_q = at->n_q;
    memset(out, 0, sizeof(vec) * rows * NODES * n_ports);
    for (int64_t row = 0; row < rows; row++, M += NODES * n_q, out += NODES * n_ports)
        for (int64_t node = 0; node < NODES; node++)
            for (int64_t j = 0; j < n_q; j++)
                for (int64_t i = 0; i < n_ports; i++)
                    out[n_ports * node + i] += M[n_q * node + j] * G[n_ports * (n_q * node + j) + i];
}

/* Numbers of LANES samples from `first` on, `apart` from one to the next; beyond the last one they are left out. */
static INLINE void store(const problem *at, double *to, int64_t apart, int64_t first, vec numbers)
{
    for (int64_t lane = 0; lane < LANES && first + lane < at->count; lane++)
        to[apart * (first + lane)] = numbers[lane];
}

/* Derivatives (n_q, n_ports) of the heats by target at one node: one of LANES numbers each, the first at G. */
static void heat_slopes(const problem *at, const double *V, double *G)
{
    for (int64_t j = 0; j < at->n_q * at->n_ports; j++)
        G[LANES * j] = 0.0;
    for (int64_t pair = 0; pair < at->n_pairs; pair++) {
        const int64_t *place = at->pairs + 4 * pair;
        double by[2][3];
        slopes(place[0], at->numbers + NUMBERS * pair, V[place[1]], V[place[2]], place[3] < 0 ? 0.0 : V[place[3]], by);
        for (int side = 0; side < 2; side++)
            for (int64_t j = 0; j < at->n_q; j++) {
                const double to = at->scatter[at->padded_q * (2 * pair + side) + j];
                for (int k = 0; k < 3; k++)
                    if (to != 0.0 && place[1 + k] >= 0 && place[1 + k] < at->n_ports)
                        G[LANES * (at->n_ports * j + place[1 + k])] += to * by[side][k];
            }
    }
}

/* Solve [A B] of n rows: X with A X = B replaces B. A is 1 less the derivative of a fixed point that converges: without
 * exchange of rows; 0 where a pivot is small all the same. */
static INLINE int solve(vec *rows, int64_t n, int64_t width)
{
    vec per_pivot[DEGREE * MOST_PORTS];
    for (int64_t k = 0; k < n; k++) {
        const vec pivot = rows[width * k + k];
        for (int lane = 0; lane < LANES; lane++)
            if (!(fabs(pivot[lane]) > PIVOT))
                return 0;
        per_pivot[k] = 1.0 / pivot;
        for (int64_t i = k + 1; i < n; i++) {
            const vec factor = rows[width * i + k] * per_pivot[k];
            for (int64_t j = k + 1; j < width; j++)
                rows[width * i + j] -= factor * rows[width * k + j];
        }
    }
    for (int64_t k = n - 1; k >= 0; k--) {
        for (int64_t i = k + 1; i < n; i++)
            for (int64_t j = n; j < width; j++)
                rows[width * k + j] -= rows[width * k + i] * rows[width * i + j];
        for (int64_t j = n; j < width; j++)
            rows[width * k + j] *= per_pivot[k];
    }
    return 1;
}

/* Derivatives of LANES samples from `first` on, F of their ends by their starts and `through` of these by what is
 * added at the nodes; at the end of the samples the last one takes the places that are left. */
static INLINE int derivatives(const problem *at, int64_t n_ports, int64_t first)
{
    const int64_t n_q = at->n_q, n = at->n_free, nodes = DEGREE * n_ports;
    const int64_t columns = NODES * n_ports, width = nodes + n, per_node = n_ports + at->n_w;
    double base[ROWS], q[HEATS];
    vec G[NODES * MOST * MOST_PORTS], at_nodes[DEGREE * MOST_PORTS * NODES * MOST_PORTS];
    vec at_end[MOST * NODES * MOST_PORTS], rows[DEGREE * MOST_PORTS * (DEGREE * MOST_PORTS + MOST)];
    for (int64_t lane = 0; lane < LANES; lane++) {
        const int64_t k = first + lane < at->count ? first + lane : at->count - 1;
        double *V = at->V + NODES * per_node * k;
        if (!fixed_point(at, at->z + at->n_z * k, at->w + at->n_w * k, V, q, base))
            return 0;
        memcpy(at->q + NODES * n_q * k, q, sizeof(double) * NODES * n_q);
        for (int64_t node = 0; node < NODES; node++)
            heat_slopes(at, V + per_node * node, (double *)(G + n_q * n_ports * node) + lane);
    }
    by_ports(at, n_ports, at->M, nodes, G, at_nodes);
    by_ports(at, n_ports, at->M + nodes * NODES * n_q, n, G, at_end);
    for (int64_t i = 0; i < nodes; i++) { /* transposed: as many right sides as states */
        for (int64_t j = 0; j < nodes; j++)
            rows[width * i + j] = (i == j ? 1.0 : 0.0) - at_nodes[columns * j + n_ports + i];
        for (int64_t j = 0; j < n; j++)
            rows[width * i + nodes + j] = at_end[columns * j + n_ports + i];
    }
    if (!solve(rows, nodes, width))
        return 0;
    for (int64_t i = 0; i < n; i++) {
        vec F[MOST];
        for (int64_t j = 0; j < n; j++)
            F[j] = at->K[at->n_z * (nodes + i) + j] + (vec){0.0};
        for (int64_t p = 0; p < n_ports; p++)
            F[at->ports[p]] += at_end[columns * i + p];
        for (int64_t k = 0; k < nodes; k++) {
            const vec by = rows[width * k + nodes + i];
            store(at, at->through + nodes * i + k, n * nodes, first, by);
            for (int64_t j = 0; j < n; j++)
                F[j] += by * at->K[at->n_z * k + j];
            for (int64_t p = 0; p < n_ports; p++)
                F[at->ports[p]] += by * at_nodes[columns * k + p];
        }
        for (int64_t j = 0; j < n; j++)
            store(at, at->F + n * i + j, n * n, first, F[j]);
    }
    return 1;
}

/* The same, where the compiler knows how many ports there are, and unrolls its loops: a quarter less time. */
static INLINE int of_size(const problem *at, int64_t first)
{
    switch (at->n_ports) {
    case 1: return derivatives(at, 1, first);
    case 2: return derivatives(at, 2, first);
    case 3: return derivatives(at, 3, first);
    case 4: return derivatives(at, 4, first);
    default: return derivatives(at, at->n_ports, first);
    }
}

int64_t NAMED(robthermal_march_size_, LANES)(void)
{
    return sizeof(problem);
}

static int fits(const problem *at)
{
    return at->n_ports <= MOST_PORTS && at->n_pairs <= MOST_PAIRS && at->n_ports + at->n_w <= MOST && at->n_q <= MOST
           && at->n_z <= MOST;
}

/* Samples that were differentiated: `count`, or fewer where a fixed point is not found. */
int64_t NAMED(robthermal_derivatives_, LANES)(const problem *at)
{
    if (!fits(at) || at->n_free > at->n_z)
        return 0;
    for (int64_t first = 0; first < at->count; first += LANES)
        if (!of_size(at, first))
            return first;
    return at->count;
}

/* Segments that were computed, at most `count` of the first: segment k is as long as a step of kinds[kind[k]].
 * worst: the largest roughness of them. */
int64_t NAMED(robthermal_march_, LANES)(const problem *kinds, const int64_t *kind, double *worst)
{
    const int64_t count = kinds->count, n_z = kinds->n_z, n_w = kinds->n_w;
    *worst = 0.0;
    if (!fits(kinds))
        return 0;
    for (int64_t k = 0; k < count; k++)
        if (!sample(kinds + kind[k], kinds->z + k * n_z, kinds->w + k * n_w, kinds->z + (k + 1) * n_z, worst))
            return k;
    return count;
}
