/* Interior windows of local methods through their normal equations, LANES windows at a time.
 *
 * The method is that of _normal.py, term by term; docs/explanations/frf_lpm.md derives it. A vector holds one
 * number of several windows, whose centers lie LENGTH bins apart, so that every load of a sliding window is aligned.
 * Called through _compiled.py, which checks sizes; compiled by hatch_build.py with -mavx2 -mfma.
 */
#include <math.h>
#include <stdint.h>
#include <stdlib.h>

enum { LANES = 4, LENGTH = 64, MOST_SIZE = 5, MOST_COLUMNS = 24, MOST_FUNCTIONS = 2 * MOST_SIZE - 1 };

typedef double vec __attribute__((vector_size(8 * LANES)));
typedef double complex_number[2];

/* The same fields, in the same order, as `_Problem` of _compiled.py. */
typedef struct {
    int64_t n_records, n_u, n_y, size, half, width;   /* width: bins that the windows reach, 2 half more than windows */
    const complex_number *const *U, *const *Y;        /* of every record, (n_u, stride) and (n_y, stride) */
    const int64_t *strides;                           /* of every record: from one channel to the next */
    const complex_number *w;                          /* (width,) factor of all functions, or NULL for 1 */
    const double *products, *functions, *ones;        /* (2 size-1, half+1), (size, half+1), (1, half+1): r >= 0 */
    double weak_pivot, weak_residual, weak_both, degrees_of_freedom;
    complex_number *response, *gram, *noise;          /* (n_y, n_u, F), (n_u, n_u, F), (n_y, n_y, F) or NULL */
    double *variance;                                 /* (n_y, F) */
    unsigned char *doubtful;                          /* (F,) */
} problem;

/* Sequences of one record: real and imaginary parts of `LENGTH + 2 half` places each. */
typedef struct { vec *re, *im; } signal;

#define INLINE static inline __attribute__((always_inline))

INLINE vec fill(double x)
{
    vec v;
    for (int k = 0; k < LANES; k++) v[k] = x;
    return v;
}

/* The smaller one; not a number where either is. */
INLINE vec smaller(vec a, vec b)
{
    for (int k = 0; k < LANES; k++) a[k] = b[k] < a[k] || b[k] != b[k] ? b[k] : a[k];
    return a;
}

INLINE vec root(vec a)
{
    for (int k = 0; k < LANES; k++) a[k] = sqrt(a[k]);
    return a;
}

/* Sums over the window that begins at x, times functions f (count, half+1) that are even for even p, odd for odd p. */
INLINE void sums(const vec *x, int half, const double *f, int count, vec *out)
{
    const vec *center = x + half;
    vec s[MOST_FUNCTIONS];
    for (int p = 0; p < count; p++) s[p] = center[0] * f[p * (half + 1)];
    for (int r = 1; r <= half; r++) {
        const vec even = center[r] + center[-r], odd = center[r] - center[-r];
        for (int p = 0; p < count; p++) s[p] += (p % 2 ? odd : even) * f[p * (half + 1) + r];
    }
    for (int p = 0; p < count; p++) out[p] = s[p];
}

/* L D L' of the normal equations of the transient, whose entry (s, t) is moments[s + t]: D^(-1/2) on the diagonal of
 * factors, column s of L in row s. Returns the least energy left of a function, relative to the first. */
INLINE vec factorize(const vec *moments, const int size, vec *factors)
{
    vec left[MOST_SIZE][MOST_SIZE], least = fill(1.0);
    for (int s = 0; s < size; s++)
        for (int t = 0; t < size; t++) left[s][t] = moments[s + t];
    for (int s = 0; s < size; s++) {
        least = smaller(least, left[s][s] / moments[0]);
        const vec inverse = 1.0 / left[s][s];
        factors[s * size + s] = root(inverse);
        for (int t = s + 1; t < size; t++) {
            factors[s * size + t] = left[s][t] * inverse;
            for (int e = t; e < size; e++) left[t][e] -= factors[s * size + t] * left[s][e];
        }
    }
    return least;
}

/* conj(a) b of all places. */
INLINE void multiply(signal a, signal b, int length, signal out)
{
    for (int j = 0; j < length; j++) {
        const vec ar = a.re[j], ai = a.im[j], br = b.re[j], bi = b.im[j];
        out.re[j] = ar * br + ai * bi;
        out.im[j] = ar * bi - ai * br;
    }
}

/* Stretches of a sequence side by side; zero beyond its end. */
INLINE void side_by_side(const complex_number *from, int64_t have, int length, signal to)
{
    const int64_t reach = (int64_t)(LANES - 1) * LENGTH;
    for (int j = 0; j < length; j++) {
        vec re, im;
        for (int k = 0; k < LANES; k++) {
            const int64_t at = (int64_t)k * LENGTH + j;
            const int inside = j + reach < have || at < have;
            re[k] = inside ? from[at][0] : 0.0;
            im[k] = inside ? from[at][1] : 0.0;
        }
        to.re[j] = re;
        to.im[j] = im;
    }
}

INLINE void store(complex_number *to, int64_t first, int64_t count, vec re, vec im)
{
    for (int k = 0; k < LANES; k++)
        if (first + (int64_t)k * LENGTH < count) {
            to[first + (int64_t)k * LENGTH][0] = re[k];
            to[first + (int64_t)k * LENGTH][1] = im[k];
        }
}

/* Place of the regressor phi_s U_i: the constants of G come last. */
#define COLUMN(i, s) ((s) ? (i) * (size - 1) + size - 1 - (s) : n_u * (size - 1) + (i))

/* size is a constant where the compiler knows it: sums stay in registers then. */
INLINE int solve_sized(const problem *q, const int n_u, const int n_y, const int size)
{
    const int n_k = n_u * size, n = n_u + n_y, columns = n_k + n_y, half = (int)q->half, length = LENGTH + 2 * half;
    const int n_records = (int)q->n_records, last = n_k - n_u, n_products = 2 * size - 1;
    const int per_record = 2 * n + n * n;          /* V = w U, Y; conj(w) V, conj(w) Y; conj(a) b of all pairs */
    const int64_t count = q->width - 2 * half;
    vec *memory = aligned_alloc(64, sizeof(vec) * (size_t)length * 2 * (size_t)(2 + n_records * per_record));
    signal *all = malloc(sizeof(signal) * (size_t)(2 + n_records * per_record));
    if (!memory || !all) {
        free(memory);
        free(all);
        return 1;
    }
    for (int k = 0; k < 2 + n_records * per_record; k++)
        all[k] = (signal){memory + (size_t)length * 2 * (size_t)k, memory + (size_t)length * (2 * (size_t)k + 1)};
    const signal w = all[0], energy_of_w = all[1];

    vec factors[size][size], least_of_w = fill(1.0);
    if (!q->w) {
        vec moments[MOST_FUNCTIONS];
        for (int p = 0; p < n_products; p++) {
            double total = q->products[p * (half + 1)];
            for (int r = 1; r <= half; r++) total += p % 2 ? 0.0 : 2.0 * q->products[p * (half + 1) + r];
            moments[p] = fill(total);
        }
        least_of_w = factorize(moments, size, &factors[0][0]);
    }
    for (int64_t start = 0; start < count; start += LANES * LENGTH) {
        const int64_t have = q->width - start;
        if (q->w) {
            side_by_side(q->w + start, have, length, w);
            multiply(w, w, length, energy_of_w);
        }
        for (int record = 0; record < n_records; record++) {
            signal *const own = all + 2 + record * per_record, *const turned = own + n, *const pairs = own + 2 * n;
            for (int a = 0; a < n; a++) {
                const complex_number *from = a < n_u ? q->U[record] + a * q->strides[record]
                                                     : q->Y[record] + (a - n_u) * q->strides[record];
                side_by_side(from + start, have, length, own[a]);
                if (!q->w) {
                    turned[a] = own[a];
                    continue;
                }
                if (a < n_u)
                    for (int j = 0; j < length; j++) {
                        const vec re = own[a].re[j], im = own[a].im[j];
                        own[a].re[j] = w.re[j] * re - w.im[j] * im;
                        own[a].im[j] = w.re[j] * im + w.im[j] * re;
                    }
                multiply(w, own[a], length, turned[a]);
            }
            for (int a = 0; a < n; a++)
                for (int b = a; b < n; b++)
                    if (a < n_u || a == b || q->noise) multiply(own[a], own[b], length, pairs[a * n + b]);
        }
        for (int j = 0; j < LENGTH; j++) {
            vec Hr[columns][columns], Hi[columns][columns], energy[n], least;
            vec re[MOST_FUNCTIONS], im[MOST_FUNCTIONS];
            if (q->w) {
                sums(energy_of_w.re + j, half, q->products, n_products, re);
                least_of_w = factorize(re, size, &factors[0][0]);
            }
            least = least_of_w;
            for (int a = 0; a < columns; a++)
                for (int b = a; b < columns; b++) Hr[a][b] = Hi[a][b] = fill(0.0);
            for (int a = 0; a < n; a++) energy[a] = fill(0.0);

            for (int record = 0; record < n_records; record++) {
                const signal *const own = all + 2 + record * per_record, *const turned = own + n,
                             *const pairs = own + 2 * n;
                vec Tr[columns][size], Ti[columns][size];
                for (int a = 0; a < n_u; a++) {
                    for (int b = a; b < n_u; b++) {
                        sums(pairs[a * n + b].re + j, half, q->products, n_products, re);
                        if (a == b) {
                            energy[a] += re[0];
                            for (int p = 0; p < n_products; p++) im[p] = fill(0.0);
                        } else sums(pairs[a * n + b].im + j, half, q->products, n_products, im);
                        for (int s = 0; s < size; s++)
                            for (int t = 0; t < size; t++) {
                                const int row = COLUMN(a, s), column = COLUMN(b, t);
                                if (row <= column) {
                                    Hr[row][column] += re[s + t];
                                    Hi[row][column] += im[s + t];
                                } else if (a != b) {
                                    Hr[column][row] += re[s + t];
                                    Hi[column][row] -= im[s + t];
                                }
                            }
                    }
                    for (int o = 0; o < n_y; o++) {
                        sums(pairs[a * n + n_u + o].re + j, half, q->functions, size, re);
                        sums(pairs[a * n + n_u + o].im + j, half, q->functions, size, im);
                        for (int s = 0; s < size; s++) {
                            Hr[COLUMN(a, s)][n_k + o] += re[s];
                            Hi[COLUMN(a, s)][n_k + o] += im[s];
                        }
                    }
                    sums(turned[a].re + j, half, q->products, n_products, re);
                    sums(turned[a].im + j, half, q->products, n_products, im);
                    for (int s = 0; s < size; s++)
                        for (int t = 0; t < size; t++) {
                            Tr[COLUMN(a, s)][t] = re[s + t];
                            Ti[COLUMN(a, s)][t] = im[s + t];
                        }
                }
                for (int o = 0; o < n_y; o++) {
                    for (int p = o; p < n_y; p++) {
                        if (p > o && !q->noise) continue;
                        sums(pairs[(n_u + o) * n + n_u + p].re + j, half, q->ones, 1, re);
                        Hr[n_k + o][n_k + p] += re[0];
                        if (p == o) energy[n_u + o] += re[0];
                        else {
                            sums(pairs[(n_u + o) * n + n_u + p].im + j, half, q->ones, 1, im);
                            Hi[n_k + o][n_k + p] += im[0];
                        }
                    }
                    sums(turned[n_u + o].re + j, half, q->functions, size, Tr[n_k + o]);
                    sums(turned[n_u + o].im + j, half, q->functions, size, Ti[n_k + o]);
                }
                /* What the transient of this record explains. */
                for (int d = 0; d < columns; d++)
                    for (int s = 0; s < size; s++) {
                        for (int t = s + 1; t < size; t++) {
                            Tr[d][t] -= factors[s][t] * Tr[d][s];
                            Ti[d][t] -= factors[s][t] * Ti[d][s];
                        }
                        Tr[d][s] *= factors[s][s];
                        Ti[d][s] *= factors[s][s];
                    }
                for (int d = 0; d < columns; d++)
                    for (int e = d; e < columns; e++)
                        for (int s = 0; s < size; s++) {
                            Hr[d][e] -= Tr[d][s] * Tr[e][s] + Ti[d][s] * Ti[e][s];
                            if (e > d) Hi[d][e] -= Tr[d][s] * Ti[e][s] - Ti[d][s] * Tr[e][s];
                        }
            }

            /* Cholesky factorization as far as the regressors; of the last n_u rows the inverse of the diagonal. */
            for (int c = 0; c < n_k; c++) {
                const vec pivot = Hr[c][c];
                least = smaller(least, pivot / energy[c >= last ? c - last : c / (size - 1)]);
                const vec inverse = 1.0 / root(pivot);
                Hr[c][c] = inverse;
                for (int d = c + 1; d < columns; d++) {
                    Hr[c][d] *= inverse;
                    Hi[c][d] *= inverse;
                }
                for (int d = c + 1; d < columns; d++)
                    for (int e = d; e < columns; e++) {
                        Hr[d][e] -= Hr[c][d] * Hr[c][e] + Hi[c][d] * Hi[c][e];
                        if (e > d) Hi[d][e] -= Hr[c][d] * Hi[c][e] - Hi[c][d] * Hr[c][e];
                    }
            }
            vec residual = Hr[n_k][n_k] / energy[n_u];
            for (int o = 1; o < n_y; o++) residual = smaller(residual, Hr[n_k + o][n_k + o] / energy[n_u + o]);

            /* Inverse of the last triangle, G and its gram block; with w at the center they are those of U. */
            const int64_t first = start + j;
            vec Ir[n_u][n_u], Ii[n_u][n_u];
            for (int b = 0; b < n_u; b++) {
                Ir[b][b] = Hr[last + b][last + b];
                Ii[b][b] = fill(0.0);
                for (int a = b - 1; a >= 0; a--) {
                    vec x = fill(0.0), y = fill(0.0);
                    for (int k = a + 1; k <= b; k++) {
                        x -= Hr[last + a][last + k] * Ir[k][b] - Hi[last + a][last + k] * Ii[k][b];
                        y -= Hr[last + a][last + k] * Ii[k][b] + Hi[last + a][last + k] * Ir[k][b];
                    }
                    Ir[a][b] = x * Ir[a][a];
                    Ii[a][b] = y * Ir[a][a];
                }
            }
            const vec wr = q->w ? w.re[j + half] : fill(1.0), wi = q->w ? w.im[j + half] : fill(0.0);
            const vec power = wr * wr + wi * wi;
            for (int a = 0; a < n_u; a++) {
                for (int o = 0; o < n_y; o++) {
                    vec x = fill(0.0), y = fill(0.0);
                    for (int k = a; k < n_u; k++) {
                        x += Ir[a][k] * Hr[last + k][n_k + o] - Ii[a][k] * Hi[last + k][n_k + o];
                        y += Ir[a][k] * Hi[last + k][n_k + o] + Ii[a][k] * Hr[last + k][n_k + o];
                    }
                    store(q->response + (o * n_u + a) * count, first, count, x * wr - y * wi, x * wi + y * wr);
                }
                for (int b = a; b < n_u; b++) {
                    vec x = fill(0.0), y = fill(0.0);
                    for (int k = b; k < n_u; k++) {
                        x += Ir[a][k] * Ir[b][k] + Ii[a][k] * Ii[b][k];
                        y += Ii[a][k] * Ir[b][k] - Ir[a][k] * Ii[b][k];
                    }
                    if (a == b) y = fill(0.0);
                    store(q->gram + (a * n_u + b) * count, first, count, x * power, y * power);
                    if (b > a) store(q->gram + (b * n_u + a) * count, first, count, x * power, -y * power);
                }
            }
            for (int o = 0; o < n_y; o++)
                for (int p = o; p < n_y; p++) {
                    if (p > o && !q->noise) continue;
                    const vec x = Hr[n_k + o][n_k + p] / q->degrees_of_freedom;
                    const vec y = p > o ? Hi[n_k + o][n_k + p] / q->degrees_of_freedom : fill(0.0);
                    if (q->noise) store(q->noise + (p * n_y + o) * count, first, count, x, y);
                    if (q->noise && p > o) store(q->noise + (o * n_y + p) * count, first, count, x, -y);
                    for (int k = 0; k < LANES && p == o; k++)
                        if (first + (int64_t)k * LENGTH < count) q->variance[o * count + first + k * LENGTH] = x[k];
                }
            for (int k = 0; k < LANES; k++)
                if (first + (int64_t)k * LENGTH < count)
                    q->doubtful[first + k * LENGTH] = !(least[k] > q->weak_pivot && residual[k] > q->weak_residual
                                                        && residual[k] * least[k] > q->weak_both);
        }
    }
    free(memory);
    free(all);
    return 0;
}

int robthermal_solve(const problem *q)
{
    const int n_u = (int)q->n_u, n_y = (int)q->n_y;
    if (q->size > MOST_SIZE || q->size * n_u + n_y > MOST_COLUMNS) return 2;
    if (q->size == 3) return solve_sized(q, n_u, n_y, 3);
    if (q->size == 4) return solve_sized(q, n_u, n_y, 4);
    return solve_sized(q, n_u, n_y, (int)q->size);
}

int64_t robthermal_problem_size(void)
{
    return sizeof(problem);
}

/* Whether this processor has the instructions that the library was compiled for. */
int robthermal_runs_here(void)
{
    return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
}
