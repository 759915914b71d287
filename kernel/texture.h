// Colours of textures at leaf coordinates, linear.
#pragma once
#include "leaf.h"
#define HARD 1e-6f  // of an offset: stops of a gradient that are no farther apart are a hard edge

// Another hue of HSV, in turns, of the same saturation and value.
static V hued(V c, float turns) {
    F value = max2(max2(c.x, c.y), c.z), least = min2(min2(c.x, c.y), c.z), chroma = value - least;
    F sixth = 1.0f / max2(chroma, all(1e-12f));  // of grey, which has no hue, 0 of it is taken
    F green = (c.z - c.x) * sixth + 2.0f, blue = (c.x - c.y) * sixth + 4.0f;
    F hue = sel(value == c.x, (c.y - c.z) * sixth, sel(value == c.y, green, blue)) / 6.0f + (turns - floorf(turns));
    hue = (hue - lower(hue)) * 6.0f;
    return (V){least + chroma * clamp(size_of(hue - 3.0f) - 1.0f, 0, 1),
               least + chroma * clamp(2.0f - size_of(hue - 2.0f), 0, 1),
               least + chroma * clamp(2.0f - size_of(hue - 4.0f), 0, 1)};
}
static V operated(const Texture *t, V c) {
    for (int k = 0; k < t->steps; k++) {
        const float *s = t->step + 4 * k;
        if ((int)s[0] == TINT) c = (V){c.x * s[1], c.y * s[2], c.z * s[3]};
        else if ((int)s[0] == HUE) c = hued(c, s[1]);
        else {
            F luma = 0.2126f * c.x + 0.7152f * c.y + 0.0722f * c.z;
            c = plus(c, (V){s[1] * (luma - c.x), s[1] * (luma - c.y), s[1] * (luma - c.z)});
        }
        c = (V){clamp(c.x, 0, 1), clamp(c.y, 0, 1), clamp(c.z, 0, 1)};
    }
    return c;
}
static V coloured(const Texture *t, V q) {
    F r[3];
    const float *m = t->place;
    F u = m[0] * q.x + m[1] * q.y + m[2] * q.z + m[3], v = m[4] * q.x + m[5] * q.y + m[6] * q.z + m[7];
    if (t->kind == SPACE) {
        V share;
        M first = cell_of(t->wide, cubed(q, 1), &share);
        for (int k = 0; k < 3; k++) r[k] = blended(t->data + (size_t)k * t->wide * t->wide * t->wide, t->wide, first, share);
    } else if (t->kind == PICTURE) {  // which goes on beyond its sides; the first texels are the last once more
        F x = clamp((u - lower(u)) * (float)(t->wide - 2) + 0.5f, 0, t->wide - 2 + 0.5f);
        F y = clamp((v - lower(v)) * (float)(t->high - 2) + 0.5f, 0, t->high - 2 + 0.5f);
        M i = cut(x), j = cut(y), at = j * t->wide + i;
        F a = x - floats(i), b = y - floats(j);
        for (int k = 0; k < 3; k++) {
            const float *from = t->data + (size_t)k * t->wide * t->high;
            F top = gather(from, at), right = gather(from + 1, at);
            F low = gather(from + t->wide, at), corner = gather(from + t->wide + 1, at);
            top += (right - top) * a; low += (corner - low) * a;
            r[k] = top + (low - top) * b;
        }
    } else {
        F s = t->kind == LINEAR ? (u + 1.0f) * 0.5f : root(u * u + v * v);
        const float *stop = t->data;
        for (int k = 0; k < 3; k++) r[k] = all(stop[1 + k]);
        for (int i = 1; i < t->stops; i++) {
            const float *a = stop + 4 * (i - 1), *b = stop + 4 * i;
            float over = b[0] - a[0];
            F share = over > HARD ? clamp((s - a[0]) * (1 / over), 0, 1) : sel(s >= b[0], all(1), all(0));
            for (int k = 0; k < 3; k++) r[k] += share * (b[1 + k] - a[1 + k]);
        }
    }
    return operated(t, (V){r[0], r[1], r[2]});
}
