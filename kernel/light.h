// Light from everywhere: what rays bring from the sky, from nodes of the light around where they end, and through
// media; and what surfaces that glow send, as discs. Places and turns of rays come from scenelang/drawing/solid/around.py.
// Sums go ray by ray and disc by disc, so that a point has the same light whatever is asked with it.
#pragma once
#include "cone.h"
#include "shade.h"
enum { ROOM = 16, AGAIN = 5, DRAWN = 32, FEWEST = 4 };  // whole packets of nodes around a place; rays of it; rays to discs
#define SURE 0.01f  // world units, as `MarchSettings.gap`
#define LITTLE 0.02f  // share of a node that is worth a ray
#define OPEN 0.02f  // of the shares of nodes around a place, that no wall hides; less is dark
#define ASIDE_SQUARED 60.0f  // times as far, squared, as along a surface are nodes off whose plane a place lies
#define TOWARDS 0.3f  // of a ray's way, beside the normal, which nodes around its end face against
#define APART 0.02f  // so far before surfaces, in world units,
#define RISE 0.3f  // parts of a way,
#define HIGHEST 0.1f  // and at most, ways begin and end that walls may cross
#define DIFFER 0.3f  // light by which nodes around a place differ,
#define SHORT 1.2f  // and world units from a place, for which that sends rays,
#define NEARBY 0.2f  // in hollows
#define LIFTED 1e-4f  // world units off a surface where rays to lamps and discs begin,
#define OFF 1e-3f  // and those that gather,
#define AHEAD 3e-4f  // and on their way, where rays begin
#define SHUT 1e-2f  // world units: light of rays that end so near fades, as those begin within what is opaque
#define CAP 0.98f  // of colours
#define BEFORE 0.02f  // world units before a disc where rays to it end
#define DIM 1e-4f  // light that is worth few rays
#define GOLDEN 2.399963f  // radians
#define PI 3.14159265f
#define THICK 0.3f  // steps of the lattice: so near lies a point to the plane of another
#define ALIGNED 0.75f  // cosine: normals farther apart belong to other surfaces
#define LEVEL 0.1f  // of squares of steps: planes through few points are as level

typedef float Q __attribute__((vector_size(16), aligned(4)));
typedef struct { Rows from, way; float begin[BEAM], limit[BEAM], hit[BEAM], depth[BEAM]; int32_t of[BEAM]; } Rays;
typedef struct { float at[3], normal[3], share[ROOM], kept; const int32_t *index; const uint8_t *alike; int32_t count, ground[4]; } End;
typedef struct {
    Rays ray, other;  // those that gather, and those to nodes or from lamps
    Rows light, haze, slope, at, up, colour, sent, lit;  // the last five of places that send rays again
    float reach[BEAM], clear[BEAM], part[BEAM], turn[2 * BEAM], here[6 * BEAM];
    int32_t of[BEAM];
    End end[BEAM];
} Level;
// Parts of nodes that others see: those of the jth lie from begin[j] on; `row` has a 0 for each node.
typedef struct { int64_t *begin; int32_t *index; float *share, *row; } Exchange;
typedef struct { Scene scene; const Around *around; Slot *slot; int32_t *list; Level *level; int64_t met, rays; } Gather;

// How far rays (n) get, and how deep the media before that are; unless null, the field's gradients there.
static ONCE void trace(Gather *w, Rays *r, int n, Rows *slope) {
    const Scene *s = &w->scene;
    w->rays += n;
    for (int i = n; i % W; i++) {
        for (int d = 0; d < 3; d++) { r->from.v[d][i] = r->from.v[d][n - 1]; r->way.v[d][i] = r->way.v[d][n - 1]; }
        r->begin[i] = 0; r->limit[i] = -BIG;
    }
    for (int i = 0; i < n; i += W) {
        V from = load3(&r->from, i), way = load3(&r->way, i);
        int m = slots_of(s, from, way, load(r->begin, i), min2(load(r->limit, i), all(BIG)), w->list, s->objects, w->slot);
        Trail t = {all(INFINITY), all(0), all(0), ints(0), ints(0), 0};
        if (m) t = s->mixed || s->dense ? march(s, w->slot, m, SURE, 800, 0, 0, &(Pieces){0, 0, 0}, &w->met, KIND)
                                        : march(s, w->slot, m, SURE, 800, 0, 0, &(Pieces){0, 0, 0}, &w->met, DISTANCE);
        keep(r->hit, i, t.hit);
        keep(r->depth, i, t.depth);
        V g = {all(0), all(0), all(0)};
        M hit = t.hit < BIG;
        F far = sel(hit, t.hit + INTO, all(0));
        if (slope && any(hit)) beside(s, w->slot, m, far, plus(from, scaled(way, far)), hit, &g, &w->met);
        if (slope) keep3(slope, i, g);
    }
}
static void to_floor(const Around *a, Rays *r, int n) {  // limits of rays to the ground
    for (int i = 0; i < n; i++) {
        float down = r->way.v[1][i], high = r->from.v[1][i];
        r->begin[i] = 0;
        r->limit[i] = a->grounded && down < 0 && high > a->floor ? (a->floor - high) / down : INFINITY;
    }
}
// Cells know which nodes are near and face against the axis that a unit way is nearest to: a cell's number.
static int64_t cell_at(const Around *a, const float p[3], const float way[3]) {
    float x = fabsf(way[0]), y = fabsf(way[1]), z = fabsf(way[2]);
    int axis = x >= fmaxf(y, z) ? 0 : y >= z ? 1 : 2;
    int64_t cell = 2 * axis + (way[axis] > 0);
    for (int d = 0; d < 3; d++)
        cell = cell * a->counts[d] + (int)fminf(fmaxf((p[d] - a->low[d]) / a->side, 0), a->counts[d] - 1);
    return cell;
}
IN M groups_of(const uint8_t *alike) {  // of nodes of a cell
    typedef uint8_t B __attribute__((vector_size(W)));
    B r;
    memcpy(&r, alike, sizeof r);
    return __builtin_convertvector(r, M);
}
// Shares of the nodes near a place that face against a way and in whose planes it lies; their cell.
static int64_t nodes_near(const Around *a, const float p[3], const float way[3], float *share) {
    int64_t cell = cell_at(a, p, way);
    float room = 0.0625f * a->side * a->side;
    F sum = all(0);
    for (int j = 0; j < ROOM; j += W) {  // those beyond the last weigh nothing
        const float *about = a->about + cell * 7 * ROOM + j;
        V off = {load(about, 0) - p[0], load(about, ROOM) - p[1], load(about, 2 * ROOM) - p[2]};
        V n = {load(about, 3 * ROOM), load(about, 4 * ROOM), load(about, 5 * ROOM)};
        F above = dot(off, n), square = room + dot(off, off) + ASIDE_SQUARED * above * above;
        F facing = max2(-(n.x * way[0] + n.y * way[1] + n.z * way[2]), all(0));
        F part = load(about, 6 * ROOM) * (facing * facing + 1e-5f) / (square * square);
        keep(share, j, part);
        sum += part;
    }
    float each = 1 / fmaxf(sum_of(sum), 1e-20f);
    for (int j = 0; j < ROOM; j += W) keep(share, j, load(share, j) * each);
    return cell;
}
// Nodes of the ground around a place of it, from first to last at FAR sinh(WARP u) / sinh(WARP) along both axes.
static void on_floor(const Around *a, End *e) {
    int low[2], side = a->ground;
    float part[2], sum = 0;
    for (int d = 0; d < 2; d++) {
        float x = e->at[2 * d] * a->scale, size = fabsf(x), u = copysignf(logf(size + sqrtf(size * size + 1)), x) / a->warp;
        float at = fminf(fmaxf((u + 1) * 0.5f * (side - 1), 0), side - 1.001f);
        low[d] = (int)at;
        part[d] = at - low[d];
    }
    for (int j = 0; j < 4; j++) {
        int x = j % 2, z = j / 2;
        e->ground[j] = a->first + (low[1] + z) * side + low[0] + x;
        e->share[j] = (x ? part[0] : 1 - part[0]) * (z ? part[1] : 1 - part[1]) * (a->node[e->ground[j]].weight + 1e-4f);
        sum += e->share[j];
    }
    for (int j = 0; j < 4; j++) e->share[j] /= sum;
    e->count = 4; e->index = e->ground;
    e->kept = expf(-(e->at[0] * e->at[0] + e->at[2] * e->at[2]) / a->fade);
    e->normal[0] = e->normal[2] = 0; e->normal[1] = 1;
}
// A ray from a place to a node, over what is round.
static void to_node(Rays *r, int i, const End *e, const Node *o, int of) {
    float far = 0, length = 0, to[3];
    for (int d = 0; d < 3; d++) far += (o->p[d] - e->at[d]) * (o->p[d] - e->at[d]);
    float lift = fminf(APART + RISE * sqrtf(far), HIGHEST);
    for (int d = 0; d < 3; d++) {
        r->from.v[d][i] = e->at[d] + lift * e->normal[d];
        to[d] = o->p[d] + lift * o->n[d] - r->from.v[d][i];
        length += to[d] * to[d];
    }
    length = fmaxf(sqrtf(length), 1e-6f);
    for (int d = 0; d < 3; d++) r->way.v[d][i] = to[d] / length;
    r->begin[i] = 0; r->limit[i] = length; r->of[i] = of;
}
static void open_nodes(Gather *w, Level *l, int n) {  // which rays to nodes are free, by ray and group
    trace(w, &l->other, n, 0);
    for (int i = 0; i < n; i++) if (!(l->other.hit[i] < BIG)) l->part[l->other.of[i] / 2] += 1 + l->other.of[i] % 2;
}
// Nodes around where rays (n) end; none around those that end in the sky.
static void ends_of(Gather *w, Level *l, int n) {
    const Around *a = w->around;
    Rays *r = &l->ray;
    to_floor(a, r, n);
    trace(w, r, n, &l->slope);
    int others = 0;
    for (int i = 0; i < n; i++) {
        End *e = l->end + i;
        int met = r->hit[i] < BIG;
        l->reach[i] = fminf(r->hit[i], r->limit[i]);
        e->count = 0;
        l->part[i] = 0;
        if (!(l->reach[i] < BIG)) continue;
        for (int d = 0; d < 3; d++) e->at[d] = r->from.v[d][i] + r->way.v[d][i] * l->reach[i];
        if (!met) { on_floor(a, e); continue; }
        e->kept = 1;
        if (!a->near) continue;
        float towards = 0, length = 0, way[3], size = 0;
        for (int d = 0; d < 3; d++) {
            towards += l->slope.v[d][i] * r->way.v[d][i];
            length += l->slope.v[d][i] * l->slope.v[d][i];
        }
        length = fmaxf(sqrtf(length), 1e-9f);
        for (int d = 0; d < 3; d++) {  // in a crevice the nearest surface may be the one that is left
            e->normal[d] = towards > 0 ? -r->way.v[d][i] : l->slope.v[d][i] / length;
            way[d] = TOWARDS * r->way.v[d][i] - e->normal[d];
            size += way[d] * way[d];
        }
        size = fmaxf(sqrtf(size), 1e-9f);
        for (int d = 0; d < 3; d++) way[d] /= size;
        int64_t cell = nodes_near(a, e->at, way, e->share);
        e->index = a->index + cell * a->near; e->alike = a->alike + cell * ROOM; e->count = a->near;
        if (!a->hollow) continue;
        if (others + 2 > BEAM) { open_nodes(w, l, others); others = 0; }
        for (int group = 0; group < 2; group++) {  // of a cell's nodes with no wall between them, one tells of all
            int best = -1;
            float most = LITTLE;
            for (int j = 0; j < ROOM; j += W) {
                F part = sel(groups_of(e->alike + j) == group, load(e->share, j), all(0));
                float here = most_of(part);
                if (here > most) { most = here; best = j + __builtin_ctz((unsigned)bits(part == here)); }
            }
            if (best >= 0) to_node(&l->other, others++, e, a->node + e->index[best], 2 * i + group);
        }
    }
    if (!a->hollow) return;
    if (others) open_nodes(w, l, others);
    for (int i = 0; i < n; i++) {
        End *e = l->end + i;
        if (e->index == e->ground || !e->count) continue;
        int open = (int)l->part[i];  // bit by bit, of groups
        F sum = all(0);
        for (int j = 0; j < ROOM; j += W) {
            F part = sel(((open >> groups_of(e->alike + j)) & 1) != 0, load(e->share, j), all(0));
            keep(e->share, j, part);
            sum += part;
        }
        float each = 1 / fmaxf(sum_of(sum), OPEN);
        for (int j = 0; j < ROOM; j += W) keep(e->share, j, load(e->share, j) * each);
    }
}
static void sky_of(const Around *a, float up, float light[3]) {
    float high = fminf(fmaxf(2 * up, 0), 1);
    for (int d = 0; d < 3; d++) light[d] = a->horizon[d] + (a->zenith[d] - a->horizon[d]) * high;
}
// Light of media along rays (n) up to where they end, and what these let through.
static void haze_of(const Around *a, Level *l, int n) {
    int steps = a->steps, b = a->sides[1], c = a->sides[2];
    for (int i = 0; i < n; i += W) {
        V from = load3(&l->ray.from, i), way = load3(&l->ray.way, i), light = {all(0), all(0), all(0)};
        F begin = all(0), end = load(l->reach, i), through = all(1);
        const F *p = &from.x, *to = &way.x;
        for (int d = 0; d < 3; d++) {
            F on = sel(size_of(to[d]) > 1e-6f, to[d], all(1e-6f));
            F low = (a->corner[d] - p[d]) / on, high = (a->corner[d] + a->spacing * (a->sides[d] - 1) - p[d]) / on;
            begin = max2(min2(low, high), begin);
            end = min2(max2(low, high), end);
        }
        F each = max2(end - begin, all(0)) * (1.0f / steps);
        int crosses = bits(each > 0.0f);
        for (int k = 0; k < steps && crosses; k++) {
            V at = plus(from, scaled(way, begin + (k + 0.5f) * each));
            const F *x = &at.x;
            F part[3], row[4];
            M index = ints(0);
            for (int d = 0; d < 3; d++) {
                F u = clamp((x[d] - a->corner[d]) * (1 / a->spacing), 0, a->sides[d] - 1.001f);
                M low = cut(u);
                part[d] = u - floats(low);
                index = index * a->sides[d] + low;
            }
            F share[8];
            float of[4][W];
            index *= 4;
            for (int j = 0; j < 8; j++) share[j] = (j & 4 ? part[0] : 1.0f - part[0]) * (j & 2 ? part[1] : 1.0f - part[1]) * (j & 1 ? part[2] : 1.0f - part[2]);
            for (int w = 0; w < W; w++) {  // four rows of a node at once, of rays that pass the lattice
                Q sum = {0, 0, 0, 0};
                for (int j = 0; j < 8 && crosses >> w & 1; j++) sum += share[j][w] * *(const Q *)(a->haze + index[w] + 4 * ((j >> 2) * b * c + (j >> 1 & 1) * c + (j & 1)));
                for (int d = 0; d < 4; d++) of[d][w] = sum[d];
            }
            for (int d = 0; d < 4; d++) row[d] = load(of[d], 0);
            F dense = max2(row[3], all(1e-9f)), past = through * exponential(-dense * each), sent = (through - past) / dense;
            light = plus(light, scaled((V){row[0], row[1], row[2]}, sent));
            through = past;
        }
        keep3(&l->haze, i, light);
        keep(l->clear, i, through);
    }
}
// Light of lamps, whose middles tell of all of them, at places (n) that send rays again, into `lit`.
static void lit_by(Gather *w, Level *l, int n) {
    const Around *a = w->around;
    Rays *r = &l->other;
    for (int i = 0; i < n; i += W) keep3(&l->lit, i, (V){all(0), all(0), all(0)});
    for (int k = 0; k < a->lamps; k++) {
        const float *lamp = a->lamp + 7 * k, radius = lamp[6];
        for (int i = 0; i < n; i += W) {
            V at = {all(lamp[0]), all(lamp[1]), all(lamp[2])}, p = load3(&l->at, i), up = load3(&l->up, i), to = minus(at, p);
            F far = max2(length_of(to), all(1e-3f));
            keep(l->reach, i, form(dot(up, to) / far, far, radius));
            to = minus(plus(p, scaled(up, all(LIFTED))), at);
            far = max2(length_of(to), all(1e-9f));
            keep3(&r->from, i, at); keep3(&r->way, i, over(to, far));
            keep(r->begin, i, all(radius)); keep(r->limit, i, far - CLEAR);
        }
        trace(w, r, n, 0);
        for (int i = 0; i < n; i++) if (!(r->hit[i] < BIG)) {
            float clear = l->reach[i] * expf(-r->depth[i]);
            for (int d = 0; d < 3; d++) l->lit.v[d][i] += clear * lamp[3 + d];
        }
    }
}
static void gathered(Gather *w, Level *l, int64_t n, int64_t stride, const float *p, const float *normal, const float *turn,
                     int rays, int finer, float *light, const Exchange *to);
// Light that rays (n) bring from where they end, without media. If `finer`, places nearer than nodes may be, and in
// hollows those around which nodes differ, send rays again.
static void brought(Gather *w, Level *l, int n, int finer) {
    const Around *a = w->around;
    int again = 0;
    ends_of(w, l, n);
    for (int i = 0; i < n; i++) {
        const End *e = l->end + i;
        float light[3] = {0, 0, 0}, colour[3] = {0, 0, 0}, spread = 0;
        if (!(l->reach[i] < BIG)) sky_of(a, l->ray.way.v[1][i], light);
        for (int j = 0; j < e->count; j++) for (int d = 0; d < 3; d++) light[d] += e->share[j] * a->node[e->index[j]].sent[d];
        for (int d = 0; d < 3; d++) l->light.v[d][i] = e->count ? light[d] * e->kept + a->horizon[d] * (1 - e->kept) : light[d];
        if (!finer || !e->count) continue;
        float part = 1 - l->reach[i] / SHORT;
        if (a->hollow) {
            for (int j = 0; j < e->count; j++) {
                const float *sent = a->node[e->index[j]].sent;
                float off = sent[0] + sent[1] + sent[2] - (light[0] + light[1] + light[2]);
                spread += e->share[j] * off * off;
            }
            part = fmaxf(1 - l->reach[i] / NEARBY, sqrtf(spread) / DIFFER - 1);
        }
        if (!(part > 0)) continue;
        for (int j = 0; j < e->count; j++) for (int d = 0; d < 3; d++) colour[d] += e->share[j] * a->node[e->index[j]].colour[d];
        l->of[again] = i; l->part[again] = fminf(part, 1) * e->kept;
        for (int d = 0; d < 3; d++) {
            l->at.v[d][again] = e->at[d]; l->up.v[d][again] = e->normal[d];
            l->colour.v[d][again] = fminf(fmaxf(colour[d], 0), CAP); l->sent.v[d][again] = light[d];
        }
        for (int d = 0; d < 2; d++) {  // turns by places
            double at = 37.719 * (d ? 0.6199 : 0.8130) * e->at[0] + 78.233 * (d ? 0.3014 : 0.8931) * e->at[1]
                + 12.99 * (d ? 0.9213 : 1.7061) * e->at[2] + 0.5;
            l->turn[d * BEAM + again] = fabs(at) < 1e9 ? (float)(at - floor(at)) : 0;
        }
        again++;
    }
    if (!again) return;
    float kept[BEAM];
    memcpy(kept, l->reach, sizeof kept);
    for (int i = again; i % W; i++) for (int d = 0; d < 3; d++) { l->at.v[d][i] = l->at.v[d][again - 1]; l->up.v[d][i] = l->up.v[d][again - 1]; }
    lit_by(w, l, again);
    memcpy(l->reach, kept, sizeof kept);
    gathered(w, l + 1, again, BEAM, l->at.v[0], l->up.v[0], l->turn, AGAIN, 0, l->here, 0);
    for (int i = 0; i < again; i++) for (int d = 0; d < 3; d++)
        l->light.v[d][l->of[i]] += l->part[i] * (l->colour.v[d][i] * (l->lit.v[d][i] + l->here[d * BEAM + i]) - l->sent.v[d][i]);
}
IN V turned(V n, F x, F y, F z) {  // by the frame whose third axis is n (Duff et al. 2017)
    F sign = sel(n.y < 0.0f, all(-1), all(1)), a = -1.0f / (sign + n.y), b = n.x * n.z * a;
    return (V){(1.0f + sign * n.x * n.x * a) * x + b * y + n.x * z, -sign * n.x * x - n.z * y + n.y * z,
               sign * b * x + (sign + n.z * n.z * a) * y + n.z * z};
}
// Light (3, n) that points with unit normals (3, n) receive by so many rays, which numbers (2, n) turn, and how far halves of
// these are from it (3, n more); rows lie `stride` apart. Or, where an `Exchange` is, the parts of each node that they see
// there, what they receive of the sky, the horizon and media, and the part of rays that meet objects, in the fourth row.
static void gathered(Gather *w, Level *l, int64_t n, int64_t stride, const float *p, const float *normal, const float *turn,
                     int rays, int finer, float *light, const Exchange *to) {
    const Around *a = w->around;
    float each = 1.0f / rays;
    int64_t used = to ? to->begin[0] : 0;
    for (int d = 0; d < 6; d++) memset(light + d * stride, 0, 4 * (size_t)n);
    for (int64_t from = 0; from < n * rays; from += BEAM) {
        int some = (int)(n * rays - from < BEAM ? n * rays - from : BEAM);
        for (int i = 0; i < some; i += W) {
            V at, up;
            F number, shift, first;
            for (int k = 0; k < W; k++) {
                int64_t which = i + k < some ? from + i + k : from + some - 1, j = which / rays;
                at.x[k] = p[j]; at.y[k] = p[stride + j]; at.z[k] = p[2 * stride + j];
                up.x[k] = normal[j]; up.y[k] = normal[stride + j]; up.z[k] = normal[2 * stride + j];
                number[k] = (float)(which % rays); shift[k] = turn[j]; first[k] = turn[stride + j];
            }
            F u = min2((number + shift) * each, all(1)), r = root(u), sine, cosine;
            sines(GOLDEN * (number + shift) + 2 * PI * first, &sine, &cosine);
            V way = turned(up, r * cosine, r * sine, root(1.0f - u));
            keep3(&l->ray.way, i, way);  // out of what begins there, in corners
            keep3(&l->ray.from, i, plus(at, plus(scaled(up, all(OFF)), scaled(way, all(AHEAD)))));
        }
        if (to) ends_of(w, l, some);
        else brought(w, l, some, finer);
        if (a->haze) haze_of(a, l, some);
        for (int i = 0; i < some; i++) {
            int64_t j = (from + i) / rays;
            const End *e = l->end + i;
            float part = (a->haze ? l->clear[i] : 1) * each;
            if (!to) {
                float fade = part * fminf(l->reach[i] / SHUT, 1), sign = ((from + i) % rays + 1) / 2 % 2 ? -1 : 1;
                for (int d = 0; d < 3; d++) {
                    float sent = l->light.v[d][i] * fade + (a->haze ? l->haze.v[d][i] * each : 0);
                    light[d * stride + j] += sent;
                    light[(3 + d) * stride + j] += sign * sent;
                }
                continue;
            }
            float sky[3] = {0, 0, 0};
            if (!(l->reach[i] < BIG)) sky_of(a, l->ray.way.v[1][i], sky);
            for (int d = 0; d < 3; d++)
                light[d * stride + j] += part * (e->count ? a->horizon[d] * (1 - e->kept) : sky[d]) + (a->haze ? l->haze.v[d][i] * each : 0);
            light[3 * stride + j] += l->ray.hit[i] < BIG ? each : 0;
            for (int k = 0; k < e->count; k++) {
                float more = e->share[k] * e->kept * part;
                int32_t node = e->index[k];
                if (!(more > 0)) continue;
                if (to->row[node] == 0) to->index[used++] = node;
                to->row[node] += more;
            }
            if ((from + i) % rays < rays - 1) continue;
            for (int64_t k = to->begin[j]; k < used; k++) { to->share[k] = to->row[to->index[k]]; to->row[to->index[k]] = 0; }
            to->begin[j + 1] = used;
        }
    }
}
// Light of each disc that points receive: what is seen of it, by its form factor. Without a normal, a surface that faces it.
IN F disc_form(const float *disc, V p, V n, int faced) {
    V to = {disc[0] - p.x, disc[1] - p.y, disc[2] - p.z}, face = {all(disc[3]), all(disc[4]), all(disc[5])};
    F area = all(disc[9]), square = PI * dot(to, to), there = max2(-dot(to, face), all(0));
    // where it is as near as it is wide, a disc sends light from below the point rather than its middle
    F far = square / max2(square + area, all(1e-12f));
    to = minus(scaled(to, far), scaled(face, (1.0f - far) * there));
    square = dot(to, to);
    F here = faced ? max2(dot(to, n), all(0)) : root(square);
    return area * here * there / max2(square * (PI * square + area), all(1e-12f));
}
// Rays (n) to discs: what they say of points that drew them, and rows of them if wanted.
static void to_discs(Gather *w, Level *l, int n, int64_t first, float *both, int32_t *point, float *ray, int64_t room,
                     int64_t *count) {
    trace(w, &l->other, n, 0);
    for (int i = 0; i < n; i++) {
        float clear = l->other.hit[i] < BIG ? 0 : expf(-l->other.depth[i]);
        int64_t j = l->other.of[i];
        for (int d = 0; d < 3; d++) {
            both[d * W + j - first] += l->sent.v[d][i];
            both[(3 + d) * W + j - first] += l->sent.v[d][i] * clear;
        }
        if (*count >= room) continue;
        for (int d = 0; d < 3; d++) { ray[d * room + *count] = l->other.way.v[d][i]; ray[(3 + d) * room + *count] = l->sent.v[d][i] * clear; }
        point[(*count)++] = (int32_t)j;
    }
}
// Light (3, n) that points with unit normals (3, n), or surfaces that face each disc, receive of what glows if nothing hides
// it, and unless null the parts (3, n) that arrive, by rays to some discs: fewer where less is received than `worth`. Of
// these rays, as many as there is room for: numbers of points, ways and the light that arrives (6, room).
static void glowing(Gather *w, int64_t n, const float *p, const float *normal, float worth, float *light, float *free,
                    int32_t *point, float *ray, int64_t room, int64_t *count) {
    const Around *a = w->around;
    Level *l = w->level;
    Rays *r = &l->other;
    for (int64_t i = 0; i < n; i += W) {
        V q, up = {all(0), all(0), all(0)}, sum = up;
        F whole = all(0), turn, before = all(0), running = all(0);
        float both[6 * W] = {0};
        q = read_points(p, n, n, i);
        if (normal) up = read_points(normal, n, n, i);
        for (int d = 0; d < a->discs; d++) {
            const float *disc = a->disc + 10 * d;
            F f = disc_form(disc, q, up, normal != 0);
            sum = plus(sum, (V){f * disc[6], f * disc[7], f * disc[8]});
            whole += f * (disc[6] + disc[7] + disc[8]);
        }
        store(light, n, i, sum.x); store(light + n, n, i, sum.y); store(light + 2 * n, n, i, sum.z);
        if (!free) continue;
        for (int k = 0; k < W; k++) {
            double at = 37.719 * q.x[k] + 78.233 * q.y[k] + 12.99 * q.z[k];
            turn[k] = fabs(at) < 1e9 ? (float)(at - floor(at)) : 0;
        }
        // a disc has as many rays as there are whole numbers that the sum passes with it
        F rate = clamp(whole * (DRAWN / fmaxf(worth, DIM)), FEWEST, DRAWN) / max2(whole, all(DIM));
        F share = whole / max2(lower(whole * rate + turn), all(1));
        int m = 0;
        for (int d = 0; d < a->discs; d++) {
            const float *disc = a->disc + 10 * d, bright = disc[6] + disc[7] + disc[8];
            running += disc_form(disc, q, up, normal != 0) * bright;
            F passed = lower(running * rate + turn), many = passed - before;
            before = passed;
            for (int some = bits(many > 0.0f); some; some &= some - 1) {
                int k = __builtin_ctz((unsigned)some);
                if (i + k >= n) break;
                float far = 0, from[3] = {q.x[k] + LIFTED * up.x[k], q.y[k] + LIFTED * up.y[k], q.z[k] + LIFTED * up.z[k]};
                for (int c = 0; c < 3; c++) far += (disc[c] - from[c]) * (disc[c] - from[c]);
                far = fmaxf(sqrtf(far), 1e-6f);
                for (int c = 0; c < 3; c++) {
                    r->from.v[c][m] = from[c]; r->way.v[c][m] = (disc[c] - from[c]) / far;
                    l->sent.v[c][m] = disc[6 + c] / fmaxf(bright, 1e-9f) * many[k] * share[k];
                }
                r->begin[m] = 0; r->limit[m] = far - BEFORE; r->of[m++] = (int32_t)(i + k);
                if (m == BEAM) { to_discs(w, l, m, i, both, point, ray, room, count); m = 0; }
            }
        }
        if (m) to_discs(w, l, m, i, both, point, ray, room, count);
        for (int k = 0; k < W && i + k < n; k++) {  // of a channel that hardly any ray has all of them tell
            float drawn = (both[k] + both[W + k] + both[2 * W + k]) / 1000, came = (both[3 * W + k] + both[4 * W + k] + both[5 * W + k]) / 1000;
            for (int d = 0; d < 3; d++) free[d * n + i + k] = (both[(3 + d) * W + k] + came) / fmaxf(both[d * W + k] + drawn, 1e-9f);
        }
    }
}
IN V unit(V a) { return over(a, max2(length_of(a), all(1e-9f))); }
IN F masked(F cosine, F square) {
    F r = 2.0f * cosine / max2(cosine + root(square + (1.0f - square) * cosine * cosine), all(1e-9f));
    return sel(cosine > 0.0f, r, all(0));
}
// What a rough mirror sends back of light along a unit way, times the cosine (scenelang/drawing/solid/gloss.py).
IN V lobe(V n, F square, V back, V straight, V way) {
    V half = unit(plus(back, way));
    F up = dot(half, n), cosine = max2(dot(n, back), all(1e-4f)), even = up * up * (square - 1.0f) + 1.0f;
    F facets = square / max2(PI * even * even, all(1e-12f));
    F rest = 1.0f - clamp(dot(half, way), 0, 1), fifth = rest * rest * rest * rest * rest;
    F part = facets * masked(cosine, square) * masked(dot(n, way), square) / (4.0f * cosine);
    return (V){part * (straight.x + (1.0f - straight.x) * fifth), part * (straight.y + (1.0f - straight.y) * fifth),
               part * (straight.z + (1.0f - straight.z) * fifth)};
}
enum { TURNS = 8, TURNED = 4 };  // of a lamp's disc about the mirrored way, and places on each
// Light of a lamp of power 1 that rough mirrors send back if nothing is in its way: of its disc, as evenly as facets lie there.
static ONCE V mirrored(V at, float radius, V p, V n, F rough, V back, V straight) {
    V axis = minus(at, p), total = {all(0), all(0), all(0)};
    F far = max2(length_of(axis), all(1e-3f)), square = rough * rough * rough * rough;
    axis = over(axis, far);
    if (!(radius > 0)) return scaled(lobe(n, square, back, straight, axis), PI / (far * far));
    V r = minus(scaled(n, 2.0f * dot(n, back)), back);
    F x = dot(r, axis), sine = clamp(radius / far, 0, 1), aside = root(max2(1.0f - x * x, all(1e-12f))), rim = root(1.0f - sine * sine);
    V u = unit(minus(axis, scaled(r, x))), v = {r.y * u.z - r.z * u.y, r.z * u.x - r.x * u.z, r.x * u.y - r.y * u.x};
    F inner = clamp(sine / aside, 0, 1), widest = sel(x > rim, all(PI), arc(root(1.0f - inner * inner)));
    for (int i = 0; i < TURNS; i++) {
        float place = (2 * i + 1 - TURNS) * (PI / 2 / TURNS);
        F s, c, turn = widest * sinf(place), end[2];
        sines(turn, &s, &c);
        F y = aside * c, size = max2(root(x * x + y * y), all(1e-6f)), cosine = clamp(rim / size, 0, 1);
        F half = root(1.0f - cosine * cosine);
        for (int k = 0; k < 2; k++) {  // tangents of half the angles from r, and of how many facets lie before
            float side = k ? 1 : -1;
            F t = max2((y * cosine + side * x * half) / max2(size + x * cosine - side * y * half, all(1e-4f)), all(0));
            end[k] = t * t / (t * t + square);
        }
        F part = (end[1] - end[0]) * widest * (2 * PI / TURNS / TURNED * cosf(place)) / square;
        for (int k = 0; k < TURNED; k++) {
            F share = clamp(end[0] + (end[1] - end[0]) * ((k + 0.5f) / TURNED), 0, 1 - 1e-6f), t = square * share / (1.0f - share);
            F straightly = (1.0f - t) / (1.0f + t), sideways = 2.0f * root(t) / (1.0f + t), dense = (t + square) / (1.0f + t);
            V way = plus(scaled(r, straightly), scaled(plus(scaled(u, c), scaled(v, s)), sideways));
            total = plus(total, scaled(lobe(n, square, back, straight, way), part * dense * dense));
        }
    }
    return scaled(total, sel(far > radius, all(1 / (radius * radius)), all(0)));
}
// How surely points with unit normals lie on the same surface as others, whose lattice's cells have so long sides.
IN F on_one(V p, V n, V to, V face, F side) {
    F off = size_of(dot(minus(to, p), plus(face, n)));
    return clamp(2.0f - off / (THICK * side), 0, 1) * clamp((dot(face, n) - ALIGNED) * 8.0f, 0, 1);
}
IN V gathered3(const float *from, int64_t n, M at) { return (V){gather(from, at), gather(from + n, at), gather(from + 2 * n, at)}; }
// A picture's lattice, of points row by row: the eye, the camera's forward, right and up, pixels of a world unit at a distance
// of 1, half the picture's sides, the lattice's step in pixels, its columns and rows.
typedef struct { float eye[3], forward[3], right[3], up[3], scale, middle[2], step, columns, rows; } View;
