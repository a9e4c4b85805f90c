/* Sphere tracing (J. C. Hart, "Sphere tracing", 1996) through the pyramid, on to where the sign changes. The
 * finest level's trilinear interpolant is the surface; a ray is looked at every tenth of a voxel next to it,
 * so that what it can miss is thinner than that. */
#include "render/render.h"

/* Of the distance to go at once on the finest level, whose samples can be wrong by most of a voxel at edges.
 */
static const double EAGER = 0.8;
/* What a coarser level's samples can be wrong by, its voxels: √3/2, and rounding. */
static const double ERROR = 0.9;
static const double LEAST_STEP = 0.1; /* finest voxels */
/* A ray that has been so long next to a surface goes on in longer steps, which double each time. */
enum { PATIENCE = 256, MOST_STEPS = 4096, REFINEMENTS = 24 };
static const double BOUNDS_MARGIN = 1.0;
static const double PRECISION = 1e-3; /* finest voxels */
/* Of a normal's central differences, finest voxels: narrower ones show the cells, wider ones lean farther
 * over edges, where they see too much sky. */
static const float STENCIL = 1.0f;

typedef struct march {
    const vsh_field *field;
    vshi_vec origin, direction; /* field space, unit */
    int32_t level;              /* that the last sample was taken from */
    uint64_t samples;
} march;

static inline double sample(march *m, int32_t level, const float p[3]) {
    ++m->samples;
    return vshi_level_sample(m->field, level, p, NULL);
}

static inline double resolved(const march *m, int32_t level) {
    const vshi_level *l = &m->field->levels[level];
    return l->band - VSHI_BAND_EDGE * l->scale;
}

/* The sample of the finest level that resolves it, looked for from the last one's level on. */
static double distance(march *m, double t) {
    const vshi_vec at = vshi_add(m->origin, vshi_scale(m->direction, t));
    const float p[3] = {(float)at.x, (float)at.y, (float)at.z};
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

/* The part of the ray within the bounds. */
static bool clip_to_bounds(const march *m, double *begin, double *end) {
    const double M = BOUNDS_MARGIN;
    const float *low = m->field->bounds_min, *high = m->field->bounds_max;
    return vshi_clip(m->origin, m->direction,
                     (vshi_vec){(double)low[0] - M, (double)low[1] - M, (double)low[2] - M},
                     (vshi_vec){(double)high[0] + M, (double)high[1] + M, (double)high[2] + M}, begin, end);
}

/* Between a place outside and one inside: regula falsi, the end that stays halved (the Illinois algorithm).
 */
static double refine(march *m, double outside, double h_outside, double inside, double h_inside) {
    int side = 0;
    double t = inside;
    for (int i = 0; i < REFINEMENTS && inside - outside > PRECISION; ++i) {
        t = outside + (inside - outside) * (h_outside / (h_outside - h_inside));
        const double h = distance(m, t);
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

static double step_from(const march *m, double h, double least) {
    const double size = fabs(h);
    const double step = m->level > 0 ? size - ERROR * (double)m->field->levels[m->level].scale : EAGER * size;
    return fmax(step, least);
}

double vshi_field_hit(const vsh_field *field, const vshi_eye_ray *ray, double end, uint64_t *samples,
                      bool *finished) {
    const double origin[3] = {ray->origin.x, ray->origin.y, ray->origin.z};
    march m = {.field = field,
               .origin = vshi_to_field(field, origin),
               .direction = vshi_unit(vshi_transform_vector(field->to_field, ray->direction)),
               .level = field->level_count - 1};
    double t = 0.0, last = end / field->voxel_size, before = 0.0, h_before = 0.0;
    bool outside = false, hit = false, over = !clip_to_bounds(&m, &t, &last);
    double least = LEAST_STEP;
    for (int i = 0; i < MOST_STEPS && !over && !hit; ++i) {
        const double h = distance(&m, t);
        if (outside && h < 0.0) {
            t = refine(&m, before, h_before, t, h);
            hit = true;
            break;
        }
        outside = outside || h >= 0.0; /* what begins inside goes on until it has left */
        before = t;
        h_before = h;
        least = i > 0 && i % PATIENCE == 0 ? 2.0 * least : least;
        over = t >= last;
        t = fmin(t + step_from(&m, h, least), last);
    }
    *samples += m.samples;
    *finished = hit || over;
    return hit && t < last ? t * field->voxel_size : end;
}

vshi_vec vshi_field_normal(const vsh_field *field, vshi_vec position, vshi_vec otherwise) {
    const double world[3] = {position.x, position.y, position.z};
    const vshi_vec at = vshi_to_field(field, world);
    const float p[3] = {(float)at.x, (float)at.y, (float)at.z};
    double slope[3];
    for (int axis = 0; axis < 3; ++axis) {
        float low[3] = {p[0], p[1], p[2]}, high[3] = {p[0], p[1], p[2]};
        low[axis] -= STENCIL;
        high[axis] += STENCIL;
        slope[axis] = (double)vshi_field_distance(field, high) - (double)vshi_field_distance(field, low);
    }
    const vshi_vec n = vshi_direction_to_world(field, (vshi_vec){slope[0], slope[1], slope[2]});
    return vshi_dot(n, n) > 0.5 ? n : otherwise;
}
