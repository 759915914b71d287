// Exact distances of leaves in the place of decoders, as scenelang/compiler/geometries.py has them.
#pragma once
#include "scene.h"
#include "vec.h"
#define HALF_CUBE 0.57735027f  // of a box's side
#define CAN 0.70710678f  // radius and half-height of a cylinder
#define LEAN 0.8660254f  // radius of a cone's base
#define TINY 1e-12f

IN F signed_as(F a, F size) { return sel(a < 0.0f, -size, sel(a > 0.0f, size, all(0))); }
IN F length_of(V p) { return root(dot(p, p)); }
// Distances to where levels, distances from orthogonal planes or lines, are all below zero; derivatives by these.
IN F corner(const int count, const F *level, F *by) {
    F highest = level[0], sum = all(0), square = all(0);
    for (int i = 1; i < count; i++) highest = max2(highest, level[i]);
    for (int i = 0; i < count; i++) {
        F above = max2(level[i], all(0));
        sum += above * above;
        by[i] = sel(highest > 0.0f, above, sel(level[i] == highest, all(1), all(0)));
        square += by[i] * by[i];
    }
    F over = 1.0f / root(square);
    for (int i = 0; i < count; i++) by[i] *= over;
    return root(sum) + min2(highest, all(0));
}
IN V around_y(V p, F rho, F by_rho, F by_y) {
    F rate = by_rho / max2(rho, all(TINY));
    return (V){rate * p.x, by_y, rate * p.z};
}
static F formula(int which, V p, int grad, V *g) {
    F rho = root(p.x * p.x + p.z * p.z), by[3], d;
    V r;
    switch (which) {
        case SPHERE: {
            F length = max2(length_of(p), all(TINY));
            d = length - 1.0f; r = scaled(p, 1.0f / length);
            break;
        }
        case TORUS: {
            F ring = rho - 0.7f, tube = max2(root(ring * ring + p.y * p.y), all(TINY));
            d = tube - 0.3f; r = around_y(p, rho, ring / tube, p.y / tube);
            break;
        }
        case BOX: {
            F level[3] = {size_of(p.x) - HALF_CUBE, size_of(p.y) - HALF_CUBE, size_of(p.z) - HALF_CUBE};
            d = corner(3, level, by); r = (V){signed_as(p.x, by[0]), signed_as(p.y, by[1]), signed_as(p.z, by[2])};
            break;
        }
        case CYLINDER: {
            F level[2] = {rho - CAN, size_of(p.y) - CAN};
            d = corner(2, level, by); r = around_y(p, rho, by[0], signed_as(p.y, by[1]));
            break;
        }
        case CONE: {  // two corners that meet: its side between apex and rim, and its base up to the rim
            F along = 0.5f * rho - LEAN * p.y, base[2];
            F level[2] = {LEAN * rho + 0.5f * p.y - 0.5f, size_of(along) - LEAN}, below[2] = {-p.y - 0.5f, rho - LEAN};
            F a = corner(2, level, by), b = corner(2, below, base);
            M side = a >= b;
            F way = sel(along > 0.0f, by[1], -by[1]);
            d = max2(a, b);
            r = around_y(p, rho, sel(side, LEAN * by[0] + 0.5f * way, base[1]), sel(side, 0.5f * by[0] - LEAN * way, -base[0]));
            break;
        }
        case CAPSULE: {
            F beyond = signed_as(p.y, max2(size_of(p.y) - 0.5f, all(0)));
            V q = {p.x, beyond, p.z};
            F length = max2(length_of(q), all(TINY));
            d = length - 0.5f; r = scaled(q, 1.0f / length);
            break;
        }
        default: {  // OCTAHEDRON: outside the projection onto a simplex (Duchi et al. 2008)
            F a = size_of(p.x), b = size_of(p.y), c = size_of(p.z), above = a + b + c - 1.0f;
            F most = max2(max2(a, b), c), least = min2(min2(a, b), c);
            F way = max2(max2(most - 1.0f, 0.5f * (above - least)), above / 3.0f);
            M out = above > 0.0f;
            V q = {sel(out, min2(a, way), all(1)), sel(out, min2(b, way), all(1)), sel(out, min2(c, way), all(1))};
            F length = max2(length_of(q), all(TINY)), over = 1.0f / length;
            d = sel(out, length, above * HALF_CUBE);
            r = (V){signed_as(p.x, q.x * over), signed_as(p.y, q.y * over), signed_as(p.z, q.z * over)};
        }
    }
    if (grad) *g = r;
    return d;
}
