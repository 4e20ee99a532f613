/* A time-varying Kalman filter along a record, and columns of residuals through it: one sample after the other, what
 * _riccati.py and _whitening.py do with numpy in blocks of samples.
 *
 * Called through _filter.py, which checks sizes. The build compiles this file once for every kind of processor, with
 * vectors of LANES numbers; the names of what is called from outside end with LANES.
 */
#include <math.h>
#include <string.h>

#include "../../_lanes.h"

enum { MOST = 64, WIDTH = MOST / LANES, ROWS = 4, WIDE = 2 }; /* states or sensors, vectors of a row; of a block */
#define INLINE inline __attribute__((always_inline))

/* The same fields, in the same order, as `_Filter` of _filter.py; the steps say how many numbers lie from one sample to
 * the next, 0 where all samples have the same. */
typedef struct {
    int64_t count, n, ns;
    const double *A, *C;    /* (count, n, n) and (count, ns, n) */
    int64_t A_step, C_step;
    double *gains, *roots;  /* (count, n, ns) and (count, ns, ns) */
} filter;

/* `rows` rows of `wide` vectors: out += sign M in, whose sums stay in registers. */
static INLINE void block(int rows, int wide, int64_t n, double sign, const double *M, int64_t apart, const vec *in,
                         vec *out, int64_t width)
{
    vec sums[ROWS][WIDE];
    for (int row = 0; row < rows; row++)
        for (int v = 0; v < wide; v++)
            sums[row][v] = out[width * row + v];
    for (int64_t j = 0; j < n; j++, in += width)
        for (int row = 0; row < rows; row++) {
            const double by = sign * M[apart * row + j];
            for (int v = 0; v < wide; v++)
                sums[row][v] += by * in[v];
        }
    for (int row = 0; row < rows; row++)
        for (int v = 0; v < wide; v++)
            out[width * row + v] = sums[row][v];
}

static INLINE void some(int wide, int64_t rows, int64_t n, double sign, const double *M, int64_t apart, const vec *in,
                        vec *out, int64_t width)
{
    int64_t i = 0;
    for (; i + ROWS <= rows; i += ROWS)
        block(ROWS, wide, n, sign, M + apart * i, apart, in, out + width * i, width);
    for (; i < rows; i++)
        block(1, wide, n, sign, M + apart * i, apart, in, out + width * i, width);
}

/* out (rows, width vectors) += sign M in, with M (rows, n) and in (n, width vectors). */
static INLINE void add(int64_t rows, int64_t n, double sign, const double *M, int64_t apart, const vec *in, vec *out,
                       int64_t width)
{
    int64_t v = 0;
    for (; v + WIDE <= width; v += WIDE)
        some(WIDE, rows, n, sign, M, apart, in + v, out + v, width);
    for (; v < width; v++)
        some(1, rows, n, sign, M, apart, in + v, out + v, width);
}

/* Some columns of residuals r (count, ns, m) to z of the same shape: z = root (r - C x), then x = A (x + gain (r - C x)),
 * from x = 0. */
static void whitened(const filter *by, int64_t m, int64_t columns, const double *r, double *z)
{
    const int64_t n = by->n, ns = by->ns, width = (columns + LANES - 1) / LANES;
    vec x[MOST * WIDTH], next[MOST * WIDTH], e[MOST * WIDTH], out[MOST * WIDTH];
    memset(x, 0, sizeof(vec) * n * width);
    memset(e, 0, sizeof(vec) * ns * width);
    for (int64_t k = 0; k < by->count; k++, r += ns * m, z += ns * m) {
        for (int64_t i = 0; i < ns; i++)
            memcpy(e + width * i, r + m * i, sizeof(double) * columns);
        add(ns, n, -1.0, by->C + by->C_step * k, n, x, e, width);
        memset(out, 0, sizeof(vec) * ns * width);
        add(ns, ns, 1.0, by->roots + ns * ns * k, ns, e, out, width);
        for (int64_t i = 0; i < ns; i++)
            memcpy(z + m * i, out + width * i, sizeof(double) * columns);
        add(n, ns, 1.0, by->gains + n * ns * k, ns, e, x, width);
        memset(next, 0, sizeof(vec) * n * width);
        add(n, n, 1.0, by->A + by->A_step * k, n, x, next, width);
        memcpy(x, next, sizeof(vec) * n * width);
    }
}

void NAMED(robthermal_whitened_, LANES)(const filter *by, int64_t m, const double *r, double *z)
{
    for (int64_t first = 0; first < m; first += MOST)
        whitened(by, m, m - first < MOST ? m - first : MOST, r + first, z + first);
}

/* Inverse Cholesky factor of S (ns, ns), whose lower triangle is given; 0 where S is not positive definite. */
static int inverse_factor(int64_t ns, double *S, double *root)
{
    for (int64_t j = 0; j < ns; j++) {
        for (int64_t k = 0; k < j; k++)
            S[ns * j + j] -= S[ns * j + k] * S[ns * j + k];
        if (!(S[ns * j + j] > 0.0))
            return 0;
        S[ns * j + j] = sqrt(S[ns * j + j]);
        for (int64_t i = j + 1; i < ns; i++) {
            for (int64_t k = 0; k < j; k++)
                S[ns * i + j] -= S[ns * i + k] * S[ns * j + k];
            S[ns * i + j] /= S[ns * j + j];
        }
    }
    memset(root, 0, sizeof(double) * ns * ns);
    for (int64_t j = 0; j < ns; j++)
        for (int64_t i = j; i < ns; i++) {
            double sum = i == j ? 1.0 : 0.0;
            for (int64_t k = j; k < i; k++)
                sum -= S[ns * i + k] * root[ns * k + j];
            root[ns * i + j] = sum / S[ns * i + i];
        }
    return 1;
}

/* Gains and roots of the filter, from the covariance P (n, n) before the first sample, with the readings' noise R
 * (count, ns, ns) and what every sample adds Q (count, n, n). Samples that were filtered: `count`, or fewer where the
 * covariance of the innovations is not positive definite. */
int64_t NAMED(robthermal_filtered_, LANES)(const filter *by, const double *R, int64_t R_step, const double *Q,
                                           int64_t Q_step, const double *start)
{
    const int64_t n = by->n, ns = by->ns, width = (n + LANES - 1) / LANES, row = LANES * width;
    vec P_[MOST * WIDTH], turned_[MOST * WIDTH], passed[MOST * WIDTH], seen_[MOST * WIDTH], weighed_[MOST * WIDTH];
    double S[MOST * MOST], weights[MOST * MOST];
    double *P = (double *)P_, *turned = (double *)turned_, *seen = (double *)seen_, *weighed = (double *)weighed_;
    memset(P_, 0, sizeof(vec) * n * width);
    memset(turned_, 0, sizeof(vec) * n * width);
    for (int64_t i = 0; i < n; i++)
        memcpy(P + row * i, start + n * i, sizeof(double) * n);
    for (int64_t k = 0; k < by->count; k++) {
        const double *A = by->A + by->A_step * k, *C = by->C + by->C_step * k;
        double *root = by->roots + ns * ns * k, *gain = by->gains + n * ns * k;
        memset(seen_, 0, sizeof(vec) * ns * width); /* C P, for P is symmetric */
        add(ns, n, 1.0, C, n, P_, seen_, width);
        memcpy(S, R + R_step * k, sizeof(double) * ns * ns);
        for (int64_t i = 0; i < ns; i++)
            for (int64_t j = 0; j <= i; j++)
                for (int64_t l = 0; l < n; l++)
                    S[ns * i + j] += C[n * i + l] * seen[row * j + l];
        if (!inverse_factor(ns, S, root))
            return k;
        memset(weighed_, 0, sizeof(vec) * ns * width);
        add(ns, ns, 1.0, root, ns, seen_, weighed_, width);
        for (int64_t i = 0; i < n; i++) {
            for (int64_t s = 0; s < ns; s++)
                weights[ns * i + s] = weighed[row * s + i];
            for (int64_t s = 0; s < ns; s++) {
                double sum = 0.0;
                for (int64_t t = s; t < ns; t++)
                    sum += weights[ns * i + t] * root[ns * t + s];
                gain[ns * i + s] = sum;
            }
        }
        add(n, ns, -1.0, weights, ns, weighed_, P_, width); /* of what was read */
        memset(passed, 0, sizeof(vec) * n * width);
        add(n, n, 1.0, A, n, P_, passed, width);
        for (int64_t i = 0; i < n; i++) {
            for (int64_t j = 0; j < n; j++)
                turned[row * j + i] = A[n * i + j];
            memcpy(P + row * i, Q + Q_step * k + n * i, sizeof(double) * n);
        }
        add(n, n, 1.0, (double *)passed, row, turned_, P_, width);
        for (int64_t i = 0; i < n; i++)
            for (int64_t j = 0; j < i; j++)
                P[row * i + j] = P[row * j + i] = 0.5 * (P[row * i + j] + P[row * j + i]);
    }
    return by->count;
}
