/* Pictures: bands of samples, traced in tiles over threads and filtered into pixels.
 *
 * Surfaces are sphere traced (J. C. Hart, "Sphere tracing", 1996) through the pyramid to the sign change of
 * the finest level's trilinear interpolant. Next to a surface, a ray is sampled every tenth of a voxel, so it
 * misses only thinner parts.
 *
 * The filter is Blackman and Harris' window over three pixels (F. J. Harris, "On the use of windows for
 * harmonic analysis with the discrete Fourier transform", 1978): edges without steps or ringing. */
#include "render/render.h"

#include "base/elementary.h"
#include "base/floats.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "field/field.h"
#include "field/level.h"
#include "light/light.h"
#include "shade/ao.h"
#include "shade/shade.h"
#include "shade/shadow.h"
#include "trace/sampler.h"

#include <vdbshade/light.h>

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
    BAND_SAMPLES = 1 << 18, /* samples in memory at once */
    MOST_SIDE = 65000,      /* samples */
    MOST_SAMPLES = 16,      /* along a pixel's side */
    TILE = 8,               /* samples along a side */
    TILE_SAMPLES = TILE * TILE,
    MOST_LIGHTS = 256
};

/* The result of a ray. */
typedef struct seen {
    float color[3];
    float alpha;
    float depth; /* infinite: nothing */
    float normal[3];
} seen;

/* Light shafts: a thin, even fog in a box around the visible scene. */
typedef struct fog {
    vshi_sampler *sampler; /* blue noise; NULL: no fog */
    vshi_vec low, high;
    double extinction; /* per world unit */
} fog;

/* A picture under way. */
typedef struct rendering {
    const vsh_render_options *options;
    vshi_sample_grid grid;
    const vsh_surface *surfaces;
    size_t surface_count;
    const vsh_light *lights;
    size_t light_count;
    const vsh_occluders *occluders;
    vsh_query *query; /* of the occluders */
    vsh_run run;
    bool traces_shadow, traces_ao; /* rays against triangles, not marches through the field */
    double offset;                 /* of points on surfaces, voxels */
    vshi_lit *lit;                 /* NULL: none */
    fog fog;
    const vsh_picture *picture;
    double weight[3 * MOST_SAMPLES]; /* of the filter's 3 N samples across */
    vshi_lit_band band;              /* the current rows; depth and triangle are NULL without lit meshes */
    seen *seen;                      /* [band.rows × columns] */
    vsh_shade_stats *stats;          /* [tiles of the band] */
} rendering;

/* Clips a ray's interval *begin … *end to a box; false if nothing is left. */
static bool clip_to_box(vshi_vec origin, vshi_vec direction, vshi_vec low, vshi_vec high, double *begin,
                        double *end) {
    vshi_clip_axis(origin.x, direction.x, low.x, high.x, begin, end);
    vshi_clip_axis(origin.y, direction.y, low.y, high.y, begin, end);
    vshi_clip_axis(origin.z, direction.z, low.z, high.z, begin, end);
    return *begin < *end;
}

/* --- sphere tracing */

static const double EAGER = 0.8; /* share of the finest level's distance: at edges it is wrong by a voxel */
static const double ERROR = 0.9; /* error of coarse samples, their voxels: √3/2, and rounding */
static const double LEAST_STEP = 0.1; /* finest voxels */
/* After PATIENCE steps the least step doubles, and again after as many. */
enum { PATIENCE = 256, MOST_STEPS = 4096, REFINEMENTS = 24 };
static const double BOUNDS_MARGIN = 1.0;
static const double PRECISION = 1e-3; /* finest voxels */
/* Central differences of normals, finest voxels: narrower ones show the cells. Wider ones lean over edges,
 * where they see too much sky. */
static const float STENCIL = 1.0f;

/* World space; `direction` is unit. */
typedef struct eye_ray {
    vshi_vec origin, direction;
} eye_ray;

typedef struct march {
    const vsh_field *field;
    vshi_vec origin, direction; /* field space, unit */
    int32_t level;              /* of the last sample */
    uint64_t samples;
} march;

static double sample(march *m, int32_t level, const float p[3]) {
    ++m->samples;
    return vshi_level_sample(m->field, level, p, NULL);
}

static double resolved(const march *m, int32_t level) {
    const vshi_level *l = &m->field->levels[level];
    return l->band - VSHI_BAND_EDGE * l->scale;
}

/* Samples the finest level that resolves the distance, beginning at the last sample's level. */
static double sample_distance(march *m, double t) {
    const vshi_vec at = vshi_add(m->origin, vshi_scale(m->direction, t));
    float p[3];
    vshi_vec_to_floats(at, p);
    double h = sample(m, m->level, p);
    if (fabs(h) >= resolved(m, m->level)) {
        while (fabs(h) >= resolved(m, m->level) && m->level + 1 < m->field->level_count) {
            h = sample(m, ++m->level, p);
        }
        return h;
    }
    while (m->level > 0 && fabs(h) < resolved(m, m->level - 1) + ERROR * m->field->levels[m->level].scale) {
        const double finer = sample(m, m->level - 1, p);
        if (fabs(finer) >= resolved(m, m->level - 1)) {
            break;
        }
        h = finer;
        --m->level;
    }
    return h;
}

/* Finds the zero between a place outside and one inside by regula falsi with halving (the Illinois
 * algorithm).
 */
static double refine(march *m, double outside, double h_outside, double inside, double h_inside) {
    int side = 0;
    double t = inside;
    for (int i = 0; i < REFINEMENTS && inside - outside > PRECISION; ++i) {
        t = outside + (inside - outside) * (h_outside / (h_outside - h_inside));
        const double h = sample_distance(m, t);
        if (fabs(h) < 0.25 * PRECISION) {
            return t;
        }
        if (h < 0.0) {
            inside = t;
            h_inside = h;
            h_outside *= side == -1 ? 0.5 : 1.0;
            side = -1;
        } else {
            outside = t;
            h_outside = h;
            h_inside *= side == 1 ? 0.5 : 1.0;
            side = 1;
        }
    }
    return t;
}

/* Finds the distance to a field's zero surface, world units, or `end` if there is none before it. Counts the
 * work. */
static double find_surface(const vsh_field *field, const eye_ray *ray, double end, vsh_shade_stats *stats) {
    const double M = BOUNDS_MARGIN;
    const float *low = field->bounds_min, *high = field->bounds_max;
    const double origin[3] = {ray->origin.x, ray->origin.y, ray->origin.z};
    march m = {.field = field,
               .origin = vshi_to_field(field, origin),
               .direction = vshi_unit(vshi_transform_vector(field->to_field, ray->direction)),
               .level = field->level_count - 1};
    double t = 0.0, last = end / field->voxel_size, before = 0.0, h_before = 0.0, least = LEAST_STEP;
    bool outside = false, hit = false;
    bool over = !clip_to_box(
        m.origin, m.direction, (vshi_vec){(double)low[0] - M, (double)low[1] - M, (double)low[2] - M},
        (vshi_vec){(double)high[0] + M, (double)high[1] + M, (double)high[2] + M}, &t, &last);
    for (int i = 0; i < MOST_STEPS && !over; ++i) {
        const double h = sample_distance(&m, t);
        if (outside && h < 0.0) {
            t = refine(&m, before, h_before, t, h);
            hit = true;
            break;
        }
        outside = outside || h >= 0.0; /* a ray that begins inside continues until it leaves */
        before = t;
        h_before = h;
        least = i > 0 && i % PATIENCE == 0 ? 2.0 * least : least;
        over = t >= last;
        const double size = fabs(h);
        const double step = m.level > 0 ? size - ERROR * (double)field->levels[m.level].scale : EAGER * size;
        t = fmin(t + fmax(step, least), last);
    }
    stats->samples += m.samples;
    stats->unfinished += !(hit || over);
    return hit && t < last ? t * field->voxel_size : end;
}

/* Unit normal next to the surface, world space; `otherwise` if the field has none. */
static vshi_vec find_normal(const vsh_field *field, vshi_vec position, vshi_vec otherwise) {
    const double world[3] = {position.x, position.y, position.z};
    float p[3];
    double slope[3];
    vshi_vec_to_floats(vshi_to_field(field, world), p);
    for (int axis = 0; axis < 3; ++axis) {
        float low[3] = {p[0], p[1], p[2]}, high[3] = {p[0], p[1], p[2]};
        low[axis] -= STENCIL;
        high[axis] += STENCIL;
        slope[axis] = (double)vshi_field_distance(field, high) - (double)vshi_field_distance(field, low);
    }
    const vshi_vec n = vshi_direction_to_world(field, vshi_vec_of(slope));
    return vshi_dot(n, n) > 0.5 ? n : otherwise;
}

/* --- hits of a tile */

/* Voxels by which a surface may be nearer than a lit mesh of the same shape. */
static const double SAME = 1.5;
/* Voxels between a triangle and its marches' start: CLEAR, grown until the field's surface is LEAST_CLEAR
 * below, up to MOST_CLEAR. */
static const double CLEAR = 0.5, LEAST_CLEAR = 0.3, MOST_CLEAR = 3.0;

/* Hits of a tile that are shaded together. */
typedef struct hits {
    size_t count;
    seen *seen[TILE_SAMPLES];
    const double *color[TILE_SAMPLES];
    vshi_lift_point points[TILE_SAMPLES];
    double traced[TILE_SAMPLES][3];  /* origins of AO rays against triangles, */
    double lifted[TILE_SAMPLES][3];  /* of rays to the current light, */
    double marched[TILE_SAMPLES][3]; /* and of marches through the field */
    float normals[TILE_SAMPLES][3];
    float faces[TILE_SAMPLES][3]; /* normals of the triangles; on a field, those of `normals` */
    uint32_t texels[TILE_SAMPLES];
    float visibility[TILE_SAMPLES];
    float ao[TILE_SAMPLES];
    float light[TILE_SAMPLES][3];
} hits;

/* The nearest surface before the lit mesh at distance `lit`; NULL if there is none. */
static const vsh_surface *find_nearest(const rendering *r, const eye_ray *ray, double lit, double *distance,
                                       vsh_shade_stats *stats) {
    const vsh_surface *nearest = NULL;
    *distance = lit;
    for (size_t i = 0; i < r->surface_count; ++i) {
        const vsh_surface *surface = &r->surfaces[i];
        const double end = fmin(*distance, lit - SAME * surface->field->voxel_size);
        const double t = end > 0.0 ? find_surface(surface->field, ray, end, stats) : end;
        ++stats->marches;
        if (t < end) {
            *distance = t;
            nearest = surface;
        }
    }
    return nearest;
}

static void add_point(hits *h, const vshi_lift_point *point, vshi_vec marched, const double *color,
                      uint32_t texel, seen *result) {
    const size_t i = h->count++;
    h->seen[i] = result;
    h->color[i] = color;
    h->points[i] = *point;
    vshi_vec_to_doubles(point->foot, h->traced[i]);
    vshi_vec_to_doubles(marched, h->marched[i]);
    vshi_vec_to_floats(point->normal, h->normals[i]);
    vshi_vec_to_floats(point->face, h->faces[i]);
    h->texels[i] = texel;
    memcpy(result->normal, h->normals[i], sizeof result->normal);
}

static void add_surface_hit(const rendering *r, hits *h, const vsh_surface *surface, const eye_ray *ray,
                            double distance, uint32_t texel, seen *result) {
    const vshi_vec at = vshi_add(ray->origin, vshi_scale(ray->direction, distance));
    const vshi_vec n = find_normal(surface->field, at, vshi_scale(ray->direction, -1.0));
    const vshi_vec point = vshi_add(at, vshi_scale(n, r->offset * surface->field->voxel_size));
    add_point(h, &(vshi_lift_point){point, {0.0, 0.0, 0.0}, n, n}, point, surface->color, texel, result);
}

/* Finds how far above a triangle marches begin, voxels. They must begin outside the field's surface, which is
 * a shell around an open mesh. */
static double find_clearance(const vsh_field *field, vshi_vec at, vshi_vec normal) {
    double clearance = CLEAR;
    if (field->unknown) {
        return 0.0; /* nothing is marched */
    }
    while (clearance < MOST_CLEAR) {
        double world[3];
        float p[3];
        vshi_vec_to_doubles(vshi_add(at, vshi_scale(normal, clearance * field->voxel_size)), world);
        vshi_vec_to_floats(vshi_to_field(field, world), p);
        const double h = (double)vshi_field_distance(field, p);
        if (h >= LEAST_CLEAR) {
            return clearance;
        }
        clearance += fmax(CLEAR - h, LEAST_CLEAR);
    }
    return CLEAR; /* inside another solid */
}

static void add_bare_hit(const rendering *r, hits *h, uint32_t triangle, vshi_vec through, uint32_t texel,
                         seen *result) {
    const vshi_lit_point p = vshi_lit_meet(r->lit, triangle, through);
    const vsh_field *field = r->occluders->field;
    const double clear = find_clearance(field, p.point.foot, p.point.face) * field->voxel_size;
    add_point(h, &p.point, vshi_add(p.point.foot, vshi_scale(p.point.face, clear)), p.color, texel, result);
}

/* Lights the hits, one light after another, so that room for one is enough. */
static vsh_result light_hits(const rendering *r, hits *h, vsh_shade_stats *stats, vsh_error *error) {
    vsh_points points = {h->count, NULL, &h->normals[0][0], h->texels};
    vsh_query_output output = vsh_query_output_default();
    if (r->options->ao) {
        points.positions = r->traces_ao ? &h->traced[0][0] : &h->marched[0][0];
        output.ao = h->ao;
        vsh_point_layout layout = vsh_point_layout_default();
        layout.face_normals = &h->faces[0][0];
        VSHI_TRY(vsh_query_points(r->query, &points, &layout, &r->run, &output, stats, error));
        output.ao = NULL;
    }
    points.positions = &h->lifted[0][0];
    for (size_t l = 0; l < r->light_count; ++l) {
        float *visibility[MOST_LIGHTS] = {NULL};
        visibility[l] = h->visibility;
        const vshi_lifter lifter = vshi_lifter_open(r->occluders, &r->lights[l]);
        for (size_t i = 0; i < h->count; ++i) {
            const vshi_vec from = vshi_vec_of(r->traces_shadow ? h->traced[i] : h->marched[i]);
            vshi_vec_to_doubles(vshi_add(from, vshi_lift_find(&lifter, &h->points[i])), h->lifted[i]);
        }
        output.visibility = visibility;
        VSHI_TRY(vsh_query_points(r->query, &points, NULL, &r->run, &output, stats, error));
        vshi_shade_irradiance(&points, NULL, &r->lights[l], h->visibility, &r->options->tint,
                              &h->light[0][0]);
    }
    for (size_t i = 0; i < h->count; ++i) {
        const double open = !r->options->ao ? 1.0 : h->ao[i] > 0.0f ? (double)h->ao[i] : 0.0;
        for (int c = 0; c < 3; ++c) {
            h->seen[i]->color[c] =
                (float)(h->color[i][c] * ((double)h->light[i][c] + r->options->sky[c] * open));
        }
    }
    return VSH_OK;
}

/* --- fog */

static const double FOG_AROUND = 0.25; /* diagonals */

/* A ray of a tile up to its end. */
typedef struct fog_ray {
    eye_ray ray;
    double end;     /* world units, may be infinite */
    uint32_t texel; /* of the mask */
} fog_ray;

/* Points of the tile's rays at one step, and the light that each adds. */
typedef struct step {
    size_t count;
    double positions[TILE_SAMPLES][3];
    float towards[TILE_SAMPLES][3];
    float visibility[TILE_SAMPLES];
    float light[TILE_SAMPLES][3];
    double share[TILE_SAMPLES];
} step;

/* Fog scatters light of all directions, so each point faces each light. */
static vsh_result light_step(const rendering *r, step *s, vsh_shade_stats *stats, vsh_error *error) {
    const vsh_points points = {s->count, &s->positions[0][0], NULL, NULL};
    for (size_t l = 0; l < r->light_count; ++l) {
        const vsh_light *light = &r->lights[l];
        float *visibility[MOST_LIGHTS] = {NULL};
        vsh_query_output output = vsh_query_output_default();
        visibility[l] = s->visibility;
        output.visibility = visibility;
        VSHI_TRY(vsh_query_points(r->query, &points, NULL, &r->run, &output, stats, error));
        const vshi_light_place place = vshi_light_in_world(light);
        for (size_t i = 0; i < s->count; ++i) {
            vshi_vec to;
            vshi_light_towards(&place, vshi_vec_of(s->positions[i]), &to);
            vshi_vec_to_floats(to, s->towards[i]);
        }
        vsh_shade_irradiance(&points, &s->towards[0][0], light, s->visibility, &s->light[0][0]);
    }
    return VSH_OK;
}

/* Puts the fog before a tile's results. Not inline: its frame would add to the tile's. */
static __attribute__((noinline)) vsh_result add_fog(const rendering *r, size_t count, const fog_ray *rays,
                                                    seen **results, vsh_shade_stats *stats,
                                                    vsh_error *error) {
    const fog *f = &r->fog;
    const int32_t steps = r->options->shaft_steps;
    double begin[TILE_SAMPLES], length[TILE_SAMPLES], jitter[TILE_SAMPLES];
    size_t in[TILE_SAMPLES], passing = 0;
    for (size_t i = 0; i < count; ++i) {
        double end = rays[i].end;
        begin[i] = 0.0;
        if (clip_to_box(rays[i].ray.origin, rays[i].ray.direction, f->low, f->high, &begin[i], &end)) {
            length[i] = end - begin[i];
            jitter[i] = vshi_sampler_mask(f->sampler, rays[i].texel, 0);
            in[passing++] = i;
            const float left = (float)vshi_exp(-f->extinction * length[i]);
            for (int c = 0; c < 3; ++c) {
                results[i]->color[c] *= left;
            }
        }
    }
    for (int32_t k = 0; k < steps && passing > 0; ++k) {
        step s = {.count = passing};
        for (size_t j = 0; j < passing; ++j) {
            const size_t i = in[j];
            const double stretch = length[i] / steps, along = (k + jitter[i]) * stretch;
            vshi_vec_to_doubles(
                vshi_add(rays[i].ray.origin, vshi_scale(rays[i].ray.direction, begin[i] + along)),
                s.positions[j]);
            s.share[j] = vshi_exp(-f->extinction * along) * f->extinction * stretch;
        }
        VSHI_TRY(light_step(r, &s, stats, error));
        for (size_t j = 0; j < passing; ++j) {
            for (int c = 0; c < 3; ++c) {
                results[in[j]]->color[c] += (float)(s.share[j] * (double)s.light[j][c]);
            }
        }
    }
    return VSH_OK;
}

/* Finds the fog's box, around everything visible. */
static void place_fog(rendering *r) {
    vshi_vec low = {INFINITY, INFINITY, INFINITY}, high = {-INFINITY, -INFINITY, -INFINITY};
    for (size_t i = 0; i < r->surface_count; ++i) {
        vsh_field_info info;
        vsh_field_get_info(r->surfaces[i].field, &info);
        if (info.bricks > 0 && info.active_voxels > 0) {
            low = (vshi_vec){fmin(low.x, info.bounds_min[0]), fmin(low.y, info.bounds_min[1]),
                             fmin(low.z, info.bounds_min[2])};
            high = (vshi_vec){fmax(high.x, info.bounds_max[0]), fmax(high.y, info.bounds_max[1]),
                              fmax(high.z, info.bounds_max[2])};
        }
    }
    vshi_lit_grow_box(r->lit, &low, &high);
    const double diagonal = vshi_length(vshi_sub(high, low)), around = FOG_AROUND * diagonal;
    const vshi_vec margin = {around, around, around};
    r->fog.low = vshi_sub(low, margin);
    r->fog.high = vshi_add(high, margin);
    r->fog.extinction = low.x <= high.x && diagonal > 0.0 ? r->options->shafts / diagonal : 0.0;
}

/* --- tiles */

static size_t count_tiles(int32_t samples) {
    return ((size_t)samples + TILE - 1) / TILE;
}

static vsh_result render_tile(void *user, size_t tile, vsh_error *error) {
    const rendering *r = user;
    const vshi_sample_grid *grid = &r->grid;
    const vshi_lit_band *band = &r->band;
    const size_t across = count_tiles(grid->columns);
    const int32_t column = (int32_t)(tile % across) * TILE;
    const int32_t row = band->first_row + (int32_t)(tile / across) * TILE;
    vsh_shade_stats *stats = &r->stats[tile];
    hits h = {.count = 0};
    fog_ray rays[TILE_SAMPLES];
    seen *all[TILE_SAMPLES];
    size_t count = 0;
    *stats = vsh_shade_stats_zero();
    for (int32_t y = row; y < row + TILE && y < band->first_row + band->rows; ++y) {
        for (int32_t x = column; x < column + TILE && x < grid->columns; ++x) {
            const size_t at = (size_t)(y - band->first_row) * (size_t)grid->columns + (size_t)x;
            const vshi_vec through = vshi_sample_ray(grid, x, y);
            const double slant = vshi_length(through);
            const eye_ray ray = {grid->frame.eye, vshi_scale(through, 1.0 / slant)};
            const uint32_t texel = (uint32_t)x + 65536u * (uint32_t)y;
            const double lit = r->lit != NULL ? band->depth[at] * slant : INFINITY;
            seen *result = &r->seen[at];
            double distance;
            *result = (seen){.depth = INFINITY};
            const vsh_surface *surface = find_nearest(r, &ray, lit, &distance, stats);
            if (surface != NULL) {
                add_surface_hit(r, &h, surface, &ray, distance, texel, result);
            } else if (lit < INFINITY && vshi_lit_is_bare(r->lit, band->triangle[at])) {
                add_bare_hit(r, &h, band->triangle[at], through, texel, result);
            } else if (lit < INFINITY) {
                vshi_lit_shade(r->lit, band->triangle[at], through, result->color, result->normal);
            }
            result->alpha = distance < INFINITY ? 1.0f : 0.0f;
            result->depth = (float)(distance / slant);
            for (int c = 0; c < 3 && !(distance < INFINITY); ++c) {
                result->color[c] = (float)r->options->background[c];
            }
            rays[count] = (fog_ray){ray, distance, texel};
            all[count++] = result;
        }
    }
    if (h.count > 0) {
        VSHI_TRY(light_hits(r, &h, stats, error));
    }
    return r->fog.sampler != NULL ? add_fog(r, count, rays, all, stats, error) : VSH_OK;
}

/* --- the filter */

static void begin_picture(rendering *r) {
    static const double PI = 3.14159265358979323846;
    const vsh_picture *picture = r->picture;
    const int32_t count = 3 * r->grid.samples;
    const size_t pixels = (size_t)r->grid.width * (size_t)r->grid.height;
    double sum = 0.0;
    for (int32_t i = 0; i < count; ++i) {
        const double x = 2.0 * PI * (i + 0.5) / count;
        r->weight[i] =
            0.35875 - 0.48829 * vshi_cos(x) + 0.14128 * vshi_cos(2.0 * x) - 0.01168 * vshi_cos(3.0 * x);
        sum += r->weight[i];
    }
    for (int32_t i = 0; i < count; ++i) {
        r->weight[i] /= sum;
    }
    if (picture->color != NULL) {
        memset(picture->color, 0, 3 * pixels * sizeof(float));
    }
    if (picture->alpha != NULL) {
        memset(picture->alpha, 0, pixels * sizeof(float));
    }
    if (picture->normal != NULL) {
        memset(picture->normal, 0, 3 * pixels * sizeof(float));
    }
    for (size_t i = 0; picture->depth != NULL && i < pixels; ++i) {
        picture->depth[i] = INFINITY;
    }
}

/* Adds the band's samples under the filter around a pixel. */
static void filter_pixel(const rendering *r, int32_t x, int32_t y) {
    const int32_t n = r->grid.samples, across = 3 * n;
    const size_t pixel = (size_t)y * (size_t)r->grid.width + (size_t)x;
    double color[3] = {0.0}, normal[3] = {0.0}, alpha = 0.0;
    float nearest = INFINITY;
    for (int32_t j = 0; j < across; ++j) {
        const int32_t row = y * n + j - r->band.first_row;
        if (row < 0 || row >= r->band.rows) {
            continue;
        }
        const seen *samples = r->seen + (size_t)row * (size_t)r->grid.columns + (size_t)(x * n);
        for (int32_t i = 0; i < across; ++i) {
            const double weight = r->weight[j] * r->weight[i];
            for (int c = 0; c < 3; ++c) {
                color[c] += weight * (double)samples[i].color[c];
                normal[c] += weight * (double)samples[i].normal[c];
            }
            alpha += weight * (double)samples[i].alpha;
            const bool own = i >= n && i < 2 * n && j >= n && j < 2 * n;
            nearest = own && samples[i].depth < nearest ? samples[i].depth : nearest;
        }
    }
    const vsh_picture *picture = r->picture;
    for (size_t c = 0; c < 3; ++c) {
        if (picture->color != NULL) {
            picture->color[3 * pixel + c] += (float)color[c];
        }
        if (picture->normal != NULL) {
            picture->normal[3 * pixel + c] += (float)normal[c];
        }
    }
    if (picture->alpha != NULL) {
        picture->alpha[pixel] += (float)alpha;
    }
    if (picture->depth != NULL && nearest < picture->depth[pixel]) {
        picture->depth[pixel] = nearest;
    }
}

/* The first row of pixels that the band's samples reach. */
static int32_t first_pixel(const rendering *r) {
    const int32_t first = r->band.first_row / r->grid.samples - 2;
    return first > 0 ? first : 0;
}

static void filter_rows(void *user, size_t begin, size_t end) {
    const rendering *r = user;
    for (size_t row = begin; row < end; ++row) {
        for (int32_t x = 0; x < r->grid.width; ++x) {
            filter_pixel(r, x, first_pixel(r) + (int32_t)row);
        }
    }
}

static void end_picture(const rendering *r) {
    const vsh_picture *picture = r->picture;
    const size_t pixels = (size_t)r->grid.width * (size_t)r->grid.height;
    for (size_t i = 0; picture->normal != NULL && i < pixels; ++i) {
        float *normal = picture->normal + 3 * i;
        vshi_vec_to_floats(vshi_unit(vshi_vec_off(normal)), normal);
    }
    for (size_t i = 0; picture->alpha != NULL && i < pixels; ++i) {
        const float alpha = picture->alpha[i]; /* sums of weights round */
        picture->alpha[i] = alpha > 1.0f - 0x1p-20f ? 1.0f : alpha;
    }
}

/* --- bands */

static int32_t rows_at_once(const vshi_sample_grid *grid) {
    const int32_t rows = BAND_SAMPLES / grid->columns / TILE * TILE;
    return rows > TILE ? rows : TILE;
}

static vsh_result allocate_band(rendering *r, vsh_error *error) {
    const size_t rows = (size_t)rows_at_once(&r->grid), samples = rows * (size_t)r->grid.columns;
    const size_t lit = r->lit != NULL ? samples : 0;
    const vshi_array arrays[] = {VSHI_ARRAY(r->seen, samples), VSHI_ARRAY(r->band.depth, lit),
                                 VSHI_ARRAY(r->band.triangle, lit),
                                 VSHI_ARRAY(r->stats, count_tiles(r->grid.columns) * (rows / TILE))};
    return VSHI_ALLOCATE_BLOCK(arrays, "samples", error);
}

static void raster_strips(void *user, size_t begin, size_t end) {
    const rendering *r = user;
    for (size_t strip = begin; strip < end; ++strip) {
        vshi_lit_raster(r->lit, &r->band, strip);
    }
}

static vsh_result render_band(rendering *r, vshi_job *job, vsh_shade_stats *stats, vsh_error *error) {
    const size_t tiles = count_tiles(r->grid.columns) * count_tiles(r->band.rows);
    if (r->lit != NULL) {
        const size_t strips = ((size_t)r->grid.columns + VSHI_LIT_STRIP - 1) / VSHI_LIT_STRIP;
        VSHI_TRY(vshi_parallel_for(job, strips, 1, 0, raster_strips, r, error));
    }
    VSHI_TRY(vshi_parallel_each(job, tiles, 4, 1, render_tile, r, error));
    for (size_t i = 0; i < tiles; ++i) {
        vshi_shade_stats_add(stats, &r->stats[i]);
    }
    const int32_t end = (r->band.first_row + r->band.rows - 1) / r->grid.samples + 1;
    const int32_t count = (end < r->grid.height ? end : r->grid.height) - first_pixel(r);
    return count > 0 ? vshi_parallel_for(job, (size_t)count, 4, 0, filter_rows, r, error) : VSH_OK;
}

static vsh_result render_picture(rendering *r, vsh_shade_stats *stats, vsh_error *error) {
    VSHI_TRY(allocate_band(r, error));
    vshi_job *job;
    VSHI_TRY(vshi_job_open(&job, &r->run, "render", count_tiles(r->grid.rows) * count_tiles(r->grid.columns),
                           "render", error));
    vsh_result result = VSH_OK;
    begin_picture(r);
    const int32_t most = rows_at_once(&r->grid);
    for (int32_t first = 0; first < r->grid.rows && result == VSH_OK; first += most) {
        const int32_t left = r->grid.rows - first;
        r->band.first_row = first;
        r->band.rows = left < most ? left : most;
        result = render_band(r, job, stats, error);
    }
    if (result == VSH_OK) {
        end_picture(r);
    }
    vshi_job_end(job);
    return result;
}

/* --- checks */

/* Voxels. Triangles and casters without voxels lie about this far over the visible surface. */
static const double OFFSET = 0.5;

static vsh_result check_colors(const char *name, const double color[3], double most, vsh_error *error) {
    for (int c = 0; c < 3; ++c) {
        if (!(color[c] >= 0.0 && color[c] <= most)) {
            return vshi_fail(error, VSH_ERROR_ARGUMENT, "%s (%g, %g, %g) is out of range 0 … %g", name,
                             color[0], color[1], color[2], most);
        }
    }
    return VSH_OK;
}

static vsh_result check_options(const vsh_render_options *o, size_t light_count, vsh_error *error) {
    static const double BRIGHTEST = 1e15;
    const vshi_range numbers[] = {
        {"width", o->width, 1, VSH_MAX_PICTURE_SIZE}, {"height", o->height, 1, VSH_MAX_PICTURE_SIZE},
        {"samples", o->samples, 1, MOST_SAMPLES},     {"shafts", o->shafts, 0.0, 100.0},
        {"shaft_steps", o->shaft_steps, 1, 64},       {"light_count", (double)light_count, 0, MOST_LIGHTS}};
    VSHI_TRY(vshi_check_ranges(numbers, sizeof numbers / sizeof numbers[0], error));
    const int32_t side = o->width > o->height ? o->width : o->height;
    if ((side + 2) * o->samples > MOST_SIDE) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "samples %d: a side of %d pixels allows at most %d",
                         o->samples, side, MOST_SIDE / (side + 2));
    }
    VSHI_TRY(check_colors("sky", o->sky, BRIGHTEST, error));
    VSHI_TRY(check_colors("background", o->background, BRIGHTEST, error));
    VSHI_TRY(vshi_lit_check(o, error));
    for (size_t i = 0; i < o->lit_count; ++i) {
        VSHI_TRY(check_colors("color of lit meshes", o->lit[i].color, 1.0, error));
    }
    VSHI_TRY(vshi_tint_check(&o->tint, error));
    return vshi_camera_check(&o->camera, error);
}

static vsh_result check_surfaces(const vsh_surface *surfaces, size_t count, vsh_error *error) {
    if (count > VSH_MAX_SURFACES || (surfaces == NULL && count > 0)) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "%zu surfaces: NULL, or more than %d", count,
                         VSH_MAX_SURFACES);
    }
    for (size_t i = 0; i < count; ++i) {
        if (surfaces[i].field == NULL) {
            return vshi_fail(error, VSH_ERROR_ARGUMENT, "surface %zu: field is NULL", i);
        }
        VSHI_TRY(check_colors("color of a surface", surfaces[i].color, 1.0, error));
    }
    return VSH_OK;
}

static vsh_result check_memory(const rendering *r, vsh_error *error) {
    const vsh_field *field = r->occluders->field;
    const double samples = (double)rows_at_once(&r->grid) * r->grid.columns;
    double bytes = samples * (sizeof(seen) + 12.0) + samples / TILE_SAMPLES * sizeof(vsh_shade_stats) +
                   vshi_lit_bytes(r->options) + vshi_field_bytes(field);
    for (size_t i = 0; i < r->surface_count; ++i) {
        bytes += r->surfaces[i].field != field ? vshi_field_bytes(r->surfaces[i].field) : 0.0;
    }
    return vshi_check_limit(&r->run, bytes, "render", error);
}

/* Whether light comes from occluders other than the visible fields. */
static bool needs_offset(const rendering *r) {
    bool offset = (r->light_count > 0 && r->traces_shadow) || (r->options->ao && r->traces_ao);
    for (size_t i = 0; i < r->occluders->layer_count && !offset; ++i) {
        offset = r->occluders->layers[i].field == NULL;
    }
    return offset;
}

static vshi_sample_grid make_grid(const vsh_render_options *o) {
    vshi_view_frame frame = {.eye = vshi_vec_of(o->camera.position),
                             .middle = {0.5 * o->width, 0.5 * o->height}};
    frame.forward = vshi_unit(vshi_sub(vshi_vec_of(o->camera.target), frame.eye));
    const double pixel = 2.0 * vshi_tan(0.5 * o->camera.fov) / o->height;
    const vshi_vec right = vshi_unit(vshi_cross(frame.forward, vshi_unit(vshi_vec_of(o->camera.up))));
    frame.right = vshi_scale(right, pixel);
    frame.down = vshi_scale(vshi_cross(frame.forward, right), pixel);
    return (vshi_sample_grid){.frame = frame,
                              .width = o->width,
                              .height = o->height,
                              .samples = o->samples,
                              .columns = (o->width + 2) * o->samples,
                              .rows = (o->height + 2) * o->samples};
}

vsh_result vsh_render(const vsh_surface *surfaces, size_t surface_count, const vsh_occluders *occluders,
                      const vsh_light *lights, size_t light_count, const vsh_render_options *options,
                      const vsh_run *run, const vsh_picture *picture, vsh_shade_stats *stats,
                      vsh_error *error) {
    VSHI_FLOATS;
    VSHI_NEEDS_BOTH(picture, occluders);
    VSHI_NEEDS_OF(light_count, lights);
    vsh_render_options o = vsh_render_options_default();
    rendering r = {.options = &o,
                   .surfaces = surfaces,
                   .surface_count = surface_count,
                   .lights = lights,
                   .light_count = light_count,
                   .occluders = occluders,
                   .picture = picture};
    vsh_shade_stats own = vsh_shade_stats_zero();
    vsh_result result;
    VSHI_TRY(vshi_options_resolve(options, &o, sizeof o, "vsh_render_options", error));
    VSHI_TRY(vshi_run_resolve(run, &r.run, error));
    VSHI_TRY(check_options(&o, light_count, error));
    VSHI_TRY(check_surfaces(surfaces, surface_count, error));
    r.grid = make_grid(&o);
    VSHI_TRY_DONE(check_memory(&r, error));
    VSHI_TRY_DONE(vsh_query_create(occluders, lights, light_count, &o.shade, &r.query, error));
    VSHI_TRY_DONE(vshi_lit_create(&o, lights, light_count, &r.grid, &r.lit, error));
    r.traces_shadow = vshi_shadow_traces(&o.shade, occluders->triangles);
    r.traces_ao = vshi_ao_traces(&o.shade, occluders->triangles);
    r.offset = needs_offset(&r) ? OFFSET : 0.0;
    place_fog(&r);
    if (light_count > 0 && r.fog.extinction > 0.0) {
        r.fog.sampler = vshi_sampler_create(VSH_SAMPLER_BLUE, 1, o.shade.frame);
        if (r.fog.sampler == NULL) {
            VSHI_TRY_DONE(vshi_fail_memory(error, "render"));
        }
    }
    result = render_picture(&r, stats != NULL ? stats : &own, error);
done:
    free(r.seen); /* the block's first array */
    vshi_sampler_free(r.fog.sampler);
    vshi_lit_free(r.lit);
    vsh_query_free(r.query);
    return result;
}

/* --- 8 bits */

/* Interleaved gradient noise in [0, 1), shifted for each channel: small neighbourhoods contain all levels (J.
 * Jimenez, "Next generation post processing in Call of Duty: Advanced Warfare", 2014). */
static double find_mask(int32_t column, int32_t row, int channel) {
    const double place = 0.06711056 * (column + 17 * channel) + 0.00583715 * (row + 31 * channel);
    const double turn = 52.9829189 * (place - floor(place));
    return turn - floor(turn);
}

vsh_result vsh_picture_encode(const vsh_picture *picture, int32_t width, int32_t height, double exposure,
                              float *const rgb[3], float *alpha, vsh_error *error) {
    VSHI_FLOATS;
    static const double LEAST_ALPHA = 1e-6;
    if (picture == NULL || picture->color == NULL || rgb == NULL || rgb[0] == NULL || rgb[1] == NULL ||
        rgb[2] == NULL || (alpha != NULL && picture->alpha == NULL)) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "vsh_picture_encode: a plane is NULL");
    }
    if (width < 1 || width > VSH_MAX_PICTURE_SIZE || height < 1 || height > VSH_MAX_PICTURE_SIZE ||
        !(fabs(exposure) <= 20.0)) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT,
                         "vsh_picture_encode: %d × %d pixels, exposure %g: expected 1 … %d and -20 … 20",
                         width, height, exposure, VSH_MAX_PICTURE_SIZE);
    }
    const double gain = vshi_exp2(exposure);
    for (int32_t row = 0; row < height; ++row) {
        for (int32_t column = 0; column < width; ++column) {
            const size_t pixel = (size_t)row * (size_t)width + (size_t)column;
            double over = gain;
            if (alpha != NULL) {
                const double a = picture->alpha[pixel];
                alpha[pixel] = (float)(floor(255.0 * fmin(1.0, fmax(0.0, a)) + 0.5) / 255.0);
                over = a > LEAST_ALPHA ? gain / a : 0.0;
            }
            for (int c = 0; c < 3; ++c) {
                const double value = vshi_to_srgb(over * (double)picture->color[3 * pixel + (size_t)c]);
                rgb[c][pixel] =
                    (float)(fmin(255.0, floor(255.0 * value + find_mask(column, row, c))) / 255.0);
            }
        }
    }
    return VSH_OK;
}
