/* x(k+1) = A(k) x(k) + b(k) for many columns at once, one step after the other: what _recursion.py does with numpy.
 *
 * Called from there, where sizes are checked: A (count, n, n) with `apart` numbers from one step to the next (0 where
 * all are the same), b (count, n, m), x (count + 1, n, m) whose first is given.
 */
#include <stdint.h>
#include <string.h>

/* Columns at a time, in one vector, or some narrower ones where the processor has no more: with GNU's library that is
 * decided where it runs. */
enum { TOGETHER = 8, ROWS = 4 };
typedef double vec __attribute__((vector_size(64)));
#if defined(__x86_64__) && defined(__GLIBC__) && defined(__GNUC__) && !defined(__clang__)
#define WIDEST __attribute__((target_clones("avx512f", "fma", "default")))
#else
#define WIDEST
#endif
#define INLINE inline __attribute__((always_inline))
#define APART __attribute__((noinline))

/* One column, four rows at a time, whose sums do not wait for each other; wide vectors are slower here. */
static APART void column(int64_t n, const double *A, const double *b, const double *now, double *next)
{
    int64_t i = 0;
    for (; i + ROWS <= n; i += ROWS, A += ROWS * n) {
        double sums[ROWS] = {b[i], b[i + 1], b[i + 2], b[i + 3]};
        for (int64_t j = 0; j < n; j++)
            for (int row = 0; row < ROWS; row++)
                sums[row] += A[n * row + j] * now[j];
        for (int row = 0; row < ROWS; row++)
            next[i + row] = sums[row];
    }
    for (; i < n; i++, A += n) {
        double sum = b[i];
        for (int64_t j = 0; j < n; j++)
            sum += A[j] * now[j];
        next[i] = sum;
    }
}

/* Fewer columns than a vector has. */
static APART void few(int64_t n, int64_t m, const double *A, const double *b, const double *now, double *next)
{
    for (int64_t i = 0; i < n; i++, A += n, b += m, next += m) {
        memcpy(next, b, sizeof(double) * m);
        for (int64_t j = 0; j < n; j++)
            for (int64_t c = 0; c < m; c++)
                next[c] += A[j] * now[m * j + c];
    }
}

/* `rows` rows of TOGETHER columns out of m, whose sums stay in registers. */
static INLINE void block(int rows, int64_t n, int64_t m, const double *A, const double *b, const double *now,
                         double *next)
{
    vec sums[ROWS];
    for (int row = 0; row < rows; row++)
        memcpy(sums + row, b + m * row, sizeof(vec));
    for (int64_t j = 0; j < n; j++) {
        vec by;
        memcpy(&by, now + m * j, sizeof(vec));
        for (int row = 0; row < rows; row++)
            sums[row] += A[n * row + j] * by;
    }
    for (int row = 0; row < rows; row++)
        memcpy(next + m * row, sums + row, sizeof(vec));
}

/* TOGETHER columns out of m. */
static INLINE void some(int64_t n, int64_t m, const double *A, const double *b, const double *now, double *next)
{
    int64_t i = 0;
    for (; i + ROWS <= n; i += ROWS)
        block(ROWS, n, m, A + n * i, b + m * i, now, next + m * i);
    for (; i < n; i++)
        block(1, n, m, A + n * i, b + m * i, now, next + m * i);
}

WIDEST void robthermal_recursion(int64_t count, int64_t n, int64_t m, int64_t apart, const double *A, const double *b,
                                 double *x)
{
    for (int64_t k = 0; k < count; k++, A += apart, b += n * m, x += n * m) {
        double *next = x + n * m;
        if (m == 1)
            column(n, A, b, x, next);
        else if (m < TOGETHER)
            few(n, m, A, b, x, next);
        else
            for (int64_t c = 0; c < m; c += TOGETHER) { /* the last ones again where fewer are left */
                const int64_t first = c + TOGETHER > m ? m - TOGETHER : c;
                some(n, m, A, b + first, x + first, next + first);
            }
    }
}
