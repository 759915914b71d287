// Lamps of a radius: how much of one a point sees, without random numbers.
// A lamp is a disc as a point sees it, and what is between them a cone. A ray along its axis, from the lamp, tells whether
// something comes nearer to the axis than the cone is wide, or holds the cone whole: most points are lit or dark. For the
// others the disc is cut into parts, each a thinner cone; beside its axis the field is asked where things were nearest to
// the ray. The distance, negative within solids, over the thin cone's radius there tells what share of the part a straight
// edge at that distance leaves. Planes through what is nearest on both sides of the place give the edge's distance even
// where a solid is thin. Edges of several things hide the same, or other places, as they face alike, or apart.
#pragma once
#include "march.h"
enum { PARTS = 4, THINGS = 3, MARCHED = 800 };  // of the disc; nearest to a ray, that are kept; steps at most
#define ASIDE 0.6f  // in units of the disc's radius, where the middles of parts are,
#define WIDE 0.55f  // and their radii: shares of straight edges are right
#define STRIDE 0.5f  // least steps, in units of the cone's radius,
#define HASTE 0.03f  // and of the way that is left,
#define HURRY 0.5f  // but no more of the cone's radius
#define FLOOR 0.012f  // what is added to all steps, in world units; rays end so far before a point

typedef struct { V at, way, normal; F far, spread; float radius; } Cone;  // of a lamp, towards points
typedef struct { F least, where; } Thing;  // least distance over the cone's radius, and how far along the ray it is

IN V over(V a, F by) { return (V){a.x / by, a.y / by, a.z / by}; }
IN F arc(F c) {  // the arc cosine of -1 to 1, within 1e-6 of itself (Abramowitz and Stegun 4.4.46)
    F x = size_of(c);
    F p = 1.5707963050f + x * (-0.2145988016f + x * (0.0889789874f + x * (-0.0501743046f + x * (0.0308918810f
        + x * (-0.0170881256f + x * (0.0066700901f - x * 0.0012624911f))))));
    F r = p * root(max2(1.0f - x, all(0)));
    return sel(c < 0.0f, 3.14159265f - r, r);
}
// The part of a unit disc on the near side of a straight edge at c from its middle.
IN F share(F c) {
    c = clamp(c, -1, 1);
    return (arc(-c) + c * root(1.0f - c * c)) * 0.318309886f;
}
// Follow the axes of cones, and keep what comes nearest to them, nearer things first.
static ONCE void pass(const Scene *s, const Slot *slot, int n, const Cone *c, Thing thing[THINGS], int64_t *pairs) {
    F t = all(BIG), before = all(0);
    M falls = ints(0);
    for (int k = 0; k < THINGS; k++) thing[k] = (Thing){all(1), all(0)};
    for (int k = 0; k < n; k++) if (slot[k].object->flags & STOPS) t = min2(slot[k].begin, t);
    M alive = t < BIG;
    for (int i = 0; i < MARCHED && any(alive); i++) {
        Met m = meet(s, slot, n, t, alive, pairs, DISTANCE);
        F left = max2(c->far - t, all(FLOOR)), radius = c->spread * left, near = m.d / radius;
        M fall = (near < before) & alive, other = fall & ~falls;  // something else comes near
        for (int k = 1; k < THINGS; k++) {  // what is nearer moves the others on
            M moved = other & (thing[0].least < thing[k].least);
            Thing a = thing[0], b = thing[k];
            thing[0] = (Thing){sel(moved, b.least, a.least), sel(moved, b.where, a.where)};
            thing[k] = (Thing){sel(moved, a.least, b.least), sel(moved, a.where, b.where)};
        }
        F least = sel(other, all(1), thing[0].least);
        thing[0].where = sel((near < least) & alive, t, thing[0].where);
        thing[0].least = sel(alive, min2(near, least), least);
        falls = fall; before = near;
        least = min2(thing[0].least, thing[1].least);  // less than the third
        F step = max2((m.d - clamp(least, -1, 1) * radius) / m.rate, STRIDE * radius);
        F next = t + step + min2(HURRY * c->spread, all(HASTE)) * left + FLOOR;
        F following = min2(sel(next > m.last, all(BIG), next), m.next);
        alive &= (least > -1.0f) & (following < BIG);
        t = sel(alive, following, t);
    }
}
// Distances and gradients a little beside rays, at p, of what these meet at t.
static ONCE F beside(const Scene *s, const Slot *slot, int n, F t, V p, M some, V *gradient, int64_t *pairs) {
    Fold f;
    fold_open(s, &f, GRADIENT);
    for (int k = n - 1; k >= 0; k--) {
        const Slot *e = slot + k;
        M in = (e->begin <= t) & (t <= e->end) & some;
        if (any(in)) fold_take(s, &f, e->object, mapped(e->object->map, p), in, e->object->radius > RIM, GRADIENT);
    }
    fold_close(s, &f, 0, GRADIENT);
    *pairs += f.pairs;
    *gradient = f.state->g;
    return f.state->d;
}
typedef struct { F t, d, along; V across; } Plane;  // through what is nearest: along a part's axis, and across it
// What a part of the disc has left of its light, and the side to which it has, once a thing hides some of it.
static ONCE void hide(const Scene *s, const Slot *slot, int n, const Cone *c, V aside, V way, F t, M some, F *lit, V *side,
                      int64_t *pairs) {
    Plane two[2];
    F spread = WIDE * c->spread;
    for (int i = 0; i < 2; i++) {
        F left = max2(c->far - t, all(FLOOR));
        V g, p = plus(c->at, plus(scaled(c->way, t), scaled(aside, left)));
        F d = beside(s, slot, n, t, p, some, &g, pairs), length = max2(length_of(g), all(0.05f)), along = dot(g, way) / length;
        two[i] = (Plane){t, d / length, along, minus(over(g, length), scaled(way, along))};
        F step = (STRIDE * c->spread + HASTE) * left + FLOOR;
        t = min2(max2(sel(along > 0.0f, t - step, t + step), all(c->radius)), c->far - FLOOR);
    }
    // planes through what is nearest at both meet beside the axis, where an edge is; of thin plates, never
    Plane a = two[0], b = two[1];
    M both = a.along * b.along < 0.0f;
    F apart = sel(both, a.along - b.along, all(1)), middle = (b.d - a.d + a.along * a.t - b.along * b.t) / apart;
    V edge = over(minus(scaled(b.across, a.along), scaled(a.across, b.along)), apart);
    V g = choose(both, edge, choose(b.d < a.d, b.across, a.across));
    F d = sel(both, a.d + a.along * (middle - a.t), min2(a.d, b.d));
    t = sel(both, middle, a.t);
    F steep = max2(length_of(g), all(1e-3f)), off = d / (steep * spread * max2(c->far - t, all(FLOOR)));
    // what is nearest within the lamp hides nothing
    off = sel((d > 0.0f) & (t - a.along * d < c->radius), all(1), off);
    F hides = 1.0f - share(off), rest = *lit;
    g = over(g, steep);
    // of two edges one hides what the other does, other places, or crosses it, by their angle
    F cosine = dot(g, *side), common = sel(cosine > 0.0f, min2(hides, 1.0f - rest), max2(hides - rest, all(0)));
    F crossed = hides * (1.0f - rest);
    *side = choose(some & (hides > 1.0f - rest), g, *side);
    *lit = sel(some, rest - hides + crossed + size_of(cosine) * (common - crossed), rest);
}
// Shares of a lamp's light that a packet of points receives through what there is.
static ONCE F shown(const Scene *s, const Slot *slot, int n, const Cone *c, int64_t *pairs) {
    const float turn[PARTS][2] = {{0.955336489f, 0.295520207f}, {-0.295520207f, 0.955336489f},  // by 0.3, and quarters more
                                  {-0.955336489f, -0.295520207f}, {0.295520207f, -0.955336489f}};
    Thing thing[THINGS];
    pass(s, slot, n, c, thing, pairs);
    F least = min2(thing[0].least, thing[1].least), whole = share(least);
    F upright = size_of(c->normal.x) + size_of(c->normal.y) + size_of(c->normal.z);
    M half = (size_of(least) < 1.0f) & (upright > 0.0f);
    if (!any(half)) return whole;
    // parts are turned alike but for points straight behind the lamp, seen along (0.6, 0, -0.8)
    V w = c->way, u = {-0.8f * w.y, 0.6f * w.z + 0.8f * w.x, -0.6f * w.y};
    u = over(u, max2(length_of(u), all(1e-6f)));
    V v = {w.y * u.z - w.z * u.y, w.z * u.x - w.x * u.z, w.x * u.y - w.y * u.x};
    F sum = all(0), weights = all(0);
    for (int k = 0; k < PARTS; k++) {
        // how the part's axis goes apart from the ray, back from the point
        V aside = scaled(plus(scaled(u, all(turn[k][0])), scaled(v, all(turn[k][1]))), ASIDE * c->spread);
        V way = minus(c->way, aside), side = {all(0), all(0), all(0)};
        way = over(way, length_of(way));
        F lit = all(1), facing = -dot(c->normal, way) / (WIDE * c->spread);
        for (int i = 0; i < THINGS; i++) {
            M some = half & (thing[i].least < 1.0f);
            if (any(some)) hide(s, slot, n, c, aside, way, thing[i].where, some, &lit, &side, pairs);
        }
        F open = share(facing), rest = root(max2(1.0f - facing * facing, all(0)));
        lit = min2(min2(lit, open) / max2(open, all(1e-6f)), all(1));
        F weight = facing * open + rest * rest * rest * (2.0f / 3.0f * 0.318309886f);  // the mean of max(0, facing + y)
        sum += lit * weight; weights += weight;
    }
    return sel(half, sum / max2(weights, all(1e-9f)), whole);
}
