/* Traces the samples of a tile, and shades their hits. */
#include "base/elementary.h"
#include "light/view.h"
#include "render/render.h"
#include "shade/shade.h"

/* How much nearer than a lit mesh a surface of the same shape may be, its voxels. */
static const double SAME = 1.5;
/* Marches begin this far above a triangle, plus the height of the field's surface above it, up to a limit.
 * In voxels. */
static const double CLEAR = 0.5, LEAST_CLEAR = 0.3, MOST_CLEAR = 3.0;

/* The hits on surfaces in a tile, to be shaded together. */
typedef struct hits {
    size_t count;
    vshi_seen *seen[VSHI_TILE_SAMPLES];
    const double *color[VSHI_TILE_SAMPLES];
    vshi_lift_point points[VSHI_TILE_SAMPLES];
    double traced[VSHI_TILE_SAMPLES][3];  /* where rays against triangles begin, of AO, */
    double lifted[VSHI_TILE_SAMPLES][3];  /* and of the light at hand */
    double marched[VSHI_TILE_SAMPLES][3]; /* where marches through the field begin */
    float normals[VSHI_TILE_SAMPLES][3];
    float faces[VSHI_TILE_SAMPLES][3]; /* normals of the triangles; the same where a field is hit */
    uint32_t texels[VSHI_TILE_SAMPLES];
    float visibility[VSHI_TILE_SAMPLES];
    float ao[VSHI_TILE_SAMPLES];
    float light[VSHI_TILE_SAMPLES][3];
} hits;

static void put(vshi_vec p, double at[3]) {
    at[0] = p.x;
    at[1] = p.y;
    at[2] = p.z;
}

/* The nearest surface, NULL where there is none or a lit mesh at `lit` stands for it. */
static const vsh_surface *find_surface(const vshi_scenery *scenery, const vshi_eye_ray *ray, double lit,
                                       double *distance, vsh_shade_stats *stats) {
    const vsh_surface *nearest = NULL;
    *distance = lit;
    for (size_t i = 0; i < scenery->surface_count; ++i) {
        const vsh_surface *surface = &scenery->surfaces[i];
        const double end = fmin(*distance, lit - SAME * surface->field->voxel_size);
        bool finished = true;
        const double t =
            end > 0.0 ? vshi_field_hit(surface->field, ray, end, &stats->samples, &finished) : end;
        ++stats->marches;
        stats->unfinished += !finished;
        if (t < end) {
            *distance = t;
            nearest = surface;
        }
    }
    return nearest;
}

static void add_point(hits *h, const vshi_lift_point *point, vshi_vec marched, const double *color,
                      uint32_t texel, vshi_seen *seen) {
    const size_t i = h->count++;
    const vshi_vec n = point->normal, face = point->face;
    h->seen[i] = seen;
    h->color[i] = color;
    h->points[i] = *point;
    put(point->foot, h->traced[i]);
    put(marched, h->marched[i]);
    h->normals[i][0] = (float)n.x, h->normals[i][1] = (float)n.y, h->normals[i][2] = (float)n.z;
    h->faces[i][0] = (float)face.x, h->faces[i][1] = (float)face.y, h->faces[i][2] = (float)face.z;
    h->texels[i] = texel;
    for (int c = 0; c < 3; ++c) {
        seen->normal[c] = h->normals[i][c];
    }
}

static void add_hit(const vshi_scenery *scenery, hits *h, const vsh_surface *surface, const vshi_eye_ray *ray,
                    double distance, uint32_t texel, vshi_seen *seen) {
    const vshi_vec at = vshi_add(ray->origin, vshi_scale(ray->direction, distance));
    const vshi_vec n = vshi_field_normal(surface->field, at, vshi_scale(ray->direction, -1.0));
    const vshi_vec point = vshi_add(at, vshi_scale(n, scenery->lift * surface->field->voxel_size));
    add_point(h, &(vshi_lift_point){point, {0.0, 0.0, 0.0}, n, n}, point, surface->color, texel, seen);
}

/* Returns how far above a triangle marches begin, in voxels. They must begin outside the field's surface,
 * which is a shell around an open mesh. */
static double find_clearance(const vsh_field *field, vshi_vec at, vshi_vec normal) {
    double clearance = CLEAR;
    if (field->unknown) {
        return 0.0; /* nothing is marched */
    }
    while (clearance < MOST_CLEAR) {
        const vshi_vec point = vshi_add(at, vshi_scale(normal, clearance * field->voxel_size));
        const double world[3] = {point.x, point.y, point.z};
        const vshi_vec p = vshi_to_field(field, world);
        const double h = (double)vshi_field_distance(field, (float[3]){(float)p.x, (float)p.y, (float)p.z});
        if (h >= LEAST_CLEAR) {
            return clearance;
        }
        clearance += fmax(CLEAR - h, LEAST_CLEAR);
    }
    return CLEAR; /* in something else */
}

static void add_bare(const vshi_scenery *scenery, hits *h, uint32_t triangle, vshi_vec through,
                     uint32_t texel, vshi_seen *seen) {
    const vshi_lit_point p = vshi_lit_meet(scenery->lit, triangle, through);
    const vsh_field *field = scenery->occluders->field;
    const double clear = find_clearance(field, p.point.foot, p.point.face) * field->voxel_size;
    add_point(h, &p.point, vshi_add(p.point.foot, vshi_scale(p.point.face, clear)), p.color, texel, seen);
}

/* Light at the hits, one after the other of the lights, so that room for one is enough. */
static vsh_result light_hits(const vshi_scenery *scenery, hits *h, vsh_shade_stats *stats, vsh_error *error) {
    vsh_points points = {h->count, NULL, &h->normals[0][0], h->texels};
    vsh_query_output output = vsh_query_output_default();
    if (scenery->options->ao) {
        points.positions = scenery->traces_ao ? &h->traced[0][0] : &h->marched[0][0];
        output.ao = h->ao;
        vsh_point_layout layout = vsh_point_layout_default();
        layout.face_normals = &h->faces[0][0];
        VSHI_TRY(vsh_query_points(scenery->query, &points, &layout, &scenery->run, &output, stats, error));
        output.ao = NULL;
    }
    points.positions = &h->lifted[0][0];
    for (size_t l = 0; l < scenery->light_count; ++l) {
        float *visibility[VSHI_MOST_LIGHTS] = {NULL};
        visibility[l] = h->visibility;
        const vshi_lifter lifter = vshi_lifter_open(scenery->occluders, &scenery->lights[l]);
        for (size_t i = 0; i < h->count; ++i) {
            const vshi_vec from = vshi_vec_of(scenery->traces_shadow ? h->traced[i] : h->marched[i]);
            put(vshi_add(from, vshi_lift_find(&lifter, &h->points[i])), h->lifted[i]);
        }
        output.visibility = visibility;
        VSHI_TRY(vsh_query_points(scenery->query, &points, NULL, &scenery->run, &output, stats, error));
        vshi_shade_irradiance(&points, NULL, &scenery->lights[l], h->visibility, &scenery->options->tint,
                              &h->light[0][0]);
    }
    for (size_t i = 0; i < h->count; ++i) {
        const double open = !scenery->options->ao ? 1.0 : h->ao[i] > 0.0f ? (double)h->ao[i] : 0.0;
        for (int c = 0; c < 3; ++c) {
            h->seen[i]->color[c] =
                (float)(h->color[i][c] * ((double)h->light[i][c] + scenery->options->sky[c] * open));
        }
    }
    return VSH_OK;
}

/* --- fog */

/* A ray of a tile, up to where it ends. */
typedef struct fog_ray {
    vshi_eye_ray ray;
    double end;     /* world units, may be infinite */
    uint32_t texel; /* of the mask */
} fog_ray;

/* Points of the tile's rays at one step, and what each adds. */
typedef struct step {
    size_t count;
    double positions[VSHI_TILE_SAMPLES][3];
    float towards[VSHI_TILE_SAMPLES][3];
    float visibility[VSHI_TILE_SAMPLES];
    float light[VSHI_TILE_SAMPLES][3];
    double share[VSHI_TILE_SAMPLES];
} step;

/* All the light that passes, whatever its direction: as if each point faced it. */
static vsh_result light_step(const vshi_scenery *scenery, step *s, vsh_shade_stats *stats, vsh_error *error) {
    const vsh_points points = {s->count, &s->positions[0][0], NULL, NULL};
    for (size_t l = 0; l < scenery->light_count; ++l) {
        const vsh_light *light = &scenery->lights[l];
        float *visibility[VSHI_MOST_LIGHTS] = {NULL};
        vsh_query_output output = vsh_query_output_default();
        visibility[l] = s->visibility;
        output.visibility = visibility;
        VSHI_TRY(vsh_query_points(scenery->query, &points, NULL, &scenery->run, &output, stats, error));
        const vshi_light_place place = vshi_light_in_world(light);
        for (size_t i = 0; i < s->count; ++i) {
            vshi_vec to;
            vshi_light_towards(&place, vshi_vec_of(s->positions[i]), &to);
            s->towards[i][0] = (float)to.x, s->towards[i][1] = (float)to.y, s->towards[i][2] = (float)to.z;
        }
        vsh_shade_irradiance(&points, &s->towards[0][0], light, s->visibility, &s->light[0][0]);
    }
    return VSH_OK;
}

/* Puts the fog before what the rays of a tile brought back. Not inline: its frame would add to the tile's. */
static __attribute__((noinline)) vsh_result add_fog(const vshi_scenery *scenery, size_t count,
                                                    const fog_ray *rays, vshi_seen **seen,
                                                    vsh_shade_stats *stats, vsh_error *error) {
    const vshi_shafts *shafts = &scenery->shafts;
    const int32_t steps = scenery->options->shaft_steps;
    double begin[VSHI_TILE_SAMPLES], length[VSHI_TILE_SAMPLES], jitter[VSHI_TILE_SAMPLES];
    size_t in[VSHI_TILE_SAMPLES], passing = 0;
    for (size_t i = 0; i < count; ++i) {
        double end = rays[i].end;
        begin[i] = 0.0;
        if (vshi_clip(rays[i].ray.origin, rays[i].ray.direction, shafts->low, shafts->high, &begin[i],
                      &end)) {
            length[i] = end - begin[i];
            jitter[i] = vshi_sampler_mask(shafts->sampler, rays[i].texel, 0);
            in[passing++] = i;
            const float left = (float)vshi_exp(-shafts->extinction * length[i]);
            for (int c = 0; c < 3; ++c) {
                seen[i]->color[c] *= left;
            }
        }
    }
    for (int32_t k = 0; k < steps && passing > 0; ++k) {
        step s = {.count = passing};
        for (size_t j = 0; j < passing; ++j) {
            const size_t i = in[j];
            const double stretch = length[i] / steps, along = (k + jitter[i]) * stretch;
            const vshi_vec at =
                vshi_add(rays[i].ray.origin, vshi_scale(rays[i].ray.direction, begin[i] + along));
            put(at, s.positions[j]);
            s.share[j] = vshi_exp(-shafts->extinction * along) * shafts->extinction * stretch;
        }
        VSHI_TRY(light_step(scenery, &s, stats, error));
        for (size_t j = 0; j < passing; ++j) {
            for (int c = 0; c < 3; ++c) {
                seen[in[j]]->color[c] += (float)(s.share[j] * (double)s.light[j][c]);
            }
        }
    }
    return VSH_OK;
}

vsh_result vshi_tile_render(const vshi_scenery *scenery, const vshi_rows *rows, int32_t column, int32_t row,
                            vsh_shade_stats *stats, vsh_error *error) {
    const vshi_sample_grid *grid = scenery->grid;
    const vsh_render_options *o = scenery->options;
    hits h = {.count = 0};
    fog_ray fog[VSHI_TILE_SAMPLES];
    vshi_seen *all[VSHI_TILE_SAMPLES];
    size_t count = 0;
    for (int32_t y = row; y < row + VSHI_TILE && y < rows->first + rows->count; ++y) {
        for (int32_t x = column; x < column + VSHI_TILE && x < grid->columns; ++x) {
            const size_t at = (size_t)(y - rows->first) * (size_t)grid->columns + (size_t)x;
            const vshi_vec through = vshi_sample_ray(grid, x, y);
            const double slant = vshi_length(through);
            const vshi_eye_ray ray = {grid->frame.eye, vshi_scale(through, 1.0 / slant)};
            const uint32_t texel = (uint32_t)x + 65536u * (uint32_t)y;
            vshi_seen *seen = &rows->seen[at];
            *seen = (vshi_seen){.depth = INFINITY};
            const double lit = scenery->lit != NULL ? rows->lit.depth[at] * slant : INFINITY;
            double distance;
            const vsh_surface *surface = find_surface(scenery, &ray, lit, &distance, stats);
            if (surface == NULL && lit < INFINITY && vshi_lit_is_bare(scenery->lit, rows->lit.triangle[at])) {
                add_bare(scenery, &h, rows->lit.triangle[at], through, texel, seen);
            } else if (surface == NULL && lit < INFINITY) {
                vshi_lit_shade(scenery->lit, rows->lit.triangle[at], through, seen->color, seen->normal);
            }
            if (surface != NULL) {
                add_hit(scenery, &h, surface, &ray, distance, texel, seen);
            }
            seen->alpha = distance < INFINITY ? 1.0f : 0.0f;
            seen->depth = (float)(distance / slant);
            for (int c = 0; c < 3 && !(distance < INFINITY); ++c) {
                seen->color[c] = (float)o->background[c];
            }
            fog[count] = (fog_ray){ray, distance, texel};
            all[count++] = seen;
        }
    }
    if (h.count > 0) {
        VSHI_TRY(light_hits(scenery, &h, stats, error));
    }
    return scenery->shafts.extinction > 0.0 ? add_fog(scenery, count, fog, all, stats, error) : VSH_OK;
}
