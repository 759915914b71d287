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
    void own_##v(const Scene *, int64_t, const int32_t *, const float *, float *, float *, float *); \
    int64_t rays_##v(const Scene *, int64_t, int64_t, const float *, const float *, const float *, const float *, float, int32_t, \
                     int32_t, int32_t, float *, float *, int32_t *, float *, int64_t *, Piece *, int64_t, void *); \
    void cones_##v(const Scene *, int64_t, const float *, float, const float *, const float *, const float *, const float *, \
                   float *, int64_t *, void *); \
    void shade_##v(const Scene *, const Stage *, int32_t, int32_t, int32_t, int32_t, float *, int64_t *, void *); \
    void finish_##v(const Scene *, const Stage *, int32_t, int32_t, int32_t, int32_t, const float *, int32_t *, float *, int64_t *, void *); \
    void around_##v(const Scene *, const Around *, int64_t, const float *, const float *, const float *, int32_t, int32_t, float *, \
                    int64_t *, int32_t *, float *, float *, int64_t *, void *); \
    void exchanged_##v(int64_t, const int64_t *, const int32_t *, const float *, const float *, float *); \
    void arriving_##v(const Scene *, const Around *, int64_t, const float *, const float *, int32_t, float *, float *, void *); \
    int64_t glowing_##v(const Scene *, const Around *, int64_t, const float *, const float *, float, float *, float *, int32_t *, \
                        float *, int64_t, void *); \
    void passed_on_##v(int64_t, int64_t, float, const float *, const float *, const float *, const float *, const float *, \
                       const float *, const float *, float *, float *); \
    void evened_##v(const float *, const float *, const float *, int32_t, const float *, int32_t, int32_t, float *); \
    void between_##v(int64_t, const float *, const float *, const float *, const float *, int32_t, float *, int32_t *); \
    void haze_##v(const Scene *, const Around *, int64_t, const float *, const float *, const float *, float *, float *, void *); \
    int64_t crossings_##v(const Scene *, int64_t, const int32_t *, const float *, const float *, const float *, const float *, int64_t, \
                          int32_t *, float *); \
    void mirrored_##v(int64_t, const float *, float, const float *, const float *, const float *, const float *, const float *, float *); \
    void plane_##v(const Flat *, const Page *, int32_t, int32_t, float *, int32_t *, int64_t *, void *); \
    void states_##v(const Flat *, int64_t, const float *, float, float *, void *);
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
OUT void sizes(int32_t r[17]) {
    size_t all[17] = {sizeof(Object), sizeof(Step), sizeof(Decoder), sizeof(Cell), sizeof(Texture), sizeof(Piece), sizeof(Scene),
                      sizeof(Lamp), sizeof(Stage), sizeof(Node), sizeof(Around), sizeof(Shape), sizeof(FlatStep), sizeof(Leaf),
                      sizeof(Joint), sizeof(Flat), sizeof(Page)};
    for (int i = 0; i < 17; i++) r[i] = (int32_t)all[i];
}
OUT int64_t scratch(int32_t variant, const Scene *s) { return PICK(scratch, s); }
OUT int64_t field(int32_t variant, const Scene *s, int64_t n, const float *p, const float *reach, float *distance,
                  float *gradient, float *look, int32_t *owner, void *memory) {
    return PICK(field, s, n, p, reach, distance, gradient, look, owner, memory);
}
OUT void own(int32_t variant, const Scene *s, int64_t n, const int32_t *object, const float *p, float *distance, float *gradient,
             float *colour) {
    PICK(own, s, n, object, p, distance, gradient, colour);
}
OUT int64_t rays(int32_t variant, const Scene *s, int64_t n, int64_t origins, const float *p, const float *way, const float *begin,
                 const float *limit, float gap, int32_t steps, int32_t halvings, int32_t coloured, float *hit, float *length,
                 int32_t *soft, float *depth, int64_t *counts, Piece *piece, int64_t room, void *memory) {
    return PICK(rays, s, n, origins, p, way, begin, limit, gap, steps, halvings, coloured, hit, length, soft, depth, counts, piece, room, memory);
}
OUT void cones(int32_t variant, const Scene *s, int64_t n, const float *at, float radius, const float *way, const float *far,
               const float *spread, const float *normal, float *part, int64_t *counts, void *memory) {
    PICK(cones, s, n, at, radius, way, far, spread, normal, part, counts, memory);
}
OUT void shade(int32_t variant, const Scene *s, const Stage *stage, int32_t top, int32_t bottom, int32_t first, int32_t last,
               float *picture, int64_t *counts, void *memory) {
    PICK(shade, s, stage, top, bottom, first, last, picture, counts, memory);
}
OUT void finish(int32_t variant, const Scene *s, const Stage *stage, int32_t top, int32_t bottom, int32_t first, int32_t last,
                const float *picture, int32_t *pixel, float *out, int64_t *counts, void *memory) {
    PICK(finish, s, stage, top, bottom, first, last, picture, pixel, out, counts, memory);
}
OUT void around(int32_t variant, const Scene *s, const Around *a, int64_t n, const float *p, const float *normal, const float *turn,
                int32_t rays, int32_t finer, float *light, int64_t *begin, int32_t *index, float *share, float *row, int64_t *counts,
                void *memory) {
    PICK(around, s, a, n, p, normal, turn, rays, finer, light, begin, index, share, row, counts, memory);
}
OUT void exchanged(int32_t variant, int64_t n, const int64_t *begin, const int32_t *index, const float *share, const float *sent,
                   float *received) {
    PICK(exchanged, n, begin, index, share, sent, received);
}
OUT void arriving(int32_t variant, const Scene *s, const Around *a, int64_t n, const float *p, const float *way, int32_t finer,
                  float *light, float *reach, void *memory) {
    PICK(arriving, s, a, n, p, way, finer, light, reach, memory);
}
OUT int64_t glowing(int32_t variant, const Scene *s, const Around *a, int64_t n, const float *p, const float *normal, float worth,
                    float *light, float *free, int32_t *point, float *ray, int64_t room, void *memory) {
    return PICK(glowing, s, a, n, p, normal, worth, light, free, point, ray, room, memory);
}
OUT void passed_on(int32_t variant, int64_t n, int64_t far, float share, const float *here, const float *next, const float *clear,
                   const float *base, const float *surface, const float *source, const float *light, float *along, float *result) {
    PICK(passed_on, n, far, share, here, next, clear, base, surface, source, light, along, result);
}
OUT void evened(int32_t variant, const float *view, const float *p, const float *normal, int32_t rows, const float *values,
                int32_t step, int32_t part, float *out) {
    PICK(evened, view, p, normal, rows, values, step, part, out);
}
OUT void between(int32_t variant, int64_t n, const float *p, const float *normal, const float *view, const float *seen,
                 int32_t values, float *out, int32_t *fits) {
    PICK(between, n, p, normal, view, seen, values, out, fits);
}
OUT void haze(int32_t variant, const Scene *s, const Around *a, int64_t n, const float *p, const float *way, const float *reach,
              float *light, float *clear, void *memory) {
    PICK(haze, s, a, n, p, way, reach, light, clear, memory);
}
OUT int64_t crossings(int32_t variant, const Scene *s, int64_t n, const int32_t *object, const float *p, const float *way,
                      const float *rate, const float *least, int64_t room, int32_t *line, float *along) {
    return PICK(crossings, s, n, object, p, way, rate, least, room, line, along);
}
OUT void mirrored(int32_t variant, int64_t n, const float *at, float radius, const float *p, const float *normal, const float *rough,
                  const float *back, const float *straight, float *light) {
    PICK(mirrored, n, at, radius, p, normal, rough, back, straight, light);
}
OUT void plane(int32_t variant, const Flat *s, const Page *g, int32_t top, int32_t rows, float *out, int32_t *owner, int64_t *counts,
               void *memory) {
    PICK(plane, s, g, top, rows, out, owner, counts, memory);
}
OUT void states(int32_t variant, const Flat *s, int64_t n, const float *p, float room, float *state, void *memory) {
    PICK(states, s, n, p, room, state, memory);
}
