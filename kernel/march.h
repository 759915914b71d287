// Rays: the objects that a packet of them passes, and how far their first surfaces and the media before these are.
// The field bounds how far a surface or another kind of material is, and a step goes as far (Hart 1996). Where the
// last two bounds predict a surface farther on, a step goes just behind that, by at most `gap` more. Where media
// differ, steps in them are bounded by each other's surfaces, too, and ways are cut where they do.
#pragma once
#include "points.h"
#define BEHIND 3e-5f  // world units behind where a surface is foreseen that it is asked for
#define ROUNDING 2e-7f  // of distances, as a part of how far and how large things are: what is less deep is not met
#define DRIFT 0.2f  // of media that differ along a piece little by little, as `JUMP`
#define BETWEEN 8  // halvings of a step from one medium to another

typedef struct {  // an object that some rays of a packet pass: where they begin behind its map, and how that changes
    V start, way;
    F begin, end, rate;
    const Object *object;
} Slot;
typedef struct { Piece *piece; int64_t count, room; } Pieces;  // those beyond the room are counted alone
typedef struct { F hit, length, depth; M soft, lost; int64_t asked; } Trail;
typedef struct { F d, free, rate, next, cuts, last, until, look[REGISTER]; M medium; } Met;

// Slots of rays from `from` along unit `way`, from `low` up to `high`, of the objects of a list; their number. Balls ahead
// may be smaller by `spare`, and by `widen` more for each unit of the way, in world units.
IN int slots(const Scene *s, V from, V way, F low, F high, F spare, F widen, const int32_t *list, int listed, Slot *slot, const int less) {
    F lows[DEEP + 1], highs[DEEP + 1];
    int n = 0, around = 0;
    M alive = low <= high;
    for (int k = listed - 1; k >= 0; k--) {
        const Object *o = s->object + list[k];
        int cuts = s->clipping && (o->ends || o->flags & (CLIPS | BEGINS));
        if (s->clipping) for (int e = 0; e < o->ends; e++) { lows[around] = low; highs[around++] = high; }
        V to = {o->centre[0] - from.x, o->centre[1] - from.y, o->centre[2] - from.z};
        F ahead = dot(to, way), room = o->extent * o->extent * 1.0001f + 1e-12f - dot(to, to);
        M maybe = alive & ((room >= 0.0f) | ((ahead > 0.0f) & (room + ahead * ahead >= 0.0f)));
        if (!cuts && !any(maybe)) continue;
        V a = times(o->map, way), start = mapped(o->map, from);
        F square = dot(a, a), over = 1.0f / square, middle = -dot(start, a) * over;
        V closest = plus(start, scaled(a, middle));
        F ball = all(o->ball), inner = all(0);  // leaf units by which they are smaller
        if (less && !(o->flags & WIDER)) {
            F off = root(dot(to, to)) - o->extent;
            inner = sel(off > 0.0f, max2(spare + widen * off, all(0)) / o->scale, all(0));
            ball -= inner * o->reach;
        }
        F left = ball * ball - dot(closest, closest), half = root(max2(left * over, all(0)));
        F begin = max2(middle - half, low), end = min2(middle + half, high);
        if (o->flags & BOXED) {
            F ix = 1.0f / a.x, iy = 1.0f / a.y, iz = 1.0f / a.z;
            F x0 = (o->low[0] + inner - start.x) * ix, x1 = (o->high[0] - inner - start.x) * ix;
            F y0 = (o->low[1] + inner - start.y) * iy, y1 = (o->high[1] - inner - start.y) * iy;
            F z0 = (o->low[2] + inner - start.z) * iz, z1 = (o->high[2] - inner - start.z) * iz;
            begin = max2(max2(min2(x0, x1), begin), max2(min2(y0, y1), min2(z0, z1)));
            end = min2(min2(max2(x0, x1), end), min2(max2(y0, y1), max2(z0, z1)));
        }
        M hit = (left > 0.0f) & (begin <= end) & maybe;
        if (s->clipping) {
            if (o->flags & BEGINS) { around--; low = lows[around]; high = highs[around]; }
            if (o->flags & CLIPS) { low = sel(hit, begin, all(BIG)); high = sel(hit, end, all(-BIG)); }
        }
        if (any(hit)) slot[n++] = (Slot){start, a, sel(hit, begin, all(BIG)), sel(hit, end, all(-BIG)), o->rate * root(square), o};
    }
    return n;
}
static int slots_of(const Scene *s, V from, V way, F low, F high, const int32_t *list, int listed, Slot *slot) {
    return slots(s, from, way, low, high, all(0), all(0), list, listed, slot, 0);
}
// Rays that pass something that draws.
IN M drawing(const Slot *slot, int n) {
    M r = ints(0);
    for (int k = 0; k < n; k++) if (slot[k].object->flags & DRAWS) r |= slot[k].begin <= slot[k].end;
    return r;
}
// What rays meet at t. `next` is where other objects begin that may show something, `cuts` where others do, `until`
// where the first of the objects that are met ends, and `last` where the last of those that draw does.
IN Met meet(const Scene *s, const Slot *slot, int n, F t, M alive, int64_t *pairs, const int wanted) {
    Met r;
    Fold f;
    fold_open(s, &f, wanted);
    r.rate = all(1e-3f); r.next = r.cuts = r.until = all(BIG); r.last = all(-BIG);
    for (int k = n - 1; k >= 0; k--) {
        const Slot *e = slot + k;
        const Object *o = e->object;
        M ahead = e->begin > t, in = ~ahead & (t <= e->end) & alive;
        F begin = sel(ahead, e->begin, all(BIG));
        if (o->flags & STOPS) r.next = min2(begin, r.next);
        else r.cuts = min2(begin, r.cuts);
        if (!any(in)) continue;
        r.rate = max2(sel(in, e->rate, all(0)), r.rate);
        r.until = min2(sel(in & (e->end > t), e->end, all(BIG)), r.until);
        if (o->flags & DRAWS) r.last = max2(sel(in, e->end, all(-BIG)), r.last);
        fold_take(s, &f, o, plus(e->start, scaled(e->way, t)), in, o->radius > RIM, wanted);
    }
    fold_close(s, &f, 0, wanted);
    r.d = f.state->d;
    r.free = size_of(r.d);
    r.medium = (r.d < 0.0f) & (s->mixed ? f.state->kind > 0.5f : ints(s->media ? -1 : 0));
    if (wanted & REGISTER_) for (int k = 0; k < s->rows; k++) r.look[k] = f.state->look[k];
    if (wanted & KIND) r.free = sel(r.medium, min2(f.state->change, r.free), r.free);
    *pairs += f.pairs;
    return r;
}
static ONCE Met looked(const Scene *s, const Slot *slot, int n, F t, M alive, int64_t *pairs) {
    return meet(s, slot, n, t, alive, pairs, KIND | REGISTER_);
}
static void close_pieces(const Scene *s, Pieces *to, int32_t ray, M which, F since, F end, F density, Trail *r) {
    end = max2(end, since);
    F sigma = s->dense ? max2(density, all(1e-9f)) : all(s->sigma), before = s->dense ? r->depth / sigma : r->length;
    for (int m = bits(which); m; m &= m - 1) {
        int k = __builtin_ctz((unsigned)m);
        if (to->count < to->room) to->piece[to->count] = (Piece){ray + k, since[k], end[k], before[k], sigma[k]};
        to->count++;
    }
    r->length = sel(which, r->length + (end - since), r->length);
    r->depth = sel(which, r->depth + sigma * (end - since), r->depth);
}
// Follow a packet of rays, of which the first is the `ray`th, by their slots.
IN Trail march(const Scene *s, const Slot *slot, int n, float gap, int steps, int halvings, int32_t ray, Pieces *pieces,
               int64_t *pairs, const int wanted) {
    Trail r = {all(INFINITY), all(0), all(0), ints(0), ints(0), 0};
    F t = all(BIG), past, free = all(0), since = all(0), seen = all(0), look[REGISTER], first[REGISTER];  // where and what
    // the medium was last, and at the beginning of the piece
    M within = ints(0);
    int parted = (wanted & KIND) && (s->dense || s->coloured), density = s->rows - s->switched;
    for (int k = 0; k < REGISTER; k++) look[k] = first[k] = all(0);
    float large = 0;
    for (int k = 0; k < n; k++) {
        if (slot[k].object->flags & STOPS) t = min2(slot[k].begin, t);
        large = fmaxf(slot[k].object->extent, large);
    }
    M alive = t < BIG;
    past = t;
    t += sel(alive, all(BEHIND), all(0));
    for (; steps > 0 && any(alive); steps--) {
        Met m;
        int whole = parted && any(within & alive);
        if (!whole) m = meet(s, slot, n, t, alive, pairs, wanted);
        if (whole || (parted && any(m.medium & alive))) m = looked(s, slot, n, t, alive, pairs);
        r.asked += __builtin_popcount(bits(alive));
        M medium = m.medium & alive, done = alive & ~medium & (m.d < -ROUNDING * (t + large));
        F at = max2(past + (t - past) * (free / max2(free + m.free, all(1e-9f))), t - gap);
        M struck = done & ~within;
        r.hit = sel(struck, at, r.hit);
        if (s->media) {
            M into = done & within, leave = within & ~medium & ~done & alive;
            if (any(leave)) close_pieces(s, pieces, ray, leave, since, at, look[density], &r);
            if (any(into)) {  // where a medium gives way to a solid the distance need not be 0
                F low = past, high = t;
                for (int i = 0; i < halvings; i++) {
                    F half = 0.5f * (low + high);
                    M still = meet(s, slot, n, half, into, pairs, wanted).medium;
                    low = sel(still, half, low); high = sel(still, high, half);
                }
                r.hit = sel(into, high, r.hit);
                r.soft |= into;
                close_pieces(s, pieces, ray, into, since, high, look[density], &r);
            }
            since = sel(medium & ~within, at, since);
            if (parted && any(medium)) {
                M other = medium & within & ((unlike(s, m.look, look) > JUMP) | (unlike(s, m.look, first) > DRIFT));
                if (any(other)) {
                    F low = seen, high = t;
                    for (int i = 0; i < BETWEEN; i++) {
                        F half = 0.5f * (low + high);
                        Met h = looked(s, slot, n, half, other, pairs);
                        M before = unlike(s, h.look, look) < unlike(s, h.look, m.look);
                        low = sel(before, half, low); high = sel(before, high, half);
                    }
                    F between = 0.5f * (low + high);
                    close_pieces(s, pieces, ray, other, since, between, look[density], &r);
                    since = sel(other, between, since);
                }
                M begun = other | (medium & ~within);
                for (int k = 0; k < s->rows; k++) {
                    first[k] = sel(begun, m.look[k], first[k]);
                    look[k] = sel(medium, m.look[k], look[k]);
                }
                seen = sel(medium, t, seen);
            }
            within = medium;
        }
        alive &= ~done;
        // the bound fell from `free` at `past` to m.free; on that line it is 0 at: 5 % more puts the point behind
        F safe = m.free / m.rate, hope = sel(free > 0.0f, 1.05f * m.free * (t - past) / max2(free - m.free, all(1e-12f)), all(0)) + BEHIND;
        hope = sel((m.d < 0.0f) & ~m.medium, all(8 * BEHIND), hope);  // within, though not yet deep: it may be thin
        F next = t + min2(max2(hope, safe), safe + gap);
        next = sel(within, min2(next, m.until), next);
        M over = (within & (m.until >= BIG)) | (~within & (next > m.last));
        F following = min2(sel(over, all(BIG), next), sel(within, min2(m.next, m.cuts), m.next));
        M ended = alive & ~(following < BIG), jumps = over | (following > next);
        if (s->media && any(ended & within)) close_pieces(s, pieces, ray, ended & within, since, t, look[density], &r);
        alive &= ~ended;
        past = sel(jumps, following, t);
        free = sel(jumps, all(0), m.free);
        t = sel(alive, following + sel(jumps, all(BEHIND), all(0)), t);
    }
    r.lost = alive;
    if (s->media && any(alive & within)) close_pieces(s, pieces, ray, alive & within, since, t, look[density], &r);
    return r;
}
// Objects whose balls a cone from a point may meet: `cosine` of its half angle about a unit `axis`.
static int in_cone(const Scene *s, const float at[3], const float axis[3], float cosine, int32_t *list) {
    float sine = sqrtf(fmaxf(1 - cosine * cosine, 0));
    int count = 0;
    for (int i = 0; i < s->objects; i++) {
        const Object *o = s->object + i;
        float x = o->centre[0] - at[0], y = o->centre[1] - at[1], z = o->centre[2] - at[2], far = sqrtf(x * x + y * y + z * z);
        int kept = far <= o->extent || (s->clipping && (o->ends || o->flags & (CLIPS | BEGINS)));
        if (!kept) {  // nearer than both angles together, which may be more than half a turn
            float narrow = o->extent / far, wide = sqrtf(fmaxf(1 - narrow * narrow, 0));
            kept = cosine <= -wide || !(x * axis[0] + y * axis[1] + z * axis[2] < far * (cosine * wide - sine * narrow - 1e-5f));
        }
        list[count] = i;
        count += kept;
    }
    return count;
}
// The cone about unit ways (3, n) of rays from one to another; the cosine of its half angle.
static float cone_of(const float *way, int64_t n, int64_t end, int64_t from, float axis[3]) {
    V sum = {all(0), all(0), all(0)};
    F least = all(1);
    float length = 0;
    for (int64_t i = from; i < end; i += W) sum = plus(sum, read_points(way, n, end, i));
    axis[0] = sum_of(sum.x); axis[1] = sum_of(sum.y); axis[2] = sum_of(sum.z);
    for (int d = 0; d < 3; d++) length += axis[d] * axis[d];
    length = sqrtf(length);
    if (!(length > 1e-6f)) return -1;
    for (int d = 0; d < 3; d++) axis[d] /= length;
    V middle = {all(axis[0]), all(axis[1]), all(axis[2])};
    for (int64_t i = from; i < end; i += W) least = min2(dot(read_points(way, n, end, i), middle), least);
    return -most_of(-least) - 1e-5f;
}
