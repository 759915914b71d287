// Direct light in media: what ways of rays from the eye through them send there.
// With u = 1 - T^(1/2), T what a way lets through up to a point, the integral over T sigma dt is one over 2 (1 - u) du: where
// light fades as T does, three nodes are exact.
#pragma once
#include "shade.h"
#define LONG 2.0f  // world units: longer ways are cut,
#define STEEP 1.2f  // and those where the last node gets so much more light than the first, or other lamps,
#define LEAST 0.04f  // if they are so large a part of what is seen,
enum { THIRDS = 3, SPANS = 9, SPLITS = SPANS * 8 + 1 };  // into these. Spans of a lamp; of as many as there may be
#define SLENDER 0.8f  // cosine: ways that a lamp sees under a larger angle are cut where it changes by spans,
static const float SPAN[SPANS + 1] = {-BIG, -14.0f, -3.7f, -1.0f, -0.27f, 0.27f, 1.0f, 3.7f, 14.0f, BIG};  // tangents at the lamp
#define BUSY 8.0f  // texels that a way may cross with `FEW` panels of two points each
enum { FEW = 4, MANY = 12 };
static const float GAUSS[4][3] = {{0}, {0.5f}, {0.211324865f, 0.788675135f}, {0.112701665f, 0.5f, 0.887298335f}};
static const float SHARE[4][3] = {{0}, {1}, {0.5f, 0.5f}, {0.277777778f, 0.444444444f, 0.277777778f}};

// Where ways begin and end, and how much of the light of points along them comes to the eye: t and weights, at shares x of
// what they take.
IN F along(F x, F begin, F end, F before, F sigma, F *weight) {
    F taken = 1.0f - exponential(-0.5f * sigma * (end - begin)), left = 1.0f - x * taken;
    *weight = 2.0f * taken * left * exponential(-sigma * before);
    return begin - logarithm(max2(left, all(1e-30f))) * (2.0f / sigma);
}
// Replace the colours of a way's nodes, times their weights, by those of many points between them, where textures vary: the
// light is a polynomial between nodes.
static ONCE void interwoven(Job *j, const Piece *way, const float to[3], float texels, Beam *b, int at) {
    const Stage *e = j->stage;
    int panels = texels <= BUSY ? FEW : MANY, count = 2 * panels;
    F weight;
    V sum[3], turn = constant(to), eye = constant(e->eye);
    for (int k = 0; k < e->nodes; k++) sum[k] = (V){all(0), all(0), all(0)};
    for (int i = 0; i < count; i += W) {
        F x;
        M some;
        V aside;
        for (int k = 0; k < W; k++) {
            int m = i + k, four = m % 8 < 4 ? m % 4 : 3 - m % 4;  // samples in turn
            x[k] = ((float)(m / 2) + (m % 2 ? 0.788675135f : 0.211324865f)) / (float)panels; some[k] = m < count ? -1 : 0;
            float u = four & 1 ? 0.25f : -0.25f, v = four & 2 ? -0.25f : 0.25f;
            aside.x[k] = u * (float)e->right[0] + v * (float)e->up[0]; aside.y[k] = u * (float)e->right[1] + v * (float)e->up[1];
            aside.z[k] = u * (float)e->right[2] + v * (float)e->up[2];
        }
        F t = along(x, all(way->begin), all(way->end), all(way->before), all(way->sigma), &weight);
        F side = (j->means ? (float)e->px : 0) * t * dot(turn, constant(e->deep));
        V p = plus(plus(eye, scaled(turn, t)), scaled(aside, side));
        float far = 0;
        for (int k = 0; k < W; k++) if (some[k] && side[k] > far) far = side[k];
        State s = told(j->s, p, e->gap + side, e->gap + far, some, j->list, j->listed, j->near, &j->met, REGISTER_);
        V colour = scaled(rows_of(s.look, 0), sel(some, weight / (float)count, all(0)));
        for (int k = 0; k < e->nodes; k++) {
            F base = all(1);
            for (int m = 0; m < e->nodes; m++) if (m != k) base *= (x - GAUSS[e->nodes][m]) / (GAUSS[e->nodes][k] - GAUSS[e->nodes][m]);
            sum[k] = plus(sum[k], scaled(colour, base));
        }
    }
    for (int k = 0; k < e->nodes; k++) for (int d = 0; d < 3; d++) {
        F part = d == 0 ? sum[k].x : d == 1 ? sum[k].y : sum[k].z;
        float total = 0;
        for (int m = 0; m < W; m++) total += part[m];
        b->colour[0].v[d][at + k] = total;
    }
}
// Texels that a way may cross in a world unit.
static float crossed(const Scene *s, const float eye[3], const float to[3], const Piece *way) {
    float r = 0;
    for (int i = 0; i < s->objects; i++) if (s->object[i].detail > 0) {
        const Object *o = s->object + i;
        float v[3], ahead = 0, off = 0;
        for (int d = 0; d < 3; d++) { v[d] = o->centre[d] - eye[d]; ahead += v[d] * to[d]; }
        ahead = fminf(fmaxf(ahead, way->begin), way->end);
        for (int d = 0; d < 3; d++) off += (v[d] - to[d] * ahead) * (v[d] - to[d] * ahead);
        if (off <= o->extent * o->extent) r += o->detail;
    }
    return r;
}
typedef struct { Piece way[BEAM]; int count; } Ways;

// Add what ways of rays from `first` on send to the eye; those between whose nodes light changes go, in thirds, to `finer`.
static void send(Job *j, Beam *b, int first, const Ways *ways, Ways *finer) {
    const Stage *e = j->stage;
    int nodes = e->nodes, n = ways->count * nodes;
    Beam m;
    F weight;
    float begin[BEAM], end[BEAM], before[BEAM], sigma[BEAM], x[BEAM], share[BEAM], weights[BEAM];
    for (int i = 0; i < (n + W - 1) / W * W; i++) {
        const Piece *w = ways->way + (i < n ? i : n - 1) / nodes;
        int ray = first + w->ray;
        begin[i] = w->begin; end[i] = w->end; before[i] = w->before; sigma[i] = w->sigma;
        x[i] = GAUSS[nodes][i % nodes]; share[i] = SHARE[nodes][i % nodes];
        for (int d = 0; d < 3; d++) m.way.v[d][i] = b->way.v[d][ray];
    }
    for (int i = 0; i < n; i += W) {
        V way = load3(&m.way, i), none = {all(0), all(0), all(0)};
        F t = along(load(x, i), load(begin, i), load(end, i), load(before, i), load(sigma, i), &weight);
        M some;
        for (int k = 0; k < W; k++) some[k] = i + k < n ? -1 : 0;
        weight *= load(share, i);
        V p = plus(constant(e->eye), scaled(way, t));
        State s = told(j->s, p, all(e->gap), e->gap, some, j->list, j->listed, j->near, &j->met, REGISTER_);
        for (int k = 0; k < j->sheets; k++) keep3(&m.colour[k], i, scaled(rows_of(s.look, 3 * k), weight));
        keep3(&m.p, i, p); keep3(&m.n, i, none); keep(weights, i, weight);
        keep3(&m.glow[0], i, e->glow ? scaled(rows_of(s.look, e->glow), weight) : none);
        for (int k = 0; k < W; k++) m.reached[i + k] = m.edge[i + k] = 0;
    }
    for (int i = 0; j->sheets > 1 && i < ways->count; i++) {
        const Piece *w = ways->way + i;
        float to[3] = {b->way.v[0][first + w->ray], b->way.v[1][first + w->ray], b->way.v[2][first + w->ray]};
        float texels = crossed(j->s, e->eye, to, w) * fminf(w->end - w->begin, 1 / w->sigma);
        if (texels > 0) interwoven(j, w, to, texels, &m, i * nodes);
    }
    for (int k = 0; k < j->sheets; k++) for (int d = 0; d < 3; d++) for (int i = 0; i < n; i++)
        m.light[k].v[d][i] = m.colour[k].v[d][i] * e->ambient[0] + m.glow[0].v[d][i];
    light_up(j, &m, n, 1);
    for (int i = 0; i < ways->count; i++) {
        const Piece *w = ways->way + i;
        const Rows *plain = &m.light[j->sheets - 1];
        int from = i * nodes, last = from + nodes - 1, other = 0;
        float part = 0, dim = 0, bright = 0;
        for (int k = from; k <= last; k++) { part += weights[k]; other |= m.reached[k] != m.reached[from]; }
        for (int d = 0; d < 3; d++) { dim += plain->v[d][from]; bright += plain->v[d][last]; }
        if (finer && part > LEAST && (other || bright > STEEP * dim || w->end - w->begin > LONG)) {
            float each = (w->end - w->begin) / THIRDS;
            for (int k = 0; k < THIRDS; k++)
                finer->way[finer->count++] = (Piece){w->ray, w->begin + k * each, w->begin + (k + 1) * each, w->before + k * each, w->sigma};
        } else for (int sheet = 0; sheet < j->sheets; sheet++)
            for (int d = 0; d < 3; d++) for (int k = from; k <= last; k++) b->glow[sheet].v[d][first + w->ray] += m.light[sheet].v[d][k];
    }
}
static void flush(Job *j, Beam *b, int first, Ways *ways) {
    Ways finer = {.count = 0};
    if (ways->count) send(j, b, first, ways, &finer);
    for (int at = 0, most = BEAM / j->stage->nodes; at < finer.count; at += most) {
        Ways some = {.count = finer.count - at < most ? finer.count - at : most};
        memcpy(some.way, finer.way + at, sizeof(Piece) * (size_t)some.count);
        send(j, b, first, &some, 0);
    }
    ways->count = 0;
}
// Add what media send along a packet of rays, the first of which is the block's `first`th, by its ways in them.
static ONCE void scatter(Job *j, Beam *b, int first, const Pieces *pieces) {
    const Stage *e = j->stage;
    Ways ways = {.count = 0};
    int64_t count = pieces->count < pieces->room ? pieces->count : pieces->room;
    for (int64_t i = 0; i < count; i++) {
        const Piece *whole = pieces->piece + i;
        float cuts[SPLITS + 1] = {whole->begin, whole->end}, to[3];
        int n = 2;
        for (int d = 0; d < 3; d++) to[d] = b->way.v[d][first + whole->ray];
        for (int l = 0; l < e->lamps; l++) {  // where the light of a lamp falls unevenly
            float at[3], middle = 0, product = 0, one = 0, two = 0, aside = 0;
            for (int d = 0; d < 3; d++) {
                at[d] = e->lamp[l].at[d] - e->eye[d];
                float p = at[d] - to[d] * whole->begin, q = at[d] - to[d] * whole->end;
                product += p * q; one += p * p; two += q * q; middle += at[d] * to[d];
            }
            if (product > SLENDER * sqrtf(one) * sqrtf(two)) continue;
            for (int d = 0; d < 3; d++) aside += (at[d] - to[d] * middle) * (at[d] - to[d] * middle);
            aside = fmaxf(sqrtf(aside), e->nearest);
            for (int k = 1; k < SPANS; k++) {
                float t = middle + SPAN[k] * aside;
                if (!(t > whole->begin && t < whole->end)) continue;
                int place = n++;
                for (; cuts[place - 1] > t; place--) cuts[place] = cuts[place - 1];
                cuts[place] = t;
            }
        }
        for (int k = 0; k + 1 < n; k++) {
            if (!(cuts[k] < cuts[k + 1]) && n > 2) continue;
            ways.way[ways.count++] = (Piece){whole->ray, cuts[k], cuts[k + 1], whole->before + cuts[k] - whole->begin, whole->sigma};
            if (ways.count == BEAM / e->nodes) flush(j, b, first, &ways);
        }
    }
    flush(j, b, first, &ways);
}
