// The field at points: the objects that these may meet, and what they come to.
#pragma once
#include "fold.h"
#define BLOCK (256 / W)  // packets that have a list of objects in common

typedef struct { V at; M in; const Object *object; int far; } Near;  // an object that points of a packet may meet

// Objects, as numbers that rise, that points of packets from `from` on may meet within their reach.
static int listed(const Scene *s, const float *p, const float *reach, int64_t n, int64_t from, int32_t *list) {
    V low = {all(BIG), all(BIG), all(BIG)}, high = {all(-BIG), all(-BIG), all(-BIG)};
    float far = 0, centre[3], ball = 0;
    for (int64_t i = from; i < n && i < from + BLOCK * W; i += W) {
        V q;
        q = read_points(p, n, n, i);
        low = (V){min2(q.x, low.x), min2(q.y, low.y), min2(q.z, low.z)};
        high = (V){max2(q.x, high.x), max2(q.y, high.y), max2(q.z, high.z)};
        for (int k = 0; k < W && i + k < n; k++) far = reach[i + k] > far ? reach[i + k] : far;
    }
    float least[3] = {-most_of(-low.x), -most_of(-low.y), -most_of(-low.z)}, most[3] = {most_of(high.x), most_of(high.y), most_of(high.z)};
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
// What a packet of points comes to, exact where |D| is less than a reach, by the objects of a list, in `near`.
IN State told(const Scene *s, V q, F reach, float far, M some, const int32_t *list, int count, Near *near, int64_t *pairs,
              const int wanted) {
    int m = held(s, q, reach, far, some, list, count, near);
    Fold f;
    fold_open(s, &f, wanted);
    while (m--) fold_take(s, &f, near[m].object, near[m].at, near[m].in, near[m].far, wanted);
    fold_close(s, &f, 0, wanted);
    *pairs += f.pairs;
    return f.state[0];
}
// Distances of objects alone, by their numbers from 1, at points, and gradients or, for `REGISTER_`, colours.
IN F alone(const Scene *s, M owner, V q, V *more, const int wanted) {
    F r = all(0);
    *more = (V){all(0), all(0), all(0)};
    for (M left = owner > 0; any(left);) {
        int number = owner[__builtin_ctz((unsigned)bits(left))];
        M mine = owner == number;
        const Object *o = s->object + number - 1;
        V own = mapped(o->map, q), local, to = {all(o->look[0]), all(o->look[1]), all(o->look[2])};
        F d = all(0);
        if (wanted == GRADIENT) d = leaf_slope(s, o, own, 1, &to, &local);
        else if (wanted == DISTANCE || o->texture >= 0) d = leaf_distance(s, o, own, 1, &local);
        if (wanted == REGISTER_ && o->texture >= 0) to = coloured(s->texture + o->texture, local);
        r = sel(mine, d, r);
        *more = choose(mine, to, *more);
        left &= ~mine;
    }
    return r;
}
