/* What every kernel shares that is compiled once for each width of vectors: the vector, names that end with its width,
 * and whether the processor has the instructions. */
#include <stdint.h>

#ifndef LANES
#error "hatch_build.py says how wide a vector is"
#endif

typedef double vec __attribute__((vector_size(8 * LANES)));

#define JOINED(name, lanes) name##lanes
#define NAMED(name, lanes) JOINED(name, lanes)

/* Whether this processor has the instructions that this part of the library was compiled for. */
int NAMED(robthermal_runs_here_, LANES)(void)
{
#if defined(__AVX512F__)
    return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl")
           && __builtin_cpu_supports("fma");
#elif defined(__AVX2__)
    return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
#else
    return 1;
#endif
}
