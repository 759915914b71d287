// Direct light on opaque surfaces and the ground, along rays from an eye: the colours of a picture, linear.
#pragma once
#include "march.h"
#define INTO 3e-5f  // world units behind a surface where its material is asked for
#define CLEAR 2e-4f  // world units before a surface where rays from a lamp end

typedef struct { F d, t; V g, colour, glow; } Surface;

// What is met at t of rays where `in` holds.
IN void ask_slots(const Scene *s, const Slot *slot, int n, V way, F t, M in, int glow, int64_t *pairs, Surface *r) {
    Fold f;
    fold_open(s, &f, GRADIENT | REGISTER_);
    for (int k = n - 1; k >= 0; k--) {
        const Slot *e = slot + k;
        M there = (e->begin <= t) & (t <= e->end) & in;
        if (any(there)) fold_take(s, &f, e->object, plus(e->start, scaled(e->way, t)), there, e->object->radius > RIM, GRADIENT | REGISTER_);
    }
    fold_close(s, &f, 0, GRADIENT | REGISTER_);
    *pairs += f.pairs;
    const State *x = f.state;
    *r = (Surface){x->d, t, x->g, {x->look[0], x->look[1], x->look[2]}, {all(0), all(0), all(0)}};
    if (glow) r->glow = (V){x->look[glow], x->look[glow + 1], x->look[glow + 2]};
}
IN F ahead(F d, F towards, float gap) {  // how far the surface is; along one, at a cosine over -0.02, d says nothing of it
    return clamp(sel(towards < -0.02f, -d / sel(towards < -0.02f, towards, all(-1)), all(-INTO)), -gap, gap);
}
// The surfaces that rays meet at t, with unit normals that face them.
ONCE static Surface surface(const Scene *s, const Slot *slot, int n, V way, F t, M hit, float gap, int glow, int64_t *pairs) {
    Surface r, again;
    ask_slots(s, slot, n, way, t + INTO, hit, glow, pairs, &r);
    r.t = t;
    F towards = dot(r.g, way);
    M left = towards > 0.0f, off = hit & (left | (size_of(r.d) > 3 * INTO));  // beyond an edge, or bounds told little
    if (any(off)) {
        F there = t + INTO + sel(left, all(-gap), ahead(r.d, towards, gap));
        ask_slots(s, slot, n, way, there, off, glow, pairs, &again);
        M known = off & (dot(again.g, again.g) > 0.01f) & ~(left & (dot(again.g, way) > 0.0f));  // not past an edge
        r.t = sel(known, there - INTO, t);
        r.d = sel(known, again.d, r.d);
        r.g = choose(known, again.g, r.g); r.colour = choose(known, again.colour, r.colour); r.glow = choose(known, again.glow, r.glow);
        towards = dot(r.g, way);
    }
    r.t = r.t + INTO + ahead(r.d, towards, gap);
    r.g = scaled(r.g, sel(towards > 0.0f, all(-1), all(1)) / max2(root(dot(r.g, r.g)), all(1e-12f)));
    return r;
}
enum { BEAM = 256 };  // rays that are shaded together
typedef struct { float v[3][BEAM]; } Rows;
typedef struct { Rows p, n, colour, way, light; float far[BEAM], received[BEAM], alpha[BEAM]; int32_t ray[BEAM]; } Beam;
typedef struct { int64_t lights, near, steps, met, lost; } Shaded;

IN F load(const float *from, int i) { F r; memcpy(&r, from + i, sizeof r); return r; }
IN V load3(const Rows *r, int i) { return (V){load(r->v[0], i), load(r->v[1], i), load(r->v[2], i)}; }
IN void keep(float *to, int i, F a) { memcpy(to + i, &a, sizeof a); }
IN void keep3(Rows *r, int i, V a) { keep(r->v[0], i, a.x); keep(r->v[1], i, a.y); keep(r->v[2], i, a.z); }
IN V constant(const float c[3]) { return (V){all(c[0]), all(c[1]), all(c[2])}; }
static ONCE F hit_of(const Scene *s, const Slot *slot, int n, float gap, Shaded *w) {
    Trail r = march(s, slot, n, gap, 800, 0, 0, 0, &w->met, DISTANCE);
    w->near += __builtin_popcount(bits(drawing(slot, n)));
    w->steps += r.asked;
    w->lost += __builtin_popcount(bits(r.lost));
    return r.hit;
}
// Objects that rays (n) of a block from a point may meet; their number.
static int narrowed(const Scene *s, const float at[3], const Rows *way, int n, int32_t *list) {
    float axis[3], cosine = cone_of(way->v[0], BEAM, n, 0, axis);
    return in_cone(s, at, axis, cosine, list);
}
// Light of lamps that points of a block, of which n are there, receive where nothing is in its way.
static void light_up(const Scene *s, const Stage *stage, Beam *b, int n, Slot *slot, int32_t *list, Shaded *w) {
    for (int l = 0; l < stage->lamps; l++) {
        const Lamp *lamp = stage->lamp + l;
        V at = constant(lamp->at);
        int lit = 0;
        for (int i = 0; i < n; i += W) {  // full packets of points that face it
            V normal = load3(&b->n, i), to = minus(load3(&b->p, i), at), colour = load3(&b->colour, i);
            F r = max2(root(dot(to, to)), all(stage->nearest)), facing = -dot(normal, to) / r, received = facing / (r * r);
            to = plus(to, scaled(normal, all(stage->lift)));
            F far = root(dot(to, to));
            to = scaled(to, 1.0f / max2(far, all(1e-9f)));
            F bright = colour.x * lamp->power[0] + colour.y * lamp->power[1] + colour.z * lamp->power[2];
            for (int m = bits((facing > 0.0f) & (bright != 0.0f)); m; m &= m - 1) {
                int k = __builtin_ctz((unsigned)m);
                if (i + k >= n) break;
                b->way.v[0][lit] = to.x[k]; b->way.v[1][lit] = to.y[k]; b->way.v[2][lit] = to.z[k];
                b->far[lit] = far[k] - CLEAR; b->received[lit] = received[k]; b->ray[lit++] = i + k;
            }
        }
        if (!lit) continue;
        w->lights += lit;
        for (int i = lit; i % W; i++) {
            for (int d = 0; d < 3; d++) b->way.v[d][i] = b->way.v[d][lit - 1];
            b->far[i] = -BIG;
        }
        int listed = narrowed(s, lamp->at, &b->way, lit, list);
        for (int i = 0; i < lit; i += W) {
            int m = slots_of(s, at, load3(&b->way, i), all(0), load(b->far, i), list, listed, slot);
            F hit = m ? hit_of(s, slot, m, stage->gap, w) : all(INFINITY);
            for (int k = 0; k < W && i + k < lit; k++) if (!(hit[k] < BIG)) {
                int j = b->ray[i + k];
                for (int d = 0; d < 3; d++) b->light.v[d][j] += b->received[i + k] * lamp->power[d] * b->colour.v[d][j];
            }
        }
    }
}
// Light and alpha along a block of n rays from the eye, whose ways are in `b->way`.
static void shade_block(const Scene *s, const Stage *stage, Beam *b, int n, Slot *slot, int32_t *list, Shaded *w) {
    V eye = constant(stage->eye), none = {all(0), all(0), all(0)};
    int listed = narrowed(s, stage->eye, &b->way, n, list);
    for (int i = 0; i < n; i += W) {
        V way = load3(&b->way, i), normal = none, colour = none, haze = none;
        F high = clamp(way.y * 2.0f, 0, 1), limit = all(BIG);
        if (stage->grounded && stage->eye[1] > stage->floor) {
            M down = way.y < 0.0f;
            limit = sel(down, min2((stage->floor - stage->eye[1]) / sel(down, way.y, all(-1)), all(BIG)), limit);
        }
        F last = limit;
        for (int k = 0; k < W; k++) if (i + k >= n) last[k] = -BIG;
        V light = none;
        if (!stage->transparent) {
            V low = constant(stage->horizon);
            light = plus(low, scaled(minus(constant(stage->zenith), low), high));
        }
        int m = slots_of(s, eye, way, all(0), last, list, listed, slot);
        F t = m ? hit_of(s, slot, m, stage->gap, w) : all(INFINITY);
        M hit = t < BIG, floor = ~hit & (limit < BIG), both = hit | floor;
        F far = limit;
        if (any(hit)) {
            Surface met = surface(s, slot, m, way, sel(hit, t, all(0)), hit, stage->gap, stage->glow, &w->met);
            far = sel(hit, met.t, far);
            normal = choose(hit, met.g, none); colour = choose(hit, met.colour, none); haze = choose(hit, met.glow, none);
        }
        V p = plus(eye, scaled(way, sel(both, far, all(0))));
        if (any(floor)) {
            F kept = exponential((p.x * p.x + p.z * p.z) * (-1.0f / stage->fade));
            colour = choose(floor, scaled(constant(stage->ground), kept), colour);
            haze = choose(floor, scaled(constant(stage->horizon), 1.0f - kept), haze);
            normal = choose(floor, (V){all(0), all(1), all(0)}, normal);
        }
        light = choose(both, plus(scaled(colour, stage->ambient[0] + stage->ambient[1] * normal.y), haze), light);
        keep3(&b->p, i, p); keep3(&b->n, i, normal); keep3(&b->colour, i, colour); keep3(&b->light, i, light);
        keep(b->alpha, i, sel(both, all(1), all(stage->transparent ? 0 : 1)));
    }
    light_up(s, stage, b, n, slot, list, w);
}
