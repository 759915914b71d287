// The flat tables of a scene, as scenelang/drawing/tables.py fills them and has checked them; its dtypes mirror these.
// Distances are in world units, or in leaf units behind an object's way to its leaf. Matrices lie row by row.
#pragma once
#include <stdint.h>
enum { DEEP = 15, REGISTER = 12, CELL_ROWS = 5, FEATURES = 7, UNITS = 8, LINES = 27, WIDEST = 32, STEPS = 9 };
enum { DRAWS = 1, CLIPS = 2, BEGINS = 4, BOXED = 8, SKINNED = 16, BUMPY = 32, STOPS = 64, MEDIUM = 128, WIDER = 256 };
enum { MAP, TURN_Z, TURN_Y };  // kinds of steps
enum { NORMS, SILU, GRID, GROWN, FORMULA };  // kinds of decoders
enum { SPHERE, TORUS, BOX, CYLINDER, CONE, CAPSULE, OCTAHEDRON };  // formulas
enum { PICTURE, SPACE, LINEAR, RADIAL };  // kinds of textures
enum { TINT, GREY, HUE };  // operations on a colour

typedef struct {  // one object
    float map[12];  // into the space in which it lies in a ball about the origin
    float scale;  // world distance per leaf distance
    float reach, moved;  // a leaf ball of radius r lies in one of radius reach r + moved behind the map
    float radius;  // leaf units beyond which it changes nothing
    float ball;  // radius of the ball around that behind the map
    float rate;  // at which its distance changes in that at most, per step of 1 behind the map
    float centre[3], extent;  // a ball of the world around that
    float low[3], high[3];  // a box behind the map, of a `BOXED` one
    float amount, frequency;  // of a displacement
    float first, wall, last, late;  // of a skin: |d - first| - wall - last
    float detail;  // texels that a way of a world unit may cross, 0 for none
    float look[REGISTER];
    int32_t flags, ends, decoder, step, steps, texture, depth, path[DEEP];
} Object;
typedef struct { int32_t kind; float twirl, rate, map[12]; } Step;
typedef struct {
    int32_t kind;
    int32_t units, size[UNITS], inner, features, feature[FEATURES];  // of norm units: lines of each, lines inside
    int32_t width;  // units of a hidden layer, nodes along an axis of a grid, or which formula
    float radius, line[LINES][8];  // weights of the features that there are; the last is the bias
    const float *data;  // weights of layers, or nodes
} Decoder;
typedef struct {  // gates: that of distance, two of colour, two of the kind of material
    float own[CELL_ROWS], past[CELL_ROWS], bias[CELL_ROWS], candidate, bump;
    int32_t smooth;
} Cell;
typedef struct {
    int32_t kind, wide, high, stops, steps;  // sides of texels, or of colours of space; numbers of stops and steps
    float place[8];  // from leaf coordinates to the picture
    const float *data, *step;  // texels (3, high, wide), nodes (3, n, n, n) or stops (k, 4); steps (k, 4)
} Texture;
typedef struct { int32_t ray; float begin, end, before, sigma; } Piece;  // of a ray in media; optical depth before it over sigma
typedef struct {
    int32_t objects, groups, deepest, rows, switched, clipping;  // rows of the register; the last that come with a kind
    int32_t media, mixed;  // whether there are media, and opaque things too
    int32_t hues, dense, coloured;  // rows of colours; whether media have different extinctions, and colours
    float sigma, reach;  // the extinction of all media, where it is one; how far around objects distances hold
    const Object *object;
    const Step *step;
    const Decoder *decoder;
    const Cell *cell;  // of the objects, then of the groups
    const Texture *texture;
} Scene;
typedef struct { float at[3], power[3], radius; } Lamp;  // 0 of a point; power times colour
typedef struct {
    double forward[3], right[3], up[3], px;  // of the camera, of a picture that is 2 wide where `forward` ends; a pixel's side
    float eye[3], horizon[3], zenith[3], ground[3], floor, gap, ambient[2], fade, nearest, lift, contrast, deep[3], exposure;
    // `deep` tells how wide that picture's half is at a point; all light counts times `exposure` where it is encoded
    int32_t lamps, grounded, transparent, glow;  // `glow`: the first row of the register that tells it, 0 for none
    int32_t width, height, count, every, nodes;  // samples of a pixel that differs, or of every one; nodes of a way in a medium
    const Lamp *lamp;
    const Scene *opaque, *hazy;  // what is opaque alone, and what is not, as lamps of a radius ask
} Stage;
typedef struct { float p[3], n[3], sent[3], colour[3], weight; } Node;  // of the light
typedef struct {  // light from everywhere, as scenelang/drawing/solid/around.py makes it
    float low[3], side;  // of cells, which know `near` nodes each for the six ways that they face
    float horizon[3], zenith[3], floor, fade;
    float scale, warp;  // of the nodes of the ground, `ground` along both axes from `first` on
    float corner[3], spacing;  // of the lattice of media, of `sides` nodes
    int32_t nodes, first, near, counts[3], ground, grounded, hollow, lamps, sides[3], steps, discs;
    const Node *node;
    const int32_t *index;  // nodes of cells, and for hollows whether no wall is between each and the first
    const uint8_t *alike;
    const float *about;  // places, normals and weights (7, 16) of the nodes of cells
    const float *lamp, *haze, *disc;  // places, powers and radii; light and density; places, normals, light and areas
} Around;

// The plane: rows of scenelang/drawing/tables.py's PlaneTables.
enum { FEATURES_2D = 10, LINE_2D = 11, OUTLINE_WORDS = 64 };
typedef struct { int32_t kind; float steep, rate, number[6]; } FlatStep;  // how far it takes points apart at most, and turns
typedef struct {  // an object of the plane
    float scale, reach, calm;  // as of `Object`; 1 over how much faster than 1 its distance changes at most
    float low[2], high[2];  // a box of the world outside which it changes nothing
    float first, wall, last, colour[4];  // of a skin; premultiplied, and opacity
    int32_t flags, leaf, step, steps, texture, depth, path[DEEP];
} Shape;
typedef struct {
    int32_t kind;
    int32_t units, size[UNITS + 1], inner, features, feature[FEATURES_2D];  // lines of the notch, and of each unit
    int32_t width, side;  // nodes along an axis of a grid, or pieces of an outline, and cells along an axis of its grid
    float radius, slope, line[LINES][LINE_2D], steep[LINES], whole[UNITS + 1];  // bounds on how fast all these change
    const float *data;
    const int32_t *first, *near;  // where the list of each of an outline's cells begins, and the lists of pieces
    const float *posts;  // of each cell a point, x and y, and its winding number, in three rows
    const int32_t *begins, *passing;  // the same of pieces that pass it, as twice their number, and 1 where its post is left
} Leaf;
typedef struct { int32_t flags; float own[3], past[3], bias[3], candidate, bump, width, stretch; } Joint;  // a cell
typedef struct {
    int32_t objects, groups, deepest, clear, traced, rounded;
    float slope, empty, over_unit;  // of coverage by the state, the state before the first object, world units of 1
    const Shape *shape;
    const FlatStep *step;
    const Leaf *leaf;
    const Joint *joint;  // of the objects, then of the groups
    const Texture *texture;
} Flat;
typedef struct {  // a picture: its first pixel's middle and the step to the next, how to ask, and places of samples
    double west, north, step;
    int32_t width, height, samples, count, channels;
    float px, corner, near, extent, background[3], place[32];
} Page;
