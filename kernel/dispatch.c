// Calls go to the variant for what the processor has: 2: x86-64-v4, 1: x86-64-v3, 0: what every machine has.
#include <stddef.h>
#include "scene.h"
#ifdef _WIN32
#define OUT __declspec(dllexport)
#else
#define OUT __attribute__((visibility("default")))
#endif
#define EACH(v) \
    int64_t scratch_##v(const Scene *); \
    int64_t field_##v(const Scene *, int64_t, const float *, const float *, float *, float *, float *, int32_t *, void *); \
    void own_##v(const Scene *, int64_t, const int32_t *, const float *, float *, float *);
EACH(v2)
#if defined(__x86_64__) && !defined(ONE)
EACH(v3)
EACH(v4)
#include <cpuid.h>
static unsigned long long xgetbv(void) {
    unsigned a, d;
    __asm__ volatile("xgetbv" : "=a"(a), "=d"(d) : "c"(0));
    return a | (unsigned long long)d << 32;
}
OUT int32_t newest(void) {
    unsigned a, b, c, d, e, vectors = 1u << 27 | 1u << 12 | 1u << 28;  // OSXSAVE FMA AVX
    if (!__get_cpuid(1, &a, &e, &c, &d) || (c & vectors) != vectors) return 0;
    unsigned long long kept = xgetbv();  // registers that the system keeps
    unsigned more = 1u << 5 | 1u << 3 | 1u << 8;  // AVX2 BMI1 BMI2
    if ((kept & 6) != 6 || !__get_cpuid_count(7, 0, &a, &b, &c, &d) || (b & more) != more) return 0;
    unsigned wide = 1u << 16 | 1u << 17 | 1u << 28 | 1u << 30 | 1u << 31;  // AVX-512 F DQ CD BW VL
    return (kept & 0xe6) == 0xe6 && (b & wide) == wide ? 2 : 1;
}
#define PICK(f, ...) (variant == 2 ? f##_v4(__VA_ARGS__) : variant == 1 ? f##_v3(__VA_ARGS__) : f##_v2(__VA_ARGS__))
#else
OUT int32_t newest(void) { return 0; }
#define PICK(f, ...) f##_v2(__VA_ARGS__)
#endif
OUT const char *mark(void) { return MARK; }  // a digest of the sources
// What tables.py has to agree with.
OUT void sizes(int32_t r[6]) {
    size_t all[6] = {sizeof(Object), sizeof(Step), sizeof(Decoder), sizeof(Cell), sizeof(Texture), sizeof(Scene)};
    for (int i = 0; i < 6; i++) r[i] = (int32_t)all[i];
}
OUT int64_t scratch(int32_t variant, const Scene *s) { return PICK(scratch, s); }
OUT int64_t field(int32_t variant, const Scene *s, int64_t n, const float *p, const float *reach, float *distance,
                  float *gradient, float *look, int32_t *owner, void *memory) {
    return PICK(field, s, n, p, reach, distance, gradient, look, owner, memory);
}
OUT void own(int32_t variant, const Scene *s, int64_t n, const int32_t *object, const float *p, float *distance, float *gradient) {
    PICK(own, s, n, object, p, distance, gradient);
}
