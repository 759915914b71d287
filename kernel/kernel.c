// What Python calls, for one kind of processor: `NAME` adds its name. No globals; scratch comes from the caller.
#include "band.h"
#ifndef NAME
#define NAME(x) x
#endif

// Bytes of scratch that calls need.
int64_t NAME(scratch)(const Scene *s) { return room_of(s); }

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
        State told_ = told(s, q, own, far, some, list, count, near, &pairs, wanted), *r = &told_;
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
    return gradient ? asked(s, n, p, reach, distance, gradient, look, owner, scratch, ALL)
                    : asked(s, n, p, reach, distance, 0, look, owner, scratch, REGISTER_ | OWNER);
}
// Distances of objects alone, whatever else there is, and unless null their gradients (3, n), at points (3, n) with numbers
// from 0; or, unless null, their colours (3, n) instead.
void NAME(own)(const Scene *s, int64_t n, const int32_t *object, const float *p, float *distance, float *gradient, float *colour) {
    float *to = colour ? colour : gradient;
    for (int64_t i = 0; i < n; i += W) {
        V q, more;
        M owner = ints(0);
        read_points(p, n, i, &q);
        for (int k = 0; k < W && i + k < n; k++) owner[k] = object[i + k] + 1;
        F d = colour ? alone(s, owner, q, &more, REGISTER_) : gradient ? alone(s, owner, q, &more, GRADIENT) : alone(s, owner, q, &more, DISTANCE);
        if (!colour) store(distance, n, i, d);
        if (!to) continue;
        store(to, n, i, more.x); store(to + n, n, i, more.y); store(to + 2 * n, n, i, more.z);
    }
}
IN int64_t followed(const Scene *s, int64_t n, int64_t origins, const float *p, const float *way, const float *begin,
                    const float *limit, float gap, int32_t steps, int32_t halvings, float *hit, float *length, int32_t *soft,
                    float *depth, int64_t counts[5], Piece *piece, int64_t room, void *scratch, const int wanted) {
    Slot *slot = aligned(scratch);
    int32_t *list = (int32_t *)(slot + s->objects + 1);
    Pieces pieces = {piece, 0, room};
    int64_t lost = 0, met = 0, near = 0, asked = 0;
    int count = s->objects;
    for (int i = 0; i < count; i++) list[i] = i;
    for (int64_t i = 0; i < n; i += W) {
        V from, to;
        F low, high;
        if (i % (BLOCK * W) == 0 && origins == 1) {
            float axis[3], cosine = cone_of(way, n, i + BLOCK * W < n ? i + BLOCK * W : n, i, axis);
            count = in_cone(s, p, axis, cosine, list);
        }
        read_points(way, n, i, &to);
        if (origins == 1) from = (V){all(p[0]), all(p[1]), all(p[2])};
        else read_points(p, n, i, &from);
        for (int k = 0; k < W; k++) {
            int64_t j = i + k < n ? i + k : n - 1;
            low[k] = begin[j]; high[k] = i + k < n ? limit[j] : -BIG;
        }
        int m = slots_of(s, from, to, low, min2(high, all(BIG)), list, count, slot);
        Trail r = march(s, slot, m, gap, steps, halvings, (int32_t)i, &pieces, &met, wanted);
        store(hit, n, i, r.hit); store(length, n, i, r.length); store((float *)soft, n, i, (F)r.soft);
        store(depth, n, i, r.depth);
        lost += __builtin_popcount(bits(r.lost));
        near += __builtin_popcount(bits(drawing(slot, m)));
        asked += r.asked;
    }
    counts[0] = pieces.count; counts[1] = lost; counts[2] = met; counts[3] = near; counts[4] = asked;
    return pieces.count;
}
// Follow n rays along unit ways (3, n) from one origin (3,) or n (3, n), from `begin` (n) up to a limit (n), by so many
// steps at most: how far the first opaque surface is, inf for none, how long the ways in media before it are, whether (-1
// or 0) a medium gives way to it, and how deep, optically, these media are; pieces of these ways, as many as there is room
// for, cut where media differ, in colour only if `coloured`. Counts are of all pieces, of rays that came to no end, of pairs
// of points and objects, of rays that pass what draws, and of points.
int64_t NAME(rays)(const Scene *s, int64_t n, int64_t origins, const float *p, const float *way, const float *begin,
                   const float *limit, float gap, int32_t steps, int32_t halvings, int32_t coloured, float *hit, float *length,
                   int32_t *soft, float *depth, int64_t counts[5], Piece *piece, int64_t room, void *scratch) {
    Scene own = *s;
    own.coloured = s->coloured && coloured;
    s = &own;
    if (s->mixed || s->dense || s->coloured)
        return followed(s, n, origins, p, way, begin, limit, gap, steps, halvings, hit, length, soft, depth, counts, piece, room, scratch, KIND);
    return followed(s, n, origins, p, way, begin, limit, gap, steps, halvings, hit, length, soft, depth, counts, piece, room, scratch, DISTANCE);
}
// Shares (n) of the light of a lamp of a radius at a point that points at `far` (n) along unit ways (3, n) from it receive
// through what there is, which is opaque; surfaces there have normals (3, n), 0 for points in media. `spread` (n) is the
// lamp's radius at distance 1 from the points. Counts are of rays that pass what draws and of pairs of points and objects.
void NAME(cones)(const Scene *s, int64_t n, const float *at, float radius, const float *way, const float *far, const float *spread,
                 const float *normal, float *part, int64_t counts[2], void *scratch) {
    Slot *slot = aligned(scratch);
    int32_t *list = (int32_t *)(slot + s->objects + 1);
    V from = {all(at[0]), all(at[1]), all(at[2])};
    int64_t met = 0, near = 0;
    int count = 0;
    for (int64_t i = 0; i < n; i += W) {
        if (i % (BLOCK * W) == 0) {
            float axis[3], cosine = cone_of(way, n, i + BLOCK * W < n ? i + BLOCK * W : n, i, axis);
            count = in_cone(s, at, axis, cosine, list);
        }
        Cone c = {.at = from, .radius = radius};
        read_points(way, n, i, &c.way);
        read_points(normal, n, i, &c.normal);
        M there = ints(0);
        for (int k = 0; k < W; k++) {
            int64_t j = i + k < n ? i + k : n - 1;
            c.far[k] = far[j]; c.spread[k] = spread[j]; there[k] = i + k < n ? -1 : 0;
        }
        F wide = (ASIDE + WIDE) * c.spread;
        F limit = sel(there, min2(c.far - FLOOR, all(BIG)), all(-BIG));
        int m = slots(s, from, c.way, all(radius), limit, s->reach - wide * c.far, wide, list, count, slot, 1);
        M some = drawing(slot, m);
        near += __builtin_popcount(bits(some));
        store(part, n, i, any(some) ? sel(some, shown(s, slot, m, &c, &met), all(1)) : all(1));
    }
    counts[0] = near; counts[1] = met;
}
// Light of the centres of a picture's pixels, in rows from `first` up to `last`, into those from `top` up to `bottom`:
// (R, bottom - top, width), colours, alpha and, of scenes with textures, the same colours of plain ones. Counts are as `Work`.
void NAME(shade)(const Scene *s, const Stage *stage, int32_t top, int32_t bottom, int32_t first, int32_t last, float *picture,
                 int64_t counts[7], void *scratch) {
    Job j = job_of(s, stage, scratch);
    centres(&j, top, bottom, first, last, picture);
    counted(&j, counts);
}
// The pixels of such rows, (last - first, width, 3 or 4), by more samples where light differs from row to row or column to
// column, in sRGB; `pixel` holds as many numbers. The last count is of numbers that are none.
void NAME(finish)(const Scene *s, const Stage *stage, int32_t top, int32_t bottom, int32_t first, int32_t last,
                  const float *picture, int32_t *pixel, float *out, int64_t counts[7], void *scratch) {
    Job j = job_of(s, stage, scratch);
    finished(&j, top, bottom, first, last, picture, pixel, out);
    counted(&j, counts);
}
