/* Volumes: their values against closed forms, against queries at the same places, and against a lightmap. */
#include "folder.h"
#include "previews.h"
#include "texels_of.h"
#include "volumes.h"

static const double TOWARDS[3] = {0.3, 1.0, 0.2};

/* A unit ball at the origin. */
static truth_scene ball(void) {
    static const truth_solid solid = {.shape = TRUTH_SPHERE, .radius = 1.0};
    return (truth_scene){&solid, 1};
}

/* Angle between the direction to the ball's centre and the sun's, less the ball's own half angle: what is
 * left of the sky between its edge and the sun's centre, radians. */
static double clearance(const double p[3]) {
    const double far = length3(p), cosine = -dot3(p, TOWARDS) / (far * length3(TOWARDS));
    return acos(fmax(-1.0, fmin(1.0, cosine))) - asin(fmin(1.0, 1.0 / far));
}

TEST(a_box_around_a_ball_holds_its_umbra_its_penumbra_and_light) {
    const double angle = RADIANS(12.0), voxel = 0.05;
    OWNED(vsh_field) *field = field_of(ball(), voxel, 4.0);
    OWNED(vsh_voxels) *voxels = cube_of(3.0, 0.1);
    const vsh_light light = sun(TOWARDS, angle);
    OWNED(vsh_volume) *volume = bake(occluders_of(field), voxels, &light, 1, NULL, NULL);
    FREED_BY(free_dense) dense d = copy_of(volume, 0, voxels);
    double square = 0.0;
    size_t umbra = 0, lit = 0, penumbra = 0;
    for (size_t i = 0; i < d.count; ++i) {
        const double *p = d.centre + 3 * i;
        if (length3(p) < 1.0 + voxel) {
            continue;
        }
        const double clear = clearance(p), margin = voxel / length3(p);
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
    for (size_t m = 0; m < COUNT_OF(methods); ++m) {
        vsh_volume_options options = preview_volume_options();
        options.ao = 1;
        options.shade.ao_distance = 8.0;
        options.shade.ao_method = methods[m].method;
        options.shade.ao_cones = options.shade.rays = methods[m].number;
        OWNED(vsh_volume) *volume = bake(occluders_of(field), voxels, NULL, 0, &options, NULL);
        FREED_BY(free_dense) dense d = copy_of(volume, 0, voxels);
        double square = 0.0;
        size_t count = 0;
        for (size_t i = 0; i < d.count; ++i) {
            const double far = length3(d.centre + 3 * i);
            if (far > 1.05) {
                const double truth = 1.0 - 0.5 * (1.0 - sqrt(1.0 - 1.0 / (far * far)));
                square += (d.values[i] - truth) * (d.values[i] - truth);
                ++count;
            }
        }
        assert_true(count > 10000 && sqrt(square / (double)count) < methods[m].error);
    }
}

/* --- the same values as queries */

/* Shadow at places by a query. */
static float *query_shadow(const vsh_occluders *occluders, const vsh_light *light,
                           const vsh_shade_options *options, size_t count, const double *places) {
    OWNED(vsh_query) *query = query_of(occluders, light, 1, options);
    float *values = malloc(count * sizeof *values), *const visibility[1] = {values};
    vsh_query_output output = vsh_query_output_default();
    output.visibility = visibility;
    const vsh_points points = {count, places, NULL, NULL};
    assert_ok(vsh_query_points(query, &points, NULL, NULL, &output, NULL, &failure));
    return values;
}

/* Fine voxels, which blocks prove together, and coarse ones. */
TEST(volumes_have_the_values_of_queries_at_voxel_centres) {
    const double low[3] = {-3.0, -0.4, -3.0}, high[3] = {3.0, 4.0, 3.0};
    OWNED(vsh_field) *field = field_of(truth_seeds(), 0.05, 4.0);
    vsh_light lights[4] = {sun(truth_seeds_sun, 0.2), lamp((const double[]){1.0, 1.5, 1.0}, 0.2)};
    lights[2] = lights[3] = lights[1];
    strcpy(lights[2].name, "fading");
    lights[2].falloff = VSH_FALLOFF_QUADRATIC;
    lights[2].reach = 1.8;
    strcpy(lights[3].name, "spot");
    lights[3].type = VSH_LIGHT_SPOT;
    for (int32_t method = VSH_SHADOW_HARD; method <= VSH_SHADOW_CONE; ++method) {
        vsh_volume_options options = preview_volume_options();
        options.shade.method = method;
        for (int coarse = 0; coarse < 2; ++coarse) {
            OWNED(vsh_voxels) *voxels = box_of(low, high, coarse ? 0.4 : 0.06);
            OWNED(vsh_volume) *volume =
                bake(occluders_of(field), voxels, lights, COUNT_OF(lights), &options, NULL);
            for (size_t l = 0; l < COUNT_OF(lights); ++l) {
                FREED_BY(free_dense) dense d = copy_of(volume, l, voxels);
                FREED float *distance = distances_of(field, d.count, d.centre);
                FREED float *values =
                    query_shadow(occluders_of(field), &lights[l], &options.shade, d.count, d.centre);
                size_t outside = 0;
                for (size_t i = 0; i < d.count; ++i) {
                    outside += distance[i] >= 0.0f;
                    assert_true(!(distance[i] >= 0.0f) || bits_of(d.values[i]) == bits_of(values[i]));
                }
                assert_true(outside > 500);
            }
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
    size_t open = 0, closed = 0;
    for (size_t i = 0; i < d.count; ++i) {
        const double distance = truth_distance(truth_seeds(), d.centre + 3 * i);
        open += distance > 0.7 && d.values[i] == 1.0f;
        assert_true(distance < 0.7 || d.values[i] == 1.0f);
        closed += distance > 0.0 && d.values[i] < 0.9f;
    }
    assert_true(open > 10000 && closed > 200);
    vsh_volume_grid info;
    vsh_volume_get_grid(volume, 0, &info);
    assert_true(info.tiles > 0);
}

/* A ball in the field and a slab in a layer: both hide the light, and both are solid. */
TEST(layers_hide_light_and_are_solid) {
    static const truth_solid slab = {
        .shape = TRUTH_BOX, .center = {0.0, 1.8, 0.0}, .half = {0.5, 0.25, 0.5}, .radius = 0.0};
    OWNED(vsh_field) *field = field_of(ball(), 0.05, 4.0);
    vshi_layer layer = vshi_layer_default();
    OWNED(vsh_field) *of_layer = field_of((truth_scene){&slab, 1}, 0.05, 4.0);
    layer.field = of_layer;
    OWNED(vsh_voxels) *voxels = cube_of(2.4, 0.1);
    vsh_volume_options options = preview_volume_options();
    options.ao = 1;
    options.shade.ao_distance = 0.5;
    const vsh_light light = sun(TOWARDS, 0.1);
    OWNED(vsh_volume) *volume = bake(occluders_with(field, &layer, 1), voxels, &light, 1, &options, NULL);
    FREED_BY(free_dense) dense d = copy_of(volume, 0, voxels), ao = copy_of(volume, 1, voxels);
    FREED float *one = distances_of(field, d.count, d.centre),
                *two = distances_of(of_layer, d.count, d.centre);
    FREED float *values =
        query_shadow(occluders_with(field, &layer, 1), &light, &options.shade, d.count, d.centre);
    size_t different = 0, behind = 0, inside = 0, near = 0;
    for (size_t i = 0; i < d.count; ++i) {
        if (one[i] >= 0.0f && two[i] >= 0.0f) {
            different += bits_of(values[i]) != bits_of(d.values[i]);
            assert_true(fabsf(values[i] - d.values[i]) < 0.05f);
            behind += d.values[i] == 0.0f && d.centre[3 * i + 1] > 1.0;
            near += two[i] < 0.1f && one[i] > 0.6f && ao.values[i] < 0.7f;
        }
        inside += two[i] < -0.1f && two[i] > -0.2f;
    }
    const vsh_volume_info info = volume_info(volume);
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
    const vsh_mesh floor = quad_mesh("floor", positions, QUAD_UVS);
    vsh_lightmap_options lightmap = size_of(SIDE, SIDE, 1);
    lightmap.ao_spacing = 1;
    OWNED(vsh_charts) *charts = charts_from(&floor, 1, &lightmap);
    static float shadow[TEXELS], ao[TEXELS], coverage[TEXELS];
    float *const shadows_of[1] = {shadow};
    const vsh_lightmap planes = {.shadow = shadows_of, .ao = ao, .coverage = coverage};
    assert_ok(vsh_bake_lightmap(occluders_of(field), charts, &light, 1, &options.shade, NULL, &planes, NULL,
                                &failure));
    OWNED(texel_list) *texels = texels_from(charts);
    const texel_samples samples = samples_of(texels);
    assert_int_equal(samples.count, TEXELS);
    FREED_BY(free_dense) dense shadows_in = copy_of(volume, 0, voxels), ao_in = copy_of(volume, 1, voxels);
    double worst[2] = {0.0, 0.0}, square[2] = {0.0, 0.0};
    size_t count = 0, alone = 0;
    for (size_t i = 0; i < samples.count; ++i) {
        const double *p = samples.positions + 3 * i;
        const size_t texel = vsh_texel_place(samples.texels[i], SIDE);
        if (coverage[texel] == 0.0f) {
            continue;
        }
        const float values[2] = {sample_dense(&shadows_in, p), sample_dense(&ao_in, p)};
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

/* A sphere and a terrain beside the field, neither in voxels: values are those of queries, voxels within them
 * are inside, and they have no AO in free space. */
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
    OWNED(vshi_heights) *heights = NULL;
    OWNED(vshi_spheres) *spheres = NULL;
    assert_ok(vshi_heights_create(&source, NULL, &heights, &failure));
    assert_ok(vshi_spheres_create(high_ball, 1, NULL, NULL, &spheres, &failure));
    OWNED(vsh_field) *field = field_of(ball(), 0.05, 4.0);
    vshi_layer layers[2] = {vshi_layer_default(), vshi_layer_default()};
    layers[0].spheres = spheres;
    layers[1].heights = heights;
    layers[0].method = layers[1].method = VSH_SHADOW_HARD;
    OWNED(vsh_voxels) *voxels = cube_of(2.6, 0.05);
    vsh_volume_options options = preview_volume_options();
    const vsh_light light = sun(TOWARDS, 0.1);
    OWNED(vsh_volume) *volume = bake(occluders_with(field, layers, 2), voxels, &light, 1, &options, NULL);
    FREED_BY(free_dense) dense d = copy_of(volume, 0, voxels);
    FREED float *distance = distances_of(field, d.count, d.centre);
    FREED float *answer =
        query_shadow(occluders_with(field, layers, 2), &light, &options.shade, d.count, d.centre);
    size_t outside = 0, in_ball = 0, in_sphere = 0, in_heights = 0, shaded_by_sphere = 0;
    for (size_t i = 0; i < d.count; ++i) {
        const double *p = d.centre + 3 * i;
        const double to[3] = {p[0] - high_ball[0], p[1] - high_ball[1], p[2] - high_ball[2]};
        const bool within = length3(to) < high_ball[3];
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
    const vsh_volume_info info = volume_info(volume);
    assert_true(outside > 10000 && shaded_by_sphere > 100 && in_sphere > 500 && in_heights > 3000);
    assert_true(info.filled + info.off > in_ball + in_sphere + in_heights);
}

/* --- voxels inside solids, sparseness, limits, and what is refused */

static const double UP[3] = {0.0, 1.0, 0.0};

/* --- inside */

/* A renderer that interpolates between voxels sees at a ball's surface what the surface's own points see. It
 * would not if inside voxels were dark. */
static void check_surface(const dense *d, const double towards[3]) {
    static const double TERMINATOR = 0.65; /* cosine beyond the voxels that it passes */
    uint64_t counter = 5;
    for (int i = 0; i < 4000; ++i) {
        double p[3];
        random_direction(&counter, p);
        const double cosine = dot3(p, towards) / length3(towards);
        assert_true(fabs(cosine) < TERMINATOR || sample_dense(d, p) == (cosine > 0.0 ? 1.0f : 0.0f));
    }
}

/* Searches all voxels within five: one of the nearest outside has the value of a filled voxel. */
TEST(inside_voxels_take_the_nearest_outside_value_or_are_off) {
    const double low[3] = {-1.4, -1.4, -1.4}, high[3] = {1.4, 1.4, 1.4};
    vsh_grid *grid = grid_of(ball(), 0.05);
    vsh_voxels *all[2] = {band_of(grid, 0.0), box_of(low, high, 0.07)};
    OWNED(vsh_field) *field = field_of_grid(grid, 2.0);
    const double towards[3] = {0.4, 1.0, 0.1};
    const vsh_light light = sun(towards, RADIANS(60.0));
    for (int v = 0; v < 2; ++v) {
        vsh_volume_options options = preview_volume_options();
        OWNED(vsh_volume) *nearest = bake(occluders_of(field), all[v], &light, 1, &options, NULL);
        options.inside = VSH_INSIDE_OFF;
        OWNED(vsh_volume) *off = bake(occluders_of(field), all[v], &light, 1, &options, NULL);
        vsh_volume_info filled, left;
        vsh_volume_get_info(nearest, &filled);
        vsh_volume_get_info(off, &left);
        vsh_volume_grid grids[2];
        vsh_volume_get_grid(nearest, 0, &grids[0]);
        vsh_volume_get_grid(off, 0, &grids[1]);
        assert_true(filled.filled > 1000 && filled.shaded == left.shaded && left.filled == 0);
        assert_true(left.off == filled.filled + filled.off);
        assert_true(grids[0].active_voxels == filled.shaded + filled.filled);
        assert_true(grids[1].active_voxels == left.shaded);
        FREED_BY(free_dense) dense d = copy_of(nearest, 0, all[v]), e = copy_of(off, 0, all[v]);
        FREED float *distance = distances_of(field, d.count, d.centre);
        size_t checked = 0;
        for (size_t i = 0; i < d.count; ++i) {
            if (!(distance[i] < 0.0f && distance[i] > -0.14f)) {
                continue;
            }
            assert_true(e.values[i] == 1.0f); /* the background */
            int32_t at[3];
            index_of(&d, i, at);
            int best = INT32_MAX;
            bool found = false;
            for (int k = 0; k < 11 * 11 * 11; ++k) {
                const int step[3] = {k / 121 - 5, k / 11 % 11 - 5, k % 11 - 5};
                size_t n = 0;
                bool within = true;
                for (int axis = 2; axis >= 0; --axis) {
                    const int32_t place = at[axis] - d.low[axis] + step[axis];
                    within = within && place >= 0 && place < d.size[axis];
                    n = n * (size_t)d.size[axis] + (size_t)place;
                }
                const int square = step[0] * step[0] + step[1] * step[1] + step[2] * step[2];
                if (!within || distance[n] < 0.0f || (v == 0 && distance[n] > 0.1499f) || square > best) {
                    continue;
                }
                found = (square == best && found) || d.values[n] == d.values[i];
                best = square;
            }
            assert_true(best > 16 || found);
            checked += best <= 16;
        }
        assert_true(checked > 1000);
        if (v == 0) {
            check_surface(&d, towards);
        }
    }
    vsh_voxels_free(all[1]);
    vsh_voxels_free(all[0]);
}

TEST(a_narrower_band_has_only_voxels_near_the_surface) {
    vsh_grid *grid = grid_of(ball(), 0.05);
    OWNED(vsh_voxels) *whole = band_of(grid, 0.0), *narrow = band_of(grid, 1.0), *widest = band_of(grid, 3.0);
    vsh_voxels_info info[3];
    vsh_voxels_get_info(whole, &info[0]);
    vsh_voxels_get_info(narrow, &info[1]);
    vsh_voxels_get_info(widest, &info[2]);
    vsh_grid_info of_grid;
    vsh_grid_get_info(grid, &of_grid);
    assert_true(info[0].count == of_grid.active_voxels && info[2].count == info[0].count);
    const double shell = 4.0 * PI * 400.0; /* voxel² of the surface */
    assert_true(fabs((double)info[1].count - 2.0 * shell) < 0.1 * shell);
    assert_true(info[0].has_normals == 1);
    OWNED(vsh_field) *field = field_of_grid(grid, 1.0);
    const vsh_light light = sun(UP, 0.1);
    OWNED(vsh_volume) *volume = bake(occluders_of(field), narrow, &light, 1, NULL, NULL);
    vsh_volume_grid made;
    vsh_volume_get_grid(volume, 0, &made);
    assert_true(made.active_voxels == info[1].count);
}

/* --- sparse, and the same */

TEST(uniform_regions_are_tiles) {
    const double low[3] = {-6.4, -6.4, -6.4}, high[3] = {6.4, 6.4, 6.4};
    OWNED(vsh_field) *field = field_of(ball(), 0.05, 4.0);
    OWNED(vsh_voxels) *voxels = box_of(low, high, 0.1);
    const vsh_light light = sun(UP, RADIANS(3.0));
    OWNED(vsh_volume) *volume = bake(occluders_of(field), voxels, &light, 1, NULL, NULL);
    vsh_volume_grid grid;
    vsh_volume_info info;
    vsh_volume_get_grid(volume, 0, &grid);
    vsh_volume_get_info(volume, &info);
    const uint64_t solid = 128 * 128 * 128;
    assert_true(grid.active_voxels + info.off == solid);
    assert_true(grid.tiles > 1000 && grid.leaves < 700); /* of 4096 blocks */
    assert_true(info.bytes < solid * sizeof(float) / 3);
    assert_string_equal(grid.name, "shadow.sun");
    vsh_volume_get_grid(volume, 1, &grid);
    assert_true(grid.name[0] == '\0' && grid.active_voxels == 0);
}

/* --- values read back */

TEST(copies_are_of_voxels_at_their_centres_and_boxes_have_limits) {
    OWNED(vsh_field) *field = field_of(ball(), 0.1, 4.0);
    OWNED(vsh_voxels) *voxels = cube_of(2.0, 0.25);
    const vsh_light light = sun(UP, RADIANS(40.0));
    OWNED(vsh_volume) *volume = bake(occluders_of(field), voxels, &light, 1, NULL, NULL);
    FREED_BY(free_dense) dense d = copy_of(volume, 0, voxels);
    assert_true(d.size[0] == 16 && d.size[1] == 16 && d.size[2] == 16);
    for (size_t i = 0; i < d.count; i += 7) {
        int32_t index[3];
        index_of(&d, i, index);
        for (int axis = 0; axis < 3; ++axis) {
            assert_true(fabs(d.centre[3 * i + axis] - (-2.0 + 0.25 * (index[axis] + 0.5))) < 1e-12);
        }
    }
    const int32_t zero[3] = {4, 0, 4}, last[3] = {INT32_MAX, 0, 0}, one[3] = {1, 1, 1}, two[3] = {2, 1, 1};
    float values[2];
    assert_fails(vsh_volume_copy(volume, 1, d.low, one, values, &failure), VSH_ERROR_ARGUMENT, "grid 1");
    assert_fails(vsh_volume_copy(volume, 0, d.low, zero, values, &failure), VSH_ERROR_ARGUMENT, "along y");
    assert_fails(vsh_volume_copy(volume, 0, last, two, values, &failure), VSH_ERROR_ARGUMENT, "along x");
}

/* --- limits, bad input */

TEST(memory_is_estimated_before_it_is_allocated) {
    vsh_grid *grid = grid_of(ball(), 0.1);
    vsh_run run = run_within(1000000);
    OWNED(vsh_voxels) *voxels = NULL;
    const double low[3] = {0, 0, 0}, high[3] = {1, 1, 1};
    assert_fails(vsh_voxels_from_box(low, high, 0.001, &run, &voxels, &failure), VSH_ERROR_LIMIT,
                 "box of 1000 x 1000 x 1000 voxels");
    assert_non_null(strstr(failure.message, "limit"));
    run.memory_limit = 1000;
    assert_fails(vsh_voxels_from_grid(grid, 0.0, &run, &voxels, &failure), VSH_ERROR_LIMIT, "band");
    voxels = cube_of(2.0, 0.05);
    OWNED(vsh_field) *field = field_of_grid(grid, 4.0);
    vsh_light lights[2] = {sun(UP, 0.1), sun(UP, 0.2)};
    strcpy(lights[1].name, "moon");
    vsh_volume *volume = NULL;
    run.memory_limit = 1600000; /* 1000 blocks: enough for the one, not for its values */
    assert_fails(vsh_bake_volume(occluders_of(field), voxels, lights, 2, NULL, &run, &volume, NULL, &failure),
                 VSH_ERROR_LIMIT, "2 grids of 512000 voxels");
    /* 2^31 voxels and more are refused by memory, or by the range of indices, on every machine */
    run.memory_limit = (uint64_t)4 << 30;
    vsh_voxels *none = NULL;
    assert_fails(vsh_voxels_from_box(low, high, 1.0 / 1291.0, &run, &none, &failure), VSH_ERROR_LIMIT,
                 "1291 x 1291 x 1291");
    const double far_away[3] = {1e5, 1.0, 1.0};
    assert_fails(vsh_voxels_from_box(low, far_away, 1e-4, &run, &none, &failure), VSH_ERROR_LIMIT, "along x");
    assert_null(none);
}

TEST(bad_boxes_bands_and_options_are_refused) {
    static const struct {
        double low[3], high[3], voxel;
        vsh_result code;
        const char *part;
    } boxes[] = {
        {{0, 0, 0}, {1, 1, 0}, 0.1, VSH_ERROR_ARGUMENT, "along z"},
        {{0, 2, 0}, {1, 1, 1}, 0.1, VSH_ERROR_ARGUMENT, "2 … 1 along y"},
        {{0, 0, 0}, {INFINITY, 1, 1}, 0.1, VSH_ERROR_ARGUMENT, "along x"},
        {{0, 0, 0}, {1, 1, 1}, 0.0, VSH_ERROR_ARGUMENT, "voxel size 0"},
        {{0, 0, 0}, {1, 1, 1}, NAN, VSH_ERROR_ARGUMENT, "voxel size"},
        {{0, 0, 0}, {1e-5, 1e-5, 1e-5}, 1e-6, VSH_ERROR_LIMIT, "voxel size 1e-06"},
        {{1e15, 0, 0}, {1.1e15, 1, 1}, 100.0, VSH_ERROR_LIMIT, "from the origin"},
    };
    OWNED(vsh_voxels) *voxels = NULL;
    for (size_t i = 0; i < COUNT_OF(boxes); ++i) {
        assert_fails(
            vsh_voxels_from_box(boxes[i].low, boxes[i].high, boxes[i].voxel, NULL, &voxels, &failure),
            boxes[i].code, boxes[i].part);
        assert_null(voxels);
    }
    vsh_grid *grid = grid_of(ball(), 0.1);
    const double bands[] = {-1.0, 3.5, NAN, INFINITY};
    for (int i = 0; i < 4; ++i) {
        assert_fails(vsh_voxels_from_grid(grid, bands[i], NULL, &voxels, &failure), VSH_ERROR_ARGUMENT,
                     "0 … 3");
    }
    voxels = cube_of(0.3, 0.1);
    OWNED(vsh_field) *field = field_of_grid(grid, 1.0);
    const vsh_occluders *occluders = occluders_of(field);
    OWNED(vsh_volume) *volume = NULL;
    vsh_volume_options inside = preview_volume_options(), rays = inside, taps = inside;
    inside.inside = 7;
    rays.shade.rays = 4097;
    taps.ao = 1;
    taps.shade.ao_method = VSH_AO_TAPS;
    vsh_light suns[2] = {sun(UP, 0.1), sun(UP, 0.2)}, nameless[2] = {suns[0], suns[0]},
              inverted = sun(UP, -1.0);
    nameless[1].name[0] = '\0';
    const struct {
        const vsh_light *lights;
        size_t count;
        const vsh_volume_options *options;
        const char *part;
    } bakes[] = {{NULL, 0, NULL, "nothing to bake"},
                 {suns, 2, NULL, "both named 'sun'"},
                 {nameless, 2, NULL, "light 1: no name"},
                 {&inverted, 1, NULL, "light 0"},
                 {suns, 1, &inside, "inside 7"},
                 {suns, 1, &rays, "rays 4097"},
                 {suns, 1, &taps, "taps"}};
    for (size_t i = 0; i < COUNT_OF(bakes); ++i) {
        assert_fails(vsh_bake_volume(occluders, voxels, bakes[i].lights, bakes[i].count, bakes[i].options,
                                     NULL, &volume, NULL, &failure),
                     VSH_ERROR_ARGUMENT, bakes[i].part);
        assert_null(volume);
    }
    taps.ao = 0; /* the method of AO that is not baked does not matter */
    volume = bake(occluders, voxels, suns, 1, &taps, NULL);
    assert_fails(vsh_volume_write(volume, "/nowhere/at/all/x.vdb", 0, NULL, 0, &failure), VSH_ERROR_WRITE,
                 "/nowhere");
}

/* --- dense copies of grids in files, as OpenVDB reads them back */

/* Comparisons of .vdb files copy grids. */
TEST(copied_distances_of_a_ball_are_exact_and_active_within_the_band) {
    const double voxel = 0.125, half = 3.0 * voxel;
    OWNED(vsh_grid) *grid = grid_of(ball(), voxel);
    assert_ok(vsh_grid_write(grid, at("ball.vdb"), NULL, NULL, 0, &failure));
    const int32_t low[3] = {-12, -11, -13}, size[3] = {25, 21, 27}; /* not the same along any two axes */
    const size_t count = (size_t)size[0] * (size_t)size[1] * (size_t)size[2];
    FREED float *values = malloc(count * sizeof *values), *active = malloc(count * sizeof *active);
    assert_ok(vshi_vdb_copy(at("ball.vdb"), "surface", low, size, NULL, values, active, &failure));
    size_t within = 0;
    for (size_t i = 0; i < count; ++i) {
        const double x = voxel * (low[0] + (double)(i % 25)), y = voxel * (low[1] + (double)(i / 25 % 21));
        const double z = voxel * (low[2] + (double)(i / 25 / 21)), truth = sqrt(x * x + y * y + z * z) - 1.0;
        const double expected = fmin(half, fmax(-half, truth));
        assert_true(fabs((double)values[i] - expected) < 0.02 * voxel);
        assert_true(active[i] == 0.0f || active[i] == 1.0f);
        if (fabs(fabs(truth) - half) > 0.1 * voxel) { /* at its very edge either will do */
            assert_true((active[i] == 1.0f) == (fabs(truth) < half));
            within += active[i] == 1.0f;
        }
    }
    assert_true(within > 1000);
    /* each alone, and by the first grid's name */
    float one = 7.0f;
    const int32_t middle[3] = {0, 0, 8}, single[3] = {1, 1, 1};
    assert_ok(vshi_vdb_copy(at("ball.vdb"), NULL, middle, single, NULL, &one, NULL, &failure));
    assert_true(fabs((double)one) < 0.02 * voxel);
    assert_ok(vshi_vdb_copy(at("ball.vdb"), NULL, middle, single, NULL, NULL, &one, &failure));
    assert_true(one == 1.0f);
}

FIXTURE(make_folder, remove_folder)
