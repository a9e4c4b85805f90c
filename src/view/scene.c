/* The page of a scene: the surface of its casters' voxels, with light at the vertices. */
#include "base/floats.h"
#include "base/memory.h"
#include "field/field.h"
#include "io/model/model.h"
#include "shade/occluders.h"
#include "view/page.h"

#include <math.h>
#include <stdlib.h>
#include <vdbshade/light.h>

/* Texels of a row of the image of values: WebGL 2 holds that many. */
enum { WIDTH = 2048, LIGHT_CHANNELS = 3 };

/* Distance of shaded points from the surface, voxels: beyond the surface's own voxels. */
static const double OFFSET = 0.5;

/* Even light of the sky for scenes without ambient light: with lights, and without any. */
static const double DIM_SKY = 0.3, ONLY_SKY = 1.0;

/* Points for which extracting the field's surface pays for AO rays. */
static const double MANY_POINTS = 1e6;

typedef struct surface {
    const char *path;
    const vsh_scene *scene;
    const vsh_run *run;
    vshi_model_shape shape; /* positions relative to `middle`; its arrays and `points` are one block */
    double *points;         /* [vertex_count][3]: shaded points, world units */
    double middle[3];       /* world space */
    float **planes;         /* [channel_count]; one block with the two arrays below */
    float *light;           /* [vertex_count][3]: irradiance */
    char (*names)[VSH_CHANNEL_NAME];
    int32_t channel_count;
    int32_t height; /* of the image of values */
} surface;

static size_t texel_count(const surface *s) {
    return (size_t)WIDTH * (size_t)s->height;
}

/* --- the mesh */

typedef struct part {
    const vsh_field *field;
    vshi_surface_quads quads;
} part;

static void add_vertices(surface *s, const part *p, size_t first) {
    for (size_t i = 0; i < p->quads.corner_count; ++i) {
        const float *at = p->quads.corners + 3 * i;
        float gradient[3];
        vshi_field_lower_bound(p->field, at, gradient);
        const vshi_vec world = vshi_to_world(p->field, vshi_vec_off(at));
        const vshi_vec slope = vshi_vec_off(gradient);
        const vshi_vec normal = vshi_dot(slope, slope) > 0.0 ? vshi_direction_to_world(p->field, slope)
                                                             : (vshi_vec){0.0, 1.0, 0.0};
        const vshi_vec point = vshi_add(world, vshi_scale(normal, OFFSET * p->field->voxel_size));
        const double from[3][3] = {
            {world.x, world.y, world.z}, {normal.x, normal.y, normal.z}, {point.x, point.y, point.z}};
        for (size_t k = 0; k < 3; ++k) {
            s->shape.positions[3 * (first + i) + k] = (float)(from[0][k] - s->middle[k]);
            s->shape.normals[3 * (first + i) + k] = (float)from[1][k];
            s->points[3 * (first + i) + k] = from[2][k];
        }
    }
}

/* Adds two triangles for each quad. Quads run either way round, so the page shows both sides. */
static void add_triangles(surface *s, const part *p, uint32_t first) {
    for (size_t q = 0; q < p->quads.quad_count; ++q) {
        static const int corners[] = {0, 1, 2, 0, 2, 3};
        const uint32_t *quad = p->quads.quads + 4 * q;
        uint32_t *to = s->shape.indices + 3 * s->shape.triangle_count;
        const size_t triangles = quad[2] != quad[3] ? 2 : 1;
        for (size_t k = 0; k < 3 * triangles; ++k) {
            to[k] = first + quad[corners[k]];
        }
        s->shape.triangle_count += triangles;
    }
}

static vsh_result allocate_mesh(surface *s, double quads, vsh_error *error) {
    const double vertices = (double)s->shape.vertex_count;
    VSHI_TRY(vshi_check_limit(s->run, 2.0 * (48.0 * vertices + 24.0 * quads), s->path, error));
    if (vertices > UINT32_MAX) {
        return vshi_fail(error, VSH_ERROR_LIMIT, "%s: %g vertices, at most %u; use larger voxels", s->path,
                         vertices, UINT32_MAX);
    }
    const size_t count = 3 * s->shape.vertex_count;
    const vshi_array arrays[] = {VSHI_ARRAY(s->shape.positions, count), VSHI_ARRAY(s->shape.normals, count),
                                 VSHI_ARRAY(s->points, count),
                                 VSHI_ARRAY(s->shape.indices, 6 * (size_t)quads)};
    return VSHI_ALLOCATE_BLOCK(arrays, s->path, error);
}

static vsh_result join_parts(surface *s, const part *parts, size_t count, vsh_error *error) {
    double quads = 0.0;
    for (size_t i = 0; i < count; ++i) {
        s->shape.vertex_count += parts[i].quads.corner_count;
        quads += (double)parts[i].quads.quad_count;
    }
    VSHI_TRY(allocate_mesh(s, quads, error));
    for (size_t i = 0, first = 0; i < count; first += parts[i++].quads.corner_count) {
        add_vertices(s, &parts[i], first);
        add_triangles(s, &parts[i], (uint32_t)first);
    }
    return VSH_OK;
}

/* Joins the surfaces of the field and of each layer's field in one mesh. */
static vsh_result make_mesh(surface *s, const vsh_occluders *occluders, vsh_error *error) {
    part *parts = NULL;
    const size_t count = 1 + occluders->layer_count;
    VSHI_TRY(vshi_allocate((void **)&parts, count, sizeof *parts, s->path, error));
    vsh_result result = VSH_OK;
    for (size_t i = 0; i < count && result == VSH_OK; ++i) {
        parts[i].field = i == 0 ? occluders->field : occluders->layers[i - 1].field;
        result = vshi_surface_quads_make(parts[i].field, 0.0, s->run, &parts[i].quads, error);
    }
    vsh_field_info info;
    vsh_field_get_info(occluders->layer_count > 0 ? occluders->layers[0].field : occluders->field, &info);
    for (int axis = 0; axis < 3; ++axis) {
        s->middle[axis] = 0.5 * (info.bounds_min[axis] + info.bounds_max[axis]);
    }
    result = result == VSH_OK ? join_parts(s, parts, count, error) : result;
    for (size_t i = 0; i < count; ++i) {
        vshi_surface_quads_free(&parts[i].quads);
    }
    free(parts);
    return result;
}

/* --- its light */

static vsh_result allocate_values(surface *s, vsh_error *error) {
    const size_t lights = s->scene->light_count, count = lights + (s->scene->ao != 0) + LIGHT_CHANNELS;
    s->height = (int32_t)((s->shape.vertex_count + WIDTH - 1) / WIDTH);
    const double texels = (double)texel_count(s);
    VSHI_TRY(vshi_check_limit(s->run, 4.0 * texels * (double)(count + LIGHT_CHANNELS), s->path, error));
    float *values;
    const vshi_array arrays[] = {VSHI_ARRAY(s->planes, count),
                                 VSHI_ARRAY(s->light, LIGHT_CHANNELS * s->shape.vertex_count),
                                 VSHI_ARRAY(s->names, count), VSHI_ARRAY(values, count * texel_count(s))};
    VSHI_TRY(VSHI_ALLOCATE_BLOCK(arrays, s->path, error));
    s->channel_count = (int32_t)count;
    for (size_t i = 0; i < count; ++i) {
        const size_t rest = i - lights - (s->scene->ao != 0);
        if (i < lights) {
            snprintf(s->names[i], sizeof s->names[i], "shadow.%s", s->scene->lights[i].name);
        } else if (i == lights && s->scene->ao != 0) {
            snprintf(s->names[i], sizeof s->names[i], "ao");
        } else {
            snprintf(s->names[i], sizeof s->names[i], "irradiance.%c", "RGB"[rest]);
        }
        s->planes[i] = values + i * texel_count(s);
    }
    return VSH_OK;
}

static vsh_points points_of(const surface *s) {
    return (vsh_points){s->shape.vertex_count, s->points, s->shape.normals, NULL};
}

static vsh_result shade(surface *s, const vsh_occluders *occluders, vsh_error *error) {
    vsh_shade_options options = s->scene->shade;
    if (s->scene->ao == 0) {
        options.ao_method = VSH_AO_AUTO; /* unused, but exact would need triangles */
    }
    vsh_query *query = NULL;
    VSHI_TRY(vsh_query_create(occluders, s->scene->lights, s->scene->light_count, &options, &query, error));
    vsh_query_output output = vsh_query_output_default();
    output.visibility = s->scene->light_count > 0 ? s->planes : NULL;
    output.ao = s->scene->ao != 0 ? s->planes[s->scene->light_count] : NULL;
    const vsh_points points = points_of(s);
    vsh_shade_stats stats = vsh_shade_stats_zero();
    const vsh_result result = vsh_query_points(query, &points, NULL, s->run, &output, &stats, error);
    vsh_query_free(query);
    return result;
}

/* Sums up the light of the sky and of the lights. */
static void add_light(surface *s) {
    const vsh_scene *scene = s->scene;
    const size_t lights = scene->light_count;
    const float *ao = scene->ao != 0 ? s->planes[lights] : NULL;
    const double even = lights > 0 ? DIM_SKY : ONLY_SKY;
    const vsh_points points = points_of(s);
    for (size_t i = 0; i < LIGHT_CHANNELS * s->shape.vertex_count; ++i) {
        const double sky = scene->has_ambient != 0 ? scene->ambient[i % LIGHT_CHANNELS] : even;
        s->light[i] = (float)(ao != NULL ? sky * (double)ao[i / LIGHT_CHANNELS] : sky);
    }
    for (size_t l = 0; l < lights; ++l) {
        vsh_shade_irradiance(&points, NULL, &scene->lights[l], s->planes[l], s->light);
    }
    float *const *to = s->planes + s->channel_count - LIGHT_CHANNELS;
    for (size_t i = 0; i < LIGHT_CHANNELS * s->shape.vertex_count; ++i) {
        to[i % LIGHT_CHANNELS][i / LIGHT_CHANNELS] = s->light[i];
    }
}

/* --- the page */

static vsh_result write(surface *s, const char *name, vsh_error *error) {
    char surface_name[] = "surface";
    vshi_model_entry entry = {.name = surface_name, .shape = 0};
    for (int row = 0; row < 3; ++row) {
        entry.transform[5 * row] = 1.0;
        entry.transform[4 * row + 3] = s->middle[row];
    }
    const vsh_model model = {.shapes = &s->shape, .shape_count = 1, .entries = &entry, .entry_count = 1};
    const char *names[VSH_MAX_CHANNELS];
    for (int32_t i = 0; i < s->channel_count; ++i) {
        names[i] = s->names[i];
    }
    const vsh_image image = {.width = WIDTH,
                             .height = s->height,
                             .channel_count = s->channel_count,
                             .names = names,
                             .planes = (const float *const *)s->planes};
    const vshi_view_surface seen = {name, &model, &image};
    return vshi_view_write_page(s->path, NULL, 0, &seen, s->run, error);
}

static vsh_result show(surface *s, const char *name, const vsh_occluders *occluders, vsh_error *error) {
    VSHI_TRY(make_mesh(s, occluders, error));
    if (s->shape.triangle_count == 0) {
        return vshi_fail(error, VSH_ERROR_INPUT, "%s: its casters have no surface; use smaller voxels", name);
    }
    VSHI_TRY(allocate_values(s, error));
    VSHI_TRY(shade(s, occluders, error));
    add_light(s);
    return write(s, name, error);
}

vsh_result vsh_view_write_scene(const char *path, const char *name, const vsh_scene *scene,
                                const vsh_run *run, vsh_error *error) {
    VSHI_FLOATS;
    VSHI_NEEDS_BOTH(path, name);
    VSHI_NEEDS(scene);
    const size_t most_lights = VSH_MAX_CHANNELS - LIGHT_CHANNELS - 1; /* one is for AO */
    if (scene->light_count > most_lights) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "%s: %zu lights, at most %zu", name, scene->light_count,
                         most_lights);
    }
    vsh_run full;
    VSHI_TRY(vshi_run_resolve(run, &full, error));
    vsh_scene voxelised = *scene;
    vsh_caster *casters = NULL;
    vsh_assets *assets = NULL;
    vsh_occluders *occluders = NULL;
    surface s = {.path = path, .scene = &voxelised, .run = &full};
    vsh_result result;
    VSHI_TRY_DONE(vshi_allocate((void **)&casters, scene->caster_count, sizeof *casters, name, error));
    for (size_t i = 0; i < scene->caster_count; ++i) {
        casters[i] = scene->casters[i];
        casters[i].direct = 0;
        casters[i].voxelised = 1;
    }
    voxelised.casters = casters;
    voxelised.receivers = NULL;
    voxelised.receiver_count = 0;
    VSHI_TRY_DONE(vsh_assets_load(&voxelised, &full, &assets, error));
    vsh_scene_occluders_options what = vsh_scene_occluders_options_default();
    what.voxels = 1;
    what.points = MANY_POINTS;
    VSHI_TRY_DONE(vsh_scene_occluders(&voxelised, assets, &what, &full, &occluders, error));
    result = show(&s, name, occluders, error);
done:
    free(s.planes);
    free(s.shape.positions);
    vsh_occluders_free(occluders);
    vsh_assets_free(assets);
    free(casters);
    return result;
}
