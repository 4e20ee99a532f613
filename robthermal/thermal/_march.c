/* One sample of exponential collocation after the other, for small systems: what _exponential.py does with numpy.
 *
 * Called through _march.py, which checks sizes. The heats of a sample are found by the fixed point T = base + M q(T) at
 * its nodes; a sample whose fixed point does not converge, or whose heats are not smooth, is left to the caller.
 */
#include <math.h>
#include <stdint.h>
#include <string.h>

enum { DEGREE = 5, NODES = DEGREE + 1, ITERATIONS = 20, NUMBERS = 8, MOST = 64 };
enum { MODULE, NATURAL, RADIATION, STEP, FOLLOW, HEATER, LEAD, CONDENSATION };

/* The same fields, in the same order, as `_Problem` of _march.py; matrices row by row. */
typedef struct {
    int64_t n_z, n_w, n_ports, n_q, n_pairs, count;
    const double *K, *Ku, *M;             /* (rows, n_z), (rows, n_w), (rows, NODES n_q); rows = DEGREE n_ports + n_z */
    const int64_t *ports;                 /* (n_ports,) */
    const int64_t *pairs;                 /* (n_pairs, 4): kind of a heat, ends and drive in [ports, w], -1 for none */
    const double *numbers;                /* (n_pairs, NUMBERS) of every heat */
    const double *scatter;                /* (2 n_pairs, n_q): what flows into both ends of a pair, by target */
    const double *gain, *tail;            /* (n_q,) and (2, NODES) */
    double goal, roughest, hottest;       /* all [K]; nothing at the ports is as hot as the last */
    const double *w;                      /* (count, n_w) */
    double *z;                            /* (count + 1, n_z), the first given */
} problem;

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
    default: /* CONDENSATION */
        into[0] = a < p[1] ? p[0] * (p[1] - a) : 0.0;
        into[1] = 0.0;
        return;
    }
    into[0] = q;
    into[1] = -q;
}

/* Heats by target at one node, V = [ports, w]. */
static void heats(const problem *at, const double *V, double *q)
{
    memset(q, 0, sizeof(double) * at->n_q);
    for (int64_t pair = 0; pair < at->n_pairs; pair++) {
        const int64_t *place = at->pairs + 4 * pair;
        double into[2];
        flow(place[0], at->numbers + NUMBERS * pair, V[place[1]], V[place[2]], place[3] < 0 ? 0.0 : V[place[3]], into);
        for (int side = 0; side < 2; side++) {
            const double *to = at->scatter + at->n_q * (2 * pair + side);
            for (int64_t j = 0; j < at->n_q; j++)
                q[j] += to[j] * into[side];
        }
    }
}

/* y += A x for A (rows, columns). */
static void add(const double *A, const double *x, int64_t rows, int64_t columns, double *y)
{
    for (int64_t i = 0; i < rows; i++, A += columns) {
        double sum = 0.0;
        for (int64_t j = 0; j < columns; j++)
            sum += A[j] * x[j];
        y[i] += sum;
    }
}

/* Whether the heats of a sample are smooth: their last coefficients are worth little. */
static int smooth(const problem *at, const double *q)
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
    return worst <= at->roughest;
}

/* One sample from z to the n_z numbers after it; 0 where it is left to the caller. */
static int sample(const problem *at, const double *z, const double *w, double *end)
{
    const int64_t n_ports = at->n_ports, n_q = at->n_q, width = n_ports + at->n_w, nodes = DEGREE * n_ports;
    double V[NODES][MOST], q[NODES * MOST], base[DEGREE * MOST + MOST], now[DEGREE * MOST], before = HUGE_VAL;
    memset(base, 0, sizeof(double) * (nodes + at->n_z));
    add(at->K, z, nodes + at->n_z, at->n_z, base);
    add(at->Ku, w, nodes + at->n_z, at->n_w, base);
    for (int node = 0; node < NODES; node++) {
        for (int64_t i = 0; i < n_ports; i++)
            V[node][i] = z[at->ports[i]];
        memcpy(V[node] + n_ports, w, sizeof(double) * (width - n_ports));
    }
    heats(at, V[0], q);
    for (int node = 1; node < NODES; node++)
        memcpy(q + n_q * node, q, sizeof(double) * n_q);
    for (int k = 0; k < ITERATIONS; k++) {
        double change = 0.0;
        memcpy(now, base, sizeof(double) * nodes);
        add(at->M, q, nodes, NODES * n_q, now);
        for (int node = 1; node < NODES; node++)
            for (int64_t i = 0; i < n_ports; i++) {
                const double T = now[n_ports * (node - 1) + i];
                if (!(fabs(T) < at->hottest)) /* or not a number */
                    return 0;
                change = fmax(change, fabs(T - V[node][i]));
                V[node][i] = T;
            }
        if (k > 1 && !(change < before))
            return 0;
        for (int node = 1; node < NODES; node++)
            heats(at, V[node], q + n_q * node);
        if (change < at->goal)
            break;
        if (k == ITERATIONS - 1)
            return 0;
        before = change;
    }
    if (!smooth(at, q))
        return 0;
    memcpy(end, base + nodes, sizeof(double) * at->n_z);
    add(at->M + nodes * NODES * n_q, q, at->n_z, NODES * n_q, end);
    return 1;
}

int64_t robthermal_march_size(void)
{
    return sizeof(problem);
}

/* Samples that were computed, at most `count`. */
int64_t robthermal_march(const problem *at)
{
    if (at->n_ports + at->n_w > MOST || at->n_q > MOST || at->n_z > MOST)
        return 0;
    for (int64_t k = 0; k < at->count; k++)
        if (!sample(at, at->z + k * at->n_z, at->w + k * at->n_w, at->z + (k + 1) * at->n_z))
            return k;
    return at->count;
}
