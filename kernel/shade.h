// Direct light: the surfaces that rays from the eye meet, and what lamps send them through all there is. Linear.
#pragma once
#include "cone.h"
#define INTO 3e-5f  // world units behind a surface where its material is asked for
#define CLEAR 2e-4f  // world units before a surface where rays from a lamp end
#define GRAZING 0.5f  // how much farther or nearer a pixel's samples may be on a surface, as a part of the way
#define DISTANT 6.0f  // radii of a lamp: points in media so far from it see the same through media all over its disc
#define UNEVEN 0.3f  // difference of beams of a lamp through media for which more are asked
enum { BEAM = 256, FOLLOWED = 800, HALVINGS = 16 };  // rays that are shaded together; steps at most; where media end

typedef struct { float v[3][BEAM]; } Rows;
typedef struct {  // points that light, in two sheets where there are textures: theirs, and plain colours
    Rows p, n, colour[2], light[2], glow[2];  // `glow` is what media before them send
    float alpha[BEAM], clear[BEAM];  // what these let through
    int32_t edge[BEAM], reached[BEAM];  // where a medium gives way to a surface; lamps that it sees, as bits
    Rows way;  // of rays from the eye, then of those from a lamp to points, which are numbered:
    float far[BEAM];
    int32_t point[BEAM];
    float received[BEAM], part[BEAM];  // what points receive of a lamp that nothing hides, and the part that arrives
} Beam;
typedef struct {  // what a call draws, and its scratch
    const Scene *s, *opaque;
    Scene dark, hazy;  // all, and what is not opaque, as lamps see them: media of all colours alike
    const Stage *stage;
    Slot *slot;
    Near *near;
    int32_t *list, *other, *every;  // objects near rays from the eye, rays from a lamp, and all
    Piece *piece;
    int64_t room;
    int sheets, listed, means;  // of textures, which centres of pixels take
    int64_t lights, rays, steps, met, lost, refined, bad;
} Job;

static void *aligned(void *p) { return (void *)(((uintptr_t)p + 63) & ~(uintptr_t)63); }
static int64_t pieces_of(const Scene *s) { return s->media ? (FOLLOWED + 2) * W : 0; }
static int64_t room_of(const Scene *s) {
    return 256 + (int64_t)(sizeof(Slot) + sizeof(Near) + 3 * sizeof(int32_t)) * (s->objects + 1) + (int64_t)sizeof(Piece) * pieces_of(s);
}
static Job job_of(const Scene *s, const Stage *stage, void *scratch) {
    Job j = {.s = s, .opaque = stage->opaque, .dark = *s, .stage = stage, .sheets = s->hues / 3, .slot = aligned(scratch), .room = pieces_of(s)};
    if (stage->hazy) j.hazy = *stage->hazy;
    j.dark.coloured = j.hazy.coloured = 0;
    j.near = aligned(j.slot + s->objects + 1);
    j.list = (int32_t *)(j.near + s->objects + 1);
    j.other = j.list + s->objects + 1;
    j.every = j.other + s->objects + 1;
    j.piece = (Piece *)(j.every + s->objects + 1);
    for (int i = 0; i < s->objects; i++) j.every[i] = i;
    return j;
}
IN F load(const float *from, int i) { F r; memcpy(&r, from + i, sizeof r); return r; }
IN V load3(const Rows *r, int i) { return (V){load(r->v[0], i), load(r->v[1], i), load(r->v[2], i)}; }
IN void keep(float *to, int i, F a) { memcpy(to + i, &a, sizeof a); }
IN void keep3(Rows *r, int i, V a) { keep(r->v[0], i, a.x); keep(r->v[1], i, a.y); keep(r->v[2], i, a.z); }
IN V constant(const float c[3]) { return (V){all(c[0]), all(c[1]), all(c[2])}; }
IN V rows_of(const F *look, int at) { return (V){look[at], look[at + 1], look[at + 2]}; }

static ONCE Trail trail_of(Job *j, const Scene *s, int n, int halvings, Pieces *pieces) {
    Trail r;
    if (s->mixed || s->dense || s->coloured) r = march(s, j->slot, n, j->stage->gap, FOLLOWED, halvings, 0, pieces, &j->met, KIND);
    else r = march(s, j->slot, n, j->stage->gap, FOLLOWED, halvings, 0, pieces, &j->met, DISTANCE);
    j->rays += __builtin_popcount(bits(drawing(j->slot, n)));
    j->steps += r.asked;
    j->lost += __builtin_popcount(bits(r.lost));
    return r;
}
typedef struct { F d, t; V g, colour[2], glow; M owner; } Surface;

// What is met at t of rays where `in` holds.
IN void ask_slots(Job *j, int n, V way, F t, M in, Surface *r) {
    Fold f;
    fold_open(j->s, &f, ALL);
    for (int k = n - 1; k >= 0; k--) {
        const Slot *e = j->slot + k;
        M there = (e->begin <= t) & (t <= e->end) & in;
        if (any(there)) fold_take(j->s, &f, e->object, plus(e->start, scaled(e->way, t)), there, e->object->radius > RIM, ALL);
    }
    fold_close(j->s, &f, 0, ALL);
    j->met += f.pairs;
    const State *x = f.state;
    int glow = j->stage->glow;
    *r = (Surface){x->d, t, x->g, {rows_of(x->look, 0), rows_of(x->look, j->sheets > 1 ? 3 : 0)}, {all(0), all(0), all(0)}, x->owner};
    if (glow) r->glow = rows_of(x->look, glow);
}
// How far the surface is ahead. Along one, at a cosine over -0.02, d says nothing of it, but rays met it within `gap`.
IN F ahead(F d, F towards, float gap) {
    M along = towards >= -0.02f;
    return clamp(sel(along, sel(d > 3 * INTO, all(gap), all(-INTO)), -d / sel(along, all(-1), towards)), -gap, gap);
}
// The mean colours of textures where four samples of a pixel meet the planes through points on surfaces; what a medium gives
// way to, where `soft`, has its own plane and colours.
static ONCE V sampled(Job *j, const Surface *r, V way, M some, M soft) {
    const Stage *e = j->stage;
    M owner = (r->owner + ((r->owner == 0) & 1)) & some;
    V eye = constant(e->eye), seen = scaled(way, r->t), n = r->g, sum = {all(0), all(0), all(0)}, own;
    F side = (float)e->px * dot(seen, constant(e->deep));
    if (any(soft & some)) {
        alone(j->s, owner & soft, plus(eye, seen), &own, GRADIENT);
        n = choose(soft, own, n);
    }
    F towards = dot(n, seen);
    towards = sel(size_of(towards) > 1e-6f, towards, all(-1e-6f));  // of planes seen from the side
    float far = 0;
    for (int k = 0; k < W; k++) if (some[k] && side[k] > far) far = side[k];
    for (int k = 0; k < 4; k++) {
        float x = k & 1 ? 0.25f : -0.25f, y = k & 2 ? -0.25f : 0.25f;
        V off = {side * (x * (float)e->right[0] + y * (float)e->up[0]), side * (x * (float)e->right[1] + y * (float)e->up[1]),
                 side * (x * (float)e->right[2] + y * (float)e->up[2])};
        F ratio = clamp(dot(n, off) / towards, -GRAZING, GRAZING), part = 1.0f / (1.0f + ratio);
        off = scaled(minus(off, scaled(seen, ratio)), part);
        V at = plus(plus(eye, scaled(way, r->t + INTO)), off);
        State x_ = told(j->s, at, side, far, some, j->list, j->listed, j->near, &j->met, REGISTER_ | OWNER);
        V colour = rows_of(x_.look, 0);
        M beside = some & (soft | (x_.owner == 0));  // the plane goes on beyond the surface
        if (any(beside)) {
            alone(j->s, owner & beside, at, &own, REGISTER_);
            colour = choose(beside, own, colour);
        }
        sum = plus(sum, scaled(colour, all(0.25f)));
    }
    return sum;
}
// The surfaces that rays meet at t, with unit normals that face them; where `soft`, a medium gives way to them.
ONCE static Surface surface(Job *j, int n, V way, F t, M hit, M soft) {
    Surface r, again;
    float gap = j->stage->gap;
    ask_slots(j, n, way, t + INTO, hit, &r);
    r.t = t;
    for (int last = 0; last < 2; last++) {
        F towards = dot(r.g, way);
        M left = towards > 0.0f, off = hit & ~soft & (left | (size_of(r.d) > 3 * INTO));  // of an edge, or bounds said little
        if (!any(off)) break;
        M beyond = left & (ints(-last) | (r.d <= 3 * INTO));
        F there = r.t + INTO + sel(beyond, all(-gap), ahead(r.d, towards, gap));
        ask_slots(j, n, way, there, off, &again);
        M past = (left | (again.d > 3 * INTO)) & (dot(again.g, way) > 0.0f), known = off & (dot(again.g, again.g) > 0.01f) & ~past;
        r.t = sel(known, there - INTO, r.t);
        r.d = sel(known, again.d, r.d); r.owner = (again.owner & known) | (r.owner & ~known);
        r.g = choose(known, again.g, r.g); r.glow = choose(known, again.glow, r.glow);
        for (int k = 0; k < j->sheets; k++) r.colour[k] = choose(known, again.colour[k], r.colour[k]);
    }
    F towards = dot(r.g, way);
    r.t = sel(soft, r.t, r.t + INTO + ahead(r.d, towards, gap));
    r.g = scaled(r.g, sel(towards > 0.0f, all(-1), all(1)) / max2(root(dot(r.g, r.g)), all(1e-12f)));
    if (j->means && j->sheets > 1) {
        M some = ints(0);
        for (int k = 0; k < n; k++) if (j->slot[k].object->texture >= 0) some |= (j->slot[k].begin <= r.t + gap) & (r.t - gap <= j->slot[k].end);
        some &= hit;
        if (any(some)) r.colour[0] = choose(some, sampled(j, &r, way, some, soft), r.colour[0]);
    }
    return r;
}
// Objects that rays (n) of a block from a point may meet, within an angle more, of a sine; their number.
static int narrowed(const Scene *s, const float at[3], const Rows *way, int n, float more, int32_t *list) {
    float axis[3], cosine = cone_of(way->v[0], BEAM, n, 0, axis);
    if (cosine > -0.5f) cosine = cosine * sqrtf(1 - more * more) - sqrtf(fmaxf(1 - cosine * cosine, 0)) * more;
    return in_cone(s, at, axis, cosine, list);
}
// What surfaces receive of a lamp of a radius and power 1 that nothing hides, by the cosine at which they see its middle
// and how far that is; 0 within it (Snyder, Area Light Sources for Real-Time Graphics, 1996).
IN F form(F cosine, F far, float radius) {
    if (!(radius > 0)) return max2(cosine, all(0)) / (far * far);
    F h = max2(far / radius, all(1)), x = root(h * h - 1.0f), sine = root(max2(1.0f - cosine * cosine, all(1e-12f)));
    F y = clamp(-x * cosine / sine, -1, 1), edge = sine * root(1.0f - y * y), slope = edge / max2(x, all(1e-6f));
    F low = (cosine * arc(y) - x * edge) / (h * h) + arc(1.0f / root(1.0f + slope * slope));
    F result = sel(cosine * h >= 1.0f, cosine / (h * h), low * 0.318309886f) / (radius * radius);
    return sel((cosine * h > -1.0f) & (far > radius), max2(result, all(0)), all(0));
}
// The part of light that media let through from a point of a lamp, off its middle, to points.
static ONCE F through(Job *j, const Lamp *lamp, const float beam[3], V p, M some) {
    float off[3] = {lamp->radius * beam[0], lamp->radius * beam[1], lamp->radius * beam[2]};
    V start = constant(off), from = plus(start, constant(lamp->at)), way = minus(p, from);
    F far = root(dot(way, way));
    way = over(way, max2(far, all(1e-9f)));
    F along = dot(start, way), rim = root(max2(along * along + (lamp->radius * lamp->radius - dot(start, start)), all(0))) - along;
    int n = slots_of(&j->hazy, from, way, rim, sel(some, far - CLEAR, all(-BIG)), j->every, j->hazy.objects, j->slot);
    if (!n) return all(1);
    Pieces none = {0, 0, 0};
    return exponential(-trail_of(j, &j->hazy, n, 0, &none).depth);
}
// The part of a lamp's light that media let through: along four beams, or twelve where these differ, whose first and second
// moments are those of a disc; along one to points in media that are far from it.
static ONCE F hazed(Job *j, const Lamp *lamp, V p, M media, M some) {
    const float a = 0.5f, b = 0.455f, c = 0.737f;
    const float beams[17][3] = {{0, 0, 0}, {a, a, a}, {a, -a, -a}, {-a, a, -a}, {-a, -a, a}, {0, -b, -c}, {0, -b, c}, {0, b, -c},
                                {0, b, c}, {-c, 0, -b}, {c, 0, -b}, {-c, 0, b}, {c, 0, b}, {-b, -c, 0}, {-b, c, 0}, {b, -c, 0}, {b, c, 0}};
    const int first[4] = {0, 1, 5, 17};
    V to = minus(p, constant(lamp->at));
    M single = media & (root(dot(to, to)) > DISTANT * lamp->radius);
    F r = all(1);
    for (int turn = 0; turn < 3; turn++) {
        M now = turn ? some & ~single : some & single;
        if (!any(now)) continue;
        F sum = all(0), least = all(BIG), most = all(0);
        for (int k = first[turn]; k < first[turn + 1]; k++) {
            F clear = through(j, lamp, beams[k], p, now);
            sum += clear; least = min2(least, clear); most = max2(most, clear);
        }
        r = sel(now, sum / (float)(first[turn + 1] - first[turn]), r);
        if (turn == 1) some &= ~single & (most - least > UNEVEN);
    }
    return r;
}
// Parts of a lamp's light that come to points: of those that a block's rays from it lead to, the packet at i.
static ONCE F reaching(Job *j, Beam *b, const Lamp *lamp, int i, int listed, M there, int media) {
    const Scene *s = j->s;
    V at = constant(lamp->at), way = load3(&b->way, i), n = {all(0), all(0), all(0)};
    F far = load(b->far, i);
    M edge = ints(0);
    if (lamp->radius > 0 || s->media) for (int k = 0; k < W; k++) if (there[k]) {
        int m = b->point[i + k];
        n.x[k] = b->n.v[0][m]; n.y[k] = b->n.v[1][m]; n.z[k] = b->n.v[2][m]; edge[k] = b->edge[m];
    }
    if (lamp->radius > 0) {
        float radius = lamp->radius;
        Cone c = {at, way, n, far, radius / root(max2(far * far - radius * radius, all(1e-9f))), radius};
        F wide = (ASIDE + WIDE) * c.spread, limit = sel(there, min2(far - FLOOR, all(BIG)), all(-BIG));
        int m = slots(j->opaque, at, way, all(radius), limit, j->opaque->reach - wide * far, wide, j->other, listed, j->slot, 1);
        M some = drawing(j->slot, m);
        j->rays += __builtin_popcount(bits(some));
        F part = any(some) ? sel(some, shown(j->opaque, j->slot, m, &c, &j->met), all(1)) : all(1);
        M open = there & (part > 0.0f);
        return s->media && any(open) ? part * hazed(j, lamp, plus(at, scaled(way, far)), ints(media ? -1 : 0), open) : part;
    }
    F limit = sel(there, sel(edge != 0, far, far - CLEAR), all(-BIG));
    int m = slots_of(s, at, way, all(0), limit, j->other, listed, j->slot);
    if (!m) return all(1);
    Pieces none = {0, 0, 0};
    Trail r = trail_of(j, &j->dark, m, 0, &none);
    F clear = sel(r.hit < BIG, all(0), s->media ? exponential(-r.depth) : all(1));
    M inside = there & (edge != 0) & (clear > 0.0f);
    if (any(inside)) {  // rays may have ended before they met what is opaque there
        float gap = j->stage->gap;
        State x = told(s, plus(at, scaled(way, far)), all(gap), gap, inside, j->every, s->objects, j->near, &j->met, REGISTER_);
        clear = sel(inside & (x.d < 0.0f) & (x.look[s->rows - 1] < 0.5f), all(0), clear);
    }
    return clear;
}
// Add the light of lamps to points of a block, of which n are there, all on surfaces or all in media.
static void light_up(Job *j, Beam *b, int n, int media) {
    const Stage *stage = j->stage;
    for (int l = 0; l < stage->lamps; l++) {
        const Lamp *lamp = stage->lamp + l;
        V at = constant(lamp->at);
        int lit = 0;
        for (int i = 0; i < n; i += W) {  // full packets of points that it may light
            V normal = load3(&b->n, i), to = minus(load3(&b->p, i), at);
            F r = max2(root(dot(to, to)), all(stage->nearest)), received;
            float radius = lamp->radius;
            if (media) {
                F rim = radius > 0 ? root(max2(1.0f - (radius / r) * (radius / r), all(0))) : all(1);
                received = sel(radius > 0 ? r > radius : ints(-1), 1.0f / (2.0f * r * r * (1.0f + rim)), all(0));
            } else received = form(-dot(normal, to) / r, r, radius);
            to = plus(to, scaled(normal, all(stage->lift)));
            F far = root(dot(to, to)), bright = all(0);
            to = scaled(to, 1.0f / max2(far, all(1e-9f)));
            keep(b->received, i, received); keep(b->part, i, all(0));
            for (int k = 0; k < j->sheets; k++) {
                V c = load3(&b->colour[k], i);
                bright += c.x * lamp->power[0] + c.y * lamp->power[1] + c.z * lamp->power[2];
            }
            for (int m = bits((received > 0.0f) & (bright != 0.0f)); m; m &= m - 1) {
                int k = __builtin_ctz((unsigned)m);
                if (i + k >= n) break;
                b->way.v[0][lit] = to.x[k]; b->way.v[1][lit] = to.y[k]; b->way.v[2][lit] = to.z[k];
                b->far[lit] = far[k]; b->point[lit++] = i + k;
            }
        }
        if (!lit) continue;
        j->lights += lit;
        for (int i = lit; i % W; i++) {
            for (int d = 0; d < 3; d++) b->way.v[d][i] = b->way.v[d][lit - 1];
            b->far[i] = b->far[lit - 1];
        }
        int listed = narrowed(lamp->radius > 0 ? j->opaque : j->s, lamp->at, &b->way, lit, 0, j->other);
        for (int i = 0; i < lit; i += W) {
            M there = ints(0);
            for (int k = 0; k < W && i + k < lit; k++) there[k] = -1;
            F clear = reaching(j, b, lamp, i, listed, there, media);
            for (int k = 0; k < W && i + k < lit; k++) b->part[b->point[i + k]] = clear[k];
        }
        for (int i = 0; i < n; i += W) {
            F clear = load(b->part, i), part = clear * load(b->received, i);
            M some = clear > 0.0f;
            if (!any(some)) continue;
            keep((float *)b->reached, i, (F)((M)load((float *)b->reached, i) | (some & (1 << l))));
            for (int k = 0; k < j->sheets; k++) {
                V c = load3(&b->colour[k], i), sum = load3(&b->light[k], i);
                V more = {part * lamp->power[0] * c.x, part * lamp->power[1] * c.y, part * lamp->power[2] * c.z};
                keep3(&b->light[k], i, choose(some, plus(sum, more), sum));
            }
        }
    }
}
