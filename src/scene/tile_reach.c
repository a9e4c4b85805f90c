#include "scene/tile_reach.h"

#include "base/memory.h"
#include "base/try.h"
#include "light/light.h"

#include <math.h>
#include <stdlib.h>

/* Of all lengths: boxes are of floats and rays begin a hair off their surfaces. */
static const double SLACK = 1e-5;

const vshi_world_box vshi_empty_box = {{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};

bool vshi_box_is_empty(const vshi_world_box *box) {
    return !(box->low[0] <= box->high[0]);
}

void vshi_box_grow(vshi_world_box *box, const vshi_world_box *by) {
    for (int axis = 0; axis < 3; ++axis) {
        box->low[axis] = fmin(box->low[axis], by->low[axis]);
        box->high[axis] = fmax(box->high[axis], by->high[axis]);
    }
}

vshi_world_box vshi_box_moved(const vshi_world_box *box, const double transform[12]) {
    vshi_world_box moved = vshi_empty_box;
    for (int corner = 0; corner < 8 && !vshi_box_is_empty(box); ++corner) {
        const vshi_vec at = {corner & 1 ? box->high[0] : box->low[0], corner & 2 ? box->high[1] : box->low[1],
                             corner & 4 ? box->high[2] : box->low[2]};
        const vshi_vec p = vshi_transform_point(transform, at);
        const vshi_world_box point = {{p.x, p.y, p.z}, {p.x, p.y, p.z}};
        vshi_box_grow(&moved, &point);
    }
    return moved;
}

static double width_of(const vsh_scene *scene) {
    double softest = 1.0;
    for (size_t i = 0; i < scene->layer_count; ++i) {
        softest = fmax(softest, scene->layers[i].shade.softness);
    }
    return softest;
}

vsh_result vshi_reach_make(const vsh_scene *scene, vshi_reach *reach, vsh_error *error) {
    *reach = (vshi_reach){.light_count = scene->light_count,
                          .distance = scene->ao ? scene->shade.ao_distance : 0.0,
                          .open = vsh_planes_shaded(&scene->planes) > 0};
    VSHI_TRY(
        vshi_allocate((void **)&reach->lights, scene->light_count, sizeof *reach->lights, "lights", error));
    const double width = width_of(scene);
    for (size_t i = 0; i < scene->light_count; ++i) {
        const vsh_light light = vshi_light_resized(&scene->lights[i], width);
        reach->lights[i] = vshi_light_in_world(&light);
    }
    return VSH_OK;
}

void vshi_reach_free(vshi_reach *reach) {
    free(reach->lights);
    reach->lights = NULL;
}

/* --- how near boxes are */

/* Distance between two boxes. */
static double gap(const vshi_world_box *a, const vshi_world_box *b) {
    double sum = 0.0;
    for (int axis = 0; axis < 3; ++axis) {
        const double d = fmax(0.0, fmax(a->low[axis] - b->high[axis], b->low[axis] - a->high[axis]));
        sum += d * d;
    }
    return sqrt(sum);
}

/* A receiver's box on its way to a light. What it sweeps, grown by what the light widens to, is where all of
 * its rays go: at `along` its sides are at low + along × low_step …, and rays at most along × widening off.
 */
typedef struct sweep {
    vshi_world_box from, step;
    double widening;
    double most; /* of `along` */
} sweep;

static vshi_world_box swept(const sweep *s, double along) {
    vshi_world_box box;
    for (int axis = 0; axis < 3; ++axis) {
        box.low[axis] = s->from.low[axis] + along * s->step.low[axis];
        box.high[axis] = s->from.high[axis] + along * s->step.high[axis];
    }
    return box;
}

/* How far what is swept at `along` is from a box, ≤ 0 where it meets it: convex in `along`, as what is swept
 * is convex, and so is the distance to a box. */
static double apart(const sweep *s, double along, const vshi_world_box *box) {
    const vshi_world_box at = swept(s, along);
    return gap(&at, box) - along * s->widening;
}

/* Where it is nearest, by golden sections (Kiefer 1953). */
static double nearest(const sweep *s, const vshi_world_box *box) {
    static const double GOLDEN = 0.6180339887498949;
    double low = 0.0, high = s->most;
    double a = high - GOLDEN * (high - low), b = low + GOLDEN * (high - low);
    double at_a = apart(s, a, box), at_b = apart(s, b, box);
    for (int i = 0; i < 48; ++i) {
        if (at_a <= at_b) {
            high = b;
            b = a;
            at_b = at_a;
            a = high - GOLDEN * (high - low);
            at_a = apart(s, a, box);
        } else {
            low = a;
            a = b;
            at_a = at_b;
            b = low + GOLDEN * (high - low);
            at_b = apart(s, b, box);
        }
    }
    return 0.5 * (low + high);
}

/* The farthest that anything in one box is from anything in the other. */
static double farthest(const vshi_world_box *a, const vshi_world_box *b) {
    double sum = 0.0;
    for (int axis = 0; axis < 3; ++axis) {
        const double d = fmax(fabs(a->high[axis] - b->low[axis]), fabs(b->high[axis] - a->low[axis]));
        sum += d * d;
    }
    return sqrt(sum);
}

/* Towards a light, as far as `world` goes; cones are `wide` times as wide. */
static sweep sweep_to(const vshi_light_place *light, const vshi_world_box *receiver,
                      const vshi_world_box *world, double wide) {
    sweep s = {.from = *receiver};
    if (light->parallel) {
        const double towards[3] = {light->towards.x, light->towards.y, light->towards.z};
        /* balls along the axis of a cone fill it: their radius is its sine of the way */
        s.widening = fmin(0.999, wide * light->sine);
        s.most = 2.0 * farthest(receiver, world) / (1.0 - s.widening);
        for (int axis = 0; axis < 3; ++axis) {
            s.step.low[axis] = s.step.high[axis] = towards[axis];
        }
        return s;
    }
    const double centre[3] = {light->centre.x, light->centre.y, light->centre.z};
    s.widening = wide * light->radius;
    s.most = 1.0;
    for (int axis = 0; axis < 3; ++axis) {
        s.step.low[axis] = centre[axis] - receiver->low[axis];
        s.step.high[axis] = centre[axis] - receiver->high[axis];
    }
    return s;
}

/* --- how much is hidden */

static double radius_of(const vshi_world_box *box) {
    double sum = 0.0;
    for (int axis = 0; axis < 3; ++axis) {
        sum += (box->high[axis] - box->low[axis]) * (box->high[axis] - box->low[axis]);
    }
    return 0.5 * sqrt(sum);
}

/* Sine of the half angle that a box takes as it is seen from another, at most; > 1: it may be all around. */
static double seen_sine(const vshi_world_box *receiver, const vshi_world_box *caster) {
    double square = 0.0;
    for (int axis = 0; axis < 3; ++axis) {
        const double middle = 0.5 * (caster->low[axis] + caster->high[axis]);
        const double d = fmax(0.0, fmax(receiver->low[axis] - middle, middle - receiver->high[axis]));
        square += d * d;
    }
    return radius_of(caster) / sqrt(square);
}

/* Share of a sun, or of a sphere's disc, of the tangent `tangent` that a cap of the sine `sine` covers at
 * most. Rays are spread evenly over a disc in the plane across them, on which a cone's solid angle Ω has at
 * most Ω / cos³ (Pharr and others 2023, 5.2). */
static double share_of_disc(double sine, double tangent) {
    if (!(sine < 1.0) || !(tangent > 0.0)) {
        return 1.0;
    }
    const double angle = 2.0 * (1.0 - sqrt(1.0 - sine * sine)); /* over π */
    const double square = 1.0 + tangent * tangent;
    return fmin(1.0, angle * square * sqrt(square) / (tangent * tangent));
}

/* Tangent of a light's half angle, at least, as it is seen from a box. */
static double least_tangent(const vshi_light_place *light, const vshi_world_box *receiver) {
    if (light->parallel) {
        return light->tangent;
    }
    const vshi_world_box centre = {{light->centre.x, light->centre.y, light->centre.z},
                                   {light->centre.x, light->centre.y, light->centre.z}};
    /* of a shape the sphere that holds it is larger than it is: nothing is known of the least */
    return light->shape == NULL ? light->radius / farthest(receiver, &centre) : 0.0;
}

static double share_of_light(const vshi_light_place *light, const vshi_world_box *receiver,
                             const vshi_world_box *caster, double sine) {
    const sweep s = sweep_to(light, receiver, caster, 1.0);
    const double slack = SLACK * farthest(receiver, caster);
    if (apart(&s, nearest(&s, caster), caster) > slack) {
        return 0.0;
    }
    return share_of_disc(sine, least_tangent(light, receiver));
}

double vshi_reach_share(const vshi_reach *reach, const vshi_world_box *receiver,
                        const vshi_world_box *caster) {
    const double off = gap(receiver, caster), slack = SLACK * farthest(receiver, caster);
    if (off <= slack) {
        return INFINITY;
    }
    const double sine = seen_sine(receiver, caster);
    double share = 0.0;
    if (reach->open || (reach->distance > 0.0 && off <= reach->distance + slack)) {
        share = fmin(1.0, sine * sine); /* of a hemisphere by its cosine */
    }
    for (size_t i = 0; i < reach->light_count && share < 1.0; ++i) {
        share = fmax(share, share_of_light(&reach->lights[i], receiver, caster, sine));
    }
    return share;
}

/* --- what is reached */

/* The last of `along` at which what is swept meets `world`, or 0. */
static double last_met(const sweep *s, const vshi_world_box *world) {
    double low = nearest(s, world), high = s->most;
    if (apart(s, low, world) > 0.0) {
        return 0.0;
    }
    for (int i = 0; i < 60 && apart(s, high, world) > 0.0; ++i) {
        const double middle = 0.5 * (low + high);
        if (apart(s, middle, world) > 0.0) {
            high = middle;
        } else {
            low = middle;
        }
    }
    return high;
}

static vshi_world_box grown(vshi_world_box box, double by) {
    for (int axis = 0; axis < 3; ++axis) {
        box.low[axis] -= by;
        box.high[axis] += by;
    }
    return box;
}

vshi_world_box vshi_reach_region(const vshi_reach *reach, const vshi_world_box *receiver,
                                 const vshi_world_box *world) {
    static const double WIDE = 2.0; /* what a cone's samples know of lies within as much again */
    vshi_world_box region = grown(*receiver, WIDE * reach->distance);
    for (size_t i = 0; i < reach->light_count; ++i) {
        const sweep s = sweep_to(&reach->lights[i], receiver, world, WIDE);
        const double last = last_met(&s, world);
        const vshi_world_box end = grown(swept(&s, last), last * s.widening);
        vshi_box_grow(&region, &end);
    }
    if (reach->open) {
        region = *world;
    }
    return region;
}
