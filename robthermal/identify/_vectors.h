/* Vectors of LANES numbers, and sequences of them: the arithmetic of _moments.c. */
#include "../_lanes.h"

typedef int64_t mask __attribute__((vector_size(8 * LANES)));
typedef double complex_number[2];

/* One sequence: real and imaginary parts. */
typedef struct { vec *re, *im; } signal;

#define INLINE static inline __attribute__((always_inline))

INLINE vec fill(double x)
{
    vec v;
    for (int k = 0; k < LANES; k++) v[k] = x;
    return v;
}

/* The smaller one; not a number where b is. */
INLINE vec smaller(vec a, vec b)
{
    const mask second = (b < a) | (b != b);
    return (vec)(((mask)b & second) | ((mask)a & ~second));
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

/* Stretches of a sequence side by side: number by number, for no instruction gathers them faster. */
INLINE void side_by_side(const complex_number *from, const int64_t *at, int length, signal to)
{
    for (int k = 0; k < LANES; k++) {
        const complex_number *own = from + at[k];
        double *re = (double *)to.re + k, *im = (double *)to.im + k;
        for (int j = 0; j < length; j++) {
            re[j * LANES] = own[j][0];
            im[j * LANES] = own[j][1];
        }
    }
}

INLINE void store(complex_number *to, const int64_t *at, vec re, vec im)
{
    for (int k = 0; k < LANES; k++) {
        to[at[k]][0] = re[k];
        to[at[k]][1] = im[k];
    }
}

/* H -= conj(a) b; of a number on the diagonal the real part alone. */
INLINE void take_away(vec *re, vec *im, vec ar, vec ai, vec br, vec bi, int diagonal)
{
    *re -= ar * br;
    *re -= ai * bi;
    if (diagonal) return;
    *im -= ar * bi;
    *im += ai * br;
}

/* A bound that the compiler does not know, where unrolled loops would fill the cache of instructions. */
INLINE int bound(int n, int known)
{
    if (!known) __asm__("" : "+r"(n));
    return n;
}
