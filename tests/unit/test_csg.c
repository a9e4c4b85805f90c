/* Trees that are bounds outside of their edges and corners (intersections, subtractions), or inside (unions):
 * what they become is compared with the distances to the same solids in closed form, near convex and concave
 * corners, wherever they lie on the lattice. docs/accuracy.md has the bounds. */
#include "fields.h"
#include "testing.h"

#include "field/field.h"

static const double VOXEL = 0.04;

enum { INTERSECTION, SUBTRACTION, UNION, KINDS };

/* A box with, without and beside another one, of which one corner lies in it; moved along its diagonal. */
typedef struct pair {
    int kind;
    truth_solid a, b;
} pair;

static pair pair_of(int kind, double moved) {
    pair p = {kind,
              {TRUTH_BOX, {0.0, 0.0, 0.0}, {0.6, 0.6, 0.6}, 0.0, 0.0},
              {TRUTH_BOX, {0.8, 0.8, 0.8}, {0.6, 0.6, 0.6}, 0.0, 0.0}};
    for (int axis = 0; axis < 3; ++axis) {
        p.a.center[axis] += moved * (1.0 + 0.3 * axis);
        p.b.center[axis] += moved * (1.0 + 0.3 * axis);
    }
    return p;
}

/* Exact everywhere. */
static double distance_to(void *user, const double at[3]) {
    const pair *p = user;
    const double a = truth_solid_distance(&p->a, at), b = truth_solid_distance(&p->b, at);
    truth_solid part = {TRUTH_BOX, {0, 0, 0}, {0, 0, 0}, 0.0, 0.0};
    double outside = INFINITY;
    if (p->kind == INTERSECTION) { /* a box */
        for (int axis = 0; axis < 3; ++axis) {
            part.center[axis] = 0.5 * (p->a.center[axis] + p->b.center[axis]);
            part.half[axis] = 0.2;
        }
        return truth_solid_distance(&part, at);
    }
    if (p->kind == SUBTRACTION) { /* inside it is exact; outside, of the three boxes that are left */
        const double inside = fmax(a, -b);
        for (int axis = 0; axis < 3; ++axis) {
            for (int k = 0; k < 3; ++k) {
                part.center[k] = p->a.center[k] - (k == axis ? 0.2 : 0.0);
                part.half[k] = k == axis ? 0.4 : 0.6;
            }
            outside = fmin(outside, truth_solid_distance(&part, at));
        }
        return inside < 0.0 ? inside : outside;
    }
    return fmin(a, b); /* outside */
}

/* The largest error of a field within two voxels of the surface, in voxels; of a union, outside of it. */
static double worst_of(const vsh_field *field, pair *p) {
    uint64_t counter = 17;
    double worst = 0.0;
    const double *middle = p->a.center;
    for (int i = 0; i < 300000; ++i) {
        const double at[3] = {middle[0] + between(&counter, -0.1, 0.8),
                              middle[1] + between(&counter, -0.1, 0.8),
                              middle[2] + between(&counter, -0.1, 0.8)};
        const double truth = distance_to(p, at);
        float h;
        vsh_field_sample(field, 1, at, &h);
        if (fabs(truth) < 2.0 * VOXEL && (p->kind != UNION || truth > VOXEL)) {
            worst = fmax(worst, fabs((double)h - truth) / VOXEL);
        }
    }
    return worst;
}

static vsh_field *field_of_tree(const pair *p) {
    vsh_sdf_node nodes[3] = {vsh_sdf_node_default(), vsh_sdf_node_default(), vsh_sdf_node_default()};
    const truth_solid *solids[2] = {&p->a, &p->b};
    for (int i = 0; i < 2; ++i) {
        nodes[i].shape = VSH_SDF_BOX;
        memcpy(nodes[i].size, solids[i]->half, sizeof nodes[i].size);
        memcpy(nodes[i].translation, solids[i]->center, sizeof nodes[i].translation);
    }
    nodes[2].shape = p->kind == INTERSECTION  ? VSH_SDF_INTERSECTION
                     : p->kind == SUBTRACTION ? VSH_SDF_SUBTRACTION
                                              : VSH_SDF_UNION;
    nodes[2].left = 0;
    nodes[2].right = 1;
    const vsh_sdf sdf = {nodes, 3};
    const vsh_grid_options options = with_voxel(VOXEL);
    vsh_grid *grid = NULL;
    assert_ok(vsh_grid_from_sdf(&sdf, &options, NULL, &grid, &failure));
    return field_of_grid(grid, 0.0);
}

static vsh_field *field_of_distances(pair *p, int exact) {
    const vsh_distance distance = {distance_to, p, 1.0, exact, {-0.8, -0.8, -0.8}, {1.6, 1.6, 1.6}};
    const vsh_grid_options options = with_voxel(VOXEL);
    vsh_grid *grid = NULL;
    assert_ok(vsh_grid_from_distance(&distance, &options, NULL, &grid, &failure));
    return field_of_grid(grid, 0.0);
}

/* A lattice of the distances themselves interpolates edges and corners with an error of its own; one that is
 * measured anew from the zero of a bound is within 0.02 voxels of that: the
 * points of its mesh may be off by 0.002, and a distance is measured from several. */
TEST(bounds_become_distances_up_to_their_corners) {
    const double phases[] = {0.0, 0.25, 0.5, 0.61};
    for (int kind = 0; kind < KINDS; ++kind) {
        double worst[3] = {0.0, 0.0, 0.0};
        for (int phase = 0; phase < 4; ++phase) {
            pair p = pair_of(kind, phases[phase] * VOXEL);
            vsh_field *fields[3] = {field_of_tree(&p), field_of_distances(&p, 1), field_of_distances(&p, 0)};
            for (int f = 0; f < 3; ++f) {
                worst[f] = fmax(worst[f], worst_of(fields[f], &p));
                vsh_field_free(fields[f]);
            }
        }
        assert_less(worst[0], worst[1] + 0.02);
        assert_less(worst[2], worst[1] + 0.02);
        assert_less(worst[1], 0.5);
    }
}
