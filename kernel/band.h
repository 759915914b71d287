// Bands of a picture: rays through pixels' centres, and through more places where these differ from their neighbours.
#pragma once
#include "mist.h"
enum { TILE = 16, LOW = 4 };  // pixels of tiles whose rays are followed together; of further samples, rows of such tiles

// The ways of n rays of a block through places of the picture, in pixels from its upper left corner.
static void rays_to(const Stage *e, const double *x, const double *y, int n, Rows *way) {
    for (int i = 0; i < n; i += W) {
        D right, up;
        V v;
        memcpy(&right, x + i, sizeof right); memcpy(&up, y + i, sizeof up);
        right = (right - 0.5 * e->width) * e->px; up = (0.5 * e->height - up) * e->px;
        // float64 up to here: at 8192 pixels float32 would move samples by a thousandth of one
        v.x = single(e->forward[0] + e->up[0] * up) + single(e->right[0] * right);
        v.y = single(e->forward[1] + e->up[1] * up) + single(e->right[1] * right);
        v.z = single(e->forward[2] + e->up[2] * up) + single(e->right[2] * right);
        keep3(way, i, over(v, root(dot(v, v))));
    }
}
// Light and alpha along a block of n rays from the eye.
static void shade_block(Job *j, Beam *b, int n) {
    const Scene *s = j->s;
    const Stage *stage = j->stage;
    V eye = constant(stage->eye), none = {all(0), all(0), all(0)};
    for (int i = n; i % W; i++) for (int d = 0; d < 3; d++) b->way.v[d][i] = b->way.v[d][n - 1];
    float wide = sqrtf(stage->deep[0] * stage->deep[0] + stage->deep[1] * stage->deep[1] + stage->deep[2] * stage->deep[2]);
    j->listed = narrowed(s, stage->eye, &b->way, n, j->sheets > 1 ? fminf(2 * (float)stage->px * wide, 0.5f) : 0, j->list);
    for (int i = 0; i < n; i += W) {
        V way = load3(&b->way, i), normal = none, colour[2] = {none, none}, haze = none, light = none;
        F high = clamp(way.y * 2.0f, 0, 1), limit = all(BIG);
        if (stage->grounded && stage->eye[1] > stage->floor) {
            M down = way.y < 0.0f;
            limit = sel(down, min2((stage->floor - stage->eye[1]) / sel(down, way.y, all(-1)), all(BIG)), limit);
        }
        F last = limit, clear = all(1);
        for (int k = 0; k < W; k++) if (i + k >= n) last[k] = -BIG;
        if (!stage->transparent) {
            V low = constant(stage->horizon);
            light = plus(low, scaled(minus(constant(stage->zenith), low), high));
        }
        Trail r = {all(INFINITY), all(0), all(0), ints(0), ints(0), 0};
        Pieces pieces = {j->piece, 0, j->room};
        int m = slots_of(s, eye, way, all(0), last, j->list, j->listed, j->slot);
        if (m) r = trail_of(j, s, m, HALVINGS, &pieces);
        M hit = r.hit < BIG, floor = ~hit & (limit < BIG), both = hit | floor;
        F far = limit;
        if (any(hit)) {
            Surface met = surface(j, m, way, sel(hit, r.hit, all(0)), hit, r.soft);
            far = sel(hit, met.t, far);
            normal = choose(hit, met.g, none); haze = choose(hit, met.glow, none);
            for (int k = 0; k < j->sheets; k++) colour[k] = choose(hit, met.colour[k], none);
        }
        V p = plus(eye, scaled(way, sel(both, far, all(0))));
        if (any(floor)) {
            F kept = exponential((p.x * p.x + p.z * p.z) * (-1.0f / stage->fade));
            for (int k = 0; k < j->sheets; k++) colour[k] = choose(floor, scaled(constant(stage->ground), kept), colour[k]);
            haze = choose(floor, scaled(constant(stage->horizon), 1.0f - kept), haze);
            normal = choose(floor, (V){all(0), all(1), all(0)}, normal);
        }
        for (int k = 0; k < j->sheets; k++) {
            V sent = plus(scaled(colour[k], stage->ambient[0] + stage->ambient[1] * normal.y), haze);
            keep3(&b->colour[k], i, colour[k]); keep3(&b->light[k], i, choose(both, sent, light)); keep3(&b->glow[k], i, none);
        }
        keep3(&b->p, i, p); keep3(&b->n, i, normal);
        keep(b->alpha, i, sel(both, all(1), all(stage->transparent ? 0 : 1)));
        keep((float *)b->edge, i, (F)(r.soft & hit));
        if (s->media) clear = exponential(-r.depth);
        keep(b->clear, i, clear); keep((float *)b->reached, i, (F)ints(0));
        if (pieces.count) scatter(j, b, i, &pieces);
    }
    light_up(j, b, n, 0);
    if (!s->media) return;
    for (int i = 0; i < n; i++) {
        for (int k = 0; k < j->sheets; k++) for (int d = 0; d < 3; d++)
            b->light[k].v[d][i] = b->light[k].v[d][i] * b->clear[i] + b->glow[k].v[d][i];
        b->alpha[i] = 1 - (1 - b->alpha[i]) * b->clear[i];
    }
}
static void centres(Job *j, int top, int bottom, int first, int last, float *picture) {
    const Stage *e = j->stage;
    size_t plane = (size_t)(bottom - top) * (size_t)e->width, at[BEAM];
    double across[BEAM], down[BEAM];
    Beam b;
    j->means = e->count > 0;
    for (int row = first; row < last; row += TILE) for (int left = 0; left < e->width; left += TILE) {
        int n = 0;
        for (int y = row; y < row + TILE && y < last; y += 2)  // in pairs of rows, so that packets are compact
            for (int x = left; x < left + TILE && x < e->width; x++)
                for (int k = y; k < y + 2 && k < last; k++) {
                    across[n] = x + 0.5; down[n] = k + 0.5;
                    at[n++] = (size_t)(k - top) * (size_t)e->width + (size_t)x;
                }
        rays_to(e, across, down, n, &b.way);
        shade_block(j, &b, n);
        for (int i = 0; i < n; i++) {
            for (int d = 0; d < 3; d++) picture[(size_t)d * plane + at[i]] = b.light[0].v[d][i];
            picture[3 * plane + at[i]] = b.alpha[i];
            for (int d = 0; d < 3 && j->sheets > 1; d++) picture[(size_t)(4 + d) * plane + at[i]] = b.light[1].v[d][i];
        }
    }
}
// Write pixels, premultiplied and linear, in sRGB, with straight alpha where the background is transparent.
static void written(Job *j, const F *sum, int n, const size_t *at, float *out) {
    int channels = j->stage->transparent ? 4 : 3;
    F value[4], whole = max2(sum[3], all(1e-6f)), wrong = all(0);
    for (int d = 0; d < 3; d++) {
        F x = j->stage->exposure * (channels == 4 ? sum[d] / whole : sum[d]);
        wrong += x - x;
        x = clamp(x, 0, 1);
        F power = exponential(logarithm(max2(x, all(1e-9f))) * (1 / 2.4f));  // IEC 61966-2-1
        value[d] = sel(x <= 0.0031308f, 12.92f * x, 1.055f * power - 0.055f);
        if (channels == 4) value[d] = value[d] * sum[3] / whole;
    }
    value[3] = clamp(sum[3], 0, 1);
    for (int k = 0; k < n; k++) {
        for (int d = 0; d < channels; d++) out[at[k] + (size_t)d] = value[d][k];
        j->bad += !(wrong[k] == 0);
    }
}
// Pixels of a row from x on that differ, nearly as bright as they look, from what lies evenly between their neighbours on
// opposite sides; `at` is the row's first of a plane of the picture.
static int uneven(const Stage *e, const float *picture, size_t plane, int from, int rows, const size_t at[3], int x) {
    F most = all(0);
    int last = e->width - 1, inside = x > 0 && x + W <= last;
    for (int row = from; row < rows; row++) {
        F v[5];  // of pixels, those above, below, left and right
        for (int k = 0; k < 5; k++) {
            const float *of = picture + (size_t)row * plane + at[k < 3 ? k : 0];
            int begin = x + (k > 2) * (2 * k - 7);
            if (inside) v[k] = load(of, begin);
            else for (int w = 0; w < W; w++) v[k][w] = of[begin + w < 0 ? 0 : begin + w > last ? last : begin + w];
            v[k] = root(clamp(row == 3 ? v[k] : v[k] * e->exposure, 0, 1));  // of 3, alpha
        }
        most = greatest(most, size_of(v[3] + v[4] - 2.0f * v[0]), size_of(v[1] + v[2] - 2.0f * v[0]));
    }
    return bits(most > e->contrast);
}
static void finished(Job *j, int top, int bottom, int first, int last, const float *picture, int32_t *pixel, float *out) {
    const Stage *e = j->stage;
    size_t plane = (size_t)(bottom - top) * (size_t)e->width, width = (size_t)e->width, channels = e->transparent ? 4 : 3, at[BEAM];
    int64_t many = (int64_t)(last - first) * e->width, count = 0;
    for (int64_t i = 0; i < many && !e->every; i += W) {
        F sum[4];
        int n = many - i < W ? (int)(many - i) : W;
        for (int d = 0; d < 4; d++) sum[d] = read_row(picture + (size_t)d * plane + (size_t)(first - top) * width, many, i);
        for (int k = 0; k < n; k++) at[k] = channels * (size_t)(i + k);
        written(j, sum, n, at, out);
    }
    if (!e->count) return;
    int from = j->sheets > 1 ? e->transparent ? 3 : 4 : 0, rows = j->sheets > 1 ? 7 : e->transparent ? 4 : 3;
    for (int row = first; row < last; row += LOW) for (int left = 0; left < e->width; left += TILE)
        for (int y = row; y < row + LOW && y < last; y++) for (int x = left; x < left + TILE && x < e->width; x += W) {
            size_t line = (size_t)(y - top) * width, at[3] = {line, y ? line - width : line, y + 1 < e->height ? line + width : line};
            int some = (1 << (e->width - x < W ? e->width - x : W)) - 1;
            for (int m = e->every ? some : some & uneven(e, picture, plane, from, rows, at, x); m; m &= m - 1)
                pixel[count++] = (y - first) * e->width + x + __builtin_ctz((unsigned)m);
        }
    j->refined += count;
    int side = (int)lrint(sqrt((double)e->count)), group = e->count < BEAM ? BEAM / e->count : 1, part = BEAM / group;
    double across[BEAM], down[BEAM];
    Beam b;
    for (int64_t i = 0; i < count; i += group) {
        int n = count - i < group ? (int)(count - i) : group;
        float sum[4][BEAM] = {{0}};
        for (int begin = 0; begin < e->count; begin += part) {
            int each = e->count - begin < part ? e->count - begin : part, m = 0;
            for (int k = 0; k < n; k++) for (int sample = begin; sample < begin + each; sample++) {
                int x = pixel[i + k] % e->width, y = first + pixel[i + k] / e->width;
                across[m] = x + (sample % side + 0.5) / side; down[m++] = y + (sample / side + 0.5) / side;
            }
            rays_to(e, across, down, m, &b.way);
            shade_block(j, &b, m);
            for (int k = 0; k < m; k++) {
                for (int d = 0; d < 3; d++) sum[d][k / each] += b.light[0].v[d][k];
                sum[3][k / each] += b.alpha[k];
            }
        }
        for (int k = 0; k < n; k += W) {
            F mean[4];
            int some = n - k < W ? n - k : W;
            for (int d = 0; d < 4; d++) mean[d] = load(sum[d], k) / (float)e->count;
            for (int w = 0; w < some; w++) at[w] = channels * (size_t)pixel[i + k + w];
            written(j, mean, some, at, out);
        }
    }
}
static void counted(const Job *j, int64_t counts[7]) {
    int64_t all[7] = {j->lights, j->rays, j->steps, j->met, j->refined, j->lost, j->bad};
    memcpy(counts, all, sizeof all);
}
