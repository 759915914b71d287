// What Python calls, for one kind of processor: `NAME` adds its name. No globals; scratch comes from the caller.
#include "cone.h"
#include "plane.h"
#include "shade.h"
#define BLOCK (256 / W)  // packets that have a list of objects in common
#ifndef NAME
#define NAME(x) x
#endif

typedef struct { V at; M in; const Object *object; int far; } Near;  // an object that points of a packet may meet

static void *aligned(void *p) { return (void *)(((uintptr_t)p + 63) & ~(uintptr_t)63); }
// Bytes of scratch that calls need.
int64_t NAME(scratch)(const Scene *s) { return 128 + (int64_t)(sizeof(Slot) + sizeof(int32_t)) * (s->objects + 1); }

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
    return gradient ? asked(s, n, p, reach, distance, gradient, look, owner, scratch, ALL)
                    : asked(s, n, p, reach, distance, 0, look, owner, scratch, REGISTER_ | OWNER);
}
// Distances of objects alone, whatever else there is, and unless null their gradients (3, n), at points (3, n) with numbers
// from 0; or, unless null, their colours (3, n) instead.
void NAME(own)(const Scene *s, int64_t n, const int32_t *object, const float *p, float *distance, float *gradient, float *colour) {
    float *to = colour ? colour : gradient;
    for (int64_t i = 0; i < n; i += W) {
        V q, g = {all(0), all(0), all(0)};
        F d = all(0);
        read_points(p, n, i, &q);
        for (int k = 0; k < W && i + k < n; k++) {
            if (k && object[i + k] == object[i + k - 1]) continue;
            const Object *o = s->object + object[i + k];
            M mine;
            for (int j = 0; j < W; j++) mine[j] = i + j < n && object[i + j] == object[i + k] ? -1 : 0;
            V slope, local, own = mapped(o->map, q);
            if (gradient) d = sel(mine, leaf_slope(s, o, own, 1, &slope, &local), d);
            else if (!colour) d = sel(mine, leaf_distance(s, o, own, 1, &local), d);
            else if (o->texture < 0) slope = (V){all(o->look[0]), all(o->look[1]), all(o->look[2])};
            else {
                leaf_distance(s, o, own, 1, &local);
                slope = coloured(s->texture + o->texture, local);
            }
            if (to) g = choose(mine, slope, g);
        }
        if (!colour) store(distance, n, i, d);
        if (!to) continue;
        store(to, n, i, g.x); store(to + n, n, i, g.y); store(to + 2 * n, n, i, g.z);
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
// Light (3, n) and alpha (n) along n rays of unit ways (3, n) from the eye of a stage, of opaque objects with plain colours;
// rays lie in rows of `across`. Counts are of rays from lamps, of rays that pass what draws, of
// points, of pairs of points and objects, and of rays that came to no end.
void NAME(shade)(const Scene *s, const Stage *stage, int64_t n, int64_t across, const float *way, float *light, float *alpha,
                 int64_t counts[5], void *scratch) {
    Slot *slot = aligned(scratch);
    int32_t *list = (int32_t *)(slot + s->objects + 1);
    Shaded w = {0, 0, 0, 0, 0};
    Beam b;
    int64_t at[BEAM], rows = across ? n / across : 0, side = 16;
    if (rows < 16 || across < 16) { across = n; rows = 1; side = BEAM; }
    for (int64_t top = 0; top < rows; top += 16) for (int64_t left = 0; left < across; left += side) {
        int k = 0;
        for (int64_t y = top; y < top + 16 && y < rows; y += 2)  // in pairs of rows, so that packets are compact
            for (int64_t x = left; x < left + side && x < across; x++)
                for (int64_t j = y; j < y + 2 && j < rows; j++) {
                    for (int d = 0; d < 3; d++) b.way.v[d][k] = way[d * n + j * across + x];
                    at[k++] = j * across + x;
                }
        int whole = k;
        for (; k % W; k++) for (int d = 0; d < 3; d++) b.way.v[d][k] = b.way.v[d][whole - 1];
        shade_block(s, stage, &b, whole, slot, list, &w);
        for (int i = 0; i < whole; i++) {
            for (int d = 0; d < 3; d++) light[d * n + at[i]] = b.light.v[d][i];
            alpha[at[i]] = b.alpha[i];
        }
    }
    counts[0] = w.lights; counts[1] = w.near; counts[2] = w.steps; counts[3] = w.met; counts[4] = w.lost;
}
// Rows of a picture of the plane from `top` on: premultiplied colours (rows, width, 4), or over a background (rows, width, 3),
// or, unless null, the owners of pixels instead. Counts are of pairs of points and objects, of pixels of which all samples
// were taken, and of those that were asked one by one. Scratch is 64 bytes for each object and group.
void NAME(plane)(const Flat *s, const Page *g, int32_t top, int32_t rows, float *out, int32_t *owner, int64_t counts[3], void *scratch) {
    Target t = {s, g, out, owner, 0, top, g->width, top + rows};
    Entry *entries = aligned(scratch);
    Drawn w = {.macro = entries, .tile = entries + s->objects, .turn = (Turn *)(entries + 2 * (size_t)s->objects)};
    w.row = (int32_t *)(w.turn + s->objects + s->groups);
    for (int y = top; y < top + rows; y += 64) {
        double low[2], high[2];
        int some = 0;
        low[0] = -INFINITY; high[0] = INFINITY;
        high[1] = g->north - g->step * (y - 0.5) + 1e-6; low[1] = g->north - g->step * (y + 63.5) - 1e-6;
        for (int i = 0; i < s->objects; i++) if (meets(s->shape + i, low, high)) w.row[some++] = i;
        for (int x = 0; x < g->width; x += 64) {
            int count = 0;
            low[0] = g->west + g->step * (x - 0.5) - 1e-6; high[0] = g->west + g->step * (x + 63.5) + 1e-6;
            for (int i = 0; i < some; i++) if (meets(s->shape + w.row[i], low, high)) w.macro[count++].object = w.row[i];
            macro(&t, w.macro, count, x, y, &w);
        }
    }
    counts[0] = w.pairs; counts[1] = w.refined; counts[2] = w.met;
}
// States (n) of the fold at points (2, n) of the plane, right within `room` world units around them.
void NAME(states)(const Flat *s, int64_t n, const float *p, float room, float *state, void *scratch) {
    Entry *entries = aligned(scratch);
    int64_t pairs = 0;
    for (int64_t i = 0; i < n; i += W) {
        P q;
        double low[2] = {INFINITY, INFINITY}, high[2] = {-INFINITY, -INFINITY};
        for (int k = 0; k < W; k++) {
            int64_t j = i + k < n ? i + k : n - 1;
            q.x[k] = p[j]; q.y[k] = p[n + j];
            for (int e = 0; e < 2; e++) {
                double at = p[e * n + j];
                low[e] = fmin(low[e], at - room); high[e] = fmax(high[e], at + room);
            }
        }
        int count = 0;
        for (int k = 0; k < s->objects; k++) if (meets(s->shape + k, low, high)) entries[count++] = (Entry){k, ALL_CELLS, 0};
        store(state, n, i, fold_plain(s, entries, count, 0, q, 0, 0, &pairs).d);
    }
}
