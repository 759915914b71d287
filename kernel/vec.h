// Packets of W floats by the vector extensions of Clang and GCC. The build sets W: 16 for AVX2, AVX-512, 4 and 8 for others.
// A comparison with NaN is false, and maxima and minima then give their second argument, so that NaN leads to no index.
#pragma once
#include <math.h>
#include <stdint.h>
#include <string.h>
#ifdef __SSE__
#include <immintrin.h>
#endif
#ifndef W
#define W 8
#endif
#define ONCE __attribute__((noinline))
#define IN static inline __attribute__((always_inline))
typedef float F __attribute__((vector_size(4 * W), aligned(4 * W)));
typedef int32_t M __attribute__((vector_size(4 * W), aligned(4 * W)));  // a mask (-1 or 0), or integers
typedef double D __attribute__((vector_size(8 * W), aligned(8 * W)));
typedef struct { F x, y, z; } V;
#define BIG 1e30f

IN F all(float a) { F r; for (int i = 0; i < W; i++) r[i] = a; return r; }
IN M ints(int32_t a) { M r; for (int i = 0; i < W; i++) r[i] = a; return r; }
IN F sel(M m, F a, F b) { return (F)(((M)a & m) | ((M)b & ~m)); }
IN F max2(F a, F b) { return sel(a > b, a, b); }  // one instruction; __builtin_elementwise_max takes four, for NaN's sake
IN F min2(F a, F b) { return sel(a < b, a, b); }
IN F size_of(F a) { return (F)((M)a & 0x7fffffff); }  // |a|
#if defined(__clang__)
IN F root(F a) { return __builtin_elementwise_sqrt(a); }
IN F whole(F a) { return __builtin_elementwise_rint(a); }
IN F lower(F a) { return __builtin_elementwise_floor(a); }
#else  // GCC, of the build for sanitizers
IN F root(F a) { F r; for (int i = 0; i < W; i++) r[i] = sqrtf(a[i]); return r; }
IN F whole(F a) { F r; for (int i = 0; i < W; i++) r[i] = rintf(a[i]); return r; }
IN F lower(F a) { F r; for (int i = 0; i < W; i++) r[i] = floorf(a[i]); return r; }
#endif
IN int bits(M m) {
#if defined(__AVX512F__) && W == 16
    return _mm512_movepi32_mask((__m512i)m);
#elif defined(__AVX__) && W == 16
    __m256 h[2]; memcpy(h, &m, sizeof m); return _mm256_movemask_ps(h[0]) | _mm256_movemask_ps(h[1]) << 8;
#elif defined(__SSE__) && W == 4
    return _mm_movemask_ps((__m128)m);
#else
    int r = 0; for (int i = 0; i < W; i++) r |= (m[i] & 1) << i; return r;
#endif
}
IN int any(M m) { return bits(m) != 0; }
IN F clamp(F a, float low, float high) { return min2(max2(a, all(low)), all(high)); }
IN F greatest(F a, F b, F c) { return max2(max2(a, b), c); }
IN F dot(V a, V b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
IN V scaled(V a, F s) { return (V){a.x * s, a.y * s, a.z * s}; }
IN V plus(V a, V b) { return (V){a.x + b.x, a.y + b.y, a.z + b.z}; }
IN V minus(V a, V b) { return (V){a.x - b.x, a.y - b.y, a.z - b.z}; }
IN V choose(M m, V a, V b) { return (V){sel(m, a.x, b.x), sel(m, a.y, b.y), sel(m, a.z, b.z)}; }
IN V cubed(V a, float most) { return (V){clamp(a.x, -most, most), clamp(a.y, -most, most), clamp(a.z, -most, most)}; }
IN V times(const float m[9], V p) {  // a matrix, row by row, times a vector
    return (V){m[0] * p.x + m[1] * p.y + m[2] * p.z, m[3] * p.x + m[4] * p.y + m[5] * p.z,
               m[6] * p.x + m[7] * p.y + m[8] * p.z};
}
IN V mapped(const float m[12], V p) {  // a matrix, row by row, and a shift behind it
    V r = times(m, p);
    return (V){r.x + m[9], r.y + m[10], r.z + m[11]};
}
IN V pulled(const float m[9], V g) {  // a gradient back through a matrix: its transpose
    return (V){m[0] * g.x + m[3] * g.y + m[6] * g.z, m[1] * g.x + m[4] * g.y + m[7] * g.z,
               m[2] * g.x + m[5] * g.y + m[8] * g.z};
}
IN M cut(F a) { return __builtin_convertvector(a, M); }  // towards zero, of numbers that fit
IN F single(D a) { return __builtin_convertvector(a, F); }
IN F floats(M a) { return __builtin_convertvector(a, F); }
IN F gather(const float *from, M at) { F r; for (int i = 0; i < W; i++) r[i] = from[at[i]]; return r; }
IN void sines(F a, F *s, F *c) {  // of |a| up to some thousands: Cody and Waite's reduction, then Cephes' polynomials
    F k = clamp(whole(a * 0.63661977f), -1e6f, 1e6f);
    F r = a - k * 1.5703125f; r = r - k * 4.837512969970703e-4f; r = r - k * 7.549789948768648e-8f;
    r = clamp(r, -1, 1);  // where k was too large
    M n = cut(k);
    F z = r * r;
    F sp = r + r * z * (-1.6666654611e-1f + z * (8.3321608736e-3f - z * 1.9515295891e-4f));
    F cp = 1.0f - 0.5f * z + z * z * (4.166664568298827e-2f + z * (-1.388731625493765e-3f + z * 2.443315711809948e-5f));
    M odd = (n & 1) == 1;
    F ss = sel(odd, cp, sp), cc = sel(odd, sp, cp);
    *s = (F)((M)ss ^ ((n & 2) << 30));
    *c = (F)((M)cc ^ (((n + 1) & 2) << 30));
}
IN F exponential(F x) {  // of x <= 0, within 2e-7 of itself
    x = clamp(x, -80, 0) * 1.44269504f;
    F k = whole(x), f = x - k;
    F p = 1.0f + f * (0.693147182f + f * (0.240226462f + f * (0.0555032f + f * (0.00961672f + f * 0.00133908f))));
    return p * (F)((cut(k) + 127) << 23);
}
IN F logarithm(F x) {  // of normal x > 0, within 1e-7 of itself or of 1: Cephes' polynomial
    M e = (((M)x >> 23) & 255) - 126;
    F m = (F)(((M)x & 0x7fffff) | 0x3f000000);
    M small = m < 0.707106781f;
    e += small;
    m = sel(small, m + m, m) - 1.0f;
    F z = m * m, y = 7.0376836292e-2f * m - 1.1514610310e-1f;
    y = y * m + 1.1676998740e-1f; y = y * m - 1.2420140846e-1f; y = y * m + 1.4249322787e-1f; y = y * m - 1.6668057665e-1f;
    y = y * m + 2.0000714765e-1f; y = y * m - 2.4999993993e-1f; y = y * m + 3.3333331174e-1f;
    F k = floats(e);
    return m + (y * m * z - 2.12194440e-4f * k - 0.5f * z) + 0.693359375f * k;
}
IN F read_row(const float *p, int64_t end, int64_t at) {  // the last number stands for those behind it
    F r;
    if (at + W <= end) memcpy(&r, p + at, sizeof r);
    else for (int k = 0; k < W; k++) r[k] = p[at + k < end ? at + k : end - 1];
    return r;
}
IN V read_points(const float *p, int64_t n, int64_t end, int64_t at) {
    return (V){read_row(p, end, at), read_row(p + n, end, at), read_row(p + 2 * n, end, at)};
}
IN float sum_of(F a) {
    float r[W];
    memcpy(r, &a, sizeof r);
    for (int half = W / 2; half; half /= 2) for (int k = 0; k < half; k++) r[k] += r[k + half];
    return r[0];
}
IN float most_of(F a) {
    float r[W];
    memcpy(r, &a, sizeof r);
    for (int half = W / 2; half; half /= 2) for (int k = 0; k < half; k++) r[k] = r[k] > r[k + half] ? r[k] : r[k + half];
    return r[0];
}
IN void store(float *to, int64_t n, int64_t at, F values) {
    if (at + W <= n) memcpy(to + at, &values, sizeof values);
    else memcpy(to + at, &values, 4 * (size_t)(n - at));
}
