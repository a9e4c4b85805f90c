/* Prints the table of src/shade/ao.c and its remaining errors. The table gives the open share of an AO cone
 * from its closest approach to the casters and from the openness of its neighbours, fitted to analytic rays.
 * The scenes (boxes, slats, spheres, closed rooms) are only used for this. Run it after a change of the
 * cones' directions or widths. Cones march the field without vshi_shade_grown(): fitted with it, sixteen
 * cones were 0.001 brighter on the cloister. */
#include "analytic.h"
#include "shade/ao.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <vdbshade/vdbshade.h>

enum { EDGE = VSHI_AO_TABLE_EDGE, CELLS = EDGE * EDGE, POINTS = 1500, RAYS = 1024, MAX_SCENES = 16 };

typedef struct sample_set {
    const char *name;
    vsh_field *field;
    double distance, weight, start;
    size_t count;
    double positions[3 * POINTS];
    float normals[3 * POINTS];
    float truth[POINTS];
} sample_set;

/* Least squares for the table: a x = b, rising along both axes. */
typedef struct normal_equations {
    double a[CELLS][CELLS], b[CELLS];
} normal_equations;

static double uniform(uint64_t *counter) {
    uint64_t z = (*counter += 0x9e3779b97f4a7c15u);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return (double)((z ^ (z >> 31)) >> 11) * 0x1p-53;
}

static void check(vsh_result result, const vsh_error *error) {
    if (result != VSH_OK) {
        fprintf(stderr, "fit_ao: %s\n", error->message);
        exit(2);
    }
}

static vsh_field *field_of(const vsh_sdf *sdf, double voxel) {
    vsh_grid_options options = vsh_grid_options_default();
    options.voxel_size = voxel;
    vsh_error error;
    vsh_grid *grid;
    vsh_field *field;
    check(vsh_grid_from_sdf(sdf, &options, NULL, &grid, &error), &error);
    check(vshi_field_create(grid, NULL, NULL, &field, &error), &error);
    vsh_grid_free(grid);
    return field;
}

static vsh_field *field_of_solids(truth_scene scene, double voxel) {
    vsh_sdf_node nodes[64];
    size_t count = 0;
    int32_t last = -1;
    for (size_t i = 0; i < scene.count; ++i) {
        const truth_solid *solid = &scene.solids[i];
        vsh_sdf_node node = vsh_sdf_node_default();
        node.shape = solid->shape == TRUTH_SPHERE ? VSH_SDF_SPHERE
                     : solid->shape == TRUTH_BOX  ? VSH_SDF_BOX
                                                  : VSH_SDF_TORUS;
        node.radius = solid->radius;
        node.minor_radius = solid->minor_radius;
        node.rounding = solid->shape == TRUTH_BOX ? solid->radius : 0.0;
        memcpy(node.size, solid->half, sizeof node.size);
        memcpy(node.translation, solid->center, sizeof node.translation);
        nodes[count++] = node;
        if (last >= 0) {
            vsh_sdf_node both = vsh_sdf_node_default();
            both.shape = VSH_SDF_UNION;
            both.left = last;
            both.right = (int32_t)count - 1;
            nodes[count++] = both;
        }
        last = (int32_t)count - 1;
    }
    return field_of(&(vsh_sdf){nodes, count}, voxel);
}

static vsh_field *field_of_room(double wall, double voxel) {
    vsh_sdf_node nodes[3] = {vsh_sdf_node_default(), vsh_sdf_node_default(), vsh_sdf_node_default()};
    nodes[0].shape = nodes[1].shape = VSH_SDF_BOX;
    nodes[0].size[0] = nodes[0].size[1] = nodes[0].size[2] = 1.0 + wall;
    nodes[2].shape = VSH_SDF_SUBTRACTION;
    nodes[2].left = 0;
    nodes[2].right = 1;
    return field_of(&(vsh_sdf){nodes, 3}, voxel);
}

/* Points on the surface, a voxel away from other surfaces; in rooms, on the floor. */
static void place_points(sample_set *set, truth_scene scene, double half, double voxel, uint64_t seed) {
    uint64_t counter = seed;
    while (set->count < POINTS) {
        double p[3], normal[3] = {0.0, 1.0, 0.0};
        for (int k = 0; k < 3; ++k) {
            p[k] = half * (2.0 * uniform(&counter) - 1.0);
        }
        p[1] = scene.count == 0 ? -0.999 : 0.5 * (p[1] + half);
        for (int step = 0; scene.count > 0 && step < 20; ++step) {
            const double h = truth_distance(scene, p);
            double length = 0.0;
            for (int k = 0; k < 3; ++k) {
                double q[3] = {p[0], p[1], p[2]};
                q[k] += 1e-6;
                normal[k] = (truth_distance(scene, q) - h) * 1e6;
                length += normal[k] * normal[k];
            }
            for (int k = 0; k < 3; ++k) {
                normal[k] /= sqrt(length);
                p[k] -= (h - 1e-4) * normal[k];
            }
        }
        double above[3];
        for (int k = 0; k < 3; ++k) {
            above[k] = p[k] + voxel * normal[k];
        }
        if (scene.count > 0 && (fabs(truth_distance(scene, above) - voxel - 1e-4) > 0.02 * voxel ||
                                fabs(p[0]) > 2.0 || fabs(p[2]) > 2.0)) {
            continue;
        }
        for (int k = 0; k < 3; ++k) {
            set->positions[3 * set->count + (size_t)k] = p[k];
            set->normals[3 * set->count + (size_t)k] = (float)normal[k];
        }
        ++set->count;
    }
}

/* Traces rays against the solids themselves, so that the table corrects the rounding of the field on
 * average. */
static void find_truth(sample_set *set, truth_scene scene) {
    for (size_t i = 0; scene.count > 0 && i < set->count; ++i) {
        const float *n = set->normals + 3 * i;
        const double normal[3] = {(double)n[0], (double)n[1], (double)n[2]};
        set->truth[i] = (float)truth_ao(scene, set->positions + 3 * i, normal, set->distance, RAYS);
    }
}

/* For each point: weights of the table's entries over its undecided cones, and the share of free cones. */
typedef struct uses {
    double (*entries)[CELLS];
    double *free;
} uses;

static void add_point(const vshi_ao_cones *cones, const float *close, double *entries, double *free) {
    for (int32_t c = 0; c < cones->count; ++c) {
        const double sine = (double)(float)cones->sines[c];
        if ((double)close[c] >= sine) {
            *free += 1.0 / cones->count;
        } else if ((double)close[c] > -sine) {
            double evidence[2], part[2];
            vshi_ao_cone_evidence(cones, close, c, evidence);
            double *at = entries + vshi_ao_table_cell(evidence, part);
            at[0] += (1.0 - part[0]) * (1.0 - part[1]) / cones->count;
            at[1] += (1.0 - part[0]) * part[1] / cones->count;
            at[EDGE] += part[0] * (1.0 - part[1]) / cones->count;
            at[EDGE + 1] += part[0] * part[1] / cones->count;
        }
    }
}

static uses uses_of(const sample_set *set, const vshi_ao_cones *cones) {
    uses u = {calloc(set->count, sizeof *u.entries), calloc(set->count, sizeof *u.free)};
    vshi_chunk *chunk = malloc(sizeof *chunk);
    if (u.entries == NULL || u.free == NULL || chunk == NULL) {
        exit(4);
    }
    const vsh_points points = {set->count, set->positions, set->normals, NULL};
    vsh_shade_stats stats = vsh_shade_stats_zero();
    for (size_t i = 0; i < set->count; ++i) {
        float close[VSHI_AO_MAX_CONES];
        vshi_vec origin, normal, axes[3];
        vshi_march_stats work = {0, 0};
        vshi_shade_origin(set->field, &points, i, set->start, &origin, &normal);
        vshi_ao_axes(normal, axes);
        chunk->count = 0;
        for (int32_t c = 0; c < cones->count; ++c) {
            const vshi_cone cone = {.origin = origin,
                                    .direction = vshi_ao_direction(axes, cones->directions[c]),
                                    .end = set->distance / set->field->voxel_size,
                                    .sine = cones->sines[c],
                                    .close = cones->sines[c],
                                    .stop = -cones->sines[c]};
            close[c] = (float)cone.close;
            vshi_chunk_add(chunk, set->field, &cone, (uint32_t)c, &stats);
        }
        vshi_kernel_of(VSH_ISA_BEST)->march(set->field, chunk, VSHI_MARCH_PLAIN, 1024, &work);
        for (size_t r = 0; r < chunk->count; ++r) {
            close[chunk->owner[r]] = chunk->close[r];
        }
        add_point(cones, close, u.entries[i], &u.free[i]);
    }
    free(chunk);
    return u;
}

static void add_equations(normal_equations *n, const sample_set *set, const uses *u) {
    const double weight = set->weight / (double)set->count;
    for (size_t i = 0; i < set->count; ++i) {
        const double *e = u->entries[i];
        for (int r = 0; r < CELLS; ++r) {
            if (e[r] > 0.0) {
                for (int c = 0; c < CELLS; ++c) {
                    n->a[r][c] += weight * e[r] * e[c];
                }
                n->b[r] += weight * e[r] * ((double)set->truth[i] - u->free[i]);
            }
        }
    }
}

/* Adds smoothness between neighbouring entries, which decides where there are no samples. */
static void add_smoothness(normal_equations *n, double weight) {
    for (int i = 0; i < CELLS; ++i) {
        const int next[2] = {i % EDGE + 1 < EDGE ? i + 1 : -1, i + EDGE < CELLS ? i + EDGE : -1};
        for (int k = 0; k < 2; ++k) {
            if (next[k] >= 0) {
                n->a[i][i] += weight;
                n->a[next[k]][next[k]] += weight;
                n->a[i][next[k]] -= weight;
                n->a[next[k]][i] -= weight;
            }
        }
    }
}

/* Coordinate descent within 0 … 1, each entry between its neighbours. Fully hidden and fully free cones are
 * known. */
static void solve(const normal_equations *n, double *table) {
    for (int i = 0; i < CELLS; ++i) {
        table[i] = (double)(i / EDGE) / (EDGE - 1);
    }
    for (int sweep = 0; sweep < 20000; ++sweep) {
        for (int i = EDGE; i < CELLS - EDGE; ++i) {
            double rest = n->b[i];
            for (int c = 0; c < CELLS; ++c) {
                rest -= c != i ? n->a[i][c] * table[c] : 0.0;
            }
            double low = 0.0, high = 1.0;
            if (i % EDGE > 0) {
                low = fmax(low, table[i - 1]);
            }
            if (i >= EDGE) {
                low = fmax(low, table[i - EDGE]);
            }
            if (i % EDGE + 1 < EDGE) {
                high = fmin(high, table[i + 1]);
            }
            if (i + EDGE < CELLS) {
                high = fmin(high, table[i + EDGE]);
            }
            table[i] = fmin(high, fmax(low, rest / n->a[i][i]));
        }
    }
}

static void report(const sample_set *set, const uses *u, const double *table) {
    double squares = 0.0, sum = 0.0;
    for (size_t i = 0; i < set->count; ++i) {
        double ao = u->free[i];
        for (int c = 0; c < CELLS; ++c) {
            ao += u->entries[i][c] * table[c];
        }
        squares += (ao - (double)set->truth[i]) * (ao - (double)set->truth[i]);
        sum += ao - (double)set->truth[i];
    }
    printf("  %-9s %.4f %+.4f", set->name, sqrt(squares / (double)set->count), sum / (double)set->count);
}

static sample_set *new_set(const char *name, vsh_field *field, double distance, double weight) {
    sample_set *set = calloc(1, sizeof *set);
    if (set == NULL) {
        exit(4);
    }
    set->name = name;
    set->field = field;
    set->distance = distance;
    set->weight = weight;
    set->start = 0.25;
    return set;
}

enum { BOXES = 12 };

static size_t make_sets(sample_set **sets) {
    static const truth_solid FLOOR = {TRUTH_BOX, {0.0, -0.5, 0.0}, {3.0, 0.5, 3.0}, 0.0, 0.0};
    static truth_solid boxes[2][BOXES + 1], slats[10], balls[BOXES + 1], porch[15];
    size_t count = 0;
    uint64_t counter = 5;
    boxes[0][0] = boxes[1][0] = slats[0] = balls[0] = FLOOR;
    for (int i = 1; i <= BOXES; ++i) {
        for (int thin = 0; thin < 2; ++thin) {
            truth_solid *box = &boxes[thin][i];
            box->shape = TRUTH_BOX;
            for (int k = 0; k < 3; ++k) {
                box->center[k] = 1.8 * (2.0 * uniform(&counter) - 1.0);
                box->half[k] = 0.1 + 0.4 * uniform(&counter);
            }
            box->center[1] = 0.2 + fabs(box->center[1]) * 0.6;
            if (thin) {
                box->half[i % 3] = 0.03 + 0.02 * uniform(&counter);
                box->half[(i + 1) % 3] *= 1.6;
            }
        }
        balls[i] = (truth_solid){TRUTH_SPHERE, {0.0, 0.0, 0.0}, {0.0, 0.0, 0.0}, 0.0, 0.0};
        balls[i].radius = 0.15 + 0.35 * uniform(&counter);
        balls[i].center[0] = 1.8 * (2.0 * uniform(&counter) - 1.0);
        balls[i].center[1] = balls[i].radius + 0.5 * uniform(&counter);
        balls[i].center[2] = 1.8 * (2.0 * uniform(&counter) - 1.0);
    }
    for (int i = 0; i < 8; ++i) {
        slats[1 + i] = (truth_solid){TRUTH_BOX, {-1.05 + 0.3 * i, 0.8, 0.0}, {0.05, 0.05, 2.0}, 0.0, 0.0};
    }
    slats[9] = (truth_solid){TRUTH_BOX, {0.0, 1.4, 0.0}, {1.2, 0.04, 1.2}, 0.0, 0.0};
    /* a yard with an arcade: wall, columns, lintels, a thin roof, a bench and steps */
    const truth_solid parts[15] = {FLOOR,
                                   {TRUTH_BOX, {0.0, 0.7, -2.0}, {2.2, 0.9, 0.15}, 0.0, 0.0},
                                   {TRUTH_BOX, {-2.0, 0.7, 0.0}, {0.15, 0.9, 2.2}, 0.0, 0.0},
                                   {TRUTH_BOX, {0.0, 1.35, -1.35}, {2.2, 0.03, 0.75}, 0.0, 0.0},
                                   {TRUTH_BOX, {0.0, 1.2, -0.8}, {2.2, 0.12, 0.1}, 0.0, 0.0},
                                   {TRUTH_BOX, {0.0, 0.1, -0.8}, {2.2, 0.14, 0.12}, 0.0, 0.0},
                                   {TRUTH_BOX, {0.0, 0.25, -1.75}, {1.2, 0.04, 0.15}, 0.0, 0.0},
                                   {TRUTH_BOX, {1.3, 0.1, 0.6}, {0.5, 0.1, 0.5}, 0.0, 0.0},
                                   {TRUTH_BOX, {1.3, 0.3, 0.6}, {0.35, 0.1, 0.35}, 0.0, 0.0},
                                   {TRUTH_BOX, {-1.4, 0.7, -0.8}, {0.07, 0.5, 0.07}, 0.0, 0.0},
                                   {TRUTH_BOX, {-0.7, 0.7, -0.8}, {0.07, 0.5, 0.07}, 0.0, 0.0},
                                   {TRUTH_BOX, {0.0, 0.7, -0.8}, {0.07, 0.5, 0.07}, 0.0, 0.0},
                                   {TRUTH_BOX, {0.7, 0.7, -0.8}, {0.07, 0.5, 0.07}, 0.0, 0.0},
                                   {TRUTH_BOX, {1.4, 0.7, -0.8}, {0.07, 0.5, 0.07}, 0.0, 0.0},
                                   {TRUTH_SPHERE, {1.3, 0.6, 0.6}, {0.0, 0.0, 0.0}, 0.25, 0.0}};
    memcpy(porch, parts, sizeof parts);
    const struct {
        const char *name;
        truth_scene scene;
    } solids[] = {{"boxes", {boxes[0], BOXES + 1}},
                  {"panels", {boxes[1], BOXES + 1}},
                  {"balls", {balls, BOXES + 1}},
                  {"slats", {slats, 10}},
                  {"porch", {porch, 15}}};
    for (size_t s = 0; s < 5; ++s) {
        vsh_field *field = field_of_solids(solids[s].scene, 0.02);
        for (int far = 0; far < 2; ++far) {
            sets[count] = new_set(solids[s].name, field, far ? 1.5 : 0.6, s == 3 ? 0.5 : s == 4 ? 2.0 : 1.0);
            place_points(sets[count], solids[s].scene, 2.0, 0.02, 17 + s);
            find_truth(sets[count++], solids[s].scene);
        }
    }
    for (int wall = 0; wall < 2; ++wall) {
        sets[count] = new_set("room", field_of_room(wall ? 0.5 : 0.15, 0.04), 10.0, 0.4);
        place_points(sets[count++], (truth_scene){NULL, 0}, 0.95, 0.04, 23);
    }
    return count;
}

int main(void) {
    static sample_set *sets[MAX_SCENES];
    static normal_equations n;
    static uses u[4][MAX_SCENES];
    const int32_t counts[] = {4, 8, 16, 64};
    const size_t set_count = make_sets(sets);
    for (int k = 0; k < 4; ++k) {
        vshi_ao_cones cones;
        vshi_ao_cones_place(&cones, counts[k], false);
        for (size_t i = 0; i < set_count; ++i) {
            u[k][i] = uses_of(sets[i], &cones);
            if (counts[k] >= 8 && counts[k] <= 16) {
                add_equations(&n, sets[i], &u[k][i]);
            }
        }
    }
    add_smoothness(&n, 1e-5);
    double table[CELLS];
    solve(&n, table);
    for (int r = 0; r < EDGE; ++r) {
        for (int c = 0; c < EDGE; ++c) {
            printf("%s%.4ff%s", c == 0 ? "{" : " ", table[r * EDGE + c], c + 1 < EDGE ? "," : "},\n");
        }
    }
    for (int k = 0; k < 4; ++k) {
        printf("%d cones, RMSE and bias:", counts[k]);
        for (size_t i = 0; i < set_count; ++i) {
            report(sets[i], &u[k][i], table);
        }
        puts("");
    }
    return 0;
}
