/* x(k+1) = A(k) x(k) + b(k) for many columns at once, one step after the other: what _recursion.py does with numpy.
 *
 * Called from there, where sizes are checked: A (count, n, n) with `apart` numbers from one step to the next (0 where
 * all are the same), b (count, n, m), x (count + 1, n, m) whose first is given. The build compiles this file once for
 * every kind of processor, with vectors of LANES numbers; the names of what is called from outside end with LANES.
 */
#include <string.h>

#include "_lanes.h"

enum { ROWS = 4, WIDE = 2 }; /* of a block, in rows and vectors */
#define INLINE inline __attribute__((always_inline))

/* One column, four rows at a time, whose sums do not wait for each other. */
static void column(int64_t n, const double *A, const double *b, const double *now, double *next)
{
    int64_t i = 0;
    for (; i + ROWS <= n; i += ROWS, A += ROWS * n) {
        double first = b[i], second = b[i + 1], third = b[i + 2], fourth = b[i + 3];
        for (int64_t j = 0; j < n; j++) {
            first += A[j] * now[j];
            second += A[n + j] * now[j];
            third += A[2 * n + j] * now[j];
            fourth += A[3 * n + j] * now[j];
        }
        next[i] = first;
        next[i + 1] = second;
        next[i + 2] = third;
        next[i + 3] = fourth;
    }
    for (; i < n; i++, A += n) {
        double sum = b[i];
        for (int64_t j = 0; j < n; j++)
            sum += A[j] * now[j];
        next[i] = sum;
    }
}

/* Fewer columns than a vector has. */
static void few(int64_t n, int64_t m, const double *A, const double *b, const double *now, double *next)
{
    for (int64_t i = 0; i < n; i++, A += n, b += m, next += m) {
        memcpy(next, b, sizeof(double) * m);
        for (int64_t j = 0; j < n; j++)
            for (int64_t c = 0; c < m; c++)
                next[c] += A[j] * now[m * j + c];
    }
}

static INLINE vec load(const double *from)
{
    vec out;
    memcpy(&out, from, sizeof(vec));
    return out;
}

/* `rows` rows of `wide` vectors out of m columns, whose sums stay in registers. */
static INLINE void block(int rows, int wide, int64_t n, int64_t m, const double *A, const double *b, const double *now,
                         double *next)
{
    vec sums[ROWS][WIDE];
    for (int row = 0; row < rows; row++)
        for (int v = 0; v < wide; v++)
            sums[row][v] = load(b + m * row + LANES * v);
    for (int64_t j = 0; j < n; j++, now += m)
        for (int v = 0; v < wide; v++) {
            const vec by = load(now + LANES * v);
            for (int row = 0; row < rows; row++)
                sums[row][v] += A[n * row + j] * by;
        }
    for (int row = 0; row < rows; row++)
        for (int v = 0; v < wide; v++)
            memcpy(next + m * row + LANES * v, &sums[row][v], sizeof(vec));
}

/* `wide` vectors out of m columns. */
static INLINE void some(int wide, int64_t n, int64_t m, const double *A, const double *b, const double *now,
                        double *next)
{
    int64_t i = 0;
    for (; i + ROWS <= n; i += ROWS)
        block(ROWS, wide, n, m, A + n * i, b + m * i, now, next + m * i);
    for (; i < n; i++)
        block(1, wide, n, m, A + n * i, b + m * i, now, next + m * i);
}

void NAMED(robthermal_recursion_, LANES)(int64_t count, int64_t n, int64_t m, int64_t apart, const double *A,
                                         const double *b, double *x)
{
    for (int64_t k = 0; k < count; k++, A += apart, b += n * m, x += n * m) {
        double *next = x + n * m;
        int64_t c = 0;
        if (m == 1)
            column(n, A, b, x, next);
        else if (m < LANES)
            few(n, m, A, b, x, next);
        else {
            for (; c + WIDE * LANES <= m; c += WIDE * LANES)
                some(WIDE, n, m, A, b + c, x + c, next + c);
            for (; c < m; c += LANES) { /* the last ones again where fewer are left */
                const int64_t first = c + LANES > m ? m - LANES : c;
                some(1, n, m, A, b + first, x + first, next + first);
            }
        }
    }
}
