/* Interior windows of local methods through their normal equations, LANES windows at a time.
 *
 * The method is that of _normal.py, term by term; docs/explanations/frf_lpm.md derives it. A vector holds one number of
 * several windows, whose centers lie a stretch of bins apart, so that every load of a sliding window is aligned.
 * Called through _compiled.py, which checks sizes. hatch_build.py compiles this file once for every kind of processor,
 * LANES numbers wide, into one library; the names of what is called from outside end with LANES.
 */
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "_vectors.h"

enum { LENGTH = 32, MOST_SIZE = 5, MOST_COLUMNS = 24, MOST_FUNCTIONS = 2 * MOST_SIZE - 1 };

/* The same fields, in the same order, as `_Problem` of _compiled.py. */
typedef struct {
    int64_t n_records, n_u, n_y, size, half, n_poles;
    int64_t count, stride;                            /* windows; from one row of a result to the next */
    const complex_number *const *U, *const *Y;        /* of every record, (n_u, .) and (n_y, .), count + 2 half bins */
    const int64_t (*strides)[2];                      /* of every record: from one channel of U, of Y to the next */
    const complex_number *turn;                       /* (count + 2 half,) exp(j theta/2) of every bin, if there are poles */
    const double (*poles)[4];                         /* of every pole alpha and beta: complex numbers */
    const double *products, *functions, *ones;        /* (half+1, 2 size-1), (half+1, size), (half+1, 1): r >= 0 */
    double weak_pivot, weak_residual, weak_both, degrees_of_freedom;
    complex_number *response, *gram, *noise;          /* (n_y, n_u, .), (n_u, n_u, .), (n_y, n_y, .) or NULL */
    double *variance;                                 /* (n_y, .) */
    unsigned char *doubtful;
} problem;

/* Sums over two neighboring windows, of which the first begins at x, times functions f (half+1, count) that are even
 * for even p, odd for odd p. */
INLINE void sums(const vec *x, int half, const double *f, int count, vec (*out)[2])
{
    const vec *center = x + half;
    vec s[MOST_FUNCTIONS][2], right = center[1], left = center[0];
    for (int p = 0; p < count; p++) {
        s[p][0] = center[0] * f[p];
        s[p][1] = center[1] * f[p];
    }
    for (int r = 1; r <= half; r++) {
        const vec next = center[r + 1], last = center[-r];
        const vec even[2] = {right + last, next + left}, odd[2] = {right - last, next - left};
        for (int p = 0; p < count; p++) {
            s[p][0] += (p % 2 ? odd : even)[0] * f[r * count + p];
            s[p][1] += (p % 2 ? odd : even)[1] * f[r * count + p];
        }
        right = next;
        left = last;
    }
    for (int p = 0; p < count; p++) {
        out[p][0] = s[p][0];
        out[p][1] = s[p][1];
    }
}

/* L D L' of the normal equations of the transient, whose entry (s, t) is moments[s + t]: 1/D on the diagonal of
 * factors, column s of L in row s. Returns the least energy left of a function, relative to the first. */
INLINE vec factorize(const vec (*moments)[2], int window, const int size, vec *factors)
{
    vec left[MOST_SIZE][MOST_SIZE], least = fill(1.0);
    const vec all = 1.0 / moments[0][window];
    for (int s = 0; s < size; s++)
        for (int t = 0; t < size; t++) left[s][t] = moments[s + t][window];
    for (int s = 0; s < size; s++) {
        least = smaller(least, left[s][s] * all);
        const vec inverse = 1.0 / left[s][s];
        factors[s * size + s] = inverse;
        for (int t = s + 1; t < size; t++) {
            factors[s * size + t] = left[s][t] * inverse;
            for (int e = t; e < size; e++) left[t][e] -= factors[s * size + t] * left[s][e];
        }
    }
    return least;
}

/* In place of exp(j theta/2) the factor w = 1/D, D the product of alpha cos(theta/2) + j beta sin(theta/2) over the poles, and |w|^2. */
INLINE void weigh(const problem *q, int length, signal w, vec *energy)
{
    for (int j = 0; j < length; j++) {
        const vec cosine = w.re[j], sine = w.im[j];
        vec re = fill(1.0), im = fill(0.0);
        for (int64_t p = 0; p < q->n_poles; p++) {
            const double *alpha = q->poles[p], *beta = q->poles[p] + 2;
            const vec x = cosine * alpha[0] - sine * beta[1], y = cosine * alpha[1] + sine * beta[0], before = re;
            re = re * x - im * y;
            im = im * x + before * y;
        }
        energy[j] = 1.0 / (re * re + im * im);
        w.re[j] = re * energy[j];
        w.im[j] = -im * energy[j];
    }
}

/* Place of the regressor phi_s U_i: the constants of G come last. */
#define COLUMN(i, s) ((s) ? (i) * (size - 1) + size - 1 - (s) : n_u * (size - 1) + (i))

/* Sequences of one block: w and of every record V = w U, Y; conj(w) V, conj(w) Y; conj(a) b of all pairs. */
typedef struct { signal w, *of_records; vec *energy_of_w; } block;

INLINE void prepare(const problem *q, const int n_u, const int n_y, const int64_t *at, int length, block b)
{
    const int n = n_u + n_y;
    if (q->n_poles) {
        side_by_side(q->turn, at, length, b.w);
        weigh(q, length, b.w, b.energy_of_w);
    }
    for (int64_t record = 0; record < q->n_records; record++) {
        signal *const own = b.of_records + record * (2 * n + n * n), *const turned = own + n, *const pairs = own + 2 * n;
        for (int a = 0; a < n; a++) {
            const complex_number *from = a < n_u ? q->U[record] + a * q->strides[record][0]
                                                 : q->Y[record] + (a - n_u) * q->strides[record][1];
            side_by_side(from, at, length, own[a]);
            if (!q->n_poles) {
                turned[a] = own[a];
                continue;
            }
            for (int j = 0; j < length && a < n_u; j++) {
                const vec re = own[a].re[j], im = own[a].im[j];
                own[a].re[j] = b.w.re[j] * re - b.w.im[j] * im;
                own[a].im[j] = b.w.re[j] * im + b.w.im[j] * re;
            }
            multiply(b.w, own[a], length, turned[a]);
        }
        for (int a = 0; a < n; a++)
            for (int c = a; c < n; c++)
                if (a < n_u || a == c || q->noise) multiply(own[a], own[c], length, pairs[a * n + c]);
    }
}

/* Add one record to the normal equations of windows j and j + 1, without what its transient explains. */
INLINE void add(const problem *q, const int n_u, const int n_y, const int size, const signal *own, int j,
                vec (*factors)[size][size], vec (*Hr)[size * n_u + n_y][size * n_u + n_y],
                vec (*Hi)[size * n_u + n_y][size * n_u + n_y], vec (*energy)[n_u + n_y])
{
    const int n = n_u + n_y, n_k = n_u * size, columns = n_k + n_y, half = (int)q->half, n_products = 2 * size - 1;
    const signal *const turned = own + n, *const pairs = own + 2 * n;
    vec Tr[2][columns][size], Ti[2][columns][size], re[MOST_FUNCTIONS][2], im[MOST_FUNCTIONS][2];
    const int unrolled = n == 2 || size == 3;
    const int m_u = bound(n_u, unrolled), m_y = bound(n_y, unrolled);
    for (int a = 0; a < m_u; a++) {
        for (int c = a; c < m_u; c++) {
            sums(pairs[a * n + c].re + j, half, q->products, n_products, re);
            if (a < c) sums(pairs[a * n + c].im + j, half, q->products, n_products, im);
            for (int v = 0; v < 2; v++) {
                if (a == c) energy[v][a] += re[0][v];
                for (int s = 0; s < size; s++)
                    for (int t = 0; t < size; t++) {
                        const int row = COLUMN(a, s), column = COLUMN(c, t);
                        if (row <= column) {
                            Hr[v][row][column] += re[s + t][v];
                            if (a < c) Hi[v][row][column] += im[s + t][v];
                        } else if (a < c) {
                            Hr[v][column][row] += re[s + t][v];
                            Hi[v][column][row] -= im[s + t][v];
                        }
                    }
            }
        }
        for (int o = 0; o < m_y; o++) {
            sums(pairs[a * n + n_u + o].re + j, half, q->functions, size, re);
            sums(pairs[a * n + n_u + o].im + j, half, q->functions, size, im);
            for (int v = 0; v < 2; v++)
                for (int s = 0; s < size; s++) {
                    Hr[v][COLUMN(a, s)][n_k + o] += re[s][v];
                    Hi[v][COLUMN(a, s)][n_k + o] += im[s][v];
                }
        }
        sums(turned[a].re + j, half, q->products, n_products, re);
        sums(turned[a].im + j, half, q->products, n_products, im);
        for (int v = 0; v < 2; v++)
            for (int s = 0; s < size; s++)
                for (int t = 0; t < size; t++) {
                    Tr[v][COLUMN(a, s)][t] = re[s + t][v];
                    Ti[v][COLUMN(a, s)][t] = im[s + t][v];
                }
    }
    for (int o = 0; o < m_y; o++) {
        for (int p = o; p < (q->noise ? m_y : o + 1); p++) {
            sums(pairs[(n_u + o) * n + n_u + p].re + j, half, q->ones, 1, re);
            if (o < p) sums(pairs[(n_u + o) * n + n_u + p].im + j, half, q->ones, 1, im);
            for (int v = 0; v < 2; v++) {
                Hr[v][n_k + o][n_k + p] += re[0][v];
                if (o < p) Hi[v][n_k + o][n_k + p] += im[0][v];
                else energy[v][n_u + o] += re[0][v];
            }
        }
        sums(turned[n_u + o].re + j, half, q->functions, size, re);
        sums(turned[n_u + o].im + j, half, q->functions, size, im);
        for (int v = 0; v < 2; v++)
            for (int s = 0; s < size; s++) {
                Tr[v][n_k + o][s] = re[s][v];
                Ti[v][n_k + o][s] = im[s][v];
            }
    }
    const int every = bound(columns, unrolled);
    for (int v = 0; v < 2; v++)
        for (int e = 0; e < every; e++)
            for (int s = 0; s < size; s++) {
                for (int t = s + 1; t < size; t++) {
                    Tr[v][e][t] -= factors[v][s][t] * Tr[v][e][s];
                    Ti[v][e][t] -= factors[v][s][t] * Ti[v][e][s];
                }
                const vec x = Tr[v][e][s] * factors[v][s][s], y = Ti[v][e][s] * factors[v][s][s];
                for (int d = 0; d <= e; d++)
                    take_away(&Hr[v][d][e], &Hi[v][d][e], Tr[v][d][s], Ti[v][d][s], x, y, d == e);
            }
}

/* Elimination of the regressors of one window, and its results at places `at`. */
INLINE void solve_window(const problem *q, const int n_u, const int n_y, const int size, const int64_t *at, vec least,
                         vec wr, vec wi, vec (*Hr)[size * n_u + n_y], vec (*Hi)[size * n_u + n_y], const vec *energy)
{
    const int n_k = n_u * size, columns = n_k + n_y, last = n_k - n_u;
    const double per_degree = 1.0 / q->degrees_of_freedom;
    vec scale[n_u], Sr[columns], Si[columns];
    for (int i = 0; i < n_u; i++) scale[i] = 1.0 / energy[i];
    /* L D L' as far as the regressors: 1/D on the diagonal, of the last n_u rows L' beside it. */
    const int unrolled = n_u + n_y == 2 || size == 3;
    const int every = bound(columns, unrolled), regressors = bound(n_k, unrolled);
    for (int c = 0; c < regressors; c++) {
        const vec inverse = 1.0 / Hr[c][c];
        least = smaller(least, Hr[c][c] * scale[c >= last ? c - last : c / (size - 1)]);
        Hr[c][c] = inverse;
        for (int e = c + 1; e < every; e++) {
            Sr[e] = Hr[c][e] * inverse;
            Si[e] = Hi[c][e] * inverse;
            for (int d = c + 1; d <= e; d++)
                take_away(&Hr[d][e], &Hi[d][e], Hr[c][d], Hi[c][d], Sr[e], Si[e], d == e);
        }
        for (int e = c + 1; e < every && c >= last; e++) {
            Hr[c][e] = Sr[e];
            Hi[c][e] = Si[e];
        }
    }
    vec residual = Hr[n_k][n_k] / energy[n_u];
    for (int o = 1; o < n_y; o++) residual = smaller(residual, Hr[n_k + o][n_k + o] / energy[n_u + o]);

    /* Inverse of the last triangle, G and its gram block; with w at the center they are those of U. */
    vec Ir[n_u][n_u], Ii[n_u][n_u];
    for (int b = 0; b < n_u; b++) {
        Ir[b][b] = fill(1.0);
        Ii[b][b] = fill(0.0);
        for (int a = b - 1; a >= 0; a--) {
            vec x = fill(0.0), y = fill(0.0);
            for (int k = a + 1; k <= b; k++) {
                x -= Hr[last + a][last + k] * Ir[k][b] - Hi[last + a][last + k] * Ii[k][b];
                y -= Hr[last + a][last + k] * Ii[k][b] + Hi[last + a][last + k] * Ir[k][b];
            }
            Ir[a][b] = x;
            Ii[a][b] = y;
        }
    }
    const vec power = wr * wr + wi * wi;
    for (int a = 0; a < n_u; a++) {
        for (int o = 0; o < n_y; o++) {
            vec x = Hr[last + a][n_k + o], y = Hi[last + a][n_k + o];
            for (int k = a + 1; k < n_u; k++) {
                x += Ir[a][k] * Hr[last + k][n_k + o] - Ii[a][k] * Hi[last + k][n_k + o];
                y += Ir[a][k] * Hi[last + k][n_k + o] + Ii[a][k] * Hr[last + k][n_k + o];
            }
            store(q->response + (o * n_u + a) * q->stride, at, x * wr - y * wi, x * wi + y * wr);
        }
        for (int b = a; b < n_u; b++) {
            vec x = fill(0.0), y = fill(0.0);
            for (int k = b; k < n_u; k++) {
                const vec D = Hr[last + k][last + k] * power;
                x += D * (Ir[a][k] * Ir[b][k] + Ii[a][k] * Ii[b][k]);
                y += D * (Ii[a][k] * Ir[b][k] - Ir[a][k] * Ii[b][k]);
            }
            if (a == b) y = fill(0.0);
            store(q->gram + (a * n_u + b) * q->stride, at, x, y);
            if (b > a) store(q->gram + (b * n_u + a) * q->stride, at, x, -y);
        }
    }
    for (int o = 0; o < n_y; o++) {
        const vec variance = Hr[n_k + o][n_k + o] * per_degree;
        for (int k = 0; k < LANES; k++) q->variance[o * q->stride + at[k]] = variance[k];
        for (int p = o; p < n_y && q->noise; p++) {
            const vec x = Hr[n_k + o][n_k + p] * per_degree, y = p > o ? Hi[n_k + o][n_k + p] * per_degree : fill(0.0);
            store(q->noise + (p * n_y + o) * q->stride, at, x, y);
            if (p > o) store(q->noise + (o * n_y + p) * q->stride, at, x, -y);
        }
    }
    const mask fine = (least > q->weak_pivot) & (residual > q->weak_residual) & (residual * least > q->weak_both);
    for (int k = 0; k < LANES; k++) q->doubtful[at[k]] = !fine[k];
}

/* Numbers of channels and functions are constants where the compiler knows them: sums stay in registers then. */
INLINE int solve_sized(const problem *q, const int n_u, const int n_y, const int size)
{
    const int n = n_u + n_y, columns = n_u * size + n_y, half = (int)q->half, length = LENGTH + 2 * half;
    const int per_record = 2 * n + n * n, n_signals = 1 + (int)q->n_records * per_record;
    const int64_t even = (q->count + LANES - 1) / LANES, stretch = even < LENGTH ? even : LENGTH;
    const size_t bytes = sizeof(vec) * (size_t)length * (2 * (size_t)n_signals + 1);
    vec *memory = aligned_alloc(64, (bytes + 63) / 64 * 64);
    signal *all = malloc(sizeof(signal) * (size_t)n_signals);
    if (!memory || !all) {
        free(memory);
        free(all);
        return 1;
    }
    memset(memory, 0, bytes);
    for (int k = 0; k < n_signals; k++)
        all[k] = (signal){memory + (size_t)length * 2 * (size_t)k, memory + (size_t)length * (2 * (size_t)k + 1)};
    const block b = {all[0], all + 1, memory + (size_t)length * 2 * (size_t)n_signals};

    vec factors[2][size][size], least[2], moments[MOST_FUNCTIONS][2];
    for (int p = 0; p < 2 * size - 1; p++) {        /* of w = 1, in every window the same */
        double total = q->products[p];
        for (int r = 1; r <= half; r++) total += p % 2 ? 0.0 : 2.0 * q->products[r * (2 * size - 1) + p];
        moments[p][0] = moments[p][1] = fill(total);
    }
    for (int v = 0; v < 2; v++) least[v] = factorize(moments, v, size, &factors[v][0][0]);
    for (int64_t start = 0; start < q->count; start += stretch * LANES) {
        int64_t at[LANES];                          /* a stretch at the end overlaps the one before */
        for (int k = 0; k < LANES; k++) {
            at[k] = start + k * stretch;
            if (at[k] > q->count - stretch) at[k] = q->count - stretch;
        }
        prepare(q, n_u, n_y, at, (int)stretch + 2 * half, b);
        for (int j = 0; j < stretch; j += 2) {
            vec Hr[2][columns][columns], Hi[2][columns][columns], energy[2][n];
            for (int v = 0; v < 2 && n == 2; v++) {     /* few: faster than a call */
                for (int d = 0; d < columns; d++)
                    for (int e = 0; e < columns; e++) Hr[v][d][e] = Hi[v][d][e] = fill(0.0);
                energy[v][0] = energy[v][1] = fill(0.0);
            }
            if (n > 2) {
                memset(Hr, 0, sizeof Hr);
                memset(Hi, 0, sizeof Hi);
                memset(energy, 0, sizeof energy);
            }
            if (q->n_poles) {
                sums(b.energy_of_w + j, half, q->products, 2 * size - 1, moments);
                for (int v = 0; v < 2; v++) least[v] = factorize(moments, v, size, &factors[v][0][0]);
            }
            for (int64_t record = 0; record < q->n_records; record++)
                add(q, n_u, n_y, size, b.of_records + record * per_record, j, factors, Hr, Hi, energy);
            for (int v = 0; v < 2 && j + v < stretch; v++) {
                int64_t places[LANES];
                for (int k = 0; k < LANES; k++) places[k] = at[k] + j + v;
                const vec wr = q->n_poles ? b.w.re[j + v + half] : fill(1.0);
                const vec wi = q->n_poles ? b.w.im[j + v + half] : fill(0.0);
                solve_window(q, n_u, n_y, size, places, least[v], wr, wi, Hr[v], Hi[v], energy[v]);
            }
        }
    }
    free(memory);
    free(all);
    return 0;
}

int NAMED(robthermal_solve_, LANES)(const problem *q)
{
    const int n_u = (int)q->n_u, n_y = (int)q->n_y;
    if (q->size > MOST_SIZE || q->size * n_u + n_y > MOST_COLUMNS) return 2;
    if (n_u == 1 && n_y == 1 && q->size == 3) return solve_sized(q, 1, 1, 3);
    if (n_u == 1 && n_y == 1 && q->size == 4) return solve_sized(q, 1, 1, 4);
    if (n_u == 2 && n_y == 2 && q->size == 3) return solve_sized(q, 2, 2, 3);
    if (n_u == 2 && n_y == 2 && q->size == 4) return solve_sized(q, 2, 2, 4);
    if (q->size == 3) return solve_sized(q, n_u, n_y, 3);
    if (q->size == 4) return solve_sized(q, n_u, n_y, 4);
    return solve_sized(q, n_u, n_y, (int)q->size);
}

int64_t NAMED(robthermal_problem_size_, LANES)(void)
{
    return sizeof(problem);
}
