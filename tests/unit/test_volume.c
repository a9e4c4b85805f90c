/* Volumes: their values against closed forms, against queries at the same places, and against a lightmap. */
#include "testing.h"
#include "volumes.h"

#include "previews.h"
#include "texels_of.h"

static const double TOWARDS[3] = {0.3, 1.0, 0.2};

/* A unit ball at the origin. */
static truth_scene ball(void) {
    static const truth_solid solid = {.shape = TRUTH_SPHERE, .radius = 1.0};
    return (truth_scene){&solid, 1};
}

static double length(const double v[3]) {
    return sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
}

/* Angle between the direction to the ball's centre and the sun's, less the ball's own half angle: what is
 * left of the sky between its edge and the sun's centre, radians. */
static double clearance(const double p[3]) {
    const double far = length(p), sun_length = length(TOWARDS);
    const double cosine = -(p[0] * TOWARDS[0] + p[1] * TOWARDS[1] + p[2] * TOWARDS[2]) / (far * sun_length);
    return acos(fmax(-1.0, fmin(1.0, cosine))) - asin(fmin(1.0, 1.0 / far));
}

TEST(a_box_around_a_ball_holds_its_umbra_its_penumbra_and_light) {
    const double angle = RADIANS(12.0), voxel = 0.05;
    OWNED(vsh_field) *field = field_of(ball(), voxel, 4.0);
    OWNED(vsh_voxels) *voxels = cube_of(3.0, 0.1);
    const vsh_light light = sun(TOWARDS, angle);
    OWNED(vsh_volume) *volume = bake(occluders_of(field), voxels, &light, 1, NULL, NULL);
    FREED_BY(free_dense) dense d = copy_of(volume, 0, voxels);
    FREED double *centre = centres_of(&d, voxels);
    double square = 0.0;
    size_t umbra = 0, lit = 0, penumbra = 0;
    for (size_t i = 0; i < d.count; ++i) {
        const double *p = centre + 3 * i;
        if (length(p) < 1.0 + voxel) {
            continue;
        }
        const double clear = clearance(p), margin = voxel / length(p);
        if (clear > 0.5 * angle + margin) {
            assert_true(d.values[i] == 1.0f);
            ++lit;
        } else if (clear < -0.5 * angle - margin) {
            assert_true(d.values[i] < 0.02f);
            ++umbra;
        } else if ((i & 7) == 0) {
            const double truth = truth_light(ball(), p, NULL, TOWARDS, tan(0.5 * angle), INFINITY, 512);
            square += (d.values[i] - truth) * (d.values[i] - truth);
            ++penumbra;
        }
    }
    assert_true(lit > 150000 && umbra > 3000 && penumbra > 1000);
    assert_true(sqrt(square / (double)penumbra) < 0.03);
}

TEST(ao_of_free_space_is_the_free_share_of_all_directions) {
    OWNED(vsh_field) *field = field_of(ball(), 0.05, 8.0);
    OWNED(vsh_voxels) *voxels = cube_of(2.4, 0.2);
    static const struct {
        int32_t method, number;
        double error; /* RMSE */
    } methods[] = {{VSH_AO_CONES, 16, 0.015}, {VSH_AO_CONES, 64, 0.008}, {VSH_AO_RAYS, 256, 0.01}};
    for (size_t m = 0; m < sizeof methods / sizeof methods[0]; ++m) {
        vsh_volume_options options = preview_volume_options();
        options.ao = 1;
        options.shade.ao_distance = 8.0;
        options.shade.ao_method = methods[m].method;
        options.shade.ao_cones = options.shade.rays = methods[m].number;
        OWNED(vsh_volume) *volume = bake(occluders_of(field), voxels, NULL, 0, &options, NULL);
        FREED_BY(free_dense) dense d = copy_of(volume, 0, voxels);
        double *centre = centres_of(&d, voxels), square = 0.0;
        size_t count = 0;
        for (size_t i = 0; i < d.count; ++i) {
            const double far = length(centre + 3 * i);
            if (far > 1.05) {
                const double truth = 1.0 - 0.5 * (1.0 - sqrt(1.0 - 1.0 / (far * far)));
                square += (d.values[i] - truth) * (d.values[i] - truth);
                ++count;
            }
        }
        assert_true(count > 10000 && sqrt(square / (double)count) < methods[m].error);
        free(centre);
    }
}

/* --- the same values as queries */

enum { LIGHTS = 2 };

static void lights_of(vsh_light lights[LIGHTS]) {
    const double place[3] = {1.0, 1.5, 1.0};
    lights[0] = sun(truth_seeds_sun, 0.2);
    lights[1] = lamp(place, 0.2);
}

/* Asks for the dense copies' voxels that are outside: `wanted` planes as the volume has them. */
static size_t compare(const vsh_field *field, const vsh_voxels *voxels, const vsh_volume *volume,
                      const vsh_query *query, bool normals, bool ao) {
    dense d[LIGHTS + 1];
    for (size_t g = 0; g < LIGHTS + (ao ? 1 : 0); ++g) {
        d[g] = copy_of(volume, g, voxels);
    }
    FREED double *centre = centres_of(&d[0], voxels);
    vsh_voxels_info info;
    vsh_voxels_get_info(voxels, &info);
    FREED float *distance = distances_of(field, d[0].count, centre);
    float *values[LIGHTS + 1], *normal = malloc(3 * d[0].count * sizeof *normal);
    size_t count = 0, *number = malloc(d[0].count * sizeof *number);
    for (size_t i = 0; i < d[0].count; ++i) {
        double slope[3], at[2][3];
        float beside[2];
        if (!(distance[i] >= 0.0f) || (normals && fabs((double)distance[i]) > 2.0 * info.voxel_size[0])) {
            continue;
        }
        for (int axis = 0; axis < 3; ++axis) {
            memcpy(at[0], centre + 3 * i, sizeof at[0]);
            memcpy(at[1], centre + 3 * i, sizeof at[1]);
            at[0][axis] -= 0.5 * info.voxel_size[axis];
            at[1][axis] += 0.5 * info.voxel_size[axis];
            vsh_field_sample(field, 2, &at[0][0], beside);
            slope[axis] = ((double)beside[1] - (double)beside[0]) / info.voxel_size[axis];
        }
        if (normals && length(slope) < 0.11) {
            continue;
        }
        for (int axis = 0; axis < 3; ++axis) {
            normal[3 * count + (size_t)axis] = (float)slope[axis];
        }
        memmove(centre + 3 * count, centre + 3 * i, 3 * sizeof *centre);
        number[count++] = i;
    }
    for (int g = 0; g <= LIGHTS; ++g) {
        values[g] = malloc(count * sizeof *values[g]);
    }
    vsh_query_output output = vsh_query_output_default();
    output.visibility = values;
    output.ao = ao ? values[LIGHTS] : NULL;
    const vsh_points points = {count, centre, normals ? normal : NULL, NULL};
    assert_ok(vsh_query_points(query, &points, NULL, NULL, &output, NULL, &failure));
    /* some normals differ by a bit, as the lattice's own axes are multiplied in another order */
    size_t different = 0, far = 0;
    for (size_t g = 0; g < LIGHTS + (ao ? 1 : 0); ++g) {
        for (size_t i = 0; i < count; ++i) {
            const float own = d[g].values[number[i]];
            different += bits_of(own) != bits_of(values[g][i]);
            far += !(fabsf(own - values[g][i]) < 1e-4f);
        }
        free(d[g].values);
    }
    assert_true(normals ? different < count / 50 && far < 20 : different == 0);
    for (int g = 0; g <= LIGHTS; ++g) {
        free(values[g]);
    }
    free(number);
    free(normal);
    return count;
}

TEST(values_are_those_of_queries_at_the_voxels_centres) {
    const double low[3] = {-3.0, -0.4, -3.0}, high[3] = {3.0, 4.0, 3.0};
    vsh_grid *grid = grid_of(truth_seeds(), 0.05);
    OWNED(vsh_voxels) *band = band_of(grid, 0.0), *fine = box_of(low, high, 0.06),
                      *coarse = box_of(low, high, 0.4);
    OWNED(vsh_field) *field = field_of_grid(grid, 4.0);
    vsh_light lights[LIGHTS];
    lights_of(lights);
    for (int32_t method = VSH_SHADOW_HARD; method <= VSH_SHADOW_CONE; ++method) {
        vsh_volume_options options = preview_volume_options();
        options.shade.method = method;
        options.ao = method == VSH_SHADOW_CONE;
        options.shade.ao_distance = 0.5;
        OWNED(vsh_query) *query = NULL;
        assert_ok(vsh_query_create(occluders_of(field), lights, LIGHTS, &options.shade, &query, &failure));
        const vsh_voxels *all[] = {band, fine, coarse};
        for (size_t v = 0; v < 3; ++v) {
            options.ao = method == VSH_SHADOW_CONE && v == 0;
            OWNED(vsh_volume) *volume = bake(occluders_of(field), all[v], lights, LIGHTS, &options, NULL);
            vsh_volume_info info;
            vsh_volume_get_info(volume, &info);
            assert_int_equal(info.grids, LIGHTS + options.ao);
            const size_t count = compare(field, all[v], volume, query, v == 0, options.ao != 0);
            assert_true(count > 500 && count <= info.shaded);
        }
    }
}

/* The proofs that go before a block's voxels: what they call AO 1 is 1 for a bake of single blocks, whose
 * neighbours never decide anything. */
TEST(blocks_that_are_proved_open_are_open) {
    OWNED(vsh_field) *field = field_of(truth_seeds(), 0.05, 4.0);
    const double low[3] = {-4.0, -1.0, -4.0}, high[3] = {4.0, 5.0, 4.0};
    OWNED(vsh_voxels) *voxels = box_of(low, high, 0.25);
    vsh_volume_options options = preview_volume_options();
    options.ao = 1;
    options.shade.ao_distance = 0.3;
    OWNED(vsh_volume) *volume = bake(occluders_of(field), voxels, NULL, 0, &options, NULL);
    FREED_BY(free_dense) dense d = copy_of(volume, 0, voxels);
    FREED double *centre = centres_of(&d, voxels);
    size_t open = 0, closed = 0;
    for (size_t i = 0; i < d.count; ++i) {
        const double distance = truth_distance(truth_seeds(), centre + 3 * i);
        open += distance > 0.7 && d.values[i] == 1.0f;
        assert_true(distance < 0.7 || d.values[i] == 1.0f);
        closed += distance > 0.0 && d.values[i] < 0.9f;
    }
    assert_true(open > 10000 && closed > 200);
    vsh_volume_grid info;
    vsh_volume_get_grid(volume, 0, &info);
    assert_true(info.tiles > 0);
}

/* Shadow at places by a query. */
static float *query_shadow(const vsh_occluders *occluders, const vsh_light *light,
                           const vsh_shade_options *options, size_t count, const double *places) {
    OWNED(vsh_query) *query = NULL;
    assert_ok(vsh_query_create(occluders, light, 1, options, &query, &failure));
    float *values = malloc(count * sizeof *values), *const visibility[1] = {values};
    vsh_query_output output = vsh_query_output_default();
    output.visibility = visibility;
    const vsh_points points = {count, places, NULL, NULL};
    assert_ok(vsh_query_points(query, &points, NULL, NULL, &output, NULL, &failure));
    return values;
}

/* A ball in the field and a slab in a layer: both hide the light, and both are solid. */
TEST(layers_hide_light_and_are_solid) {
    static const truth_solid slab = {
        .shape = TRUTH_BOX, .center = {0.0, 1.8, 0.0}, .half = {0.5, 0.25, 0.5}, .radius = 0.0};
    OWNED(vsh_field) *field = field_of(ball(), 0.05, 4.0);
    vsh_layer layer = vsh_layer_default();
    OWNED(vsh_field) *of_layer = field_of((truth_scene){&slab, 1}, 0.05, 4.0);
    layer.field = of_layer;
    OWNED(vsh_voxels) *voxels = cube_of(2.4, 0.1);
    vsh_volume_options options = preview_volume_options();
    options.ao = 1;
    options.shade.ao_distance = 0.5;
    const vsh_light light = sun(TOWARDS, 0.1);
    OWNED(vsh_volume) *volume = bake(occluders_with(field, &layer, 1), voxels, &light, 1, &options, NULL);
    FREED_BY(free_dense) dense d = copy_of(volume, 0, voxels), ao = copy_of(volume, 1, voxels);
    FREED double *centre = centres_of(&d, voxels);
    FREED float *one = distances_of(field, d.count, centre), *two = distances_of(of_layer, d.count, centre);
    FREED float *values =
        query_shadow(occluders_with(field, &layer, 1), &light, &options.shade, d.count, centre);
    size_t different = 0, behind = 0, inside = 0, near = 0;
    for (size_t i = 0; i < d.count; ++i) {
        if (one[i] >= 0.0f && two[i] >= 0.0f) {
            different += bits_of(values[i]) != bits_of(d.values[i]);
            assert_true(fabsf(values[i] - d.values[i]) < 0.05f);
            behind += d.values[i] == 0.0f && centre[3 * i + 1] > 1.0;
            near += two[i] < 0.1f && one[i] > 0.6f && ao.values[i] < 0.7f;
        }
        inside += two[i] < -0.1f && two[i] > -0.2f;
    }
    vsh_volume_info info;
    vsh_volume_get_info(volume, &info);
    assert_true(different < d.count / 50 && behind > 50 && inside > 10 && near > 50);
    assert_true(info.shaded + info.filled + info.off == d.count && info.filled > 500);
}

/* --- a lightmap of the same surface */

enum { SIDE = 64, TEXELS = SIDE * SIDE };

/* The seeds' floor is at y = 0, a plane of the lattice: a receiver there whose texels' centres are its
 * voxels' centres. The bound in docs/query.md: 0.0001 where the floor is the nearest surface by two
 * voxels, and an RMSE of 0.002 over all of it. */
TEST(a_lightmap_and_a_band_agree_where_texel_and_voxel_meet) {
    const double voxel = 0.0625, half = 0.5 * SIDE * voxel;
    vsh_grid *grid = grid_of(truth_seeds(), voxel);
    OWNED(vsh_voxels) *voxels = band_of(grid, 0.0);
    OWNED(vsh_field) *field = field_of_grid(grid, 4.0);
    const vsh_light light = sun(truth_seeds_sun, 2.0 * atan(truth_seeds_w));
    vsh_volume_options options = preview_volume_options();
    options.ao = 1;
    options.shade.ao_distance = 0.5;
    options.shade.ao_cones = 64;
    OWNED(vsh_volume) *volume = bake(occluders_of(field), voxels, &light, 1, &options, NULL);

    const float low = (float)(-half - 0.5 * voxel), high = (float)(half - 0.5 * voxel);
    const float positions[12] = {low, 0, high, high, 0, high, high, 0, low, low, 0, low};
    static const float uvs[8] = {0, 0, 1, 0, 1, 1, 0, 1};
    const vsh_mesh floor = {.name = "floor",
                            .positions = positions,
                            .uvs = uvs,
                            .indices = QUAD_INDICES,
                            .vertex_count = 4,
                            .triangle_count = 2};
    vsh_lightmap_options lightmap = size_of(SIDE, SIDE, 1);
    lightmap.ao_spacing = 1;
    OWNED(vsh_charts) *charts = create(&floor, 1, lightmap, NULL);
    static float shadow[TEXELS], ao[TEXELS], coverage[TEXELS];
    float *const shadows_of[1] = {shadow};
    const vsh_lightmap planes = {.shadow = shadows_of, .ao = ao, .coverage = coverage};
    assert_ok(vsh_bake_lightmap(occluders_of(field), charts, &light, 1, &options.shade, NULL, &planes, NULL,
                                &failure));
    OWNED(vsh_texels) *texels = rasterize(charts);
    const vsh_texel_samples samples = vsh_texels_samples(texels);
    assert_int_equal(samples.count, TEXELS);
    double worst[2] = {0.0, 0.0}, square[2] = {0.0, 0.0};
    size_t count = 0, alone = 0;
    for (size_t i = 0; i < samples.count; ++i) {
        const double *p = samples.positions + 3 * i;
        const size_t texel = vsh_texel_place(samples.texels[i], SIDE);
        if (coverage[texel] == 0.0f) {
            continue;
        }
        float values[2];
        for (size_t g = 0; g < 2; ++g) {
            assert_ok(vsh_volume_sample(volume, g, 1, p, &values[g], &failure));
        }
        const double difference[2] = {fabs((double)values[0] - (double)shadow[texel]),
                                      fabs((double)values[1] - (double)ao[texel])};
        const double above[3] = {p[0], 2.0 * voxel, p[2]};
        const bool floor_alone = truth_distance(truth_seeds(), above) > 1.99 * voxel;
        alone += floor_alone;
        ++count;
        for (int g = 0; g < 2; ++g) {
            square[g] += difference[g] * difference[g];
            worst[g] = floor_alone ? fmax(worst[g], difference[g]) : worst[g];
        }
    }
    assert_true(count > TEXELS / 2 && alone > count / 2);
    for (int g = 0; g < 2; ++g) {
        assert_true(worst[g] < 1e-4 && sqrt(square[g] / (double)count) < 0.002);
    }
}

/* A sphere and a terrain beside the field, neither in voxels: values are those of queries, what is within
 * them is inside, and free space has no AO that they would know of. */
TEST(casters_without_voxels_hide_light_and_are_solid) {
    static const double high_ball[4] = {1.6, 1.6, 0.0, 0.4},
                        down[12] = {1, 0, 0, 0, 0, 1, 0, -2.0, 0, 0, 1, 0};
    static const float values[9] = {0.0f, 0.2f, 0.0f, 0.3f, 1.0f, 0.1f, 0.0f, 0.4f, 0.0f};
    const vsh_heights_source source = {.columns = 3,
                                       .rows = 3,
                                       .values = values,
                                       .size = {2.0, 2.0},
                                       .height = 0.4,
                                       .base = 0.3,
                                       .transform = down};
    OWNED(vsh_heights) *heights = NULL;
    OWNED(vsh_spheres) *spheres = NULL;
    assert_ok(vsh_heights_create(&source, NULL, &heights, &failure));
    assert_ok(vsh_spheres_create(high_ball, 1, NULL, NULL, &spheres, &failure));
    OWNED(vsh_field) *field = field_of(ball(), 0.05, 4.0);
    vsh_layer layers[2] = {vsh_layer_default(), vsh_layer_default()};
    layers[0].spheres = spheres;
    layers[1].heights = heights;
    layers[0].method = layers[1].method = VSH_SHADOW_HARD;
    OWNED(vsh_voxels) *voxels = cube_of(2.6, 0.05);
    vsh_volume_options options = preview_volume_options();
    const vsh_light light = sun(TOWARDS, 0.1);
    OWNED(vsh_volume) *volume = bake(occluders_with(field, layers, 2), voxels, &light, 1, &options, NULL);
    FREED_BY(free_dense) dense d = copy_of(volume, 0, voxels);
    FREED double *centre = centres_of(&d, voxels);
    FREED float *distance = distances_of(field, d.count, centre);
    FREED float *answer =
        query_shadow(occluders_with(field, layers, 2), &light, &options.shade, d.count, centre);
    size_t outside = 0, in_ball = 0, in_sphere = 0, in_heights = 0, shaded_by_sphere = 0;
    for (size_t i = 0; i < d.count; ++i) {
        const double *p = centre + 3 * i;
        const double to[3] = {p[0] - high_ball[0], p[1] - high_ball[1], p[2] - high_ball[2]};
        const bool within = length(to) < high_ball[3];
        /* the terrain's middle is 0.4 over its foot at y = -2; below its least height it is solid all over */
        const bool buried = fabs(p[0]) < 0.9 && fabs(p[2]) < 0.9 && p[1] < -2.05 && p[1] > -2.25;
        if (distance[i] >= 0.0f && !within && p[1] > -1.55) {
            assert_int_equal(bits_of(d.values[i]), bits_of(answer[i]));
            ++outside;
            shaded_by_sphere += d.values[i] < 0.5f && p[0] > 1.3 && p[1] > 0.0 && p[1] < 1.2;
        }
        in_ball += distance[i] < 0.0f;
        in_sphere += within;
        in_heights += buried;
    }
    vsh_volume_info info;
    vsh_volume_get_info(volume, &info);
    assert_true(outside > 10000 && shaded_by_sphere > 100 && in_sphere > 500 && in_heights > 3000);
    assert_true(info.filled + info.off > in_ball + in_sphere + in_heights);
}
