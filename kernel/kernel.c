// What Python calls, for one kind of processor: `NAME` adds its name. No globals; scratch comes from the caller.
#include "fold.h"
#define BLOCK (256 / W)  // packets that have a list of objects in common
#ifndef NAME
#define NAME(x) x
#endif

typedef struct { V at; M in; const Object *object; int far; } Near;  // an object that points of a packet may meet

static void *aligned(void *p) { return (void *)(((uintptr_t)p + 63) & ~(uintptr_t)63); }
// Bytes of scratch that calls need.
int64_t NAME(scratch)(const Scene *s) { return 128 + (int64_t)(sizeof(Near) + sizeof(int32_t)) * (s->objects + 1); }

IN void read_points(const float *p, int64_t n, int64_t at, V *q) {  // the last point stands for those behind it
    for (int k = 0; k < W; k++) {
        int64_t j = at + k < n ? at + k : n - 1;
        q->x[k] = p[j]; q->y[k] = p[n + j]; q->z[k] = p[2 * n + j];
    }
}
// Objects, as numbers that rise, that points of packets from `from` on may meet within their reach.
static int listed(const Scene *s, const float *p, const float *reach, int64_t n, int64_t from, int32_t *list) {
    V low = {all(BIG), all(BIG), all(BIG)}, high = {all(-BIG), all(-BIG), all(-BIG)};
    float far = 0, least[3] = {BIG, BIG, BIG}, most[3] = {-BIG, -BIG, -BIG}, centre[3], ball = 0;
    for (int64_t i = from; i < n && i < from + BLOCK * W; i += W) {
        V q;
        read_points(p, n, i, &q);
        low = (V){min2(q.x, low.x), min2(q.y, low.y), min2(q.z, low.z)};
        high = (V){max2(q.x, high.x), max2(q.y, high.y), max2(q.z, high.z)};
        for (int k = 0; k < W && i + k < n; k++) far = reach[i + k] > far ? reach[i + k] : far;
    }
    for (int k = 0; k < W; k++) {
        float a[3] = {low.x[k], low.y[k], low.z[k]}, b[3] = {high.x[k], high.y[k], high.z[k]};
        for (int d = 0; d < 3; d++) {
            least[d] = a[d] < least[d] ? a[d] : least[d];
            most[d] = b[d] > most[d] ? b[d] : most[d];
        }
    }
    for (int d = 0; d < 3; d++) {
        centre[d] = 0.5f * (least[d] + most[d]);
        ball += 0.25f * (most[d] - least[d]) * (most[d] - least[d]);
    }
    ball = sqrtf(ball);
    int count = 0;
    for (int i = 0; i < s->objects; i++) {
        const Object *o = s->object + i;
        float x = o->centre[0] - centre[0], y = o->centre[1] - centre[1], z = o->centre[2] - centre[2];
        float room = ball + o->extent * (1 + far * o->reach / (o->scale * o->ball));
        int kept = s->clipping && (o->ends || o->flags & (CLIPS | BEGINS));  // others depend on it
        list[count] = i;
        count += kept || !(x * x + y * y + z * z > room * room * 1.0001f + 1e-12f);
    }
    return count;
}
// Objects of a list whose balls, larger by reaches, hold points of a packet, last ones first; their number.
IN int held(const Scene *s, V q, F reach, float far, M some, const int32_t *list, int count, Near *near) {
    M there = some, theres[DEEP + 1];  // within all that cuts away what is outside of it
    int n = 0, around = 0;
    for (int k = count - 1; k >= 0; k--) {
        const Object *o = s->object + list[k];
        if (s->clipping) for (int e = 0; e < o->ends; e++) theres[around++] = there;
        V a = mapped(o->map, q);
        F ball = o->ball + reach * (o->reach / o->scale);
        M within = dot(a, a) <= ball * ball, in = within & there;
        if (s->clipping) {
            if (o->flags & BEGINS) there = theres[--around];
            if (o->flags & CLIPS) there &= within;
        }
        if (any(in)) near[n++] = (Near){a, in, o, o->radius + far / o->scale > RIM};
    }
    return n;
}
IN void store(float *to, int64_t n, int64_t at, F values) {
    if (at + W <= n) memcpy(to + at, &values, sizeof values);
    else memcpy(to + at, &values, 4 * (size_t)(n - at));
}
IN int64_t asked(const Scene *s, int64_t n, const float *p, const float *reach, float *distance, float *gradient,
                 float *look, int32_t *owner, void *scratch, const int wanted) {
    Near *near = aligned(scratch);
    int32_t *list = (int32_t *)(near + s->objects + 1);
    int64_t pairs = 0;
    int count = 0;
    for (int64_t i = 0; i < n; i += W) {
        if (i % (BLOCK * W) == 0) count = listed(s, p, reach, n, i, list);
        V q;
        F own;
        M some;
        float far = 0;
        read_points(p, n, i, &q);
        for (int k = 0; k < W; k++) {
            int64_t j = i + k < n ? i + k : n - 1;
            own[k] = reach[j]; some[k] = i + k < n ? -1 : 0;
            far = reach[j] > far ? reach[j] : far;
        }
        int m = held(s, q, own, far, some, list, count, near);
        Fold f;
        fold_open(s, &f, wanted);
        while (m--) fold_take(s, &f, near[m].object, near[m].at, near[m].in, near[m].far, wanted);
        fold_close(s, &f, 0, wanted);
        pairs += f.pairs;
        State *r = f.state;
        store(distance, n, i, r->d);
        if (wanted & GRADIENT) { store(gradient, n, i, r->g.x); store(gradient + n, n, i, r->g.y); store(gradient + 2 * n, n, i, r->g.z); }
        if (wanted & REGISTER_) for (int k = 0; k < s->rows; k++) store(look + k * n, n, i, r->look[k]);
        if (wanted & OWNER) store((float *)owner, n, i, (F)r->owner);
    }
    return pairs;
}
// The field at n points (3, n): distances, exact where |D| is less than a reach (n) in world units, and, unless null,
// gradients (3, n), registers (rows, n) and owners (n), objects' numbers from 1 or 0; pairs of points and objects met.
int64_t NAME(field)(const Scene *s, int64_t n, const float *p, const float *reach, float *distance, float *gradient,
                    float *look, int32_t *owner, void *scratch) {
    if (!look && !owner)
        return gradient ? asked(s, n, p, reach, distance, gradient, 0, 0, scratch, GRADIENT)
                        : asked(s, n, p, reach, distance, 0, 0, 0, scratch, DISTANCE);
    return asked(s, n, p, reach, distance, gradient, look, owner, scratch, ALL);
}
// Distances of objects alone, whatever else there is, and their gradients (3, n), at points (3, n) with numbers from 0.
void NAME(own)(const Scene *s, int64_t n, const int32_t *object, const float *p, float *distance, float *gradient) {
    for (int64_t i = 0; i < n; i += W) {
        V q, g = {all(0), all(0), all(0)};
        F d = all(0);
        read_points(p, n, i, &q);
        for (int k = 0; k < W && i + k < n; k++) {
            if (k && object[i + k] == object[i + k - 1]) continue;
            const Object *o = s->object + object[i + k];
            M mine;
            for (int j = 0; j < W; j++) mine[j] = i + j < n && object[i + j] == object[i + k] ? -1 : 0;
            V slope, local;
            F own = leaf_slope(s, o, mapped(o->map, q), 1, &slope, &local);
            d = sel(mine, own, d); g = choose(mine, slope, g);
        }
        store(distance, n, i, d); store(gradient, n, i, g.x); store(gradient + n, n, i, g.y); store(gradient + 2 * n, n, i, g.z);
    }
}
