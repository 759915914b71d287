// Leaves: decoders of distances, and the way from the world to them through maps, turns and skins.
#pragma once
#include "scene.h"
#include "vec.h"
#include "formula.h"
#define RIM 3.0f  // leaf units: decoders see points in this ball, farther ones at its rim
enum { ACROSS = 3, UP = 4, MOST = 5, LEAST = 6 };  // features behind |x|, |y|, |z|

// Norm units: d = max_k |max(W_k f, 0)| + min(max_j V_j f, 0) - r, see scenelang/drawing/solid/norms.py.
IN void levels_of(const Decoder *n, const int features, const F *f, const int grad, F *above, F *sums, F *levels,
                  F *square, F *inside) {
    F x[FEATURES], best = all(0), in = all(-BIG);
    int line = 0;
    for (int i = 0; i < features; i++) x[i] = f[i];
    for (int u = 0; u < n->units; u++) {
        F sum = all(0);
        for (int k = 0; k < n->size[u]; k++, line++) {
            const float *w = n->line[line];
            F v = all(w[7]);
            for (int i = 0; i < features; i++) v += w[i] * x[i];
            v = max2(v, all(0));
            if (grad) above[line] = v;
            sum += v * v;
        }
        if (grad) sums[u] = sum;
        best = max2(best, sum);
    }
    for (int k = 0; k < n->inner; k++, line++) {
        const float *w = n->line[line];
        F v = all(w[7]);
        for (int i = 0; i < features; i++) v += w[i] * x[i];
        if (grad) levels[k] = v;
        in = max2(in, v);
    }
    *square = best; *inside = in;
}
IN F norms(const Decoder *n, V q, const int grad, V *g) {
    F ax = size_of(q.x), ay = size_of(q.y), az = size_of(q.z), f[FEATURES], across = all(1), most = ax, least = ax;
    for (int i = 0; i < n->features; i++) switch (n->feature[i]) {
        case 0: f[i] = ax; break;
        case 1: f[i] = ay; break;
        case 2: f[i] = az; break;
        case ACROSS: f[i] = across = root(q.x * q.x + q.z * q.z); break;
        case UP: f[i] = q.y; break;
        case MOST: f[i] = most = max2(max2(ax, ay), az); break;
        default: f[i] = least = min2(min2(ax, ay), az);
    }
    F above[LINES], sums[UNITS], levels[LINES], square, inside;
    switch (n->features) {  // loops of known length over features stay in registers
        case 1: levels_of(n, 1, f, grad, above, sums, levels, &square, &inside); break;
        case 2: levels_of(n, 2, f, grad, above, sums, levels, &square, &inside); break;
        case 3: levels_of(n, 3, f, grad, above, sums, levels, &square, &inside); break;
        case 4: levels_of(n, 4, f, grad, above, sums, levels, &square, &inside); break;
        default: levels_of(n, n->features, f, grad, above, sums, levels, &square, &inside);
    }
    F length = root(square), d = length - n->radius;
    if (n->inner) d += min2(inside, all(0));
    if (!grad) return d;
    F by[FEATURES], far = 1.0f / max2(length, all(1e-30f));
    int line = 0;
    for (int i = 0; i < n->features; i++) by[i] = all(0);
    M left = ints(-1);  // of units that tell the same one counts
    for (int u = 0; u < n->units; u++) {
        M highest = (sums[u] == square) & left;
        F part = sel(highest, far, all(0));
        left &= ~highest;
        for (int k = 0; k < n->size[u]; k++, line++)
            for (int i = 0; i < n->features; i++) by[i] += n->line[line][i] * (above[line] * part);
    }
    M within = (inside < 0.0f) | (length == 0.0f);  // on a face, rounding may say neither
    for (int k = 0; k < n->inner; k++, line++) {
        F rate = sel((levels[k] == inside) & within, all(1), all(0));
        for (int i = 0; i < n->features; i++) by[i] += n->line[line][i] * rate;
    }
    V r = {all(0), all(0), all(0)};
    F by_across = all(0), by_up = all(0);
    for (int i = 0; i < n->features; i++) switch (n->feature[i]) {
        case 0: r.x += by[i]; break;
        case 1: r.y += by[i]; break;
        case 2: r.z += by[i]; break;
        case ACROSS: by_across = by[i] / max2(across, all(1e-30f)); break;
        case UP: by_up = by[i]; break;
        default: {
            F at = n->feature[i] == MOST ? most : least;
            r.x += sel(ax == at, by[i], all(0)); r.y += sel(ay == at, by[i], all(0)); r.z += sel(az == at, by[i], all(0));
        }
    }
    r = (V){sel(q.x < 0.0f, -r.x, r.x), sel(q.y < 0.0f, -r.y, r.y), sel(q.z < 0.0f, -r.z, r.z)};
    r.x += by_across * q.x; r.z += by_across * q.z; r.y += by_up;
    *g = r;
    return d;
}
// Three layers with SiLU between, of weights that others have replaced; gradients go back through them.
static F silu(const Decoder *n, V q, int grad, V *g) {
    int h = n->width;
    const float *w = n->data, *second = w + 4 * h, *last = second + h * (h + 1);
    F a[2][WIDEST], slope[2][WIDEST], d = all(last[h]);
    for (int layer = 0; layer < 2; layer++)
        for (int j = 0; j < h; j++) {
            F v;
            if (layer) {
                v = all(second[h * h + j]);
                for (int i = 0; i < h; i++) v += second[h * j + i] * a[0][i];
            } else v = w[3 * h + j] + w[3 * j] * q.x + w[3 * j + 1] * q.y + w[3 * j + 2] * q.z;
            F e = exponential(-size_of(v)), s = sel(v < 0.0f, e, all(1)) / (1.0f + e);
            a[layer][j] = v * s;
            slope[layer][j] = s * (1.0f + v - a[layer][j]);
        }
    for (int j = 0; j < h; j++) d += last[j] * a[1][j];
    if (!grad) return d;
    F by[WIDEST];
    for (int j = 0; j < h; j++) a[1][j] = last[j] * slope[1][j];
    for (int i = 0; i < h; i++) {
        by[i] = all(0);
        for (int j = 0; j < h; j++) by[i] += second[h * j + i] * a[1][j];
        by[i] *= slope[0][i];
    }
    V r = {all(0), all(0), all(0)};
    for (int i = 0; i < h; i++) r = plus(r, (V){w[3 * i] * by[i], w[3 * i + 1] * by[i], w[3 * i + 2] * by[i]});
    *g = r;
    return d;
}
// A grid's cell and how far into it points of the cube lie.
IN M cell_of(int side, V q, V *share) {
    float half = 0.5f * (side - 1);
    V at = {(q.x + 1.0f) * half, (q.y + 1.0f) * half, (q.z + 1.0f) * half};
    M x = cut(clamp(at.x, 0, side - 2)), y = cut(clamp(at.y, 0, side - 2)), z = cut(clamp(at.z, 0, side - 2));
    *share = (V){at.x - floats(x), at.y - floats(y), at.z - floats(z)};
    return (x * side + y) * side + z;
}
IN F blended(const float *node, int side, M first, V share) {
    F v[4];
    for (int k = 0; k < 4; k++) {
        M at = first + (k & 1 ? side : 0) + (k & 2 ? side * side : 0);
        F a = gather(node, at), b = gather(node + 1, at);
        v[k] = a + (b - a) * share.z;
    }
    F a = v[0] + (v[1] - v[0]) * share.y, b = v[2] + (v[3] - v[2]) * share.y;
    return a + (b - a) * share.x;
}
// Distances of a grid: at points of the cube, or outside of it the least that what lies inside can have, or, of what
// grows out of the cube, to the point of the surface that is nearest: sought from the nearest point of the cube,
// then along the surface to where it faces the point.
enum { IN_CUBE, LEAST_OUTSIDE, NEAREST_OUTSIDE };
static V change_of(const Decoder *n, V q, int how);
static F grid_at(const Decoder *n, V q) {
    V share;
    M first = cell_of(n->width, q, &share);
    return blended(n->data, n->width, first, share);
}
static V foot(const Decoder *n, V q, V *normal) {
    V slope = change_of(n, q, IN_CUBE);
    *normal = scaled(slope, 1.0f / max2(root(dot(slope, slope)), all(1e-9f)));
    return minus(q, scaled(*normal, grid_at(n, q)));
}
static V away_from(const Decoder *n, V q, F *length) {
    V normal, best = foot(n, cubed(q, 1), &normal), off = minus(q, best);
    F least = root(dot(off, off));
    for (int k = 0; k < 4; k++) {
        V away = minus(q, best), along = minus(away, scaled(normal, dot(away, normal))), turned;
        V found = foot(n, cubed(plus(best, scaled(along, all(0.6f))), 1), &turned);  // 0.6: the surface may be round
        off = minus(q, found);
        F far = root(dot(off, off));
        M nearer = far < least;
        best = choose(nearer, found, best); normal = choose(nearer, turned, normal); least = sel(nearer, far, least);
    }
    *length = least;
    return minus(q, best);
}
static F grid_distance(const Decoder *n, V q, int how) {
    if (how == IN_CUBE) return grid_at(n, q);
    V at = cubed(q, 1), off = minus(q, at);
    F d = grid_at(n, at), beyond = dot(off, off);
    M out = beyond > 0.0f;
    if (!any(out)) return d;
    F far = root(d * d + beyond);
    if (how == NEAREST_OUTSIDE) away_from(n, q, &far);
    return sel(out, far, d);
}
static V change_of(const Decoder *n, V q, int how) {  // over a cell, which hides the edges of cells
    float step = 1.0f / (n->width - 1);
    F r[3], at[3] = {q.x, q.y, q.z};
    for (int k = 0; k < 3; k++) {
        F ends[2], values[2], kept = at[k];
        for (int way = 0; way < 2; way++) {
            at[k] = way ? kept + step : kept - step;
            if (how == IN_CUBE) at[k] = clamp(at[k], -1, 1);
            ends[way] = at[k];
            values[way] = grid_distance(n, (V){at[0], at[1], at[2]}, how);
        }
        at[k] = kept;
        r[k] = (values[1] - values[0]) / (how == IN_CUBE ? ends[1] - ends[0] : all(2 * step));
    }
    return (V){r[0], r[1], r[2]};
}
static F grid(const Decoder *n, V q, int grad, V *g) {
    int how = n->kind == GROWN ? NEAREST_OUTSIDE : LEAST_OUTSIDE;
    F d = grid_distance(n, q, how);
    if (!grad) return d;
    *g = change_of(n, q, how);
    V off = minus(q, cubed(q, 1));
    M out = dot(off, off) > 0.0f;
    if (how == NEAREST_OUTSIDE && any(out)) {
        F length;
        V away = away_from(n, q, &length);
        *g = choose(out, scaled(away, 1.0f / max2(length, all(1e-9f))), *g);
    }
    return d;
}
IN F decoded(const Decoder *n, V q, const int grad, V *g) {
    if (n->kind == NORMS) return norms(n, q, grad, g);
    if (n->kind == FORMULA) return formula(n->width, q, grad, g);
    return n->kind == SILU ? silu(n, q, grad, g) : grid(n, q, grad, g);
}

// Turns: of x and y by twirl |p| + rate x, or of x and z by rate y, in the sense of R.
typedef struct { V at; F cosine, sine, length; } Stepped;
IN V stepped(const Step *s, V p, Stepped *kept) {
    kept->at = p;
    if (s->kind == MAP) return mapped(s->map, p);
    F angle = s->rate * (s->kind == TURN_Z ? p.x : p.y), c, n;
    kept->length = all(1);
    if (s->twirl != 0) { kept->length = root(dot(p, p)); angle += s->twirl * kept->length; }
    sines(angle, &n, &c);
    kept->cosine = c; kept->sine = n;
    if (s->kind == TURN_Z) return (V){c * p.x + n * p.y, c * p.y - n * p.x, p.z};
    return (V){c * p.x + n * p.z, p.y, c * p.z - n * p.x};
}
IN V stepped_back(const Step *s, V g, V after, const Stepped *kept) {  // a gradient
    if (s->kind == MAP) return pulled(s->map, g);
    F c = kept->cosine, n = kept->sine, swing;
    V r;
    if (s->kind == TURN_Z) {
        swing = g.x * after.y - g.y * after.x;  // how it changes with the angle
        r = (V){c * g.x - n * g.y + s->rate * swing, n * g.x + c * g.y, g.z};
    } else {
        swing = g.x * after.z - g.z * after.x;
        r = (V){c * g.x - n * g.z, g.y + s->rate * swing, n * g.x + c * g.z};
    }
    if (s->twirl != 0) r = plus(r, scaled(kept->at, s->twirl * swing / max2(kept->length, all(1e-12f))));
    return r;
}
IN void displaced(const Object *o, V q, F *d, V *g, float amount, const int grad) {
    F sx, sy, sz, cx, cy, cz;
    float f = o->frequency;
    sines(f * q.x, &sx, &cx); sines(f * q.y, &sy, &cy); sines(f * q.z, &sz, &cz);
    *d += amount * (sx * sy * sz);
    if (grad) {
        float k = amount * f;
        *g = plus(*g, (V){k * (cx * sy * sz), k * (sx * cy * sz), k * (sx * sy * cz)});
    }
}
// World distances of an object alone at points behind its map, with their gradients in the world if `grad`, and
// the leaf coordinates there. `far`: whether points may be farther than decoders see.
IN F leaf(const Scene *s, const Object *o, V p, int far, const int grad, V *gradient, V *local) {
    Stepped kept[STEPS];
    V q = p, g, place;
    for (int k = 0; k < o->steps; k++) q = stepped(s->step + o->step + k, q, kept + k);
    F length = all(0), rim = all(1);
    place = *local = q;
    if (far) {
        length = root(dot(q, q)); rim = RIM / max2(length, all(RIM)); place = scaled(q, rim);
    }
    F d = decoded(s->decoder + o->decoder, place, grad, &g);
    if (far) {
        d += max2(length - RIM, all(0));
        if (grad) {
            V n = scaled(q, 1.0f / max2(length, all(1e-9f)));
            F along = dot(g, n);
            V beyond = {rim * (g.x - along * n.x) + n.x, rim * (g.y - along * n.y) + n.y, rim * (g.z - along * n.z) + n.z};
            g = choose(length > RIM, beyond, g);
        }
    }
    float late = o->flags & SKINNED ? o->late : 0;
    if (o->flags & BUMPY && late < 1) displaced(o, q, &d, &g, o->amount, grad);
    if (o->flags & SKINNED) {
        d -= o->first;
        if (o->wall > 0) {
            M in = d < 0.0f;
            d = size_of(d);
            if (grad) g = choose(in, (V){-g.x, -g.y, -g.z}, g);
        }
        d -= o->wall + o->last;
        if (o->flags & BUMPY && late >= 1) displaced(o, q, &d, &g, o->amount, grad);
    }
    if (grad) {
        for (int k = o->steps - 1; k >= 0; k--)
            g = stepped_back(s->step + o->step + k, g, k + 1 < o->steps ? kept[k + 1].at : q, kept + k);
        *gradient = scaled(pulled(o->map, g), all(o->scale));
    }
    return d * o->scale;
}
// Both compiled once, whoever asks: inlined everywhere they took most of the time to compile.
static ONCE F leaf_distance(const Scene *s, const Object *o, V p, int far, V *local) {
    return leaf(s, o, p, far, 0, 0, local);
}
static ONCE F leaf_slope(const Scene *s, const Object *o, V p, int far, V *gradient, V *local) {
    return leaf(s, o, p, far, 1, gradient, local);
}
