// What Python calls, for one kind of processor: `NAME` adds its name. No globals; scratch comes from the caller.
#include "band.h"
#include "light.h"
#include "plane.h"
#ifndef NAME
#define NAME(x) x
#endif

// Bytes of scratch that calls need.
int64_t NAME(scratch)(const Scene *s) {
    int64_t light = 192 + (int64_t)(sizeof(Slot) + sizeof(int32_t)) * (s->objects + 1) + 2 * (int64_t)sizeof(Level);
    return light > room_of(s) ? light : room_of(s);
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
        q = read_points(p, n, n, i);
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
        q = read_points(p, n, n, i);
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
        to = read_points(way, n, n, i);
        if (origins == 1) from = (V){all(p[0]), all(p[1]), all(p[2])};
        else from = read_points(p, n, n, i);
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
        c.way = read_points(way, n, n, i);
        c.normal = read_points(normal, n, n, i);
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
// Scratch of rays that gather, which see media of all colours alike.
static Gather gathering(const Scene *s, const Around *a, void *scratch) {
    Gather w = {*s, a, aligned(scratch), 0, 0, 0, 0};
    w.scene.coloured = 0;
    w.list = (int32_t *)(w.slot + s->objects + 1);
    w.level = aligned(w.list + s->objects + 1);
    for (int i = 0; i < s->objects; i++) w.list[i] = i;
    return w;
}
// Light (6, n) from everywhere, as of `gathered`, that n points with unit normals (3, n) receive by so many rays; or, unless
// `begin` (n + 1) is null, the parts of nodes that they see, from where the first begins on. Counts are of rays and of pairs
// of points and objects.
void NAME(around)(const Scene *s, const Around *a, int64_t n, const float *p, const float *normal, const float *turn, int32_t rays,
                  int32_t finer, float *light, int64_t *begin, int32_t *index, float *share, float *row, int64_t counts[2],
                  void *scratch) {
    Gather w = gathering(s, a, scratch);
    gathered(&w, w.level, n, n, p, normal, turn, rays, finer, light, begin ? &(Exchange){begin, index, share, row} : 0);
    counts[0] = w.rays; counts[1] = w.met;
}
// Light (3, n) that comes to n points (3, n) from unit directions, without media, and from how far (n).
void NAME(arriving)(const Scene *s, const Around *a, int64_t n, const float *p, const float *way, int32_t finer, float *light,
                    float *reach, void *scratch) {
    Gather w = gathering(s, a, scratch);
    for (int64_t from = 0; from < n; from += BEAM) {
        int some = (int)(n - from < BEAM ? n - from : BEAM);
        for (int d = 0; d < 3; d++) for (int i = 0; i < some; i++) {
            w.level->ray.from.v[d][i] = p[d * n + from + i];
            w.level->ray.way.v[d][i] = way[d * n + from + i];
        }
        brought(&w, w.level, some, finer);
        for (int d = 0; d < 3; d++) memcpy(light + d * n + from, w.level->light.v[d], 4 * (size_t)some);
        memcpy(reach + from, w.level->reach, 4 * (size_t)some);
    }
}
// Light of what glows at n points, as of `glowing`; the number of rays that there was room for.
int64_t NAME(glowing)(const Scene *s, const Around *a, int64_t n, const float *p, const float *normal, float worth, float *light,
                      float *free, int32_t *point, float *ray, int64_t room, void *scratch) {
    Gather w = gathering(s, a, scratch);
    int64_t count = 0;
    glowing(&w, n, p, normal, worth, light, free, point, ray, room, &count);
    return count;
}
// Light (3, n) of media along n rays from points (3, n) from as far as a reach (n), and what these let through (n).
void NAME(haze)(const Scene *s, const Around *a, int64_t n, const float *p, const float *way, const float *reach, float *light,
                float *clear, void *scratch) {
    Level *l = gathering(s, a, scratch).level;
    for (int64_t from = 0; from < n; from += BEAM) {
        int some = (int)(n - from < BEAM ? n - from : BEAM);
        for (int d = 0; d < 3; d++) for (int i = 0; i < BEAM; i++) {
            int64_t j = from + (i < some ? i : some - 1);
            l->ray.from.v[d][i] = p[d * n + j]; l->ray.way.v[d][i] = way[d * n + j]; l->reach[i] = reach[j];
        }
        haze_of(a, l, some);
        for (int d = 0; d < 3; d++) memcpy(light + d * n + from, l->haze.v[d], 4 * (size_t)some);
        memcpy(clear + from, l->clear, 4 * (size_t)some);
    }
}
// Light of media along parallel lines through the n nodes of a lattice, from each to the next, `far` on in a row of all: of
// sources here and there, what joins, what surfaces between send back of the light that was, and the part of the next one's
// that comes through. A share of it is added to the result.
void NAME(passed_on)(int64_t n, int64_t far, float share, const float *here, const float *next, const float *clear, const Q *base,
                      const Q *surface, const Q *source, const Q *light, Q *along, Q *result) {
    for (int64_t k = 0; k < n; k++) {
        int64_t i = far > 0 ? n - 1 - k : k, on = i + far;
        Q sum = here[i] * source[i] + base[i];
        if (surface) sum += surface[i] * light[i];
        if (on >= 0 && on < n) sum += next[i] * source[on] + clear[i] * along[on];
        along[i] = sum;
        result[i] += share * sum;
    }
}
// Rows of values (rows, n) of a lattice's points (3, n) that planes have, by least squares over the points so many steps
// around that lie on the same surface; parts 1 and 2 are how much a plane rises to the next point across and down.
void NAME(evened)(const View *v, const float *p, const float *normal, int rows, const float *values, int step, int part, float *out) {
    int32_t columns = (int32_t)v->columns, many = (int32_t)v->rows;
    int64_t n = (int64_t)columns * many;
    for (int64_t i = 0; i < n; i += W) {
        V q = read_points(p, n, n, i), up = read_points(normal, n, n, i);
        F side = max2(dot(minus(q, constant(v->eye)), constant(v->forward)), all(1e-6f)) * (v->step / v->scale * step);
        F fit[9], whole = all(0), x = all(0), y = all(0), xx = all(0), xy = all(0), yy = all(0), share = all(0);
        M at[9];
        for (int k = 0; k < 9; k++) {
            int right = k % 3 - 1, down = k / 3 - 1;
            for (int w = 0; w < W; w++) {
                int32_t j = (int32_t)(i + w < n ? i + w : n - 1), c = j % columns + step * right, r = j / columns + step * down;
                at[k][w] = (r < 0 ? 0 : r < many ? r : many - 1) * columns + (c < 0 ? 0 : c < columns ? c : columns - 1);
            }
            fit[k] = on_one(q, up, gathered3(p, n, at[k]), gathered3(normal, n, at[k]), side) * (float)((right ? 1 : 2) * (down ? 1 : 2));
            whole += fit[k];
        }
        whole = 1.0f / max2(whole, all(1e-9f));
        for (int k = 0; k < 9; k++) {
            float right = (float)(k % 3 - 1), down = (float)(k / 3 - 1);
            fit[k] *= whole;
            x += fit[k] * right; y += fit[k] * down;
            xx += fit[k] * (right * right + LEVEL); xy += fit[k] * (right * down); yy += fit[k] * (down * down + LEVEL);
        }
        F less = 1.0f / max2(xx * yy - xy * xy, all(LEVEL * LEVEL));
        for (int k = 0; k < 9; k++) {
            float right = (float)(k % 3 - 1), down = (float)(k / 3 - 1);
            F across = fit[k] * less * (yy * right - xy * down), below = fit[k] * less * (xx * down - xy * right);
            fit[k] = part == 1 ? across : part == 2 ? below : fit[k] - x * across - y * below;
            share += fit[k];
        }
        if (part) fit[4] -= share;
        else for (int k = 0; k < 9; k++) fit[k] /= max2(share, all(1e-9f));
        for (int row = 0; row < rows; row++) {
            F sum = all(0);
            for (int k = 0; k < 9; k++) sum += fit[k] * gather(values + row * n, at[k]);
            store(out + row * n, n, i, sum);
        }
    }
}
// What points (3, n) with unit normals have of `values` of a lattice, on the same surface. With some corners of a cell
// elsewhere, the others tell how values go on. A point of `seen` is a place, a normal, values, and how these change from it
// to the next across, and down. `fits` tells where a corner is.
void NAME(between)(int64_t n, const float *p, const float *normal, const View *view, const float *seen, int values, float *out,
                    int32_t *fits) {
    int row = 6 + 3 * values;
    float step = view->step, columns = view->columns, rows = view->rows;
    for (int64_t i = 0; i < n; i += W) {
        V q = read_points(p, n, n, i), up = read_points(normal, n, n, i), off = minus(q, constant(view->eye));
        F ahead = max2(dot(off, constant(view->forward)), all(1e-6f)), side = ahead * (step / view->scale);
        F u = clamp((view->scale * dot(off, constant(view->right)) / ahead + view->middle[0]) / step, 0, columns - 1.001f);
        F v = clamp((view->middle[1] - view->scale * dot(off, constant(view->up)) / ahead) / step, 0, rows - 1.001f);
        F total = all(0), most = all(0), across = all(0), down = all(0), sum[18];
        for (int k = 0; k < 3 * values; k++) sum[k] = all(0);
        for (int corner = 0; corner < 4; corner++) {
            F x = min2(lower(u) + (float)(corner >> 1), all(columns - 1)), y = min2(lower(v) + (float)(corner & 1), all(rows - 1));
            M at = cut(y * columns + x) * row;
            F fit = on_one(q, up, gathered3(seen, 1, at), gathered3(seen + 3, 1, at), side);
            F weight = fit * (max2(1.0f - size_of(u - x), all(0)) * max2(1.0f - size_of(v - y), all(0)) + 0.02f);
            total += weight; most = max2(fit, most);
            across += weight * (u - x); down += weight * (v - y);
            for (int k = 0; k < 3 * values; k++) sum[k] += weight * gather(seen + 6 + k, at);
        }
        F each = 1.0f / max2(total, all(1e-9f));
        for (int k = 0; k < values; k++)
            store(out + k * n, n, i, max2((sum[k] + (across * sum[values + k] + down * sum[2 * values + k]) * each) * each, all(0)));
        store((float *)fits, n, i, (F)(most > 0.5f));
    }
}
// Where n lines from points (3, n) all the way (3, n) meet the surfaces of objects alone, by their numbers: lines and how far
// along, from 0 to 1, as many as there is room for; their number. Steps are as long as the distance, which changes at rates
// (n) at most, and at least so small a part (n) of a line.
int64_t NAME(crossings)(const Scene *s, int64_t n, const int32_t *object, const float *p, const float *way, const float *rate,
                        const float *least, int64_t room, int32_t *line, float *along) {
    int64_t count = 0;
    for (int64_t i = 0, end; i < n; i = end) {
        const Object *o = s->object + object[i];
        for (end = i; end < n && end < i + W && object[end] == object[i];) end++;
        V from, to, local;
        F slowest, part, t = all(0);
        M alive;
        for (int k = 0; k < W; k++) {
            int64_t j = i + k < end ? i + k : end - 1;
            from.x[k] = p[j]; from.y[k] = p[n + j]; from.z[k] = p[2 * n + j];
            to.x[k] = way[j]; to.y[k] = way[n + j]; to.z[k] = way[2 * n + j];
            slowest[k] = 1 / rate[j]; part[k] = fmaxf(least[j], 1e-4f); alive[k] = i + k < end ? -1 : 0;
        }
        from = mapped(o->map, from); to = times(o->map, to);
        F d = leaf_distance(s, o, from, 1, &local);
        while (any(alive)) {
            F step = max2(size_of(d) * slowest, part), past = leaf_distance(s, o, plus(from, scaled(to, t + step)), 1, &local);
            for (int m = bits(alive & ((past < 0.0f) ^ (d < 0.0f))); m; m &= m - 1) {
                int k = __builtin_ctz((unsigned)m);
                if (count < room) { line[count] = (int32_t)(i + k); along[count] = t[k] + step[k] * d[k] / (d[k] - past[k]); }
                count++;
            }
            t += step; d = past;
            alive &= t < 1.0f;
        }
    }
    return count;
}
// Light (3, n) of a lamp of power 1 and a radius that rough mirrors at n points with unit normals send back if nothing is in
// its way; of roughness (n), unit ways back (3, n) and what they reflect along the normal (3, n).
void NAME(mirrored)(int64_t n, const float *at, float radius, const float *p, const float *normal, const float *rough,
                    const float *back, const float *straight, float *light) {
    V lamp = {all(at[0]), all(at[1]), all(at[2])};
    for (int64_t i = 0; i < n; i += W) {
        V q, up, to, part;
        F uneven;
        q = read_points(p, n, n, i); up = read_points(normal, n, n, i); to = read_points(back, n, n, i); part = read_points(straight, n, n, i);
        for (int k = 0; k < W; k++) uneven[k] = rough[i + k < n ? i + k : n - 1];
        V r = mirrored(lamp, radius, q, up, uneven, to, part);
        store(light, n, i, r.x); store(light + n, n, i, r.y); store(light + 2 * n, n, i, r.z);
    }
}
// What n nodes receive (n, 3) where nodes send (nodes, 3), by the parts of these that they see.
void NAME(exchanged)(int64_t n, const int64_t *begin, const int32_t *index, const float *share, const float *sent, float *received) {
    for (int64_t j = 0; j < n; j++) {
        float sum[3] = {0, 0, 0};
        for (int64_t k = begin[j]; k < begin[j + 1]; k++) for (int d = 0; d < 3; d++) sum[d] += share[k] * sent[3 * index[k] + d];
        for (int d = 0; d < 3; d++) received[3 * j + d] = sum[d];
    }
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
