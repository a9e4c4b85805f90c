/* Which texels of a lightmap are valid, by rays against triangles: boxes and spheres, where it is known. And
 * lightmaps as a viewer sees them: bilinear lookups on the surface, which read borders and padding too. */
#include "casts.h"
#include "directions.h"
#include "embree.h"
#include "handles.h"
#include "shapes.h"

OWNER(truth_mesh)

static const double PI = 3.14159265358979323846;

enum { MOST_QUADS = 4096, MOST_BOXES = 64, SIZE = 256 };

typedef struct box {
    double low[3], high[3];
} box;

/* Quads, each with a square of its own in a grid of charts. */
typedef struct yard {
    shape shape;
    float uvs[8 * MOST_QUADS];
    box boxes[MOST_BOXES]; /* the solids among them */
    size_t box_count;
} yard;

static void add_box(yard *s, box b) {
    assert_true(s->box_count < MOST_BOXES);
    s->boxes[s->box_count++] = b;
    shape_box(&s->shape, b.low, b.high, ALL_SIDES);
}

/* Its faces look inwards. */
static void add_room(yard *s, box b) {
    const size_t first = s->shape.vertices;
    shape_box(&s->shape, b.low, b.high, ALL_SIDES);
    for (size_t v = first; v < s->shape.vertices; v += 4) {
        float kept[3];
        memcpy(kept, s->shape.positions[v + 1], sizeof kept);
        memcpy(s->shape.positions[v + 1], s->shape.positions[v + 3], sizeof kept);
        memcpy(s->shape.positions[v + 3], kept, sizeof kept);
    }
}

static size_t quads_of(const yard *s) {
    return s->shape.triangles / 2;
}

/* A strip of charts has gaps of a fifth. */
static vsh_mesh mesh_of(yard *s) {
    const size_t across = (size_t)ceil(sqrt((double)quads_of(s)));
    assert_true(quads_of(s) <= MOST_QUADS);
    for (size_t i = 0; i < 4 * quads_of(s); ++i) {
        const float *corner = QUAD_UVS + 2 * (i % 4);
        s->uvs[2 * i] = ((float)(i / 4 % across) + 0.1f + 0.8f * corner[0]) / (float)across;
        s->uvs[2 * i + 1] = ((float)(i / 4 / across) + 0.1f + 0.8f * corner[1]) / (float)across;
    }
    vsh_mesh mesh = shape_mesh(&s->shape, "yard");
    mesh.uvs = s->uvs;
    return mesh;
}

/* A lightmap of AO, and the data that it was baked from. */
typedef struct baked {
    vsh_charts *charts;
    texel_list *texels;
    texel_samples samples; /* one a texel */
    float *ao, *coverage;
    vsh_bake_stats stats;
} baked;

static vsh_occluders *trace_mesh(const vsh_mesh *mesh, int32_t resolution) {
    vsh_occluders_options options = vsh_occluders_options_default();
    options.grid.resolution = resolution;
    vsh_occluders *occluders = NULL;
    assert_ok(vsh_occluders_create(mesh, 1, &options, NULL, &occluders, &failure));
    return occluders;
}

static baked bake(const vsh_mesh *mesh, int32_t resolution, double distance) {
    baked b = {.stats = vsh_bake_stats_zero()};
    OWNED(vsh_occluders) *occluders = trace_mesh(mesh, resolution);
    vsh_lightmap_options options = vsh_lightmap_options_default();
    options.width = options.height = SIZE;
    options.ao_spacing = 1;
    options.shade.method = VSH_SHADOW_EXACT;
    options.shade.ao_method = VSH_AO_EXACT;
    options.shade.ao_distance = distance;
    options.shade.rays = 16;
    b.charts = charts_from(mesh, 1, &options);
    b.texels = texels_from(b.charts);
    b.samples = samples_of(b.texels);
    b.ao = calloc(SIZE * SIZE, sizeof *b.ao);
    b.coverage = calloc(SIZE * SIZE, sizeof *b.coverage);
    const vsh_lightmap lightmap = {.ao = b.ao, .coverage = b.coverage};
    assert_ok(vsh_bake_lightmap(occluders, b.charts, NULL, 0, NULL, NULL, &lightmap, &b.stats, &failure));
    return b;
}

static void free_baked(baked *b) {
    texel_list_free(b->texels);
    vsh_charts_free(b->charts);
    free(b->ao);
    free(b->coverage);
}

static bool is_valid(const baked *b, size_t i) {
    return b->coverage[vsh_texel_place(b->samples.texels[i], SIZE)] == 1.0f;
}

/* How deep a point is in the deepest of the boxes. */
static double depth_in(const yard *s, const double p[3]) {
    double deepest = -INFINITY;
    for (size_t i = 0; i < s->box_count; ++i) {
        double depth = INFINITY;
        for (int axis = 0; axis < 3; ++axis) {
            depth = fmin(depth, fmin(p[axis] - s->boxes[i].low[axis], s->boxes[i].high[axis] - p[axis]));
        }
        deepest = fmax(deepest, depth);
    }
    return deepest;
}

/* How deep the point a hair above a sample is in the boxes. */
static double depth_above(const yard *s, const baked *b, size_t i) {
    const float *n = b->samples.geometric_normals + 3 * i;
    double above[3];
    go_along(b->samples.positions + 3 * i, 1e-3, (const double[]){n[0], n[1], n[2]}, above);
    return depth_in(s, above);
}

static float ao_of(const baked *b, size_t i) {
    return b->ao[vsh_texel_place(b->samples.texels[i], SIZE)];
}

static baked bake_yard(yard *s, int32_t resolution, double distance) {
    const vsh_mesh mesh = mesh_of(s);
    return bake(&mesh, resolution, distance);
}

/* Samples whose validity is not that of the boxes, a hair above the surface. */
static size_t count_wrong(const yard *s, const baked *b) {
    size_t wrong = 0;
    for (size_t i = 0; i < b->samples.count; ++i) {
        const double depth = depth_above(s, b, i);
        wrong += fabs(depth) > 1e-4 && is_valid(b, i) != (depth < 0.0);
    }
    return wrong;
}

/* A floor; boxes that stand on it, in it and in each other; pickets; and rivets a quarter of a voxel of 1/64
 * proud of a wall. */
static yard *new_yard(void) {
    yard *s = calloc(1, sizeof *s);
    add_box(s, (box){{-4.0, -0.5, -4.0}, {4.0, 0.0, 4.0}});
    add_box(s, (box){{-1.03, 0.0, -1.07}, {0.21, 1.3, 0.4}});
    add_box(s, (box){{1.0, -0.1, 1.0}, {2.03, 1.0, 2.1}});
    add_box(s, (box){{1.5, -0.1, 2.05}, {2.6, 0.7, 3.0}});
    add_box(s, (box){{1.2, 1.0, 1.2}, {1.7, 1.5, 1.7}});
    for (int i = 0; i < 9; ++i) {
        add_box(s, (box){{-3.5 + 0.2 * i, -0.3, 3.0}, {-3.39 + 0.2 * i, 0.8, 3.04}});
    }
    add_box(s, (box){{1.8, 0.0, -2.2}, {3.2, 2.0, -2.0}});
    for (int i = 0; i < 9; ++i) {
        const double x = 2.0 + 0.11 * i;
        add_box(s, (box){{x, 0.9, -2.01}, {x + 0.031, 0.931, -1.969}});
    }
    return s;
}

TEST(samples_in_solids_are_invalid_and_no_others_at_every_voxel_size) {
    FREED yard *busy = new_yard();
    static const int32_t RESOLUTIONS[3] = {32, 64, 256};
    uint64_t invalid[3];
    for (int r = 0; r < 3; ++r) {
        FREED_BY(free_baked) baked b = bake_yard(busy, RESOLUTIONS[r], 1.0);
        assert_int_equal(count_wrong(busy, &b), 0);
        invalid[r] = b.stats.invalid_texels;
    }
    assert_true(invalid[0] > 1000);
    assert_int_equal(invalid[0], invalid[1]);
    assert_int_equal(invalid[0], invalid[2]);
}

TEST(a_room_of_inward_faces_is_valid_but_where_things_stand) {
    FREED yard *s = calloc(1, sizeof *s);
    add_room(s, (box){{-3.0, 0.0, -3.0}, {3.0, 2.5, 3.0}});
    add_box(s, (box){{-1.0, 0.0, -1.0}, {0.5, 0.8, 0.5}});
    add_box(s, (box){{1.0, 1.0, 2.5}, {1.5, 1.6, 3.5}}); /* through a wall */
    FREED_BY(free_baked) baked b = bake_yard(s, 48, 1.0);
    size_t wrong = 0, behind = 0;
    for (size_t i = 0; i < b.samples.count; ++i) {
        const double *p = b.samples.positions + 3 * i, depth = depth_above(s, &b, i);
        const float *n = b.samples.geometric_normals + 3 * i;
        const bool outside = p[2] + 1e-3 * (double)n[2] > 3.0 || p[1] + 1e-3 * (double)n[1] < 0.0;
        behind += outside;
        wrong += !outside && fabs(depth) > 1e-4 && is_valid(&b, i) != (depth < 0.0);
    }
    assert_true(behind > 0);
    assert_int_equal(wrong, 0);
}

static void quad_at(yard *s, double y, double low, double high) {
    const double corners[4][3] = {{low, y, high}, {high, y, high}, {high, y, low}, {low, y, low}};
    shape_quad_at(&s->shape, corners);
}

TEST(decals_and_a_floor_under_cloth_are_valid) {
    FREED yard *s = calloc(1, sizeof *s);
    add_box(s, (box){{-4.0, -0.5, -4.0}, {4.0, 0.0, 4.0}});
    quad_at(s, 1e-4, -1.0, 0.0); /* the decal */
    quad_at(s, 0.3, 1.0, 3.0);   /* the cloth */
    FREED_BY(free_baked) baked b = bake_yard(s, 32, 1.0);
    size_t decal = 0, cloth = 0;
    for (size_t i = 0; i < b.samples.count; ++i) {
        const double *p = b.samples.positions + 3 * i;
        assert_true(is_valid(&b, i));
        const bool up = b.samples.geometric_normals[3 * i + 1] > 0.5f;
        if (up && p[1] > 5e-5 && p[1] < 2e-4) {
            ++decal;
            assert_true(ao_of(&b, i) > 0.9f);
        }
        cloth += up && p[1] == 0.0 && p[0] > 1.2 && p[0] < 2.8 && p[2] > 1.2 && p[2] < 2.8;
    }
    assert_true(decal > 1000 && cloth > 100);
}

/* Adds a sphere around a place, without its quads nearer than `hole` to the +z axis; the angle in radians. */
static void add_sphere(yard *s, double radius, double z, double hole) {
    enum { RINGS = 24, SECTORS = 32 };
    for (int ring = 0; ring < RINGS; ++ring) {
        const double a0 = hole + (PI - hole) * ring / RINGS, a1 = hole + (PI - hole) * (ring + 1) / RINGS;
        for (int sector = 0; sector < SECTORS; ++sector) {
            double corners[4][3];
            for (int k = 0; k < 4; ++k) {
                const double a = k == 1 || k == 2 ? a1 : a0;
                const double b = 2.0 * PI * ((sector + (k >= 2)) % SECTORS) / SECTORS;
                const double across = ring + 1 == RINGS && a == a1 ? 0.0 : radius * sin(a);
                corners[k][0] = across * cos(b);
                corners[k][1] = across * sin(b);
                corners[k][2] = z + radius * cos(a);
            }
            shape_quad_at(&s->shape, (const double(*)[3])corners);
        }
    }
}

TEST(an_eye_in_a_head_with_a_hole_is_valid_where_it_is_seen) {
    FREED yard *s = calloc(1, sizeof *s);
    add_sphere(s, 1.0, 0.0, 0.35);
    add_sphere(s, 0.4, 0.5, 0.0);
    static const int32_t RESOLUTIONS[2] = {32, 128};
    for (int r = 0; r < 2; ++r) {
        FREED_BY(free_baked) baked b = bake_yard(s, RESOLUTIONS[r], 0.5);
        size_t head = 0, front = 0, back = 0;
        for (size_t i = 0; i < b.samples.count; ++i) {
            const double *p = b.samples.positions + 3 * i;
            if (dot3(p, p) > 0.95) {
                ++head;
                assert_true(is_valid(&b, i));
            } else if (p[2] > 0.87) { /* up to the edge of the hole, close before which it lies */
                ++front;
                assert_true(is_valid(&b, i));
            } else if (p[2] < 0.4) {
                ++back;
                assert_false(is_valid(&b, i));
            }
        }
        assert_true(head > 1000 && front > 20 && back > 500);
    }
}

TEST(flipped_faces_invalidate_no_others) {
    FREED yard *s = calloc(1, sizeof *s);
    add_box(s, (box){{-1.0, -1.0, -1.0}, {1.0, 1.0, 1.0}});
    add_box(s, (box){{1.5, -1.0, -1.0}, {2.5, 1.0, 1.0}});
    for (size_t q = 0; q < 12; q += 5) {
        uint32_t *index = s->shape.indices[2 * q];
        const uint32_t turned[6] = {index[0], index[2], index[1], index[3], index[5], index[4]};
        memcpy(index, turned, sizeof turned);
    }
    FREED_BY(free_baked) baked b = bake_yard(s, 32, 1.0);
    for (size_t i = 0; i < b.samples.count; ++i) {
        assert_true(depth_above(s, &b, i) >= 0.0 || is_valid(&b, i));
    }
}

TEST(points_deep_in_a_box_see_no_sky_though_its_triangles_are_far) {
    FREED yard *s = calloc(1, sizeof *s);
    add_box(s, (box){{-4.0, -4.0, -4.0}, {4.0, 4.0, 4.0}});
    add_box(s, (box){{-0.01, 4.0, -0.01}, {0.01, 5.0, 0.01}}); /* less than a voxel thick */
    const vsh_mesh mesh = mesh_of(s);
    OWNED(vsh_occluders) *occluders = trace_mesh(&mesh, 64);
    const double positions[9] = {0.0, 0.0, 0.0, 2.0, 4.0, 2.0, 0.0, 4.5, 0.0};
    const float normals[9] = {0, 1, 0, 0, 1, 0, 1, 0, 0};
    const vsh_points points = {.count = 3, .positions = positions, .normals = normals};
    vsh_shade_options options = vsh_shade_options_default();
    options.ao_method = VSH_AO_EXACT;
    options.ao_distance = 0.5;
    float ao[3];
    assert_ok(vsh_shade_ao(occluders, &points, &options, NULL, ao, NULL, NULL, NULL, &failure));
    assert_true(ao[0] == 0.0f && ao[1] > 0.95f && ao[2] == 0.0f);
}

/* A floor of one chart with a box on it, as wide as `half`: its texels under the box. */
TEST(invalid_texels_take_the_nearest_value_of_their_chart) {
    FREED yard *s = calloc(1, sizeof *s);
    quad_at(s, 0.0, -4.0, 4.0);
    add_box(s, (box){{-1.5, -0.2, -1.5}, {1.5, 1.0, 1.5}});
    vsh_mesh mesh = mesh_of(s);
    const float floor[8] = {0, 0, 1, 0, 1, 0.9f, 0, 0.9f}; /* but for the topmost tenth */
    memcpy(s->uvs, floor, sizeof floor);
    for (size_t i = 8; i < 8 * quads_of(s); i += 2) {
        s->uvs[i + 1] = 0.92f + 0.07f * s->uvs[i + 1];
    }
    FREED_BY(free_baked) baked b = bake(&mesh, 32, 1.0);
    size_t filled = 0;
    for (size_t i = 0; i < b.samples.count; ++i) {
        const double *p = b.samples.positions + 3 * i;
        if (p[1] == 0.0 && fabs(p[0]) < 1.45 && fabs(p[2]) < 1.45) {
            ++filled;
            assert_false(is_valid(&b, i));
            /* beside a wall half of the sky is hidden: no texel is as dark as one without a value, or as
             * light as the open floor */
            assert_true(ao_of(&b, i) > 0.2f && ao_of(&b, i) < 0.85f);
        }
    }
    assert_true(filled > 5000);
}

/* --- narrow gaps, and places that are seen past an open end */

/* Two boxes, the upper one a millionth and a half of the scene's size over the lower: more than the roundings
 * of floats, less than rays are lifted by. */
TEST(a_gap_that_is_narrower_than_the_lift_of_rays_is_no_solid) {
    static const double GAPS[2] = {6e-6, 0.0};
    for (int k = 0; k < 2; ++k) {
        FREED yard *s = calloc(1, sizeof *s);
        add_box(s, (box){{-2.0, -1.0, -2.0}, {2.0, 0.0, 2.0}});
        add_box(s, (box){{-1.0, GAPS[k], -1.0}, {1.0, 1.0, 1.0}});
        FREED_BY(free_baked) baked b = bake_yard(s, 32, 1.0);
        size_t between = 0, valid = 0;
        for (size_t i = 0; i < b.samples.count; ++i) {
            const double *p = b.samples.positions + 3 * i;
            if (fabs(p[1]) < 1e-5 && fabs(p[0]) < 0.99 && fabs(p[2]) < 0.99) {
                ++between;
                valid += is_valid(&b, i);
            }
        }
        assert_true(between > 1000);
        assert_int_equal(valid, k == 0 ? between : 0);
    }
}

/* A quarter of a bent pipe, open at both ends, whose faces look inwards; one end a little over a floor. Some
 * rays from beside it go into it, most do not. */
TEST(a_floor_beside_the_mouth_of_an_inward_pipe_is_valid) {
    enum { AROUND = 24, ALONG = 16, FLOOR_TOP = 3 };
    static const double BEND = 0.6, RADIUS = 0.15;
    FREED yard *s = calloc(1, sizeof *s);
    add_box(s, (box){{-0.4, -0.1, -1.0}, {0.4, 0.0, 0.4}});
    for (int k = 0; k < AROUND * ALONG; ++k) {
        double corners[4][3];
        for (int c = 0; c < 4; ++c) {
            const double a = 0.5 * PI * (k / AROUND + (c >= 2)) / ALONG;
            const double b = 2.0 * PI * ((k + (c == 1 || c == 2)) % AROUND) / AROUND;
            const double r = BEND + RADIUS * cos(b);
            corners[c][0] = RADIUS * sin(b);
            corners[c][1] = 0.02 + r * sin(a);
            corners[c][2] = -r * cos(a);
        }
        shape_quad_at(&s->shape, (const double(*)[3])corners);
    }
    const vsh_mesh mesh = mesh_of(s);
    for (size_t k = 0; k < 4 * quads_of(s); ++k) { /* the floor's top has most of the lightmap */
        s->uvs[2 * k + 1] = 0.9f + 0.1f * s->uvs[2 * k + 1];
    }
    const float top[8] = {0.0f, 0.0f, 1.0f, 0.0f, 1.0f, 0.9f, 0.0f, 0.9f};
    memcpy(s->uvs + 8 * FLOOR_TOP, top, sizeof top);
    FREED_BY(free_baked) baked b = bake(&mesh, 32, 1.0);
    size_t beside = 0, wrong = 0;
    for (size_t i = 0; i < b.samples.count; ++i) {
        const double *p = b.samples.positions + 3 * i;
        if (p[1] == 0.0 && hypot(p[0], p[2] + BEND) > RADIUS) {
            ++beside;
            wrong += !is_valid(&b, i);
        }
    }
    assert_true(beside > 10000);
    assert_int_equal(wrong, 0);
}

/* A floor and a box that stands on it. */
static void put_box_on_floor(yard *s, double low, double high) {
    memset(s, 0, sizeof *s);
    quad_at(s, 0.0, -4.0, 4.0);
    add_box(s, (box){{low, 0.0, low}, {high, 1.0, high}});
}

static bool is_on_floor(const baked *b, size_t i) {
    return b->samples.positions[3 * i + 1] == 0.0 && b->samples.geometric_normals[3 * i + 1] > 0.5f;
}

/* Returns the coordinate nearest to x at which the floor has texel centres. */
static double find_centre(const baked *b, double x) {
    double nearest = INFINITY;
    for (size_t i = 0; i < b->samples.count; ++i) {
        const double *p = b->samples.positions + 3 * i;
        if (is_on_floor(b, i) && fabs(p[0]) < 3.9 && fabs(p[0] - x) < fabs(nearest - x)) {
            nearest = p[0];
        }
    }
    return nearest;
}

TEST(texels_on_the_side_of_a_box_are_filled_from_the_open) {
    FREED yard *s = malloc(sizeof *s);
    put_box_on_floor(s, -1.0, 1.0);
    FREED_BY(free_baked) baked any = bake_yard(s, 64, 1.0);
    const double low = find_centre(&any, -0.8), high = find_centre(&any, 1.2);
    put_box_on_floor(s, low, high);
    FREED_BY(free_baked) baked b = bake_yard(s, 64, 1.0);
    size_t touching = 0;
    for (size_t i = 0; i < b.samples.count; ++i) {
        const double *p = b.samples.positions + 3 * i;
        if (is_on_floor(&b, i) && fabs(p[0] - low) < 1e-6 && p[2] > low + 0.2 && p[2] < high - 0.2) {
            ++touching;
            const float ao = ao_of(&b, i);
            assert_false(is_valid(&b, i));
            assert_true(ao > 0.5f && ao < 0.65f); /* 0.5 at the foot of a high wall */
        }
    }
    assert_true(touching > 5);
}

/* The room's floor is a wall with air behind it, so nothing is met from beneath it. */
TEST(undersides_on_a_floor_with_air_beneath_it_are_invalid) {
    for (int kind = 0; kind < 3; ++kind) { /* on a plane, in a room, in a mirrored room */
        FREED yard *s = calloc(1, sizeof *s);
        if (kind > 0) {
            add_room(s, (box){{-4.0, 0.0, -4.0}, {4.0, 2.5, 4.0}});
        } else {
            quad_at(s, 0.0, -4.0, 4.0);
        }
        add_box(s, (box){{-1.0, 0.0, -1.0}, {1.0, 0.8, 1.0}});
        quad_at(s, 0.8, -0.5, 0.5); /* a cloth on the box, both of which are seen */
        add_box(s, (box){{-3.0, 1.0, -3.0}, {-2.0, 2.0, -2.0}});
        vsh_mesh mesh = mesh_of(s);
        static const double mirror[12] = {-1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0};
        mesh.transform = kind == 2 ? mirror : NULL;
        FREED_BY(free_baked) baked b = bake(&mesh, 48, 1.0);
        size_t under = 0, over = 0;
        for (size_t i = 0; i < b.samples.count; ++i) {
            const double y = b.samples.positions[3 * i + 1];
            const float up = b.samples.geometric_normals[3 * i + 1];
            if (y == 0.0 && up < -0.5f) {
                ++under;
                assert_false(is_valid(&b, i));
            } else if ((y > 0.7 && y < 0.9 && up > 0.5f) ||
                       (y > 0.95 && y < 2.05 && fabs(b.samples.positions[3 * i + 2] + 2.5) < 0.55)) {
                ++over;
                assert_true(is_valid(&b, i));
            }
        }
        assert_true(under > 100 && over > 200);
    }
}

/* --- lightmaps as a viewer sees them */

/* 250: some charts then end in texels whose centres lie outside. */
enum { TEXELS = 250, POINTS = 5000, RAYS = 1024 };

static const double LIFT = 1e-5 * 4.0; /* of the room's size */
static const double WRONG = 0.25, AO_DISTANCE = 1.0;
static const double SUN_ANGLE = 0.7; /* wide, so that texels resolve the penumbra where things touch */
static const double SUN[3] = {0.4, 0.8, 0.3};

/* Random points of the surface, lifted off it, and their truth. */
typedef struct points {
    double at[3 * POINTS], uv[2 * POINTS];
    float normal[3 * POINTS];
    float ao[POINTS], shadow[POINTS], backs[POINTS];
} points;

static double number(size_t i, double irrational) {
    return fmod((double)(i + 1) * irrational, 1.0);
}

/* Sets point i of `p`: a place on quad q, which is a rectangle. */
static void place_on_quad(const yard *s, size_t q, double across, double along, points *p, size_t i) {
    double edge[2][3], g[3];
    for (size_t k = 0; k < 3; ++k) {
        const float *corner = s->shape.positions[4 * q] + k;
        edge[0][k] = (double)(corner[3] - corner[0]);
        edge[1][k] = (double)(corner[9] - corner[0]);
        p->at[3 * i + k] = (double)corner[0] + across * edge[0][k] + along * edge[1][k];
    }
    for (size_t k = 0; k < 3; ++k) {
        g[k] = edge[0][(k + 1) % 3] * edge[1][(k + 2) % 3] - edge[0][(k + 2) % 3] * edge[1][(k + 1) % 3];
    }
    const double area = length3(g);
    for (size_t k = 0; k < 3; ++k) {
        p->normal[3 * i + k] = (float)(g[k] / area);
        p->at[3 * i + k] += LIFT * g[k] / area;
    }
    for (size_t k = 0; k < 2; ++k) {
        const float *uv = s->uvs + 8 * q + k;
        p->uv[2 * i + k] = (double)uv[0] + across * (double)(uv[2] - uv[0]) + along * (double)(uv[6] - uv[0]);
    }
}

static points *place_points(const yard *s) {
    points *p = calloc(1, sizeof *p);
    double area[MOST_QUADS], sum = 0.0;
    for (size_t q = 0; q < quads_of(s); ++q) {
        const float *c = s->shape.positions[4 * q];
        area[q] = sum += hypot(hypot((double)(c[3] - c[0]), (double)(c[4] - c[1])), (double)(c[5] - c[2])) *
                         hypot(hypot((double)(c[9] - c[0]), (double)(c[10] - c[1])), (double)(c[11] - c[2]));
    }
    for (size_t i = 0, q = 0; i < POINTS; ++i) {
        while (area[q] < ((double)i + 0.5) / POINTS * sum) {
            ++q;
        }
        place_on_quad(s, q, number(i, 0.7548776662466927), number(i, 0.5698402909980532), p, i);
    }
    return p;
}

static double look_up(const float *plane, const double uv[2]) {
    const double x = fmin(TEXELS - 1.0, fmax(0.0, uv[0] * TEXELS - 0.5));
    const double y = fmin(TEXELS - 1.0, fmax(0.0, (1.0 - uv[1]) * TEXELS - 0.5));
    double sum = 0.0;
    for (int k = 0; k < 4; ++k) {
        const double column = floor(x) + k % 2, row = floor(y) + k / 2;
        const double weight = (1.0 - fabs(x - column)) * (1.0 - fabs(y - row));
        sum += weight > 0.0 ? weight * (double)plane[(size_t)row * TEXELS + (size_t)column] : 0.0;
    }
    return sum;
}

static void trace_points(const vsh_mesh *mesh, points *p) {
    OWNED(truth_mesh) *truth = truth_mesh_create(mesh, 1);
    const double w = tan(0.5 * SUN_ANGLE);
    assert_non_null(truth);
    assert_int_equal(truth_mesh_backs(truth, POINTS, p->at, p->normal, 96, 0, p->backs), 0);
    assert_int_equal(truth_mesh_ao(truth, POINTS, p->at, p->normal, AO_DISTANCE, RAYS, 0, p->ao), 0);
    assert_int_equal(truth_mesh_light(truth, POINTS, p->at, p->normal, SUN, w, RAYS, 0, p->shadow), 0);
}

static void bake_planes(const vsh_mesh *mesh, float *ao, float *shadow) {
    OWNED(vsh_occluders) *occluders = trace_mesh(mesh, 0);
    vsh_lightmap_options options = vsh_lightmap_options_default();
    options.width = options.height = TEXELS;
    options.shade.ao_distance = AO_DISTANCE;
    options.shade.max_error = 0.005;
    options.shade.rays = 1024;
    OWNED(vsh_charts) *charts = charts_from(mesh, 1, &options);
    vsh_light sun = vsh_light_default();
    memcpy(sun.direction, SUN, sizeof SUN);
    sun.angle = SUN_ANGLE;
    float *const shadows[1] = {shadow};
    const vsh_lightmap lightmap = {.ao = ao, .shadow = shadows};
    assert_ok(vsh_bake_lightmap(occluders, charts, &sun, 1, NULL, NULL, &lightmap, NULL, &failure));
}

static void compare_seen(const points *p, const char *what, const float *plane, const float *truth) {
    size_t count = 0, dark = 0;
    double square = 0.0;
    for (size_t i = 0; i < POINTS; ++i) {
        const bool underside = p->at[3 * i + 1] < 1e-3 && p->normal[3 * i + 1] < -0.5f;
        if (p->backs[i] > 0.05f || underside) {
            continue; /* under the chest, or its own face on the floor */
        }
        const double error = look_up(plane, p->uv + 2 * i) - (double)truth[i];
        ++count;
        square += error * error;
        dark += !(error >= -WRONG);
    }
    const double rmse = sqrt(square / (double)count);
    assert_that(dark == 0 && rmse <= 0.01, "%s: %zu of %zu points are too dark by a quarter, RMSE %g", what,
                dark, count, rmse);
}

TEST(rooms_are_not_seen_darker_along_corners) {
    static const box ROOM = {{-2, 0, -2}, {2, 3, 2}};
    /* Its lower sides pass through centres of the floor's texels. */
    static const box CHEST = {{-0.46, 0, -0.46}, {0.46, 0.83, 0.39}};
    for (int open = 0; open < 2; ++open) {
        FREED yard *s = calloc(1, sizeof *s);
        FREED float *planes = calloc(2 * TEXELS * TEXELS, sizeof *planes);
        shape_box(&s->shape, CHEST.low, CHEST.high, ALL_SIDES);
        add_room(s, ROOM);
        if (open) { /* the fourth of the room's quads is its ceiling: the last takes its place */
            memcpy(s->shape.positions[4 * 9], s->shape.positions[4 * 11], 4 * sizeof *s->shape.positions);
            s->shape.triangles -= 2;
        }
        const vsh_mesh mesh = mesh_of(s);
        FREED points *p = place_points(s);
        trace_points(&mesh, p);
        bake_planes(&mesh, planes, planes + TEXELS * TEXELS);
        compare_seen(p, open ? "AO under the sky" : "AO", planes, p->ao);
        compare_seen(p, open ? "sun" : "sun outside", planes + TEXELS * TEXELS, p->shadow);
    }
}
