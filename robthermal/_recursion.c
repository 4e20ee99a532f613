/* x(k+1) = A(k) x(k) + b(k) for many columns at once, one step after the other: what _recursion.py does with numpy.
 *
 * Called from there, where sizes are checked: A (count, n, n) with `apart` numbers from one step to the next (0 where
 * all are the same), b (count, n, m), x (count + 1, n, m) whose first is given.
 */
#include <stdint.h>

/* One column, four rows at a time, whose sums do not wait for each other. */
static void column(int64_t n, const double *A, const double *b, const double *now, double *next)
{
    int64_t i = 0;
    for (; i + 4 <= n; i += 4, A += 4 * n) {
        double sums[4] = {b[i], b[i + 1], b[i + 2], b[i + 3]};
        for (int64_t j = 0; j < n; j++)
            for (int row = 0; row < 4; row++)
                sums[row] += A[n * row + j] * now[j];
        for (int row = 0; row < 4; row++)
            next[i + row] = sums[row];
    }
    for (; i < n; i++, A += n) {
        double sum = b[i];
        for (int64_t j = 0; j < n; j++)
            sum += A[j] * now[j];
        next[i] = sum;
    }
}

void robthermal_recursion(int64_t count, int64_t n, int64_t m, int64_t apart, const double *restrict A,
                          const double *restrict b, double *x)
{
    for (int64_t k = 0; k < count; k++, A += apart, b += n * m, x += n * m) {
        if (m == 1) {
            column(n, A, b, x, x + n);
            continue;
        }
        for (int64_t i = 0; i < n; i++) {
            double *restrict row = x + n * m + m * i;
            for (int64_t c = 0; c < m; c++)
                row[c] = b[m * i + c];
            for (int64_t j = 0; j < n; j++) {
                const double by = A[n * i + j], *now = x + m * j;
                for (int64_t c = 0; c < m; c++)
                    row[c] += by * now[c];
            }
        }
    }
}
