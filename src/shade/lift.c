#include "shade/lift.h"
#include "base/elementary.h"
#include "shade/layers.h"
#include "trace/embree.h"

#include <math.h>

/* Rays that look for neighbours begin this far above the triangle, in units of vshi_triangles_lift(): more
 * than the rounding of floats. */
static const double START = 0.125;

/* A neighbour at this distance or farther leaves the lift as it is; a closer one reduces it in proportion. In
 * units of the lift: with less than 2 a sample may end up inside its neighbour or above a low one. */
static const double ROOM = 4.0;

/* Sine of the elevation of the light's lowest point over the triangle (3 degrees) from which on a sample is
 * not lifted: a lift also moves the shadows of everything else. Below it the lift fades in. */
static const double WELL_ABOVE = 0.05;

vshi_lifter vshi_lifter_open(const vsh_occluders *occluders, const vsh_light *light) {
    vshi_lifter lifter = {.occluders = occluders, .light = light};
    if (light != NULL) {
        lifter.place = vshi_light_in_world(light);
    }
    return lifter;
}

/* Sines of the elevation of the light's lowest and highest point. */
typedef struct elevation {
    double lowest, highest;
} elevation;

static elevation find_elevation(const vshi_lifter *l, vshi_vec from, vshi_vec normal) {
    const vshi_light_place *place = &l->place;
    double centre = 0.0, half = 1.0; /* in the middle of the light */
    if (place->parallel) {
        centre = vshi_dot(normal, place->towards);
        half = place->sine;
    } else {
        const vshi_vec to = vshi_sub(place->centre, from);
        const double distance = vshi_length(to);
        if (distance > 0.0) {
            centre = vshi_dot(normal, to) / distance;
            half = place->radius / distance;
        }
    }
    return (elevation){centre - half, centre + half};
}

bool vshi_light_is_cut(const vshi_lifter *lifter, const vshi_lift_point *point) {
    return lifter->light != NULL && find_elevation(lifter, point->foot, point->face).lowest < 0.0;
}

/* Distance to the nearest triangle straight up and at 45 degrees to four sides, at most `far`. */
static double find_room(const vsh_triangles *triangles, vshi_vec foot, vshi_vec normal, vshi_vec up,
                        double far) {
    const vshi_vec from = vshi_add(foot, vshi_scale(normal, START * vshi_triangles_lift(triangles)));
    vshi_vec u, v;
    vshi_frame(up, &u, &v);
    const vshi_vec ways[5] = {up, vshi_unit(vshi_add(up, u)), vshi_unit(vshi_sub(up, u)),
                              vshi_unit(vshi_add(up, v)), vshi_unit(vshi_sub(up, v))};
    double room = far;
    for (int k = 0; k < 5; ++k) {
        const vshi_vec d = ways[k];
        const vshi_segment_ray ray = {{from.x, from.y, from.z}, {d.x, d.y, d.z}, room};
        room = fmin(room, vshi_triangles_distance(triangles, &ray));
    }
    return room;
}

vshi_vec vshi_lift_find(const vshi_lifter *l, const vshi_lift_point *point) {
    static const vshi_vec NONE = {0.0, 0.0, 0.0};
    const double length = vshi_length(point->lift);
    if (l->light == NULL || !(length > 0.0)) {
        return NONE;
    }
    if (find_elevation(l, point->foot, point->normal).highest < 0.0) {
        return NONE; /* the smooth surface faces away from all of the light */
    }
    const double lowest = find_elevation(l, point->foot, point->face).lowest;
    double share = lowest <= 0.0 ? 1.0 : fmax(1.0 - lowest / WELL_ABOVE, 0.0);
    const vshi_vec up = vshi_scale(point->lift, 1.0 / length);
    for (size_t k = 0; share > 0.0 && k <= l->occluders->layer_count; ++k) {
        const vsh_triangles *triangles =
            k == 0 ? l->occluders->triangles : l->occluders->layers[k - 1].triangles;
        if (triangles != NULL) {
            share *= find_room(triangles, point->foot, point->face, up, ROOM * length) / (ROOM * length);
        }
    }
    return vshi_scale(point->lift, share);
}
