// The fold: states of packets of points, which take in objects in turn by the cell, and groups as they end.
#pragma once
#include "texture.h"
#define EMPTY 100.0f  // world units: the distance where nothing has been met
#define JUMP 0.03f  // of media that differ: linear colours and extinction
#define EQUAL 2e-6f  // world units: surfaces so near each other lie in one plane
#define NEARLY 1e-4f  // and a point so near them is on them
#define NOTHING 10.0f  // how far a group with nothing in it is at most for what it is taken in by
enum { DISTANCE, GRADIENT = 1, REGISTER_ = 2, OWNER = 4, ALL = 7, KIND = 8 };  // what is asked, known to the compiler

typedef struct {
    F d;
    V g;
    F look[REGISTER];
    M owner;
    F kind, change;  // 1 in a medium; a bound on how far another object's material may begin
} State;
typedef struct {
    State state[1 + DEEP];  // of all, then of the groups that are open
    M met[1 + DEEP], touched;  // points that met something: in each group, and at all
    int level;
    const Object *last;
    int64_t pairs;
} Fold;

IN State nothing(const Scene *s, const int wanted) {
    State r;
    r.d = all(EMPTY);
    r.g = (V){all(0), all(0), all(0)};
    r.owner = ints(0);
    if (wanted & REGISTER_) for (int k = 0; k < s->rows; k++) r.look[k] = all(0);
    if (wanted & KIND) { r.kind = all(0); r.change = all(EMPTY); }
    return r;
}
// How much media with such registers differ.
IN F unlike(const Scene *s, const F *a, const F *b) {
    F r = all(0);
    if (s->coloured) for (int k = s->hues - 3; k < s->hues; k++) r += size_of(a[k] - b[k]);
    if (s->dense) r += size_of(a[s->rows - s->switched] - b[s->rows - s->switched]);
    return r;
}
// Let a state take in an operand where `in` holds.
IN void join(const Scene *s, const Cell *c, State *a, const State *x, M in, const int wanted) {
    F take = clamp(c->own[0] * x->d + c->past[0] * a->d + c->bias[0], 0, 1), keep = 1.0f - take;
    F after = take * (x->d * c->candidate - keep * c->bump) + keep * a->d;
    if (wanted & GRADIENT) {
        F rate = x->d * c->candidate - a->d - (1.0f - 2.0f * take) * c->bump;
        rate = sel((take > 0.0f) & (take < 1.0f), rate, all(0));
        F own = take * c->candidate + rate * c->own[0], past = keep + rate * c->past[0];
        a->g = choose(in, plus(scaled(x->g, own), scaled(a->g, past)), a->g);
    }
    if (wanted & (REGISTER_ | OWNER | KIND)) {
        F kind = max2(c->own[3] * x->d + c->past[3] * a->d + c->bias[3], c->own[4] * x->d + c->past[4] * a->d + c->bias[4]);
        M differ = wanted & KIND ? size_of(a->kind - x->kind) > 0.5f : ints(0);
        if ((wanted & KIND) && (wanted & REGISTER_)) differ |= (a->kind + x->kind > 1.0f) & (unlike(s, a->look, x->look) > JUMP);
        M shows = in;  // on surfaces in one plane the earlier one's material, whichever rounding puts in front
        if ((wanted & REGISTER_) && !(wanted & KIND) && !c->smooth) {
            M opaque = (a->look[s->rows - 1] < 0.5f) & (x->look[s->rows - 1] < 0.5f);
            shows &= ~(opaque & (size_of(a->d - x->d) < EQUAL) & (size_of(x->d) < NEARLY));
        }
        if (wanted & REGISTER_) {
            F paint = max2(c->own[1] * x->d + c->past[1] * a->d + c->bias[1], c->own[2] * x->d + c->past[2] * a->d + c->bias[2]);
            F gates[2] = {sel(shows, clamp(paint, 0, 1), all(0)), sel(shows, clamp(kind, 0, 1), all(0))};
            for (int k = 0; k < s->rows; k++)
                a->look[k] += gates[k >= s->rows - s->switched] * (x->look[k] - a->look[k]);
        }
        M held = shows & (kind > 0.5f);
        if (wanted & KIND) {
            F room = size_of(x->d);  // within which the operand leaves the kind of material, or the medium, as it is
            if (c->smooth) room = min2(room, 0.5f * size_of(a->d - x->d));
            room = min2(sel(differ, room, all(EMPTY)), x->change);
            a->change = sel(in, min2(a->change, room), a->change);
            a->kind += sel(in, clamp(kind, 0, 1), all(0)) * (x->kind - a->kind);
        }
        if (wanted & OWNER) a->owner = (x->owner & held) | (a->owner & ~held);
    }
    a->d = sel(in, after, a->d);
}
IN void fold_open(const Scene *s, Fold *f, const int wanted) {
    f->state[0] = nothing(s, wanted);
    f->met[0] = f->touched = ints(0);
    f->level = 0; f->last = 0; f->pairs = 0;
}
// End groups until so many are open: what each comes to goes into the state that it stands in.
IN void fold_close(const Scene *s, Fold *f, int level, const int wanted) {
    for (; f->level > level; f->level--) {
        State *x = f->state + f->level;
        x->d = min2(x->d, all(NOTHING));
        join(s, s->cell + s->objects + f->last->path[f->level - 1], x - 1, x, f->met[f->level], wanted);
        f->met[f->level - 1] |= f->met[f->level];
    }
}
// Let points, given behind an object's map, meet it where `in` holds. Objects come in order.
IN void fold_take(const Scene *s, Fold *f, const Object *o, V p, M in, int far, const int wanted) {
    if (!(o->flags & DRAWS)) {  // it changes only what is there
        in &= f->touched;
        if (!any(in)) return;
    }
    if (s->deepest) {
        int common = 0;
        if (f->last) while (common < o->depth && common < f->last->depth && o->path[common] == f->last->path[common]) common++;
        fold_close(s, f, common, wanted);
        while (f->level < o->depth) {
            f->state[++f->level] = nothing(s, wanted);
            f->met[f->level] = ints(0);
        }
    }
    f->last = o;
    State x;
    V local;
    x.d = wanted & GRADIENT ? leaf_slope(s, o, p, far, &x.g, &local) : leaf_distance(s, o, p, far, &local);
    if (wanted & REGISTER_) {
        for (int k = 0; k < s->rows; k++) x.look[k] = all(o->look[k]);
        if (o->texture >= 0 && !(wanted & KIND)) {  // rays tell media apart by plain colours
            V c = coloured(s->texture + o->texture, local);
            x.look[0] = c.x; x.look[1] = c.y; x.look[2] = c.z;
        }
    }
    if (wanted & KIND) { x.kind = all(o->look[s->rows - 1]); x.change = all(EMPTY); }
    if (wanted & OWNER) x.owner = ints(1 + (int)(o - s->object));
    join(s, s->cell + (o - s->object), f->state + f->level, &x, in, wanted);
    f->met[f->level] |= in;
    f->touched |= in;
    f->pairs += __builtin_popcount(bits(in));
}
