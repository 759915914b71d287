// The plane: pictures by the field of flat objects, from macros of 64 x 64 pixels down to blocks of 4 x 4.
//
// A macro's 16 tiles, and a tile's 16 blocks, are lanes of packets: intervals through decoders and fold prove which are of
// one colour, which objects change nothing there, and which hide all before them. What is left is asked at the pixels of a
// block; where an outline may pass, at all samples. Objects and states are those of scenelang/drawing/tables.py, `Sheet`s.
#pragma once
#include "texture.h"
enum { UNION_ = 1, SHOWN = 2, WILD = 4, SMOOTHS = 8, CUTS = 16 };  // flags of joints and objects
enum { TRACED = 1, PAINTED = 2, OWNED = 4 };  // what a fold is asked
enum { ADAPTIVE, EVERY, SINGLE, OWNERS };  // ways to ask
enum { UNITS_2D = NORMS, OUTLINE = 5, ALL_CELLS = 0xffff };
#define FARTHEST_AWAY 1e15f  // leaf units: where points lie that float32 cannot follow
#define LEAST_SHARE 1e-4f  // of a colour, that counts as part of what a point shows
#define FLAT_COLOUR 1e-4f  // of a channel: a block that is known so well has one colour
#define NARROW (1.0f / 16)  // of a pixel by the width of a blend: above it colours change much across the pixel
#define UNKNOWN 1e9f  // world units: how far off a distance may be of which nothing is proved
#define LAST 16.0f  // leaf units: farther points are asked at this distance
#define WIDTH_2D (4.0f / 3)

typedef struct { F x, y; } P;
typedef struct { F low, high; } Span;
typedef struct {
    F d, c[4], owner, most;  // of a state: distance, colours, and whose they are for the most part
} Sheet;
typedef struct {
    F edge;  // world units to the nearest outline
    M tied, blended, shown, beneath, narrow;
} Looked;
typedef struct { int32_t object; uint16_t kept, open; } Entry;  // an object at 16 cells: which it may change, or hides all in
typedef struct { int32_t entry, level; uint16_t closed, wide; } Turn;  // what came of an entry, or (-1) of a group's end
typedef struct { Entry *macro, *tile; int32_t *row; Turn *turn; int64_t pairs, refined, met; } Drawn;  // lists, and counts

IN F above(F a) { return max2(a, all(0)); }
IN F length2(F x, F y) { return root(x * x + y * y); }
// Mirrors of half a plane into half a sector of 3, 5 and 6: cosine, sine, whether what was beyond may lie on either side.
static const float MIRRORS[3][2][3] = {
    {{0.5f, 0.8660254f, 1}, {0, 0, -1}},
    {{0.30901699f, 0.95105652f, 1}, {0.80901699f, 0.58778525f, 0}},
    {{0.5f, 0.8660254f, 1}, {0.8660254f, 0.5f, 0}},
};
IN void features_of(const Leaf *n, P q, F *f) {
    F across = size_of(q.x);
    int known = -1;
    F u = q.y, v = across;
    for (int i = 0; i < n->features; i++) {
        int which = n->feature[i], order = (which - 4) / 2;
        if (which == 0) f[i] = length2(q.x, q.y);
        else if (which < 4) f[i] = which == 1 ? across : which == 2 ? size_of(q.y) : q.y;
        else {
            if (order != known) {
                u = q.y; v = across; known = order;
                for (int k = 0; k < 2; k++) {
                    const float *m = MIRRORS[order][k];
                    if (m[2] < 0) break;
                    F past = above(m[0] * v - m[1] * u);
                    u += 2 * m[1] * past; v -= 2 * m[0] * past;
                    if (m[2] > 0) v = size_of(v);
                }
            }
            f[i] = which & 1 ? v : u;
        }
    }
}
// Norm units, the first of which is a notch: see scenelang/drawing/neural/units.py.
IN F units_by(const Leaf *n, const int features, const F *f) {
    F best = all(0), notch = all(0), inside = all(-BIG);
    const float *w = n->line[0];
    for (int u = 0; u <= n->units; u++) {
        F sum = all(0);
        for (int k = 0; k < n->size[u]; k++, w += LINE_2D) {
            F v = all(w[LINE_2D - 1]);
            for (int i = 0; i < features; i++) v += w[i] * f[i];
            v = above(v);
            sum += v * v;
        }
        if (u) best = max2(best, sum); else notch = sum;
    }
    for (int k = 0; k < n->inner; k++, w += LINE_2D) {
        F v = all(w[LINE_2D - 1]);
        for (int i = 0; i < features; i++) v += w[i] * f[i];
        inside = max2(inside, v);
    }
    F d = root(best) - n->radius;
    if (n->inner) d += min2(inside, all(0));
    return n->size[0] ? d - root(notch) : d;
}
IN F units_distance(const Leaf *n, P q) {
    F f[FEATURES_2D];
    features_of(n, q, f);
    if (n->features == 2) return units_by(n, 2, f);
    return n->features == 1 ? units_by(n, 1, f) : units_by(n, n->features, f);
}
// Distances within a radius of points lie within the result of those there.
static ONCE F units_rise(const Leaf *n, P q, F radius) {
    F f[FEATURES_2D], ends[3][3], best[3], inside[3];  // of the notch, of units, inside: low, own, high
    features_of(n, q, f);
    const float *w = n->line[0];
    int line = 0;
    for (int e = 0; e < 3; e++) { best[e] = ends[0][e] = all(0); inside[e] = all(-BIG); }
    for (int u = 0; u <= n->units; u++) {
        F sum[3] = {all(0), all(0), all(0)};
        for (int k = 0; k < n->size[u]; k++, w += LINE_2D, line++) {
            F v = all(w[LINE_2D - 1]);
            for (int i = 0; i < n->features; i++) v += w[i] * f[i];
            for (int e = 0; e < 3; e++) { F at = above(v + (e - 1) * n->steep[line] * radius); sum[e] += at * at; }
        }
        F own = root(sum[1]), more = n->whole[u] * radius;
        F low = max2(root(sum[0]), own - more), high = min2(root(sum[2]), own + more);
        if (u) { best[0] = max2(best[0], low); best[1] = max2(best[1], own); best[2] = max2(best[2], high); }
        else { ends[0][0] = low; ends[0][1] = own; ends[0][2] = high; }
    }
    for (int k = 0; k < n->inner; k++, w += LINE_2D, line++) {
        F v = all(w[LINE_2D - 1]);
        for (int i = 0; i < n->features; i++) v += w[i] * f[i];
        for (int e = 0; e < 3; e++) inside[e] = max2(inside[e], v + (e - 1) * n->steep[line] * radius);
    }
    for (int e = 0; e < 3; e++) inside[e] = n->inner ? min2(inside[e], all(0)) : all(0);
    F d = best[1] + inside[1] - ends[0][1];
    F rise = max2(best[2] + inside[2] - ends[0][0] - d, d - (best[0] + inside[0] - ends[0][2]));
    return sel(rise >= 0.0f, rise, all(BIG));
}
// Outlines, see scenelang/drawing/neural/outlines.py. A piece has 16 floats.
IN F outline_step(const F *c, F t, P q) {  // of Newton's method towards the nearest point of a curve
    F dx = c[0] + t * (c[2] + t * c[4]) - q.x, dy = c[1] + t * (c[3] + t * c[5]) - q.y;
    F vx = c[2] + 2 * t * c[4], vy = c[3] + 2 * t * c[5];
    F speed = vx * vx + vy * vy, bend = max2(speed + 2 * (dx * c[4] + dy * c[5]), 0.25f * speed);
    return clamp(t - (dx * vx + dy * vy) / max2(bend, all(1e-12f)), 0, 1);
}
IN M on_left(P way, F x, F y) { return way.x * y - way.y * x >= 0.0f; }
// Inside is where the winding number is not 0: that of the cell's post, and what is crossed on the way from there.
static ONCE M outline_inside(const Leaf *n, P q, M cell) {
    int cells = n->side * n->side;
    F px = gather(n->posts, cell), py = gather(n->posts + cells, cell), turns = gather(n->posts + 2 * cells, cell);
    P way = {q.x - px, q.y - py};
    for (int lane = 0; lane < W; lane++) {
        int known = 0;
        for (int before = 0; before < lane; before++) known |= cell[before] == cell[lane];
        if (known) continue;
        M own = cell == ints(cell[lane]);
        for (int k = n->begins[cell[lane]]; k < n->begins[cell[lane] + 1]; k++) {
            const float *c = n->data + 16 * (size_t)(n->passing[k] / 2);
            F vx = q.x - c[0], vy = q.y - c[1], off = vx * c[5] - vy * c[4], side = vy * c[10] - vx * c[11];
            M left = side >= 0.0f, post = ints(-(n->passing[k] & 1));
            M crossed = (on_left(way, c[0] - px, c[1] - py) ^ on_left(way, c[6] - px, c[7] - py)) & (left ^ post) & own;
            float bent = c[10] * c[5] - c[11] * c[4];  // between chord and curve
            M within = (left ^ ints(-(bent > 0))) & (off * off < bent * (side + off)) & own;
            turns += sel(crossed, sel(left, all(1), all(-1)), all(0)) - sel(within, sel(left, all(1), all(-1)), all(0));
        }
    }
    return (turns < -0.5f) | (turns > 0.5f);
}
static ONCE F outline_distance(const Leaf *n, P p) {
    F radius = length2(p.x, p.y), shrunk = LAST / max2(radius, all(LAST));
    P q = {p.x * shrunk, p.y * shrunk};
    F x = clamp(q.x, -1, 1) * (WIDTH_2D - (WIDTH_2D - 1) / max2(size_of(q.x), all(1)));
    F y = clamp(q.y, -1, 1) * (WIDTH_2D - (WIDTH_2D - 1) / max2(size_of(q.y), all(1)));
    float finer = n->side / (2 * WIDTH_2D), last = n->side - 1;
    M column = cut(clamp((x + WIDTH_2D) * finer, 0, last)), cell = cut(clamp((y + WIDTH_2D) * finer, 0, last)) * n->side + column;
    uint64_t seen[OUTLINE_WORDS];  // pieces that were asked, of this and each further part of them
    F least = all(1e30f), t = all(0);
    M best = ints(0);
    int words = (n->width + 63) / 64;
    if (words > OUTLINE_WORDS) words = OUTLINE_WORDS;
    for (int k = 0; k < words; k++) seen[k] = 0;
    for (int lane = 0; lane < W; lane++) {
        if (lane && (cell[lane] == cell[lane - 1] || (lane >= 4 && cell[lane] == cell[lane - 4]))) continue;
        for (int k = n->first[cell[lane]]; k < n->first[cell[lane] + 1]; k++) {
            int piece = n->near[k], word = piece / 64;
            if (word < words) {
                if (seen[word] >> piece % 64 & 1) continue;
                seen[word] |= (uint64_t)1 << piece % 64;
            }
            const float *c = n->data + 16 * (size_t)piece;
            F dx = q.x - c[0], dy = q.y - c[1], at = clamp((dx * c[10] + dy * c[11]) * c[12], 0, 1);
            if (c[4] != 0 || c[5] != 0) {
                F own[6];
                for (int e = 0; e < 6; e++) own[e] = all(c[e]);
                at = outline_step(own, at, q);
            }
            dx -= at * (c[2] + at * c[4]); dy -= at * (c[3] + at * c[5]);
            F off = dx * dx + dy * dy;
            M nearer = (off < least) | ((off == least) & (piece < best));
            least = sel(nearer, off, least); t = sel(nearer, at, t);
            best = (ints(piece) & nearer) | (best & ~nearer);
        }
    }
    F c[6];
    for (int k = 0; k < 6; k++) c[k] = gather(n->data + k, best * 16);
    t = outline_step(c, t, q);
    F dx = c[0] + t * (c[2] + t * c[4]) - q.x, dy = c[1] + t * (c[3] + t * c[5]) - q.y;
    F away = length2(dx, dy);
    return sel(outline_inside(n, q, cell), -away, away) + above(radius - LAST);
}
// Grids of distances over [-1, 1]², and beyond as `GridShape` and `GrownShape` of scenelang/drawing/neural/assets.py.
IN F flat_grid_at(const Leaf *n, P q) {
    float half = 0.5f * (n->width - 1);
    F x = (q.x + 1.0f) * half, y = (q.y + 1.0f) * half;
    M i = cut(clamp(x, 0, n->width - 2)), j = cut(clamp(y, 0, n->width - 2)), at = i * n->width + j;
    x -= floats(i); y -= floats(j);
    F a = gather(n->data, at), b = gather(n->data + 1, at), c = gather(n->data + n->width, at), d = gather(n->data + n->width + 1, at);
    a += (b - a) * y; c += (d - c) * y;
    return a + (c - a) * x;
}
IN P squared(P q) { return (P){clamp(q.x, -1, 1), clamp(q.y, -1, 1)}; }
static ONCE P flat_foot(const Leaf *n, P q, P *normal) {
    float step = 1.0f / (n->width - 1);
    F ends[2][2], x[2] = {clamp(q.x + step, -1, 1), clamp(q.x - step, -1, 1)}, y[2] = {clamp(q.y + step, -1, 1), clamp(q.y - step, -1, 1)};
    for (int k = 0; k < 2; k++) { ends[0][k] = flat_grid_at(n, (P){x[k], q.y}); ends[1][k] = flat_grid_at(n, (P){q.x, y[k]}); }
    P slope = {(ends[0][0] - ends[0][1]) / (x[0] - x[1]), (ends[1][0] - ends[1][1]) / (y[0] - y[1])};
    F over = 1.0f / max2(length2(slope.x, slope.y), all(1e-9f)), d = flat_grid_at(n, q);
    *normal = (P){slope.x * over, slope.y * over};
    return (P){q.x - d * normal->x, q.y - d * normal->y};
}
static ONCE F flat_grid(const Leaf *n, P q) {
    P at = squared(q), normal, turned;
    F d = flat_grid_at(n, at), x = q.x - at.x, y = q.y - at.y, beyond = x * x + y * y;
    M out = beyond > 0.0f;
    if (!any(out)) return d;
    if (n->kind == GRID) return sel(out, root(d * d + beyond), d);
    P best = flat_foot(n, at, &normal);
    F least = length2(q.x - best.x, q.y - best.y);
    for (int k = 0; k < 4; k++) {
        F ax = q.x - best.x, ay = q.y - best.y, along = ax * normal.x + ay * normal.y;
        P aside = {best.x + 0.6f * (ax - along * normal.x), best.y + 0.6f * (ay - along * normal.y)};
        P found = flat_foot(n, squared(aside), &turned);
        F far = length2(q.x - found.x, q.y - found.y);
        M nearer = far < least;
        best = (P){sel(nearer, found.x, best.x), sel(nearer, found.y, best.y)};
        normal = (P){sel(nearer, turned.x, normal.x), sel(nearer, turned.y, normal.y)};
        least = sel(nearer, far, least);
    }
    return sel(out, least, d);
}
// The way to the leaf. With a radius, that of discs in which discs about points lie there.
IN P tamed(P q) { return (P){clamp(q.x, -FARTHEST_AWAY, FARTHEST_AWAY), clamp(q.y, -FARTHEST_AWAY, FARTHEST_AWAY)}; }
IN P carried(const Flat *s, const Shape *o, P p, F *radius) {
    for (int k = 0; k < o->steps; k++) {
        const FlatStep *t = s->step + o->step + k;
        const float *m = t->number;
        if (radius) *radius *= t->steep * (t->rate ? 1.0f + (length2(p.x, p.y) + *radius) * t->rate : all(1));
        if (t->kind == MAP) p = (P){p.x * m[0] + p.y * m[1] + m[2], p.x * m[3] + p.y * m[4] + m[5]};
        else {
            F angle = p.x * m[1] + p.y * m[2], sine, cosine;
            if (m[0] != 0) angle += length2(p.x, p.y) * m[0];
            sines(angle, &sine, &cosine);
            p = (P){p.x * cosine + p.y * sine, p.y * cosine - p.x * sine};
        }
        if (o->flags & WILD) p = tamed(p);
    }
    return p;
}
IN F leaf_2d(const Flat *s, const Shape *o, P q) {  // world units
    const Leaf *n = s->leaf + o->leaf;
    F d = n->kind == UNITS_2D ? units_distance(n, q) : n->kind == OUTLINE ? outline_distance(n, q) : flat_grid(n, q);
    if (o->flags & SKINNED) {
        d -= o->first;
        if (o->wall > 0) d = size_of(d);
        d -= o->wall + o->last;
    }
    d *= o->scale;
    return o->flags & WILD ? clamp(d, -FARTHEST_AWAY, FARTHEST_AWAY) : d;
}
IN void blank(const Flat *s, Sheet *a) {
    a->d = all(s->empty);
    for (int k = 0; k < 4; k++) a->c[k] = all(0);
    a->owner = a->most = all(0);
}
// Let a state take in an operand; `open` where nothing has been met, or nothing before matters.
IN void taken(const Flat *s, const Joint *j, int open, Sheet *a, const Sheet *x, Looked *l, const Page *g, int worn, const int wanted) {
    const int channels = s->clear ? 4 : 3;
    if (open) {
        a->d = x->d * j->candidate;
        for (int k = 0; k < channels; k++) a->c[k] = x->c[k];
        if (wanted & OWNED) { a->owner = x->owner; a->most = x->most; }
        return;
    }
    F take = clamp(j->own[0] * x->d + j->past[0] * a->d + j->bias[0], 0, 1);
    F paint = clamp(max2(j->own[1] * x->d + j->past[1] * a->d + j->bias[1], j->own[2] * x->d + j->past[2] * a->d + j->bias[2]), 0, 1);
    if (wanted & TRACED) {
        F margin = size_of(a->d * s->over_unit - x->d);
        M mixed = j->flags & SMOOTHS ? (paint > LEAST_SHARE) & (paint < 1 - LEAST_SHARE) : ints(0);
        l->shown |= l->tied & mixed;
        l->blended |= mixed;
        if (j->flags & UNION_) l->tied |= margin < 2 * g->corner * g->px;
        l->beneath |= (size_of(a->d * s->over_unit) < g->near * g->px) & (paint > 0.0f);
        if (worn && j->flags & SMOOTHS && g->px > NARROW * j->width)
            l->narrow |= margin < j->width + g->corner * g->px * (1 + j->stretch);
    }
    F through = all(0);
    if (s->clear && j->flags & UNION_) through = clamp(0.5f - a->d * s->slope, 0, 1) * (1.0f - x->c[3]);
    for (int k = 0; k < channels; k++) {
        F own = s->clear ? x->c[k] + through * a->c[k] : x->c[k];
        a->c[k] += paint * (own - a->c[k]);
    }
    if (wanted & OWNED) {
        F left = 1.0f - paint * (1.0f - through);
        M comes = (paint > 0.5f) & (x->most >= through * a->most);
        a->owner = sel(comes, x->owner, a->owner);
        a->most = sel(comes, paint * x->most, left * a->most);
    }
    a->d += take * (x->d * j->candidate - a->d) - take * (1.0f - take) * j->bump;
}
static V mean_colour(const Flat *s, const Shape *o, P p, const Page *g, int spread) {
    const Texture *t = s->texture + o->texture;
    V sum = {all(0), all(0), all(0)};
    for (int k = 0; k < spread; k++) {
        P q = carried(s, o, (P){p.x + g->place[k], p.y + g->place[16 + k]}, 0);
        sum = plus(sum, coloured(t, (V){q.x, q.y, all(0)}));
    }
    return scaled(sum, all(1.0f / spread));
}
// The fold of what the cell `bit` of entries keeps, at points. Textures, if `PAINTED`, are means about `spread` places, or
// those at the points.
IN Sheet folded(const Flat *s, const Entry *met, int count, int bit, P p, int spread, int worn, const Page *g, Looked *l,
                int64_t *pairs, const int wanted) {
    Sheet state[1 + DEEP];
    int level = 0, last = -1, some[1 + DEEP] = {0};
    blank(s, state);
    for (int i = 0; i <= count; i++) {
        const Shape *o = 0;
        if (i < count) {
            if (!(met[i].kept >> bit & 1)) continue;
            o = s->shape + met[i].object;
        }
        if (s->deepest) {  // end groups that the object does not stand in
            int common = 0;
            if (o && last >= 0) {
                const Shape *before = s->shape + last;
                while (common < o->depth && common < before->depth && o->path[common] == before->path[common]) common++;
            }
            for (; level > common; level--) {
                Sheet *x = state + level;
                const Joint *j = s->joint + s->objects + s->shape[last].path[level - 1];
                x->d *= s->over_unit;
                if (wanted & TRACED) l->edge = min2(l->edge, size_of(x->d));
                taken(s, j, !some[level - 1] && !(j->flags & CUTS), x - 1, x, l, g, worn, wanted);
                some[level - 1] = 1;
            }
            while (o && level < o->depth) { blank(s, state + ++level); some[level] = 0; }
        }
        if (!o) break;
        last = met[i].object;
        P q = carried(s, o, p, 0);
        Sheet x;
        x.d = leaf_2d(s, o, q);
        for (int k = 0; k < 4; k++) x.c[k] = all(o->colour[k]);
        const Joint *j = s->joint + last;
        if (wanted & PAINTED && o->texture >= 0) {
            V c = spread ? mean_colour(s, o, p, g, spread) : coloured(s->texture + o->texture, (V){q.x, q.y, all(0)});
            x.c[0] = c.x * o->colour[3]; x.c[1] = c.y * o->colour[3]; x.c[2] = c.z * o->colour[3];
        }
        if (wanted & TRACED) l->edge = min2(l->edge, size_of(x.d) * o->calm);
        if (wanted & OWNED) { x.owner = all((float)(last + 1)); x.most = all(o->colour[3]); }
        taken(s, j, (met[i].open >> bit & 1) || (!some[level] && !(j->flags & CUTS)), state + level, &x, l, g, worn, wanted);
        some[level] = 1;
        *pairs += W;
    }
    return state[0];
}
IN void picture_of(const Flat *s, const Sheet *a, F *r) {
    F coverage = clamp(0.5f - a->d * s->slope, 0, 1);
    for (int k = 0; k < 3; k++) r[k] = a->c[k] * coverage;
    r[3] = s->clear ? a->c[3] * coverage : coverage;
}
// Each compiled once.
static ONCE Sheet fold_plain(const Flat *s, const Entry *met, int n, int bit, P p, int spread, const Page *g, int64_t *pairs) {
    return folded(s, met, n, bit, p, spread, 0, g, 0, pairs, PAINTED);
}
static ONCE Sheet fold_traced(const Flat *s, const Entry *met, int n, int bit, P p, int worn, const Page *g, Looked *l, int64_t *pairs) {
    return folded(s, met, n, bit, p, 0, worn, g, l, pairs, TRACED);
}
static ONCE Sheet fold_owned(const Flat *s, const Entry *met, int n, int bit, P p, const Page *g, int64_t *pairs) {
    return folded(s, met, n, bit, p, 0, 0, g, 0, pairs, OWNED);
}

// Intervals.
typedef struct { Span d, c[4]; M met; } Band;
IN Span capped(Span x, F factor, F most) {  // those x that have factor x <= most, of which there are some
    F bound = most / factor;
    bound = min2(max2(bound, x.low), x.high);
    return (Span){sel(factor < 0.0f, bound, x.low), sel(factor > 0.0f, bound, x.high)};
}
IN F up(float w) { return all(w > 0 ? w : 0); }
IN F down(float w) { return all(w < 0 ? w : 0); }
// Let states take in operands where `in` holds; bits of cells where that changes nothing, and where nothing else is left.
static void spanned(const Flat *s, const Joint *j, M given, M in, Band *a, const Band *x, uint32_t *closed, uint32_t *wide) {
    F low[3], high[3], past0;
    F own_low[3], least[3], most[3];
    for (int r = 0; r < 3; r++) {
        low[r] = up(j->own[r]) * x->d.low + down(j->own[r]) * x->d.high + j->bias[r];
        high[r] = up(j->own[r]) * x->d.high + down(j->own[r]) * x->d.low + j->bias[r];
        own_low[r] = sel(given, all(BIG), low[r]);
        F past = up(j->past[r]) * a->d.high + down(j->past[r]) * a->d.low;
        if (!r) past0 = past;
        least[r] = sel(given, all(BIG), low[r] + (up(j->past[r]) * a->d.low + down(j->past[r]) * a->d.high));
        most[r] = sel(given, all(BIG), high[r] + past);
    }
    Span paint = {clamp(max2(least[1], least[2]), 0, 1), clamp(max2(most[1], most[2]), 0, 1)};
    M keeps = least[0] < 1.0f, takes = most[0] > 0.0f;
    Span kept = capped(a->d, all(j->past[0]), 1.0f - own_low[0]);
    Span own = capped(x->d, all(-j->own[0]), past0 + j->bias[0]);
    own.low = sel(given, x->d.low, own.low); own.high = sel(given, x->d.high, own.high);
    F p = own.low * j->candidate, q = own.high * j->candidate;
    F dent = sel(keeps & takes, all(j->bump / 4), all(0));
    F lowest = min2(sel(keeps, kept.low, all(BIG)), sel(takes, min2(p, q), all(BIG))) - max2(dent, all(0));
    F highest = max2(sel(keeps, kept.high, all(-BIG)), sel(takes, max2(p, q), all(-BIG))) - min2(dent, all(0));
    Span through = {all(0), all(0)};
    const int channels = s->clear ? 4 : 3;
    if (s->clear && j->flags & UNION_) {
        through.low = sel(given, all(0), clamp(0.5f - s->slope * a->d.high, 0, 1) * (1.0f - x->c[3].high));
        through.high = sel(given, all(0), clamp(0.5f - s->slope * a->d.low, 0, 1) * (1.0f - x->c[3].low));
    }
    for (int k = 0; k < channels; k++) {
        F l = a->c[k].low, h = a->c[k].high;
        F more = x->c[k].low + (through.low - 1.0f) * l, above_ = x->c[k].high + (through.high - 1.0f) * h;
        a->c[k].low = sel(in, l + min2(paint.low * more, paint.high * more), l);
        a->c[k].high = sel(in, h + max2(paint.low * above_, paint.high * above_), h);
    }
    a->d.low = sel(in, lowest, a->d.low); a->d.high = sel(in, highest, a->d.high);
    a->met |= in;
    *closed = bits(~takes & (paint.high <= 0.0f));
    *wide = bits(~keeps & (paint.low >= 1.0f) & (through.high <= 0.0f));
}
IN void blank_band(const Flat *s, Band *a) {
    a->d = (Span){all(s->empty), all(s->empty)};
    for (int k = 0; k < 4; k++) a->c[k] = (Span){all(0), all(0)};
    a->met = ints(0);
}
IN M lanes(uint32_t bits_, int base) { M r; for (int k = 0; k < W; k++) r[k] = bits_ >> (base + k) & 1 ? -1 : 0; return r; }
// Drop from entries the cells in which their objects change nothing or are hidden, note where they hide all, and find the
// cells of one colour: bits of these, with colours (16, 4). Middles of cells (x, y) have all else within a radius.
static ONCE uint32_t proved(const Flat *s, Entry *met, int count, const float *x, const float *y, float radius, Turn *turn, float colour[16][4], int64_t *pairs) {
    uint32_t flat = 0;
    for (int base = 0; base < 16; base += W) {
        P p;
        memcpy(&p.x, x + base, sizeof p.x); memcpy(&p.y, y + base, sizeof p.y);
        uint32_t mine = (W == 16 ? 0xffffu : (1u << W) - 1) << base;
        Band state[1 + DEEP];
        int level = 0, turns = 0;
        const Shape *last = 0;
        blank_band(s, state);
        for (int i = 0; i <= count; i++) {
            const Shape *o = i < count ? s->shape + met[i].object : 0;
            M in = ints(0);
            P q; F around;
            if (o) {
                if (!(met[i].kept & mine)) continue;
                around = all(radius);
                q = carried(s, o, p, &around);
                in = lanes(met[i].kept, base) & ~(length2(q.x, q.y) - around > o->reach);
                met[i].kept = (met[i].kept & ~mine) | (uint32_t)bits(in) << base;
                if (!(met[i].kept & mine)) continue;
            }
            if (s->deepest) {
                int common = 0;
                if (o && last) while (common < o->depth && common < last->depth && o->path[common] == last->path[common]) common++;
                for (; level > common; level--) {
                    Band *b = state + level;
                    const Joint *j = s->joint + s->objects + last->path[level - 1];
                    M there = b->met, given = j->flags & CUTS ? ints(0) : ~b[-1].met;
                    uint32_t closed, wide;
                    b->d.low *= s->over_unit; b->d.high *= s->over_unit;
                    spanned(s, j, given, there, b - 1, b, &closed, &wide);
                    turn[turns++] = (Turn){-1, level - 1, closed & bits(there), wide & bits(there)};
                }
                while (o && level < o->depth) blank_band(s, state + ++level);
            }
            if (!o) break;
            last = o;
            *pairs += W;
            const Leaf *n = s->leaf + o->leaf;
            F middle = leaf_2d(s, o, q), rise;
            if (n->kind == UNITS_2D) rise = units_rise(n, q, min2(around, all(UNKNOWN)));
            else rise = n->slope * root(around * around + 1.0f / (128 * 128));
            rise = min2((rise + 1e-4f) * o->scale, all(UNKNOWN));
            rise += 2e-6f * (1.0f + size_of(middle));
            Band own = {{middle - rise, middle + rise}};
            for (int k = 0; k < 4; k++)
                own.c[k] = (Span){all(o->colour[k]), all(o->texture < 0 ? o->colour[k] : o->colour[3])};
            const Joint *j = s->joint + met[i].object;
            M opened = lanes(met[i].open, base), given = opened | (j->flags & CUTS ? ints(0) : ~state[level].met);
            uint32_t closed, wide;
            spanned(s, j, given, in, state + level, &own, &closed, &wide);
            turn[turns++] = (Turn){i, level, closed & bits(in), (wide | bits(opened)) & bits(in)};
        }
        uint16_t hidden[2 + DEEP] = {0};
        while (turns--) {  // backwards: what lies behind what hides all
            Turn *t = turn + turns;
            if (t->entry < 0) hidden[t->level + 1] = hidden[t->level] | t->closed;
            else {
                Entry *m = met + t->entry;
                m->kept &= ~((uint32_t)(t->closed | hidden[t->level]) << base);
                m->open = (m->open & ~mine) | (uint32_t)t->wide << base;
            }
            hidden[t->level] |= t->wide;
        }
        F low = clamp(0.5f - s->slope * state->d.high, 0, 1), high = clamp(0.5f - s->slope * state->d.low, 0, 1);
        M same = ints(-1);
        for (int k = 0; k < 4; k++) {
            F least = k < 3 || s->clear ? state->c[k].low * low : low, most = k < 3 || s->clear ? state->c[k].high * high : high;
            same &= most - least <= FLAT_COLOUR;
            F mean = 0.5f * (least + most);
            for (int i = 0; i < W; i++) colour[base + i][k] = mean[i];
        }
        flat |= (uint32_t)bits(same) << base;
    }
    return flat;
}
typedef struct { const Flat *s; const Page *g; float *out; int32_t *owner; int left, top, right, bottom; } Target;
IN void put_pixel(const Target *t, int x, int y, const float *c) {
    int64_t at = (int64_t)(y - t->top) * t->g->width + x;
    const Page *g = t->g;
    float *to = t->out + at * g->channels;
    for (int k = 0; k < g->channels; k++) {
        float v = g->channels == 3 ? c[k] + (1 - c[3]) * g->background[k] : c[k];
        to[k] = v < 0 ? 0 : v > 1 ? 1 : v;
    }
}
static void fill(const Target *t, int x, int y, int side, const float *c) {
    int right = x + side < t->right ? x + side : t->right, bottom = y + side < t->bottom ? y + side : t->bottom;
    if (t->owner) {
        for (int j = y; j < bottom; j++)
            memset(t->owner + (int64_t)(j - t->top) * t->g->width + x, 0, sizeof(int32_t) * (size_t)(right - x));
        return;
    }
    put_pixel(t, x, y, c);
    int channels = t->g->channels;
    float *first = t->out + ((int64_t)(y - t->top) * t->g->width + x) * channels;
    for (int i = 1; i < right - x; i++) for (int k = 0; k < channels; k++) first[i * channels + k] = first[k];
    for (int j = 1; j < bottom - y; j++)
        memcpy(first + (int64_t)j * t->g->width * channels, first, sizeof(float) * channels * (size_t)(right - x));
}
// The pixels of a block.
static void block(const Target *t, const Entry *met, int count, int bit, int x, int y, Drawn *w) {
    const Flat *s = t->s;
    const Page *g = t->g;
    float px[16], py[16], result[16][4];
    int inside[16], refined[16], many = 0, worn = 0;
    for (int i = 0; i < 16; i++) {
        px[i] = (float)((g->west + g->step * x) + g->step * (i % 4));
        py[i] = (float)((g->north - g->step * y) - g->step * (i / 4));
        inside[i] = x + i % 4 < t->right && y + i / 4 < t->bottom;
        w->met += inside[i];
    }
    for (int i = 0; i < count; i++) worn |= (met[i].kept >> bit & 1) && s->shape[met[i].object].texture >= 0;
    for (int base = 0; base < 16; base += W) {
        P p;
        F c[4];
        M near = ints(0);
        memcpy(&p.x, px + base, sizeof p.x); memcpy(&p.y, py + base, sizeof p.y);
        if (g->samples == OWNERS) {
            Sheet r = fold_owned(s, met, count, bit, p, g, &w->pairs);
            for (int k = 0; k < W; k++)
                if (inside[base + k])
                    t->owner[(int64_t)(y + (base + k) / 4 - t->top) * g->width + x + (base + k) % 4] = r.d[k] * s->slope < 0 ? (int32_t)r.owner[k] : 0;
            continue;
        }
        if (g->samples == EVERY) near = ints(-1);
        else if (g->samples == SINGLE) {
            Sheet r = fold_plain(s, met, count, bit, p, 0, g, &w->pairs);
            picture_of(s, &r, c);
        } else {
            Looked l = {all(BIG), ints(0), ints(0), ints(0), ints(0), ints(0)};
            Sheet r = fold_traced(s, met, count, bit, p, worn, g, &l, &w->pairs);
            near = min2(l.edge, size_of(r.d) * s->over_unit) < g->near * g->px;
            M seen = r.d * s->slope < 0.5f;
            if (s->traced) near |= seen & (s->deepest ? l.tied & l.blended : l.shown);
            if (s->clear && s->rounded) near |= seen & l.beneath;
            if (worn) {
                near |= seen & l.narrow;
                if (any(seen & ~near)) r = fold_plain(s, met, count, bit, p, g->count, g, &w->pairs);
            }
            picture_of(s, &r, c);
        }
        for (int k = 0; k < W; k++) {
            if (!inside[base + k]) continue;
            if (near[k]) refined[many++] = base + k;
            else {
                float one[4] = {c[0][k], c[1][k], c[2][k], c[3][k]};
                put_pixel(t, x + (base + k) % 4, y + (base + k) / 4, one);
            }
        }
    }
    w->refined += many;
    int total = many * g->count;
    for (int i = 0; i < many; i++) for (int k = 0; k < 4; k++) result[i][k] = 0;
    for (int first = 0; first < total; first += W) {
        P p;
        F c[4];
        for (int k = 0; k < W; k++) {
            int at = first + k < total ? first + k : total - 1, pixel = refined[at / g->count], place = at % g->count;
            p.x[k] = px[pixel] + g->place[place]; p.y[k] = py[pixel] + g->place[16 + place];
        }
        Sheet r = fold_plain(s, met, count, bit, p, 0, g, &w->pairs);
        picture_of(s, &r, c);
        for (int k = 0; k < W && first + k < total; k++) for (int e = 0; e < 4; e++) result[(first + k) / g->count][e] += c[e][k];
    }
    for (int i = 0; i < many; i++) {
        for (int k = 0; k < 4; k++) result[i][k] /= (float)g->count;
        put_pixel(t, x + refined[i] % 4, y + refined[i] / 4, result[i]);
    }
}
// The 16 cells of a side from a corner on.
IN uint32_t cells_of(const Target *t, int x, int y, int side, float *mx, float *my) {
    const Page *g = t->g;
    uint32_t some = 0;
    double half = 0.5 * side - 0.5;
    for (int i = 0; i < 16; i++) {
        int left = x + side * (i % 4), top = y + side * (i / 4);
        mx[i] = (float)(g->west + g->step * (left + half));
        my[i] = (float)(g->north - g->step * (top + half));
        some |= (uint32_t)(left < t->right && top < t->bottom) << i;
    }
    return some;
}
IN float around(const Page *g, int side) { return (float)(side * g->step * 0.70710678) + 2e-6f * (1 + g->extent); }
static void tile(const Target *t, Entry *met, int count, int x, int y, Drawn *w) {
    float mx[16], my[16], colour[16][4] = {{0}};
    if (!count) { fill(t, x, y, 16, colour[0]); return; }
    uint32_t some = cells_of(t, x, y, 4, mx, my);
    for (int i = 0; i < count; i++) { met[i].kept = some; met[i].open = met[i].open ? ALL_CELLS : 0; }
    uint32_t flat = proved(t->s, met, count, mx, my, around(t->g, 4), w->turn, colour, &w->pairs);
    for (int b = 0; b < 16; b++) {
        if (!(some >> b & 1)) continue;
        int left = x + 4 * (b % 4), top = y + 4 * (b / 4);
        if (flat >> b & 1 && !t->owner) fill(t, left, top, 4, colour[b]);
        else block(t, met, count, b, left, top, w);
    }
}
static void macro(const Target *t, Entry *met, int count, int x, int y, Drawn *w) {
    float mx[16], my[16], colour[16][4] = {{0}};
    if (!count) { fill(t, x, y, 64, colour[0]); return; }
    uint32_t some = cells_of(t, x, y, 16, mx, my);
    for (int i = 0; i < count; i++) { met[i].kept = some; met[i].open = 0; }
    uint32_t flat = proved(t->s, met, count, mx, my, around(t->g, 16), w->turn, colour, &w->pairs);
    for (int b = 0; b < 16; b++) {
        if (!(some >> b & 1)) continue;
        int left = x + 16 * (b % 4), top = y + 16 * (b / 4), n = 0;
        if (flat >> b & 1 && !t->owner) { fill(t, left, top, 16, colour[b]); continue; }
        for (int i = 0; i < count; i++)
            if (met[i].kept >> b & 1) w->tile[n++] = (Entry){met[i].object, 0, met[i].open >> b & 1};
        tile(t, w->tile, n, left, top, w);
    }
}
// Whether a world box meets that of an object; one of what is no number is everywhere.
IN int meets(const Shape *o, const double *low, const double *high) {
    return !(o->low[0] > high[0] || o->high[0] < low[0] || o->low[1] > high[1] || o->high[1] < low[1]);
}
